//! `[machine]` of a plan: the machine in the units of the workshop.
use super::machine::{AccDec, Cyclic, Friction, Machine, MachineError, SecondOrder, Vibration};
use giotto_shared::Actuator;
use serde::{Deserialize, Serialize};

/// A machine as a plan writes it. What is left out is perfect.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MachineSpec {
    /// Set-points every so many seconds, joined by chords.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interpolation_s: Option<f64>,
    /// Feed clamp: centripetal acceleration, mm/s².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centripetal_limit_mm_s2: Option<f64>,
    /// Time constant of exponential acc/dec, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exponential_s: Option<f64>,
    /// Length of a moving average, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moving_average_s: Option<f64>,
    /// Squareness error of X and Y, µm/m.
    pub squareness_um_per_m: f64,
    /// Squareness error of Y and Z, µm/m.
    pub squareness_yz_um_per_m: f64,
    /// Squareness error of Z and X, µm/m.
    pub squareness_zx_um_per_m: f64,
    /// Growth, µm/m per hour.
    pub thermal_um_per_m_per_h: f64,
    /// Constant error of the radius, µm.
    pub radius_offset_um: f64,
    /// Vibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vibration: Option<VibrationSpec>,
    /// What all axes have.
    pub both: AxisSpec,
    /// What X has; goes before `both`.
    pub x: AxisSpec,
    /// What Y has; goes before `both`.
    pub y: AxisSpec,
    /// What Z has; goes before `both`.
    pub z: AxisSpec,
}

/// Vibration at a fixed frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "the fields are those of Vibration")]
pub struct VibrationSpec {
    pub frequency_hz: f64,
    pub amplitude_um: f64,
    #[serde(default)]
    pub phase_deg: f64,
}

/// The axis that shifts where a plan names none: Y for X, X for Y and for Z.
const NEXT: [Actuator; 3] = [Actuator::Y, Actuator::X, Actuator::X];

/// One axis.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(
    missing_docs,
    reason = "the fields are those of Machine and its elements"
)]
pub struct AxisSpec {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kv_per_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_forward: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub omega_n_rad_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zeta: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dead_time_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backlash_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lateral_play_um: Option<f64>,
    /// The axis that shifts; left out: Y for X, X for Y and Z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lateral_play_across: Option<Actuator>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_um_per_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub straightness_per_m: Option<f64>,
    /// The axis that shifts; left out: Y for X, X for Y and Z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub straightness_across: Option<Actuator>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_peak_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_decay_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_rise_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_presliding_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick_slip_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick_travel_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick_speed_mm_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cyclic_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cyclic_pitch_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cyclic_phase_deg: Option<f64>,
}

/// Friction of an axis, by what its own table or that of all axes says; `None` where neither names any.
fn friction(get: &impl Fn(fn(&AxisSpec) -> Option<f64>) -> Option<f64>) -> Option<Friction> {
    let (peak, stick) = (get(|a| a.friction_peak_um), get(|a| a.stick_slip_um));
    if peak.is_none() && stick.is_none() {
        return None;
    }
    let standard = Friction::default();
    Some(Friction {
        peak_m: peak.unwrap_or(0.0) * 1e-6,
        decay_s: get(|a| a.friction_decay_s).unwrap_or(standard.decay_s),
        rise_s: get(|a| a.friction_rise_s).unwrap_or(standard.rise_s),
        presliding_m: get(|a| a.friction_presliding_um).map_or(standard.presliding_m, |v| v * 1e-6),
        stick_slip_m: stick.unwrap_or(0.0) * 1e-6,
        stick_travel_m: get(|a| a.stick_travel_um).map_or(standard.stick_travel_m, |v| v * 1e-6),
        stick_speed_m_s: get(|a| a.stick_speed_mm_s).map_or(standard.stick_speed_m_s, |v| v * 1e-3),
    })
}

