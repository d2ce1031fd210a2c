//! How a length or an angle is shared out over ramps and constant rate.
use crate::engine::planned::Timing;
use crate::engine::ramp::FIRST;
use giotto_shared::fixed::to_fixed;

/// Phase units of a turn.
pub(super) const TURN: f64 = 18_446_744_073_709_551_616.0;
/// Phase units of a whole line.
pub(super) const LINE: f64 = TURN / 4.0;

/// ∫ of a ramp's rate exceeds its sum by T²/12 of the rate's derivative: step/N·S′/12, in units of 2⁻³² turn, Q1.
pub(super) fn end_term(timing: &Timing) -> i32 {
    let step_q32 = timing.step as f64 / 4_294_967_296.0;
    to_fixed(step_q32 / f64::from(timing.ramp_ticks) * FIRST / 12.0, 1)
}

/// Turns from start to end, whole ones included.
pub(super) fn total_turns(timing: &Timing) -> f64 {
    let steps = f64::from(timing.ramp_ticks) + f64::from(timing.cruise_ticks);
    timing.step as f64 / TURN * steps
}

/// Shares a whole length out over two ramps and a constant rate.
pub(super) fn share_out(whole: u128, ramp_ticks: u32, cruise_ticks: u32) -> Timing {
    let steps = u128::from(ramp_ticks) + u128::from(cruise_ticks);
    let step = ((whole / steps.max(1)) as u64) & !1;
    let up = (step >> 1).wrapping_mul(u64::from(ramp_ticks));
    Timing {
        start: 0,
        up,
        end: whole as u64,
        step,
        step_q1: step << 1,
        ramp_ticks,
        cruise_ticks,
        ..Timing::default()
    }
}
