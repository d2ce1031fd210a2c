//! The phase: integers that neither drift nor round from one tick to the next.
use super::Executor;

impl Executor {
    pub(super) fn advance(&mut self, by: u64) {
        let (phase, wrapped) = self.phase.overflowing_add(by);
        self.phase = phase;
        self.turns = self.turns.wrapping_add(i32::from(wrapped));
    }

    /// Replaces the phase by an exact value close to it, whole turns included.
    pub(super) fn set_phase(&mut self, exact: u64) {
        let ahead = exact.wrapping_sub(self.phase) as i64 > 0;
        let wrapped =
            i32::from(ahead && exact < self.phase) - i32::from(!ahead && exact > self.phase);
        self.phase = exact;
        self.turns = self.turns.wrapping_add(wrapped);
    }
}

/// Phase in a ramp from the sum of steps. ∫ of the rate is the trapezoidal sum less T²/12 of its derivative
/// (Euler–Maclaurin); the next term is below 1e-5 of a step from 32 ticks up.
#[inline(always)]
pub(super) fn ramp_phase(sum: u64, step: u64, end_term: i32) -> u32 {
    ((sum >> 32) as u32)
        .wrapping_sub((step >> 33) as u32)
        .wrapping_sub(end_term as u32)
}

/// step·share, step doubled, share in Q31.
#[inline(always)]
pub(super) fn scaled(step_q1: u64, share_q31: i32) -> u64 {
    let share = u64::from(share_q31 as u32);
    let low = u64::from(step_q1 as u32).wrapping_mul(share) >> 32;
    (step_q1 >> 32).wrapping_mul(share).wrapping_add(low)
}
