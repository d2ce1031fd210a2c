//! From the drives to the tool: errors of guides, scales and structure. Signs are those of
//! [`giotto_shared::term::Term`]; small errors are added, their products left out.
use super::axis::AxisPoint;
use super::machine::Machine;
use giotto_shared::{Frame, Plane};
use std::f64::consts::TAU;

/// Where the circle lies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    /// Centre in machine coordinates, m.
    pub(super) centre_m: [f64; 3],
    /// Its directions.
    pub(super) frame: Frame,
}

/// Tool position about the centre of the circle along the directions of its frame, m, at `t` seconds of campaign time.
pub(super) fn in_plane(machine: &Machine, place: Place, t: f64, axes: [AxisPoint; 3]) -> [f64; 2] {
    let point = tool(machine, place, t, axes);
    [place.frame.first(), place.frame.second()].map(|direction| dot(direction, point))
}

/// Tool position about the centre of the circle in machine coordinates, m, at `t` seconds of campaign time.
pub(super) fn tool(machine: &Machine, place: Place, t: f64, axes: [AxisPoint; 3]) -> [f64; 3] {
    let mut point = guided(machine, place.centre_m, t, axes);
    let (first, second) = (place.frame.first(), place.frame.second());
    if machine.cross_lag_s != 0.0 {
        let velocity = axes.map(|axis| axis.velocity_m_s);
        let half = 0.5 * machine.cross_lag_s;
        let [along, across] = [-half * dot(second, velocity), half * dot(first, velocity)];
        point = [0, 1, 2].map(|k| point[k] + along * first[k] + across * second[k]);
    }
    let radial = machine.radius_offset_m
        + machine.vibration.map_or(0.0, |v| {
            v.amplitude_m * (TAU * v.frequency_hz * t + v.phase_rad).sin()
        });
    if radial != 0.0 {
        let [u, v] = [dot(first, point), dot(second, point)];
        let length = u.hypot(v);
        if length > 0.0 {
            let more = radial / length;
            point = [0, 1, 2].map(|k| point[k] + more * (u * first[k] + v * second[k]));
        }
    }
    point
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The same of drives, guides and scales alone.
fn guided(machine: &Machine, centre_m: [f64; 3], t: f64, axes: [AxisPoint; 3]) -> [f64; 3] {
    let drive = axes.map(|a| a.drive_m);
    let growth = match machine.thermal_settling_s {
        settling if settling > 0.0 && machine.thermal_per_s != 0.0 => {
            machine.thermal_per_s * settling * (1.0 - (-t / settling).exp())
        }
        _ => machine.thermal_per_s * t,
    };
    let mut tool = [0, 1, 2].map(|k| {
        let cyclic = machine.cyclic[k].map_or(0.0, |c| {
            let position = centre_m[k] + drive[k];
            c.amplitude_m * (TAU * position / c.pitch_m + c.phase_rad).sin()
        });
        drive[k] + axes[k].error_m + drive[k] * (machine.scale[k] + growth) + cyclic
    });
    for (plane, shear_rad) in Plane::ALL.into_iter().zip(machine.squareness_rad) {
        let [first, second] = plane.axes().map(|axis| axis.index());
        tool[first] += 0.5 * shear_rad * drive[second];
        tool[second] += 0.5 * shear_rad * drive[first];
        // The sense of the shift is that of the plane: from its first axis to its second it is positive.
        tool[second] += 0.5 * machine.lateral_play_m[first][second] * axes[first].sign;
        tool[first] -= 0.5 * machine.lateral_play_m[second][first] * axes[second].sign;
    }
    for (moving, bows) in machine.straightness_per_m.iter().enumerate() {
        for (shifted, bow) in bows.iter().enumerate() {
            tool[shifted] += bow * drive[moving] * drive[moving];
        }
    }
    tool
}
