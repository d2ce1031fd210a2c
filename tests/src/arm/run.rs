//! One circular test of an arm, step by step.
use super::Arm;
use super::kinematics::short_way;
use crate::machine::Test;
use crate::machine::command::Command;
use crate::machine::run::{Chain, Lap, slowest_s};
use std::f64::consts::PI;

/// Largest step where friction and play have to be followed, s.
const STEP_S: f64 = 1e-3;
/// What joining angles by lines may take off the radius, m.
const CHORD_M: f64 = 3e-8;
/// Acceleration of the start, m/s².
const START_M_S2: f64 = 3.0;

/// Drives `arm` through `test`; `None` where a point is out of its reach.
pub fn simulate(arm: &Arm, test: &Test) -> Option<Lap> {
    let rate = test.sign() * test.feed_m_s / test.radius_m;
    let turn_s = 2.0 * PI / rate.abs();
    let n = test.samples;
    let spacing_s = turn_s / n as f64;
    let largest = ((12.0 * CHORD_M / test.radius_m).sqrt() / rate.abs()).min(STEP_S);
    let per_sample = (spacing_s / largest).ceil().max(1.0) as usize;
    let step_s = spacing_s / per_sample as f64;
    let slow = arm.joints.iter().map(|j| slowest_s(&j.chain));
    let settle_s = (25.0 * slow.fold(0.0, f64::max)).max(0.3);
    let command = Command::new(
        test.radius_m,
        rate,
        test.start_angle_rad,
        (test.feed_m_s / START_M_S2).max(0.05),
        (settle_s / step_s).ceil() * step_s,
    );
    let wanted = |t: f64| {
        let p = test.plane.lift(command.position_m(t));
        arm.believed
            .inverse([0, 1, 2].map(|k| test.centre_m[k] + p[k]))
    };
    let mut last = wanted(command.begin_s())?;
    let mut chains: [Chain; 6] =
        std::array::from_fn(|k| Chain::new(&arm.joints[k].chain, step_s, last[k]));
    let dead: [f64; 6] = std::array::from_fn(|k| arm.joints[k].chain.dead_time_s);
    let together = dead.iter().all(|d| *d == dead[0]);
    let mut position_m = Vec::with_capacity(n);
    let first = (command.begin_s() / step_s).floor() as i64;
    for k in first..=((n - 1) * per_sample) as i64 {
        let t = k as f64 * step_s;
        let common = wanted(t - dead[0])?;
        let mut q = [0.0; 6];
        for (joint, q) in q.iter_mut().enumerate() {
            let angle = if together || dead[joint] == dead[0] {
                common[joint]
            } else {
                wanted(t - dead[joint])?[joint]
            };
            // The same angle on the branch of the step before.
            let angle = last[joint] + short_way(last[joint], angle);
            last[joint] = angle;
            *q = chains[joint].step(angle, step_s);
        }
        if k < 0 || !(k as usize).is_multiple_of(per_sample) {
            continue;
        }
        for (q, joint) in q.iter_mut().zip(&arm.joints) {
            let periodic = joint.gear.map_or(0.0, |g| {
                g.amplitude_rad * (g.waves * *q + g.phase_rad).sin()
            });
            *q += joint.zero_rad + periodic;
        }
        let p = arm.real.forward(&q);
        position_m.push([0, 1, 2].map(|i| p[i] - test.centre_m[i]));
    }
    Some(Lap {
        position_m,
        turn_s,
        angle_rad: None,
    })
}

/// Drives `arm` by set-points, m, evenly spaced in time: where the tool is at each of them. `None` where one is out of its reach.
/// Between two set-points the joints' commands run straight.
pub fn follow(arm: &Arm, set_points: &[[f64; 3]], tick_s: f64) -> Option<Vec<[f64; 3]>> {
    let mut path: Vec<[f64; 6]> = Vec::with_capacity(set_points.len());
    for place in set_points {
        let mut q = arm.believed.inverse(*place)?;
        if let Some(last) = path.last() {
            for (q, last) in q.iter_mut().zip(last) {
                *q = last + short_way(*last, *q);
            }
        }
        path.push(q);
    }
    let last = path.len().checked_sub(1)?;
    let at = |joint: usize, tick: f64| {
        let tick = tick.max(0.0);
        let k = (tick as usize).min(last);
        let next = (k + 1).min(last);
        path[k][joint] + (tick - k as f64) * (path[next][joint] - path[k][joint])
    };
    let mut chains: [Chain; 6] =
        std::array::from_fn(|k| Chain::new(&arm.joints[k].chain, tick_s, path[0][k]));
    let places = (0..path.len()).map(|tick| {
        let mut q = [0.0; 6];
        for (joint, q) in q.iter_mut().enumerate() {
            let of = &arm.joints[joint];
            let command = at(joint, tick as f64 - of.chain.dead_time_s / tick_s);
            *q = chains[joint].step(command, tick_s);
            *q += of.zero_rad
                + of.gear.map_or(0.0, |g| {
                    g.amplitude_rad * (g.waves * *q + g.phase_rad).sin()
                });
        }
        arm.real.forward(&q)
    });
    Some(places.collect())
}
