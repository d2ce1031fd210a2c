//! A machine tool of the tests' own, moved in the time domain.
//!
//! It shares no line with `giotto::simulation`: what `diagnose` finds in its circles cannot have been
//! put there by the code under test. The chain of one axis is
//! command → interpolator → acc/dec filter → position loop → mechanics → friction → hysteresis,
//! then geometry and play couple the axes, then the instrument looks ([`instrument`]).
//! SI units throughout; index 0 is X, 1 is Y, 2 is Z. A circle may lie in any plane ([`Plane`]).
pub mod base;
pub mod command;
pub mod friction;
pub mod geometry;
pub mod hysteresis;
pub mod instrument;
pub mod linear;
pub mod pattern;
pub mod plan;
pub mod plane;
pub mod run;
pub mod two_mass;

pub use friction::{Friction, StickSlip};
pub use geometry::{Cyclic, Geometry};
pub use instrument::{Instrument, Shape, Spread};
pub use pattern::Pattern;
pub use plan::{Plan, Test};
pub use plane::Plane;
pub use run::simulate;
pub use two_mass::TwoMass;

/// Everything that shapes the motion; the default is a perfect machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Set-points every so many seconds, joined by chords; 0: continuous command.
    pub interpolation_s: f64,
    /// Largest centripetal acceleration on arcs, m/s².
    pub centripetal_limit_m_s2: f64,
    /// The three slides.
    pub axes: [AxisChain; 3],
    /// Position-dependent errors.
    pub geometry: Geometry,
    /// Sideways shift of the slide of the second index with the direction of travel of the first, m.
    pub lateral_play_m: [[f64; 3]; 3],
    /// Travel over which the sideways shift changes over, m.
    pub lateral_travel_m: f64,
    /// Vibrations of the structure.
    pub vibration: Option<Vibration>,
    /// Growth with campaign time.
    pub thermal: Option<Thermal>,
    /// Constant error of the measured radius, m.
    pub radius_offset_m: f64,
    /// Errors without a name in the contract.
    pub patterns: Vec<Pattern>,
    /// Share of the programmed feed that is driven: the override, 1 at 100 %.
    pub override_share: f64,
}

impl Default for Machine {
    fn default() -> Self {
        Self {
            interpolation_s: 0.0,
            centripetal_limit_m_s2: f64::INFINITY,
            axes: Default::default(),
            geometry: Geometry::default(),
            lateral_play_m: [[0.0; 3]; 3],
            lateral_travel_m: 10e-6,
            vibration: None,
            thermal: None,
            radius_offset_m: 0.0,
            patterns: Vec::new(),
            override_share: 1.0,
        }
    }
}

/// From the command of one axis to its position.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct AxisChain {
    /// Pure delay, s.
    pub dead_time_s: f64,
    /// Moving average over this time ("linear" acc/dec), s.
    pub average_s: f64,
    /// First-order filter ("exponential" acc/dec), s.
    pub exponential_s: f64,
    /// 1/kv of the position loop, s.
    pub lag_s: f64,
    /// Velocity feed-forward, 0…1.
    pub feed_forward: f64,
    /// ωn (rad/s) and ζ of the mechanics behind the loop.
    pub mechanics: Option<[f64; 2]>,
    /// Friction that an integrating loop works off.
    pub friction: Option<Friction>,
    /// Friction at the end of a spring, another law than `friction`.
    pub two_mass: Option<TwoMass>,
    /// Sticking and slipping at low speed.
    pub stick_slip: Option<StickSlip>,
    /// Lost motion, m; negative: the controller's backlash compensation is set too high.
    pub backlash_m: f64,
}

impl AxisChain {
    /// Mean delay of the chain at low frequency, s.
    pub fn delay_s(&self) -> f64 {
        self.dead_time_s
            + self.average_s / 2.0
            + self.exponential_s
            + self.lag_s * (1.0 - self.feed_forward)
            + self.mechanics.map_or(0.0, |[wn, zeta]| 2.0 * zeta / wn)
    }

    /// κ2 and κ4 of the linear chain (table of `physics`: they add over a cascade), s² and s⁴.
    pub fn cumulants(&self) -> [f64; 2] {
        let (t, e, l, a) = (
            self.average_s,
            self.exponential_s,
            self.lag_s,
            self.feed_forward,
        );
        let mut k2 = t * t / 12.0 + e * e + (1.0 - a * a) * l * l;
        let mut k4 = -t.powi(4) / 120.0 + 6.0 * e.powi(4) + 6.0 * (1.0 - a.powi(4)) * l.powi(4);
        if let Some([w, z]) = self.mechanics {
            k2 += -2.0 * (1.0 - 2.0 * z * z) / (w * w);
            k4 += 12.0 * (8.0 * z.powi(4) - 8.0 * z * z + 1.0) / w.powi(4);
        }
        [k2, k4]
    }
}

/// Vibration at a frequency that does not depend on the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Which way: `None` along the bar (the instrument's mount), else the axis that shakes.
    pub axis: Option<usize>,
}

/// Growth of the whole machine over the campaign, `R·total·s(t/T)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// Growth at the end of the campaign, m/m.
    pub total: f64,
    /// 0: linear in time; above: `(1−exp(−c·t/T))/(1−exp(−c))`, a warm-up.
    pub curvature: f64,
    /// A hump on top, `4·hook·u(1−u)`: the machine warms, the hall cools.
    pub hook: f64,
}

impl Thermal {
    /// Growth, m/m, at the share `u` (0…1) of the campaign.
    pub fn growth(&self, u: f64) -> f64 {
        let share = if self.curvature == 0.0 {
            u
        } else {
            (-self.curvature * u).exp_m1() / (-self.curvature).exp_m1()
        };
        self.total * (share + 4.0 * self.hook * u * (1.0 - u))
    }
}
