//! `MODEL.toml`: what `fit` and `diagnose` write and what `simulate`, `table` and `flash` read.
use crate::causes::Effect;
use serde::{Deserialize, Serialize};

/// Version of the file format written by this build.
pub const FORMAT: u32 = 1;

/// A model of one machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelFile {
    /// Format version, [`FORMAT`].
    pub format: u32,
    /// Name of the campaign it was fitted on.
    pub campaign: String,
    /// Machine, as the campaign names it.
    pub machine: String,
    /// The radius law.
    pub servo: Servo,
    /// Where it was fitted: the table's bounds.
    pub valid: Valid,
    /// What diagnosis added, in order of share.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
}

/// The axis-matched servo response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Servo {
    /// The paper's empirical model, Eq. 15.
    Beta {
        /// β1, s².
        beta1_s2: f64,
        /// β2, s⁴.
        beta2_s4: f64,
        /// Half-widths of the 95 % intervals, s² and s⁴.
        #[serde(default)]
        half_width95: [f64; 2],
    },
    /// One position loop 1/(1 + s/kv), exactly (Eq. 14 at low ω).
    Lag {
        /// kv, 1/s.
        kv_per_s: f64,
    },
    /// Second-order response.
    SecondOrder {
        /// ωn, rad/s.
        omega_n_rad_s: f64,
        /// ζ.
        zeta: f64,
    },
}

/// Ranges that the fit has seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Valid {
    /// Smallest and largest radius, mm.
    pub radius_mm: [f64; 2],
    /// Smallest and largest feed, mm/s.
    pub feed_mm_s: [f64; 2],
}
