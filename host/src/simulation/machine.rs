//! What a simulated machine is made of. [`Machine::default`] is a perfect one.

use super::arm::Arm;

/// A machine of three slides, X, Y and Z in this order. Every element is off in the default.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Machine {
    /// The controller issues set-points every so many seconds and joins them by chords.
    pub interpolation_s: Option<f64>,
    /// The controller slows arcs down to this centripetal acceleration, m/s².
    pub centripetal_limit_m_s2: Option<f64>,
    /// Acceleration/deceleration filter, the same on both axes.
    pub acc_dec: AccDec,
    /// Position loops.
    pub servo: [PositionLoop; 3],
    /// Second-order mechanics behind the loops.
    pub mechanics: [Option<SecondOrder>; 3],
    /// Pure delay of each axis, s.
    pub dead_time_s: [f64; 3],
    /// Friction of each axis.
    pub friction: [Option<Friction>; 3],
    /// Backlash of each axis, m (positive: outward step after a reversal, as the term `Backlash`).
    pub backlash_m: [f64; 3],
    /// Lateral play, m: first index the moving axis, second the one that shifts (as the term `LateralPlay`).
    pub lateral_play_m: [[f64; 3]; 3],
    /// Relative scale error of each axis, m/m.
    pub scale: [f64; 3],
    /// Squareness error ε of the planes XY, YZ, ZX, rad.
    pub squareness_rad: [f64; 3],
    /// Guide curvature, 1/m: first index the axis of travel, second the one that shifts (as the term `Straightness`).
    pub straightness_per_m: [[f64; 3]; 3],
    /// Periodic error of each axis.
    pub cyclic: [Option<Cyclic>; 3],
    /// Structural vibration at a fixed frequency.
    pub vibration: Option<Vibration>,
    /// Growth over campaign time, m/m per s at its start.
    pub thermal_per_s: f64,
    /// Time constant with which the growth settles, s; 0: it does not.
    pub thermal_settling_s: f64,
    /// In the plane of the circle, lag of each direction behind the *other* one's velocity (serial arm, A12 = −A21 = half
    /// of it), s.
    pub cross_lag_s: f64,
    /// Constant error of the radius (ball, bar), m.
    pub radius_offset_m: f64,
    /// The joints, where the machine is an arm; all of them have the loop, mechanics and dead time of X.
    pub arm: Option<Arm>,
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
        Self {
            kv_per_s: f64::INFINITY,
            feed_forward: 0.0,
        }
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

/// Friction seen in position: a pulse after each reversal of the axis that an integrating loop removes, and
/// the teeth of stick–slip while the axis is slow. In a reversal the axis stays behind, so both point
/// against the new direction of travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Height of the pulse, m: −sgn(v)·peak·p(t), p the answer of peak 1 to friction that turns at once.
    pub peak_m: f64,
    /// Decay of the pulse, s.
    pub decay_s: f64,
    /// Rise of the pulse, s; 0: at once.
    pub rise_s: f64,
    /// Travel over which the friction turns its sign, 1 − 2e^{−x/x0}, m; 0: at once.
    pub presliding_m: f64,
    /// Height of a stick–slip tooth, m: the axis falls behind by it and catches up at once.
    pub stick_slip_m: f64,
    /// Travel of the drive from tooth to tooth, m (equal to the height: full standstill between slips).
    pub stick_travel_m: f64,
    /// Axis speed at which the teeth have shrunk to 1/e, m/s: height·exp(−(v/speed)²).
    pub stick_speed_m_s: f64,
}

impl Default for Friction {
    fn default() -> Self {
        Self {
            peak_m: 0.0,
            decay_s: 0.02,
            rise_s: 0.0,
            presliding_m: 0.0,
            stick_slip_m: 0.0,
            stick_travel_m: 1e-3,
            stick_speed_m_s: 5e-3,
        }
    }
}

impl Friction {
    /// Peak of e^{−t/decay} − e^{−t/rise}.
    pub(super) fn highest(&self) -> f64 {
        if self.rise_s <= 0.0 {
            return 1.0;
        }
        let rise_s = self.rise_s.min(0.95 * self.decay_s);
        let peak_s = (self.decay_s / rise_s).ln() * self.decay_s * rise_s / (self.decay_s - rise_s);
        (-peak_s / self.decay_s).exp() - (-peak_s / rise_s).exp()
    }
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

/// Radial vibration amplitude·sin(2π·frequency·t + phase), t in campaign time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Phase at the start of the campaign, rad.
    pub phase_rad: f64,
}

/// A machine that cannot be simulated: which number is at fault and what it may be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} = {value} is outside {allowed}")]
pub struct MachineError {
    /// Field at fault.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What it may be, in words.
    pub allowed: &'static str,
}

/// Slowest settling that is simulated, s: with a longer one the run-in outlasts any circular test.
pub const MAX_TIME_CONSTANT_S: f64 = 5.0;

