//! From the two drives to the tool: errors of guides, scales and structure. Signs are those of
//! [`giotto_shared::term::Term`]; small errors are added, their products left out.
use super::axis::AxisPoint;
use super::machine::Machine;
use std::f64::consts::TAU;

/// Where the circle lies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    /// Centre in machine coordinates, m.
    pub(super) centre_m: [f64; 2],
}

/// Tool position about the centre of the circle, m, at `t` seconds of campaign time.
pub(super) fn tool(machine: &Machine, place: Place, t: f64, axes: [AxisPoint; 2]) -> [f64; 2] {
    let [x, y] = axes.map(|a| a.drive_m);
    let half_shear = 0.5 * machine.squareness_rad;
    let growth = match machine.thermal_settling_s {
        settling if settling > 0.0 && machine.thermal_per_s != 0.0 => {
            machine.thermal_per_s * settling * (1.0 - (-t / settling).exp())
        }
        _ => machine.thermal_per_s * t,
    };
    let half_cross = 0.5 * machine.cross_lag_s;
    let mut tool = [
        x + axes[0].error_m
            + x * (machine.scale[0] + growth)
            + y * half_shear
            + machine.straightness_per_m[1] * y * y
            - 0.5 * machine.lateral_play_m[1] * axes[1].sign
            - half_cross * axes[1].velocity_m_s,
        y + axes[1].error_m
            + y * (machine.scale[1] + growth)
            + x * half_shear
            + machine.straightness_per_m[0] * x * x
            + 0.5 * machine.lateral_play_m[0] * axes[0].sign
            + half_cross * axes[0].velocity_m_s,
    ];
    for axis in 0..2 {
        if let Some(c) = machine.cyclic[axis] {
            let position = place.centre_m[axis] + axes[axis].drive_m;
            tool[axis] += c.amplitude_m * (TAU * position / c.pitch_m + c.phase_rad).sin();
        }
    }
    let radial = machine.radius_offset_m
        + machine.vibration.map_or(0.0, |v| {
            v.amplitude_m * (TAU * v.frequency_hz * t + v.phase_rad).sin()
        });
    if radial != 0.0 {
        let length = tool[0].hypot(tool[1]);
        if length > 0.0 {
            tool = tool.map(|p| p * (1.0 + radial / length));
        }
    }
    tool
}
