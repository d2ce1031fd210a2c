//! The last gate before a drive: bounds of the offset and of its change, and the soft limits of a joint.
use crate::senses::smooth;
use giotto_shared::bounds::OFFSET_MAX_M;

/// The offset that passed last, by slide, m.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Guard {
    last_m: [f64; 3],
}

/// What the gate had to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Verdict {
    pub(crate) offset_cut: bool,
    pub(crate) slew_cut: bool,
}

impl Guard {
    pub(crate) const fn new() -> Self {
        Self { last_m: [0.0; 3] }
    }

    /// The offset that passed last, m.
    pub(crate) const fn last_m(&self) -> [f64; 3] {
        self.last_m
    }

    /// The offset that may go out: within ±`offset_m`, no more than `step_m` from the last one. What is no number is
    /// taken for the last one.
    pub(crate) fn pass(&mut self, wanted: [f64; 3], offset_m: f64, step_m: f64) -> Verdict {
        let mut verdict = Verdict::default();
        for (last, wanted) in self.last_m.iter_mut().zip(wanted) {
            let wanted = if wanted.is_finite() { wanted } else { *last };
            let bounded = wanted.max(-offset_m).min(offset_m);
            let change = bounded - *last;
            let slewed = change.max(-step_m).min(step_m);
            verdict.offset_cut |= bounded != wanted;
            verdict.slew_cut |= slewed != change;
            // Reached exactly: 0 has to come back as 0.
            *last = if slewed == change {
                bounded
            } else {
                *last + slewed
            };
        }
        verdict
    }
}

/// So near to a soft limit an offset begins to be taken back, m. The largest offset that is possible still cannot lead over it.
pub(crate) const NEAR_M: f64 = 2.0 * OFFSET_MAX_M as f64;

/// The share of an offset that may be added to a place: less and less as the place comes within `near` of a soft limit, none
/// at the limit or beyond. It goes by the place alone, for both signs: an offset that changes its sign near a limit would else
/// be cut in one tick and free in the next.
pub(crate) fn share(place: f64, [least, most]: [f64; 2], near: f64) -> f64 {
    let room = (most - place).min(place - least);
    // Limits that are no numbers limit nothing.
    if room >= near || room.is_nan() {
        1.0
    } else {
        smooth(room / near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_passes_beyond_its_bounds_and_everything_within_passes_unchanged() {
        let mut guard = Guard::new();
        assert_eq!(guard.pass([0.1, -0.1, 0.0], 1.0, 0.1), Verdict::default());
        assert_eq!(guard.last_m(), [0.1, -0.1, 0.0]);
        let verdict = guard.pass([9.0, -9.0, f64::NAN], 1.0, 0.1);
        assert_eq!(guard.last_m(), [0.2, -0.2, 0.0]);
        assert!(verdict.offset_cut && verdict.slew_cut);
        for _ in 0..50 {
            guard.pass([f64::INFINITY, -9.0, 0.0], 1.0, 0.1);
        }
        let [x, y, z] = guard.last_m();
        assert!(
            x <= 0.3 && y == -1.0 && z == 0.0,
            "infinite is no number: {x}"
        );
    }

    #[test]
    fn soft_limits_hold_where_the_planner_keeps_them() {
        let soft = [0.0, 100.0];
        assert_eq!(share(50.0, soft, 10.0), 1.0);
        for beyond in [100.0, 101.0, 0.0, -1.0] {
            assert_eq!(share(beyond, soft, 10.0), 0.0);
        }
        assert_eq!(share(4.0, [f64::NAN, f64::NAN], 10.0), 1.0);
        let mut last = 1.0;
        for step in 0..=12_000 {
            let place = 88.0 + f64::from(step) * 1e-3;
            let share = share(place, soft, 10.0);
            // Half of NEAR_M is the largest offset.
            assert!(place + 5.0 * share <= 100.0 && share <= last && last - share < 2e-4);
            last = share;
        }
    }
}
