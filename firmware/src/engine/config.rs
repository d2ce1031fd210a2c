//! What the engine is told about the machine, and the bounds that no table can widen.
use giotto_shared::path::{MAX_POSITION_M, MotionLimits};
use giotto_shared::wire::{ConfigField, MachineConfig, STEP_MOST, TICK_HZ};

/// Slowest and fastest tick the engine is built for, Hz.
pub const RATE_HZ: [u32; 2] = TICK_HZ;
/// Shortest feed ramp, ticks: below it the phase of a ramp is no longer exact (see `ramp`).
pub const MIN_RAMP_TICKS: u32 = 32;
/// Longest feed ramp or blend, ticks.
pub const MAX_RAMP_TICKS: u32 = 1 << 24;

/// Limits of the machine and of the correction. SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Ticks per second.
    pub rate_hz: u32,
    /// Feed, acceleration and jerk along the path.
    pub motion: MotionLimits,
    /// Feed of positioning moves, m/s.
    pub positioning_m_s: f64,
    /// Largest offset of the correction on one axis, whatever the table says, m.
    pub offset_m: f64,
    /// Largest rate of change of that offset by axis, whatever the table says, m/s.
    pub slew_m_s: [f64; 3],
    /// Time over which a correction is engaged or disengaged, s.
    pub engage_s: f64,
    /// Time in which the play of an axis is taken up at its reversal, s.
    pub take_up_s: f64,
    /// Distance of the set-points that streams are differentiated with, s; the latency is twice that.
    pub stream_window_s: f64,
    /// Ticks that a missing set-point of a stream is bridged.
    pub stream_hold_ticks: u32,
    /// Soft limits by axis, least and most, nm: no path leaves them.
    pub soft_nm: [[i32; 2]; 3],
    /// Correct although the ticks are not counted by a crystal.
    pub internal_clock: bool,
}

/// The whole of an axis, nm.
const WHOLE_NM: [i32; 2] = [
    -((MAX_POSITION_M * 1e9) as i32),
    (MAX_POSITION_M * 1e9) as i32,
];

impl Config {
    /// A robot's worth of limits: 1 m/s, 5 m/s², 100 m/s³; offsets to 20 mm at 0.2 m/s.
    pub const fn robot(rate_hz: u32) -> Self {
        Self {
            rate_hz,
            motion: MotionLimits {
                feed_m_s: 1.0,
                acceleration_m_s2: 5.0,
                jerk_m_s3: 100.0,
            },
            positioning_m_s: 0.5,
            offset_m: 0.02,
            slew_m_s: [0.2; 3],
            engage_s: 0.25,
            take_up_s: 0.008,
            stream_window_s: 0.015,
            stream_hold_ticks: 5,
            soft_nm: [WHOLE_NM; 3],
            internal_clock: false,
        }
    }

    /// The configuration itself if every number is usable; the name of the first that is not otherwise.
    pub fn checked(self) -> Result<Self, ConfigError> {
        if !(RATE_HZ[0]..=RATE_HZ[1]).contains(&self.rate_hz) {
            return Err(ConfigError("rate_hz"));
        }
        let most = |field: ConfigField| field.most().unwrap_or(0.0);
        let MotionLimits {
            feed_m_s,
            acceleration_m_s2,
            jerk_m_s3,
        } = self.motion;
        let upper_bounds = [
            (feed_m_s, most(ConfigField::Feed), "motion.feed_m_s"),
            (
                acceleration_m_s2,
                most(ConfigField::Acceleration),
                "motion.acceleration_m_s2",
            ),
            (jerk_m_s3, most(ConfigField::Jerk), "motion.jerk_m_s3"),
            (self.positioning_m_s, feed_m_s, "positioning_m_s"),
            (self.offset_m, most(ConfigField::Offset), "offset_m"),
            (self.slew_m_s[0], most(ConfigField::Slew), "slew_m_s"),
            (self.slew_m_s[1], most(ConfigField::Slew), "slew_m_s"),
            (self.slew_m_s[2], most(ConfigField::Slew), "slew_m_s"),
            (self.engage_s, 10.0, "engage_s"),
            (self.take_up_s, 1.0, "take_up_s"),
            (
                self.stream_window_s,
                most(ConfigField::Window),
                "stream_window_s",
            ),
        ];
        for (value, most, name) in upper_bounds {
            // NaN fails the comparison too.
            if !(value > 0.0 && value <= most) {
                return Err(ConfigError(name));
            }
        }
        Ok(self)
    }

