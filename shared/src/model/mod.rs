//! The radius model: from servo dynamics to the size of a circle and back.
use serde::{Deserialize, Serialize};

/// Coefficients of the paper's empirical model, Eq. 15: ΔR = β1 f²/R + β2 f⁴/R³ (SI: m, m/s).
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct RadiusModel<T> {
    /// β1, s².
    pub beta1_s2: T,
    /// β2, s⁴.
    pub beta2_s4: T,
}

/// Second and fourth cumulant of the impulse response of the axis-matched chain; they add over a cascade.
/// ln(1 + ΔR/R) = −κ2 ω²/2 + κ4 ω⁴/24.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Cumulants<T> {
    /// κ2, s².
    pub kappa2_s2: T,
    /// κ4, s⁴.
    pub kappa4_s4: T,
}
