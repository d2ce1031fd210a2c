//! The last set-points of all joints, and the derivatives at a place two strides before the newest.
//!
//! What undoes the machine's chain is one filter over some of them ([`crate::stencil`]).
use crate::settings::JOINTS;
use crate::stencil::{Inverse, Stencil};

/// Set-points kept, a power of two.
const PLACES: usize = 1024;
const MASK: usize = PLACES - 1;
/// Longest stride, ticks: the oldest of five set-points is still kept.
pub const LONGEST_STRIDE: usize = (PLACES - 1) / 4;

const _: () = assert!(PLACES.is_power_of_two() && 4 * LONGEST_STRIDE < PLACES);

/// Set-points in machine units, as they came.
#[derive(Clone, Debug)]
pub(crate) struct History {
    kept: [[f64; JOINTS]; PLACES],
    newest: usize,
    stride: usize,
    tick_s: f64,
}

/// Derivatives of one joint's path, machine units and seconds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Derivatives {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) third: f64,
    pub(crate) fourth: f64,
}

impl History {
    pub(crate) const fn new() -> Self {
        Self {
            kept: [[0.0; JOINTS]; PLACES],
            newest: 0,
            stride: 1,
            tick_s: 1e-3,
        }
    }

    /// Sets the distance of the five set-points for a period of the tick.
    pub(crate) fn pace(&mut self, window_s: f64, tick_s: f64) {
        self.tick_s = tick_s;
        // The quotient is positive; a cast saturates.
        self.stride = ((window_s / tick_s + 0.5) as usize).clamp(1, LONGEST_STRIDE);
    }

    /// Stands here since ever.
    pub(crate) fn fill(&mut self, place: &[f64; JOINTS]) {
        self.kept = [*place; PLACES];
    }

    pub(crate) fn push(&mut self, place: &[f64; JOINTS]) {
        self.newest = self.newest.wrapping_add(1);
        self.kept[self.newest & MASK] = *place;
    }

    /// The set-point of so many ticks ago.
    pub(crate) fn back(&self, ticks: usize) -> &[f64; JOINTS] {
        &self.kept[self.newest.wrapping_sub(ticks) & MASK]
    }

    /// Ticks from a set-point in to the same one out.
    pub(crate) const fn latency(&self) -> usize {
        2 * self.stride
    }

    /// Time between two ticks, s.
    pub(crate) const fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// Derivatives of a joint at the place that is corrected.
    pub(crate) fn derivatives(&self, joint: usize) -> Derivatives {
        let [p0, p1, p2, p3, p4] = self.five(joint);
        let h = self.stride as f64 * self.tick_s;
        // Odd and even differences of fourth order; of second order for the third and fourth derivative.
        Derivatives {
            velocity: (8.0 * (p1 - p3) - (p0 - p4)) / (12.0 * h),
            acceleration: (16.0 * (p1 + p3 - 2.0 * p2) - (p0 + p4 - 2.0 * p2)) / (12.0 * h * h),
            third: ((p0 - p4) - 2.0 * (p1 - p3)) / (2.0 * h * h * h),
            fourth: ((p0 + p4) - 4.0 * (p1 + p3) + 6.0 * p2) / (h * h * h * h),
        }
    }

    /// The weights that undo a chain at this period.
    pub(crate) fn stencil(&self, inverse: &Inverse) -> Stencil {
        Stencil::new(inverse, self.stride, self.tick_s, PLACES - 1)
    }

    /// What a stencil adds to a joint at the place that is corrected. Nothing, exactly, where all stood still.
    pub(crate) fn offset(&self, joint: usize, stencil: &Stencil) -> f64 {
        let at = |ticks: usize| self.back(ticks).get(joint).copied().unwrap_or(0.0);
        let base = at(self.latency());
        let places = (0..stencil.weights.len()).map(|k| {
            at(stencil
                .newest
                .saturating_add(k.saturating_mul(stencil.spacing)))
        });
        let weighted = stencil.weights.iter().zip(places);
        weighted
            .map(|(weight, place)| weight * (place - base))
            .sum()
    }

    /// A joint's set-points a stride apart, the newest first.
    fn five(&self, joint: usize) -> [f64; 5] {
        let at = |strides: usize| {
            let place = self.back(strides.wrapping_mul(self.stride));
            place.get(joint).copied().unwrap_or(0.0)
        };
        [at(0), at(1), at(2), at(3), at(4)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_shared::model::Cumulants;
    use std::boxed::Box;

    /// A polynomial of fifth degree has its derivatives exactly, and the operator its second and fourth.
    #[test]
    fn derivatives_of_polynomials_are_exact() {
        let mut history = Box::new(History::new());
        history.pace(0.015, 1e-3);
        for tick in 0..100 {
            let t = f64::from(tick) * 1e-3 - (0.099 - 0.030);
            let place = 3.0 + t * (2.0 + t * (5.0 + t * (-40.0 + t * (700.0 + t * 9000.0))));
            history.push(&[place; JOINTS]);
        }
        let at = history.derivatives(4);
        // The centre is where t is 0; of t⁵ the first derivative leaves −4·9000·h⁴.
        assert!(
            (at.velocity - (2.0 - 4.0 * 9000.0 * 0.015f64.powi(4))).abs() < 1e-9,
            "{at:?}"
        );
        assert!((at.acceleration - 10.0).abs() < 1e-8, "{at:?}");
        let stencil = history.stencil(&Inverse::new(&Cumulants {
            kappa2_s2: 5.4e-4,
            kappa4_s4: -6.0 * 2.916e-7,
        }));
        // Outside what a lag and an average have: −κ2/2 and κ2²/8 − κ4/24.
        let expected = -2.7e-4 * 10.0 + (3.645e-8 + 7.29e-8) * 24.0 * 700.0;
        assert!((history.offset(4, &stencil) - expected).abs() < 1e-12);
        assert_eq!(history.latency(), 30);
    }
}
