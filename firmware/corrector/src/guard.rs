//! The last gate before a drive: bounds of the offset and of its change, and the soft limits of a joint.

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

/// Within so many times its own size from a soft limit an offset toward it is taken back.
const NEAR: f64 = 8.0;

/// The part of an offset that may be added to a planned place: less and less of it as the place comes near the soft limit
/// that it leads to, none at the limit, none beyond. It never leads over the limit, and its velocity does not jump.
pub(crate) fn within(add: f64, planned: f64, [least, most]: [f64; 2]) -> f64 {
    let room = if add > 0.0 {
        most - planned
    } else {
        planned - least
    };
    let near = NEAR * add.abs();
    // Limits that are no numbers limit nothing.
    if room >= near || room.is_nan() {
        return add;
    }
    let share = (room / near).max(0.0);
    add * share * (2.0 - share)
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
        assert_eq!(within(0.2, 5.0, [0.0, 10.0]), 0.2);
        assert_eq!(within(-0.2, 5.0, [0.0, 10.0]), -0.2);
        assert_eq!(within(0.2, 10.0, [0.0, 10.0]), 0.0);
        // The planner is out: no farther, but back.
        assert_eq!(within(0.5, 11.0, [0.0, 10.0]), 0.0);
        assert_eq!(within(-0.5, 11.0, [0.0, 10.0]), -0.5);
        assert_eq!(within(1.0, 4.0, [f64::NAN, f64::NAN]), 1.0);
        let mut last = within(0.2, 8.0, [0.0, 10.0]);
        for step in 0..2000 {
            let planned = 8.0 + f64::from(step) * 1e-3;
            let add = within(0.2, planned, [0.0, 10.0]);
            assert!(planned + add <= 10.0 && (add - last).abs() < 0.5e-3);
            last = add;
        }
    }
}
