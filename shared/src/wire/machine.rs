//! The machine's limits as they are stored and said.
use serde::{Deserialize, Serialize};

/// Limits of the machine. SI, single precision.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MachineConfig {
    /// Largest feed, m/s.
    pub feed_m_s: f32,
    /// Largest acceleration along the path, m/s².
    pub acceleration_m_s2: f32,
    /// Largest jerk along the path, m/s³.
    pub jerk_m_s3: f32,
    /// Feed of the way to a circle, m/s.
    pub positioning_m_s: f32,
    /// Largest offset of the correction on an axis, m.
    pub offset_m: f32,
    /// Its largest rate of change by axis, m/s.
    pub slew_m_s: [f32; 3],
    /// Distance of the set-points that streams are differentiated with, s.
    pub stream_window_s: f32,
    /// Soft limits by axis, least and most, nm.
    pub soft_nm: [[i32; 2]; 3],
    /// Correct although the ticks are not counted by a crystal.
    pub internal_clock: bool,
    /// Ticks a second, from the next start on.
    pub tick_hz: u32,
    /// Units of a step by axis, from the next start on: so many nm in so many steps.
    pub step: [[u32; 2]; 3],
}

/// A number of the configuration by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(
    missing_docs,
    reason = "the message of each variant is its documentation"
)]
pub enum ConfigField {
    #[error("feed")]
    Feed,
    #[error("acceleration")]
    Acceleration,
    #[error("jerk")]
    Jerk,
    #[error("positioning feed")]
    Positioning,
    #[error("offset")]
    Offset,
    #[error("rate of the offset")]
    Slew,
    #[error("window of streams")]
    Window,
    #[error("soft limits")]
    Soft,
    #[error("ticks a second")]
    Rate,
    #[error("units of a step")]
    Step,
}

/// Slowest and fastest tick of any controller, Hz; a board may bear less.
pub const TICK_HZ: [u32; 2] = [250, 20_000];
/// Most nanometres, and most steps, in the units of a step; each is at least 1.
pub const STEP_MOST: u32 = 1 << 20;

impl ConfigField {
    /// Most that any controller takes, SI (m/s, m/s², m/s³, m, s); each is above 0. Nothing for soft limits, ticks and steps, and the
    /// positioning feed is bounded by the feed beside it.
    pub const fn most(self) -> Option<f64> {
        match self {
            Self::Feed | Self::Positioning => Some(10.0),
            Self::Acceleration => Some(1e3),
            Self::Jerk => Some(1e6),
            Self::Offset => Some(0.05),
            Self::Slew | Self::Window => Some(1.0),
            Self::Soft | Self::Rate | Self::Step => None,
        }
    }
}