impl Machine {
    /// Checks every number against what the simulation can do.
    ///
    /// # Errors
    /// The first field that is not finite or out of its range.
    pub fn check(&self) -> Result<(), MachineError> {
        let fail = |name, value, allowed| {
            Err(MachineError {
                name,
                value,
                allowed,
            })
        };
        let positive = |name, value: f64| match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => fail(name, value, "positive, finite numbers"),
        };
        let finite = |name, value: f64| match value.is_finite() {
            true => Ok(()),
            false => fail(name, value, "finite numbers"),
        };
        let time_constant = |name, value: f64| match value > 0.0 && value <= MAX_TIME_CONSTANT_S {
            true => Ok(()),
            false => fail(name, value, "0 to 5 s (zero excluded)"),
        };
        if let Some(t) = self.interpolation_s {
            time_constant("interpolation_s", t)?;
        }
        if let Some(a) = self.centripetal_limit_m_s2 {
            positive("centripetal_limit_m_s2", a)?;
        }
        match self.acc_dec {
            AccDec::None => {}
            AccDec::Exponential(t) => time_constant("exponential_s", t)?,
            AccDec::MovingAverage(t) => time_constant("moving_average_s", t)?,
        }
        for axis in 0..3 {
            let servo = self.servo[axis];
            if servo.kv_per_s.is_nan() || servo.kv_per_s < 1.0 / MAX_TIME_CONSTANT_S {
                return fail("kv_per_s", servo.kv_per_s, "0.2 /s and more");
            }
            finite("feed_forward", servo.feed_forward)?;
            if let Some(m) = self.mechanics[axis] {
                positive("omega_n_rad_s", m.omega_n_rad_s)?;
                positive("zeta", m.zeta)?;
                time_constant("1/(ζ·ωn)", slowest_s(m))?;
            }
            if !(0.0..=MAX_TIME_CONSTANT_S).contains(&self.dead_time_s[axis]) {
                return fail("dead_time_s", self.dead_time_s[axis], "0 to 5 s");
            }
            if let Some(f) = self.friction[axis] {
                finite("friction.peak_m", f.peak_m)?;
                positive("friction.decay_s", f.decay_s)?;
                finite("friction.rise_s", f.rise_s)?;
                finite("friction.presliding_m", f.presliding_m)?;
                finite("friction.stick_slip_m", f.stick_slip_m)?;
                positive("friction.stick_travel_m", f.stick_travel_m)?;
                positive("friction.stick_speed_m_s", f.stick_speed_m_s)?;
            }
            if let Some(c) = self.cyclic[axis] {
                finite("cyclic.amplitude_m", c.amplitude_m)?;
                positive("cyclic.pitch_m", c.pitch_m)?;
                finite("cyclic.phase_rad", c.phase_rad)?;
            }
            finite("backlash_m", self.backlash_m[axis])?;
            finite("scale", self.scale[axis])?;
            finite("squareness_rad", self.squareness_rad[axis])?;
            for other in 0..3 {
                finite("lateral_play_m", self.lateral_play_m[axis][other])?;
                finite("straightness_per_m", self.straightness_per_m[axis][other])?;
            }
        }
        if let Some(v) = self.vibration {
            positive("vibration.frequency_hz", v.frequency_hz)?;
            finite("vibration.amplitude_m", v.amplitude_m)?;
            finite("vibration.phase_rad", v.phase_rad)?;
        }
        finite("thermal_per_s", self.thermal_per_s)?;
        finite("thermal_settling_s", self.thermal_settling_s)?;
        if let Some((name, value)) = self.arm.as_ref().and_then(Arm::fault) {
            return fail(name, value, "finite numbers, a decay above 0");
        }
        finite("cross_lag_s", self.cross_lag_s)?;
        finite("radius_offset_m", self.radius_offset_m)
    }

    /// Slowest time constant of an axis, s: what the run-in has to outlast.
    pub(super) fn settling_s(&self, axis: usize) -> f64 {
        let mut slowest: f64 = 1.0 / self.servo[axis].kv_per_s;
        if let AccDec::Exponential(t) = self.acc_dec {
            slowest = slowest.max(t);
        }
        self.mechanics[axis].map_or(slowest, |m| slowest.max(slowest_s(m)))
    }
}

/// Time constant of the slower (or the common) pole of a second-order element, s.
fn slowest_s(m: SecondOrder) -> f64 {
    let root = (m.zeta * m.zeta - 1.0).max(0.0).sqrt();
    // ζ − √(ζ²−1) loses its digits for large ζ; its reciprocal ζ + √(ζ²−1) does not.
    if root > 0.0 {
        (m.zeta + root) / m.omega_n_rad_s
    } else {
        1.0 / (m.zeta * m.omega_n_rad_s)
    }
}