    /// As it is said on the wire. Steps are the board's business: one is a nanometre here.
    pub const fn said(&self) -> MachineConfig {
        MachineConfig {
            feed_m_s: self.motion.feed_m_s as f32,
            acceleration_m_s2: self.motion.acceleration_m_s2 as f32,
            jerk_m_s3: self.motion.jerk_m_s3 as f32,
            positioning_m_s: self.positioning_m_s as f32,
            offset_m: self.offset_m as f32,
            slew_m_s: {
                let [x, y, z] = self.slew_m_s;
                [x as f32, y as f32, z as f32]
            },
            stream_window_s: self.stream_window_s as f32,
            soft_nm: self.soft_nm,
            internal_clock: self.internal_clock,
            tick_hz: self.rate_hz,
            step: [[1, 1]; 3],
        }
    }

    /// With the numbers of the wire, if each of them is usable; otherwise the first that is not. Ticks and steps hold from the next
    /// start on: they are only looked at.
    pub fn with(self, said: &MachineConfig) -> Result<Self, ConfigField> {
        let config = Self {
            motion: MotionLimits {
                feed_m_s: f64::from(said.feed_m_s),
                acceleration_m_s2: f64::from(said.acceleration_m_s2),
                jerk_m_s3: f64::from(said.jerk_m_s3),
            },
            positioning_m_s: f64::from(said.positioning_m_s),
            offset_m: f64::from(said.offset_m),
            slew_m_s: said.slew_m_s.map(f64::from),
            stream_window_s: f64::from(said.stream_window_s),
            soft_nm: said.soft_nm,
            internal_clock: said.internal_clock,
            ..self
        };
        let ordered = config
            .soft_nm
            .iter()
            .all(|[least, most]| least < most && *least >= WHOLE_NM[0] && *most <= WHOLE_NM[1]);
        if !ordered {
            return Err(ConfigField::Soft);
        }
        if !(RATE_HZ[0]..=RATE_HZ[1]).contains(&said.tick_hz) {
            return Err(ConfigField::Rate);
        }
        let mut units = said.step.iter().flatten();
        if !units.all(|number| (1..=STEP_MOST).contains(number)) {
            return Err(ConfigField::Step);
        }
        config.checked().map_err(|ConfigError(name)| match name {
            "motion.feed_m_s" => ConfigField::Feed,
            "motion.acceleration_m_s2" => ConfigField::Acceleration,
            "motion.jerk_m_s3" => ConfigField::Jerk,
            "positioning_m_s" => ConfigField::Positioning,
            "offset_m" => ConfigField::Offset,
            "slew_m_s" => ConfigField::Slew,
            _ => ConfigField::Window,
        })
    }

    /// Seconds per tick.
    pub fn tick_s(&self) -> f64 {
        1.0 / f64::from(self.rate_hz)
    }

    /// Ticks of an engage or disengage blend.
    pub fn engage_ticks(&self) -> u32 {
        ticks(self.engage_s as f32 * self.rate_hz as f32)
    }
}

/// The next whole number; one met to seven digits is met, since times and rates are decimal. Saturates; 0 for NaN.
pub(crate) fn whole_above(exact: f32) -> u32 {
    let below = exact as u32;
    below.saturating_add(u32::from(exact - below as f32 > 1e-6 * exact))
}

/// A whole number of ticks, at least the shortest ramp.
pub(crate) fn ticks(exact: f32) -> u32 {
    whole_above(exact).clamp(MIN_RAMP_TICKS, MAX_RAMP_TICKS)
}

/// A value of [`Config`] that is not finite, not positive or beyond what the engine is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigError(
    /// Name of the value.
    pub &'static str,
);
