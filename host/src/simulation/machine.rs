//! What a simulated machine is made of. [`Machine::default`] is a perfect one.

/// A two-axis machine. Every element is off in the default.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Machine {
    /// The controller issues set-points every so many seconds and joins them by chords.
    pub interpolation_s: Option<f64>,
    /// The controller slows arcs down to this centripetal acceleration, m/s².
    pub centripetal_limit_m_s2: Option<f64>,
    /// Acceleration/deceleration filter, the same on both axes.
    pub acc_dec: AccDec,
    /// Position loops of X and Y.
    pub servo: [PositionLoop; 2],
    /// Second-order mechanics behind the loops of X and Y.
    pub mechanics: [Option<SecondOrder>; 2],
    /// Pure delay of each axis, s.
    pub dead_time_s: [f64; 2],
    /// Friction of each axis.
    pub friction: [Option<Friction>; 2],
    /// Backlash of each axis, m (positive: outward step after a reversal, as the term `Backlash`).
    pub backlash_m: [f64; 2],
    /// Lateral play: index is the moving axis, the other one shifts, m.
    pub lateral_play_m: [f64; 2],
    /// Relative scale error of each axis, m/m.
    pub scale: [f64; 2],
    /// Squareness error ε, rad.
    pub squareness_rad: f64,
    /// Guide curvature along each axis, 1/m (as the term `Straightness`).
    pub straightness_per_m: [f64; 2],
    /// Periodic error of each axis.
    pub cyclic: [Option<Cyclic>; 2],
    /// Structural vibration at a fixed frequency.
    pub vibration: Option<Vibration>,
    /// Growth over campaign time, m/m per s.
    pub thermal_per_s: f64,
    /// Constant error of the radius (ball, bar), m.
    pub radius_offset_m: f64,
}

/// Acceleration/deceleration control.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum AccDec {
    /// None.
    #[default]
    None,
    /// First-order lag of time constant T, s ("exponential", Eq. 12).
    Exponential(f64),
    /// Moving average over T, s ("linear").
    MovingAverage(f64),
}

/// Position loop 1/(1 + s/kv) with velocity feed-forward a: (1 + a·s/kv)/(1 + s/kv) (Eq. 13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionLoop {
    /// kv, 1/s; infinite: ideal.
    pub kv_per_s: f64,
    /// a, 0…1.
    pub feed_forward: f64,
}

impl Default for PositionLoop {
    fn default() -> Self {
        Self { kv_per_s: f64::INFINITY, feed_forward: 0.0 }
    }
}

/// ωn²/(s² + 2ζωn s + ωn²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondOrder {
    /// ωn, rad/s.
    pub omega_n_rad_s: f64,
    /// ζ.
    pub zeta: f64,
}

/// Friction seen in position: a pulse after each reversal of the axis that an integrating loop removes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Height of the pulse, m.
    pub peak_m: f64,
    /// Decay of the pulse, s.
    pub decay_s: f64,
    /// Stick–slip amplitude near reversals at low axis speed, m.
    pub stick_slip_m: f64,
}

/// Periodic position error amplitude·sin(2π·x/pitch + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cyclic {
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Pitch, m.
    pub pitch_m: f64,
    /// Phase, rad.
    pub phase_rad: f64,
}

/// Radial vibration amplitude·sin(2π·frequency·t + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, m.
    pub amplitude_m: f64,
}
