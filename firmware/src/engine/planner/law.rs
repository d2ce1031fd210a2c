//! The operator in a ramp as real numbers: what the tick's integers are rounded from, and what the planner judges.
use super::timing::Motion;
use crate::engine::planned::Law;
use crate::engine::ramp::{FIRST, SECOND, THIRD};
use crate::engine::zones::Built;
use giotto_shared::fixed::single_to_fixed;

/// A ramp's shapes at one place, as the tick has them in [`Shapes`](crate::engine::ramp::Shapes).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shape {
    pub(super) s: f32,
    pub(super) w2: f32,
    pub(super) w3: f32,
    pub(super) w4: f32,
    pub(super) xw3: f32,
}

impl Shape {
    /// At x = 2u − 1, −1…1. Every term has the sign of x: nothing cancels.
    pub(super) fn at(x: f32) -> Self {
        let w = 1.0 - x * x;
        let (w2, w3) = (w * w, w * w * w);
        let w4 = w2 * w2;
        let slope = 1.0 + w / 2.0 + w2 * (3.0 / 8.0) + w3 * (5.0 / 16.0) + w4 * (35.0 / 128.0);
        Self {
            s: 0.5 + 0.5 * x * slope,
            w2,
            w3,
            w4,
            xw3: x * w3,
        }
    }
}

/// The coefficients k1 to k9 of [`Law`] on an arc with a radius of 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArcLaw([f32; 9]);

/// Fraction bits of the coefficients, as powers of two.
const SCALE: [f32; 9] = {
    let bits = [33, 34, 32, 30, 33, 34, 30, 31, 30];
    let (mut scale, mut i) = ([0.0; 9], 0);
    while i < bits.len() {
        scale[i] = (1u64 << bits[i]) as f32;
        i += 1;
    }
    scale
};
/// Largest that a rounded coefficient may be: 31 bits, less what rounding may add.
const MOST: f32 = 0.98 * 2_147_483_648.0;

impl ArcLaw {
    pub(super) fn new(zone: &Built, motion: &Motion) -> Self {
        let (a, b) = (zone.operator.second_s2, zone.operator.fourth_s4);
        let (rate, t) = (motion.rate, motion.ramp_s);
        let (rate2, change) = (rate * rate, rate * FIRST / t);
        let snap = b * rate * THIRD / (t * t * t);
        Self([
            -a * rate2,
            b * rate2 * rate2,
            4.0 * b * rate2 / (t * t) * SECOND,
            -3.0 * b * change * change,
            a * change,
            -6.0 * b * rate2 * change,
            snap,
            -7.0 / 6.0 * snap,
            // (κ3/6) p‴ along the radius: Re(iω)³ and the rest of it only delay.
            -3.0 * zone.third_s3 * rate * change,
        ])
    }

    /// Outward and ahead, as shares of the radius. `sense` is −1 in a falling ramp, which is a rising one run backwards:
    /// there κ3 has the other sign (and what is ahead, too, which is left to the caller).
    pub(super) fn gain(&self, f: &Shape, sense: f32) -> [f32; 2] {
        let [k1, k2, k3, k4, k5, k6, k7, k8, k9] = self.0;
        let rate2 = f.s * f.s;
        let radial =
            rate2 * (k1 + k2 * rate2) + k3 * f.s * f.xw3 + (k4 * f.w4 + sense * k9 * f.s) * f.w4;
        [radial, f.w4 * (k5 + k6 * rate2) + k7 * f.w2 + k8 * f.w3]
    }

    /// Outward at constant rate, as a share of the radius.
    pub(super) fn steady(&self) -> f32 {
        let [k1, k2, ..] = self.0;
        k1 + k2
    }

    /// The largest coefficient, of what the integers can hold.
    pub(super) fn load(&self) -> f32 {
        self.0
            .iter()
            .zip(SCALE)
            .fold(0.0, |most, (k, scale)| (k * scale / MOST).abs().max(most))
    }

    /// Rounded; saturates beyond a load of 1.
    pub(super) fn rounded(&self) -> Law {
        let mut scaled = self.0;
        for (k, scale) in scaled.iter_mut().zip(SCALE) {
            *k *= scale;
        }
        let [k1, k2, k3, k4, k5, k6, k7, k8, k9] = scaled.map(|k| single_to_fixed(k, 0));
        Law {
            k1,
            k2,
            k3,
            k4,
            k5,
            k6,
            k7,
            k8,
            k9,
            end_term_q1: 0,
        }
    }
}

/// The coefficients k5, k7 and k8 of [`Law`] on a line, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineLaw([f32; 3]);

impl LineLaw {
    /// Up to `speed` m/s.
    pub(super) fn new(zone: &Built, speed: f32, ramp_s: f32) -> Self {
        let snap = zone.operator.fourth_s4 * speed * THIRD / (ramp_s * ramp_s * ramp_s);
        Self([
            zone.operator.second_s2 * speed * FIRST / ramp_s,
            snap,
            -7.0 / 6.0 * snap,
        ])
    }

    /// Offset along the line, m.
    pub(super) fn along(&self, f: &Shape) -> f32 {
        let [k5, k7, k8] = self.0;
        k5 * f.w4 + k7 * f.w2 + k8 * f.w3
    }

    /// Rounded.
    pub(super) fn rounded(&self) -> Law {
        let nm = |metres: f32, bits: u32| single_to_fixed(metres * 1e9, bits);
        let [k5, k7, k8] = self.0;
        Law {
            k5: nm(k5, 2),
            k7: nm(k7, 2),
            k8: nm(k8, 3),
            ..Law::default()
        }
    }
}
