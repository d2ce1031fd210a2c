//! Profile terms: departures from the one radius law that depend on axis, direction or place.
//!
//! One type for three users: the host's diagnosis estimates it, the table carries it, the engine
//! evaluates its inverse. Each term is the *error of the machine* (what is measured); the controller
//! applies the opposite. Every term is defined on the axes, so that it holds on any path; the radial
//! deviation `r(θ)` that it leaves on a circle (θ polar angle, CCW positive, `d` = ±1) is in its doc.
use crate::Axis;
use serde::{Deserialize, Serialize};

/// One compensable error of the machine. `T` is `f64` on the host, `f32` in the controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Term<T> {
    /// Constant radial error of circles (ball, bar or tool calibration): `r = offset`.
    RadiusOffset {
        /// Measured minus true radius, m.
        offset_m: T,
    },
    /// Both axes long by the same share: `r = R·relative`.
    ScaleError {
        /// Relative length error, m/m.
        relative: T,
    },
    /// X longer than Y: x error `+½ relative·x`, y error `−½ relative·y`; `r = ½R·relative·cos2θ`.
    ScaleMismatch {
        /// sx − sy, m/m.
        relative: T,
    },
    /// Axes not square: error `½ε·y` in x and `½ε·x` in y; `r = ½εR·sin2θ`.
    Squareness {
        /// ε, rad.
        shear_rad: T,
    },
    /// X lags more than Y: x error `−½Δτ·ẋ`, y error `+½Δτ·ẏ`; `r = d·½fΔτ·sin2θ`.
    ServoMismatch {
        /// Δτ = τx − τy, s.
        delta_tau_s: T,
    },
    /// X has the larger second cumulant: x error `+¼Δκ2·ẍ`, y error `−¼Δκ2·ÿ`; `r = −(Δκ2/4)(f²/R)·cos2θ`.
    BandwidthMismatch {
        /// Δκ2 = κ2x − κ2y, s².
        delta_kappa2_s2: T,
    },
    /// Hysteresis of half the step on either side: error `−½B·sgn(velocity of axis)`, counted so that a
    /// positive step is outward after the reversal: for X `r = d(B/2)·sgn(sinθ)·cosθ`,
    /// for Y `r = −d(B/2)·sgn(cosθ)·sinθ`.
    Backlash {
        /// Axis that loses motion.
        axis: Axis,
        /// B, m.
        step_m: T,
    },
    /// The other axis shifts by half of `shift` with the sign of this axis's velocity. For X (Y shifts):
    /// y error `+½L·sgn(ẋ)`, `r = −d(L/2)|sinθ|`; for Y (X shifts): x error `−½L·sgn(ẏ)`, `r = −d(L/2)|cosθ|`.
    LateralPlay {
        /// Axis whose direction of travel matters.
        axis: Axis,
        /// L, m.
        shift_m: T,
    },
    /// Friction: the axis lags behind after its velocity changes sign, by a pulse that dies away in time,
    /// `r = peak·exp(−t/decay)·|cosθ|` (X; `|sinθ|` for Y), t since the reversal, outward.
    ReversalSpike {
        /// Axis that reverses.
        axis: Axis,
        /// Height of the spike, m.
        peak_m: T,
        /// Time constant of the decay, s.
        decay_s: T,
    },
    /// Periodic error of the screw or gear: axis error `amplitude·sin(2π·position/pitch + phase)`.
    Cyclic {
        /// Axis with the periodic error.
        axis: Axis,
        /// Amplitude, m.
        amplitude_m: T,
        /// Period, m.
        pitch_m: T,
        /// Phase at position 0 (machine coordinate of the axis), rad.
        phase_rad: T,
    },
    /// Bowed guide: moving along `axis` shifts the other axis by `curvature·u²`, u measured from the centre
    /// of the circle. For X: `r = cR²·cos²θ·sinθ = (cR²/4)(sinθ + sin3θ)`.
    Straightness {
        /// Axis along whose travel the guide is bowed.
        axis: Axis,
        /// c, 1/m: the bow over ±R is cR².
        curvature_per_m: T,
    },
}

impl<T: Copy> Term<T> {
    /// The same term with each of its numbers passed through `f`: from the host's `f64` to the table's `f32`.
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        match self {
            Self::RadiusOffset { offset_m } => Term::RadiusOffset {
                offset_m: f(offset_m),
            },
            Self::ScaleError { relative } => Term::ScaleError {
                relative: f(relative),
            },
            Self::ScaleMismatch { relative } => Term::ScaleMismatch {
                relative: f(relative),
            },
            Self::Squareness { shear_rad } => Term::Squareness {
                shear_rad: f(shear_rad),
            },
            Self::ServoMismatch { delta_tau_s } => Term::ServoMismatch {
                delta_tau_s: f(delta_tau_s),
            },
            Self::BandwidthMismatch { delta_kappa2_s2 } => Term::BandwidthMismatch {
                delta_kappa2_s2: f(delta_kappa2_s2),
            },
            Self::Backlash { axis, step_m } => Term::Backlash {
                axis,
                step_m: f(step_m),
            },
            Self::LateralPlay { axis, shift_m } => Term::LateralPlay {
                axis,
                shift_m: f(shift_m),
            },
            Self::ReversalSpike {
                axis,
                peak_m,
                decay_s,
            } => Term::ReversalSpike {
                axis,
                peak_m: f(peak_m),
                decay_s: f(decay_s),
            },
            Self::Cyclic {
                axis,
                amplitude_m,
                pitch_m,
                phase_rad,
            } => Term::Cyclic {
                axis,
                amplitude_m: f(amplitude_m),
                pitch_m: f(pitch_m),
                phase_rad: f(phase_rad),
            },
            Self::Straightness {
                axis,
                curvature_per_m,
            } => Term::Straightness {
                axis,
                curvature_per_m: f(curvature_per_m),
            },
        }
    }
}
