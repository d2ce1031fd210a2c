//! The same set-point written plainly: single-precision trigonometry of libm, the operator term by term. What the
//! engine's tick is compared with, and nothing else.
use core::f32::consts::PI;

const RADIUS_M: f32 = 0.1;
const OMEGA_RAD_S: f32 = 5.0;
const RAMP_S: f32 = 0.2;
const KAPPA2_S2: f32 = 46.58e-6;
const FOURTH_S4: f32 = 0.23e-6;

/// Phase and its first four derivatives in a ramp of the rate, W(x) = x − sin(2πx)/2π.
fn phase(time_s: f32) -> [f32; 5] {
    let x = time_s / RAMP_S;
    let (s, c) = (libm::sinf(2.0 * PI * x), libm::cosf(2.0 * PI * x));
    let k = 2.0 * PI / RAMP_S;
    let angle = OMEGA_RAD_S * RAMP_S * (0.5 * x * x + (c - 1.0) / (4.0 * PI * PI));
    let rate = OMEGA_RAD_S * (x - s / (2.0 * PI));
    let first = OMEGA_RAD_S / RAMP_S * (1.0 - c);
    let second = OMEGA_RAD_S / RAMP_S * k * s;
    let third = OMEGA_RAD_S / RAMP_S * k * k * c;
    [angle, rate, first, second, third]
}

/// p − (κ2/2) p″ + (κ2²/8 − κ4/24) p⁗ on a circle tilted in space.
#[inline(never)]
pub(crate) fn tick(time_s: f32) -> [f32; 3] {
    let [a, w, w1, w2, w3] = phase(time_s);
    let (s, c) = (libm::sinf(a), libm::cosf(a));
    let radial = [c, s * 0.958, s * -0.287];
    let along = [-s, c * 0.958, c * -0.287];
    let mut out = [0.0; 3];
    for ((out, r), t) in out.iter_mut().zip(radial).zip(along) {
        let second = -w * w * r + w1 * t;
        let fourth = (w * w * w * w - 3.0 * w1 * w1 - 4.0 * w * w2) * r + (w3 - 6.0 * w * w * w1) * t;
        *out = RADIUS_M * (r - 0.5 * KAPPA2_S2 * second + FOURTH_S4 * fourth);
    }
    out
}
