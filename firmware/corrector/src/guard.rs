//! The last gate before a drive: bounds of the offset and of its change, and the soft limits of a joint.
use crate::senses::smooth;
use giotto_shared::bounds::OFFSET_MAX_M;

/// The offset that passed last, by slide, m.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Guard {
    last_m: [f64; 3],
    /// What was wanted last, within the bound of the offset.
    wanted_m: [f64; 3],
}

/// The most that its rate may be is reached, or left, in this time, s, where the offset catches up with what was wanted.
const CATCH_UP_S: f64 = 0.02;

/// What a gap shrinks by in a tick so that it closes under this brake, m a tick and tick, and without a rate of its own.
fn closing(gap_m: f64, brake_m: f64) -> f64 {
    let half = 0.5 * brake_m;
    let way = libm::sqrt(half * half + 2.0 * brake_m * gap_m.abs()) - half;
    libm::copysign(way.min(gap_m.abs()), gap_m)
}

/// What the gate had to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Verdict {
    pub(crate) offset_cut: bool,
    pub(crate) slew_cut: bool,
}

impl Guard {
    pub(crate) const fn new() -> Self {
        Self {
            last_m: [0.0; 3],
            wanted_m: [0.0; 3],
        }
    }

    /// The offset that passed last, m.
    pub(crate) const fn last_m(&self) -> [f64; 3] {
        self.last_m
    }

    /// The offset that may go out: within ±`offset_m`, its rate within `slew_m_s`. Where that has cut, the offset runs behind
    /// what is wanted, and comes up with it braking: all at once would be a blow of up to twice the bound in a tick. What is
    /// no number is taken for the last one.
    pub(crate) fn pass(
        &mut self,
        wanted: [f64; 3],
        offset_m: f64,
        slew_m_s: f64,
        tick_s: f64,
    ) -> Verdict {
        let mut verdict = Verdict::default();
        let step_m = slew_m_s * tick_s;
        let brake_m = step_m * (tick_s / CATCH_UP_S).min(1.0);
        let slides = self.last_m.iter_mut().zip(&mut self.wanted_m).zip(wanted);
        for ((last, before), wanted) in slides {
            let wanted = if wanted.is_finite() { wanted } else { *last };
            let bounded = wanted.max(-offset_m).min(offset_m);
            let behind = *before - *last;
            let near = behind.abs() <= brake_m;
            let change = if near {
                bounded - *last
            } else {
                bounded - *before + closing(behind, brake_m)
            };
            let slewed = change.max(-step_m).min(step_m);
            verdict.offset_cut |= bounded != wanted;
            verdict.slew_cut |= slewed != change || !near;
            // Reached exactly: 0 has to come back as 0.
            *last = if near && slewed == change {
                bounded
            } else {
                *last + slewed
            };
            *before = bounded;
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
        assert_eq!(
            guard.pass([0.1, -0.1, 0.0], 1.0, 0.1, 1.0),
            Verdict::default()
        );
        assert_eq!(guard.last_m(), [0.1, -0.1, 0.0]);
        let verdict = guard.pass([9.0, -9.0, f64::NAN], 1.0, 0.1, 1.0);
        assert_eq!(guard.last_m(), [0.2, -0.2, 0.0]);
        assert!(verdict.offset_cut && verdict.slew_cut);
        for _ in 0..50 {
            guard.pass([f64::INFINITY, -9.0, 0.0], 1.0, 0.1, 1.0);
        }
        let [x, y, z] = guard.last_m();
        assert!(
            x <= 0.3 && y == -1.0 && z == 0.0,
            "infinite is no number: {x}"
        );
    }

    /// A corner that asks for twice the rate: the offset is pulled no harder than what is wanted and the brake together, and
    /// ends where it should.
    #[test]
    fn an_offset_that_was_cut_comes_up_without_a_blow() {
        let (tick_s, slew_m_s, high_m) = (1e-3, 0.1, 3e-3);
        // There and back in 24 ms each: 0.19 m/s and 31 m/s² at most.
        let wanted = |t: f64| {
            let part = |t: f64| {
                let share = (t / 0.024).clamp(0.0, 1.0);
                share * share * (3.0 - 2.0 * share)
            };
            high_m * (part(t - 0.01) - part(t - 0.06))
        };
        let mut guard = Guard::new();
        let (mut last, mut hardest, mut cuts) = ([0.0; 2], 0.0f64, 0);
        for tick in 0..300 {
            let now = wanted(f64::from(tick) * tick_s);
            let verdict = guard.pass([now, 0.0, -now], 5e-3, slew_m_s, tick_s);
            let [x, _, z] = guard.last_m();
            assert!((x - last[1]).abs() <= slew_m_s * tick_s + 1e-15 && x == -z);
            hardest = hardest.max((x - 2.0 * last[1] + last[0]).abs() / (tick_s * tick_s));
            last = [last[1], x];
            cuts += u32::from(verdict.slew_cut);
        }
        assert!(cuts > 20 && last[1] == 0.0, "{cuts} {last:?}");
        assert!(hardest < 40.0, "{hardest}");
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
