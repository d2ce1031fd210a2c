//! The configuration in the form that planning needs: single precision, worked out once.
use super::demand::Bounds;
use crate::engine::config::{Config, ticks, whole_above};
use crate::engine::descent::Slowing;
use giotto_shared::fixed::single_to_fixed;
use giotto_shared::path::STEEPEST;

/// Limits of the machine and of the image. SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct Machine {
    pub(super) rate_hz: f32,
    pub(super) tick_s: f32,
    pub(super) feed_m_s: f32,
    pub(super) acceleration_m_s2: f32,
    pub(super) jerk_m_s3: f32,
    pub(super) positioning_m_s: f32,
    pub(super) offset_m: f32,
    /// By axis.
    pub(super) slew_m_s: [f32; 3],
    pub(super) take_up_ticks: u32,
    pub(super) engage_ticks: u32,
    pub(super) stream_window_s: f32,
    pub(super) stream_hold_ticks: u32,
    pub(super) soft_nm: [[i32; 2]; 3],
    /// Shortest ramp up to a feed f: the longer of f·[0] and √(f·[1]) seconds, by acceleration and by jerk.
    ramp: [f32; 2],
}

impl Machine {
    pub(super) fn new(config: &Config) -> Self {
        let rate_hz = config.rate_hz as f32;
        let (acceleration_m_s2, jerk_m_s3) = (
            config.motion.acceleration_m_s2 as f32,
            config.motion.jerk_m_s3 as f32,
        );
        Self {
            rate_hz,
            tick_s: 1.0 / rate_hz,
            feed_m_s: config.motion.feed_m_s as f32,
            acceleration_m_s2,
            jerk_m_s3,
            positioning_m_s: config.positioning_m_s as f32,
            offset_m: config.offset_m as f32,
            slew_m_s: config.slew_m_s.map(|slew_m_s| slew_m_s as f32),
            take_up_ticks: whole_above(config.take_up_s as f32 * rate_hz).clamp(3, 1 << 20),
            engage_ticks: config.engage_ticks(),
            stream_window_s: config.stream_window_s as f32,
            stream_hold_ticks: config.stream_hold_ticks,
            soft_nm: config.soft_nm,
            ramp: [
                STEEPEST[0] as f32 / acceleration_m_s2,
                STEEPEST[1] as f32 / jerk_m_s3,
            ],
        }
    }

    /// The quickest ramp within the limits along the path, made longer by a factor.
    pub(super) fn ramp_ticks(&self, feed_m_s: f32, stretch: f32) -> u32 {
        let [by_acceleration, by_jerk] = self.ramp;
        let duration_s = (feed_m_s * by_acceleration).max(libm::sqrtf(feed_m_s * by_jerk));
        ticks(duration_s * stretch * self.rate_hz)
    }

    /// What a stop may take from a speed, in the units of the tick.
    pub(super) fn slowing(&self, speed_m_s: f32, braking_m_s2: f32) -> Slowing {
        let per_tick = self.tick_s / speed_m_s;
        Slowing {
            braking: braking_m_s2 * per_tick,
            jerk: self.jerk_m_s3 * per_tick * self.tick_s,
        }
    }

    /// Least braking (m/s²) with which a stop is no longer than a ramp of so many seconds: below it a stop would lead beyond the end of
    /// its segment.
    pub(super) fn least_braking(&self, speed_m_s: f32, ramp_s: f32) -> f32 {
        let edge_s = self.acceleration_m_s2 / self.jerk_m_s3;
        let left_s = 0.9 * ramp_s - edge_s;
        if left_s > 0.0 {
            (speed_m_s / left_s).min(self.acceleration_m_s2)
        } else {
            self.acceleration_m_s2
        }
    }

    /// Bounds on an offset (nm) and on its change by axis (nm per tick).
    pub(super) fn bounds_nm(&self, bounds: &Bounds) -> (i32, [i32; 3]) {
        let per_tick = self.tick_s * 1e9;
        (
            single_to_fixed(bounds.offset_m * 1e9, 0),
            bounds
                .slew_m_s
                .map(|slew_m_s| single_to_fixed(slew_m_s * per_tick, 0)),
        )
    }
}