impl MachineSpec {
    /// The machine.
    ///
    /// # Errors
    /// Elements that lack a part, contradict each other or fail [`Machine::check`]; `name` is the key.
    pub fn machine(&self) -> Result<Machine, MachineError> {
        let missing = |name, allowed| MachineError {
            name,
            value: f64::NAN,
            allowed,
        };
        let mut machine = Machine {
            interpolation_s: self.interpolation_s,
            centripetal_limit_m_s2: self.centripetal_limit_mm_s2.map(|a| a * 1e-3),
            squareness_rad: [
                self.squareness_um_per_m,
                self.squareness_yz_um_per_m,
                self.squareness_zx_um_per_m,
            ]
            .map(|v| v * 1e-6),
            thermal_per_s: self.thermal_um_per_m_per_h * 1e-6 / 3600.0,
            radius_offset_m: self.radius_offset_um * 1e-6,
            vibration: self.vibration.map(|v| Vibration {
                frequency_hz: v.frequency_hz,
                amplitude_m: v.amplitude_um * 1e-6,
                phase_rad: v.phase_deg.to_radians(),
            }),
            ..Machine::default()
        };
        machine.acc_dec = match (self.exponential_s, self.moving_average_s) {
            (Some(_), Some(_)) => {
                return Err(missing(
                    "moving_average_s",
                    "one filter: exponential_s or moving_average_s",
                ));
            }
            (Some(t), None) => AccDec::Exponential(t),
            (None, Some(t)) => AccDec::MovingAverage(t),
            (None, None) => AccDec::None,
        };
        for (axis, own) in [self.x, self.y, self.z].into_iter().enumerate() {
            let get = |part: fn(&AxisSpec) -> Option<f64>| part(&own).or_else(|| part(&self.both));
            if let Some(kv) = get(|a| a.kv_per_s) {
                machine.servo[axis].kv_per_s = kv;
            }
            machine.servo[axis].feed_forward = get(|a| a.feed_forward).unwrap_or(0.0);
            machine.mechanics[axis] = match (get(|a| a.omega_n_rad_s), get(|a| a.zeta)) {
                (Some(omega_n_rad_s), Some(zeta)) => Some(SecondOrder {
                    omega_n_rad_s,
                    zeta,
                }),
                (None, None) => None,
                (None, Some(_)) => return Err(missing("omega_n_rad_s", "a number beside zeta")),
                (Some(_), None) => return Err(missing("zeta", "a number beside omega_n_rad_s")),
            };
            machine.dead_time_s[axis] = get(|a| a.dead_time_s).unwrap_or(0.0);
            machine.backlash_m[axis] = get(|a| a.backlash_um).unwrap_or(0.0) * 1e-6;
            let shifts = across(axis, own.lateral_play_across)?;
            machine.lateral_play_m[axis][shifts] = get(|a| a.lateral_play_um).unwrap_or(0.0) * 1e-6;
            machine.scale[axis] = get(|a| a.scale_um_per_m).unwrap_or(0.0) * 1e-6;
            let bows = across(axis, own.straightness_across)?;
            machine.straightness_per_m[axis][bows] = get(|a| a.straightness_per_m).unwrap_or(0.0);
            machine.friction[axis] = friction(&get);
            if let Some(amplitude) = get(|a| a.cyclic_um) {
                let Some(pitch) = get(|a| a.cyclic_pitch_mm) else {
                    return Err(missing("cyclic_pitch_mm", "a number beside cyclic_um"));
                };
                machine.cyclic[axis] = Some(Cyclic {
                    amplitude_m: amplitude * 1e-6,
                    pitch_m: pitch * 1e-3,
                    phase_rad: get(|a| a.cyclic_phase_deg).unwrap_or(0.0).to_radians(),
                });
            }
        }
        machine.check()?;
        Ok(machine)
    }
}

/// Index of the axis that shifts when `axis` moves.
fn across(axis: usize, named: Option<Actuator>) -> Result<usize, MachineError> {
    let other = named.unwrap_or(NEXT[axis]);
    if other.is_slide() && other.index() != axis {
        return Ok(other.index());
    }
    Err(MachineError {
        name: "across",
        value: f64::NAN,
        allowed: "another one of x, y and z",
    })
}
