//! How a length or an angle is shared out over ramps and constant rate.
use crate::engine::planned::Timing;
use crate::engine::ramp::{FIRST, clock_step};
use core::num::NonZeroU64;
use giotto_shared::fixed::single_to_fixed;

/// 2⁻⁶⁴: turns in a unit of phase.
pub(super) const TURNS_PER_UNIT: f32 = 1.0 / 18_446_744_073_709_551_616.0;

/// What laws and terms need of a motion. SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Constant rate, rad/s (arcs) or 1/s (lines).
    pub(super) rate: f32,
    /// Duration of a ramp.
    pub(super) ramp_s: f32,
    pub(super) tick_s: f32,
    /// Ticks in which an axis' play is taken up.
    pub(super) take_up_ticks: u32,
}

/// An angle to travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Way {
    /// Whole turns.
    pub(super) turns: u32,
    /// What is beyond them, in units of 2⁻⁶⁴ turn.
    pub(super) fraction: u64,
}

impl Way {
    /// A whole line, in units of phase.
    pub(super) const LINE: Self = Self {
        turns: 0,
        fraction: 1 << 62,
    };
    /// The part of a turn that a line takes.
    pub(super) const LINE_TURNS: f32 = 0.25;

    /// Phase per tick over so many ticks, rounded down to an even number; `None`: no tick, or a turn in one.
    pub(super) fn per_tick(self, ticks: u32) -> Option<u64> {
        let ticks = NonZeroU64::new(u64::from(ticks))?;
        if u64::from(self.turns) >= ticks.get() {
            return None;
        }
        // Long division, 32 bits at a time.
        let high = u64::from(self.turns) << 32 | self.fraction >> 32;
        let low = (high % ticks) << 32 | self.fraction & 0xffff_ffff;
        Some((((high / ticks) << 32) | (low / ticks)) & !1)
    }

    /// Shared out over two ramps and a constant rate; `None` as in [`Self::per_tick`].
    pub(super) fn share_out(self, ramp_ticks: u32, cruise_ticks: u32) -> Option<Timing> {
        let step = self.per_tick(ramp_ticks.saturating_add(cruise_ticks))?;
        let up = (step >> 1).wrapping_mul(u64::from(ramp_ticks));
        Some(Timing {
            up,
            end: self.fraction,
            ..at_rate(step, ramp_ticks, cruise_ticks)
        })
    }
}

/// From phase 0, where it ends not yet said.
pub(super) fn at_rate(step: u64, ramp_ticks: u32, cruise_ticks: u32) -> Timing {
    Timing {
        step,
        step_q1: step << 1,
        ramp_ticks,
        cruise_ticks,
        clock_step: clock_step(ramp_ticks),
        ..Timing::default()
    }
}

/// Turns per tick at the constant rate.
pub(super) fn turns_per_tick(timing: &Timing) -> f32 {
    timing.step as f32 * TURNS_PER_UNIT
}

/// ∫ of a ramp's rate exceeds its sum by T²/12 of the rate's derivative: step/N·S′/12, in units of 2⁻³² turn, Q1.
pub(super) fn end_term(timing: &Timing) -> i32 {
    let step_q32 = timing.step as f32 / 4_294_967_296.0;
    single_to_fixed(step_q32 / timing.ramp_ticks as f32 * (FIRST / 12.0), 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_division_is_that_of_128_bits() {
        for turns in [0, 1, 2, 999, 1_000_000] {
            for fraction in [0, 1, 1 << 62, u64::MAX, 0x1234_5678_9abc_def0] {
                for ticks in [1, 3, 1000, 1_000_003, u32::MAX] {
                    let whole = u128::from(turns) << 64 | u128::from(fraction);
                    let expected = (turns < ticks).then(|| (whole / u128::from(ticks)) as u64 & !1);
                    assert_eq!(
                        Way { turns, fraction }.per_tick(ticks),
                        expected,
                        "{turns} {fraction} {ticks}"
                    );
                }
            }
        }
        assert_eq!(Way::LINE.per_tick(0), None);
    }
}
