//! Radial errors that no listed cause describes: what `unexplained` is for.
use std::f64::consts::PI;

/// Where and when a pattern is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Here {
    /// Polar angle, rad.
    pub angle_rad: f64,
    /// Radius, m.
    pub radius_m: f64,
    /// Feed, m/s.
    pub feed_m_s: f64,
    /// +1 CCW, −1 CW.
    pub sign: f64,
    /// Time since the lap began, s.
    pub time_s: f64,
    /// Share of the campaign gone by, 0…1.
    pub share: f64,
}

/// A radial error without a name. `reach` scales it with feed and radius:
/// `(f/0.5 m/s)^reach[0]·(R/0.15 m)^reach[1]`, so an amplitude is that of a middling run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// `amplitude·cos(order·θ − phase)`, times d if `odd`.
    Lobes {
        /// Lobes a turn; 0 is a change of size.
        order: f64,
        /// Amplitude, m.
        amplitude_m: f64,
        /// Phase, rad.
        phase_rad: f64,
        /// Flips with the direction of travel.
        odd: bool,
        /// Exponents of feed and radius.
        reach: [f64; 2],
    },
    /// A bump at a fixed place of the circle.
    Bump {
        /// Height, m.
        height_m: f64,
        /// Where, rad.
        at_rad: f64,
        /// Standard width, rad.
        width_rad: f64,
        /// Exponents of feed and radius.
        reach: [f64; 2],
    },
    /// A radial shift inside one quadrant, times d.
    Quadrant {
        /// Shift, m.
        shift_m: f64,
        /// 0…3, from +X counter-clockwise.
        which: u8,
    },
    /// A jump of the size in the middle of the campaign.
    Step {
        /// Jump, m.
        jump_m: f64,
        /// Share of the campaign at which it happens.
        at: f64,
    },
    /// A sweep in time, restarted with every lap.
    Sweep {
        /// Amplitude, m.
        amplitude_m: f64,
        /// First and last frequency, cycles a turn.
        orders: [f64; 2],
    },
    /// A transient that dies away after the lap has begun.
    Transient {
        /// Height, m.
        height_m: f64,
        /// Time constant, s.
        decay_s: f64,
    },
}

impl Pattern {
    /// Radial error, m.
    pub fn radial_m(&self, h: &Here) -> f64 {
        let scaled = |reach: &[f64; 2]| {
            (h.feed_m_s / 0.5).powf(reach[0]) * (h.radius_m / 0.15).powf(reach[1])
        };
        match self {
            Self::Lobes {
                order,
                amplitude_m,
                phase_rad,
                odd,
                reach,
            } => {
                let d = if *odd { h.sign } else { 1.0 };
                d * amplitude_m * scaled(reach) * (order * h.angle_rad - phase_rad).cos()
            }
            Self::Bump {
                height_m,
                at_rad,
                width_rad,
                reach,
            } => {
                let off = (h.angle_rad - at_rad + PI).rem_euclid(2.0 * PI) - PI;
                height_m * scaled(reach) * (-0.5 * (off / width_rad).powi(2)).exp()
            }
            Self::Quadrant { shift_m, which } => {
                let quadrant = (h.angle_rad.rem_euclid(2.0 * PI) / (PI / 2.0)) as u8;
                if quadrant == *which {
                    h.sign * shift_m
                } else {
                    0.0
                }
            }
            Self::Step { jump_m, at } => {
                if h.share > *at {
                    *jump_m
                } else {
                    0.0
                }
            }
            Self::Sweep {
                amplitude_m,
                orders,
            } => {
                let turn_s = 2.0 * PI * h.radius_m / h.feed_m_s;
                let u = h.time_s / turn_s;
                amplitude_m
                    * (2.0 * PI * (orders[0] * u + 0.5 * (orders[1] - orders[0]) * u * u)).sin()
            }
            Self::Transient { height_m, decay_s } => height_m * (-h.time_s / decay_s).exp(),
        }
    }
}
