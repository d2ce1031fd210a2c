//! The simulated machine under the set-points of an outside controller.
use super::axis::{self, Grid};
use super::circle::{CircleTest, Trace};
use super::command::Knots;
use super::geometry::{self, Place};
use super::machine::Machine;
use giotto_shared::Frame;
use std::f64::consts::TAU;

/// Set-points as a controller issues them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetPoints<'a> {
    /// Distance in time, s.
    pub dt_s: f64,
    /// Positions in machine coordinates, m.
    pub position_m: &'a [[f64; 3]],
    /// Centre about which geometry, growth and the radial errors act, m.
    pub centre_m: [f64; 3],
    /// Directions in which the radial errors act.
    pub frame: Frame,
    /// First set-point in campaign time, s.
    pub started_s: f64,
    /// How the drives join the set-points.
    pub hold: Hold,
}

/// How the drives join set-points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Hold {
    /// By cubics, as in the interpolated position mode of a drive.
    #[default]
    Cubic,
    /// By chords: κ2 = dt²/6.
    Chord,
}

/// Where the tool went.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Distance in time, s.
    pub dt_s: f64,
    /// Tool positions in machine coordinates, m, at the times of the set-points.
    pub position_m: Vec<[f64; 3]>,
}

/// Moves the machine along set-points, from rest at the first one.
///
/// An `interpolation_s` of the machine longer than `dt_s` makes the drives take a set-point every so often and
/// join them by chords. The feed clamp belongs to the machine's own path planner and has no part in this.
/// Friction acts from the first reversal on. No set-points: an empty path; a machine that fails
/// [`Machine::check`]: NaN.
pub fn drive(machine: &Machine, set_points: &SetPoints<'_>) -> Path {
    let (dt_s, n) = (set_points.dt_s, set_points.position_m.len());
    if n == 0 {
        return Path {
            dt_s,
            position_m: Vec::new(),
        };
    }
    if !(dt_s > 0.0 && dt_s.is_finite() && machine.check().is_ok()) {
        return Path {
            dt_s,
            position_m: vec![[f64::NAN; 3]; n],
        };
    }
    let axes: [Vec<_>; 3] = std::array::from_fn(|axis| {
        let centre = set_points.centre_m[axis];
        let positions: Vec<f64> = set_points
            .position_m
            .iter()
            .map(|p| p[axis] - centre)
            .collect();
        let (knots, step_s) = knots(machine, set_points.hold, dt_s, positions);
        let before = (machine.dead_time_s[axis] / step_s).ceil();
        let steps = before as usize + (dt_s * n as f64 / step_s).ceil() as usize;
        let grid = Grid {
            start_s: -before * step_s,
            step_s,
            steps,
        };
        axis::motion(machine, axis, &knots, grid, (0..n).map(|i| dt_s * i as f64))
    });
    let centre_m = set_points.centre_m;
    let place = Place {
        centre_m,
        frame: set_points.frame,
    };
    let tool = |i: usize| {
        let t = set_points.started_s + dt_s * i as f64;
        let tool = geometry::tool(machine, place, t, [0, 1, 2].map(|axis| axes[axis][i]));
        [0, 1, 2].map(|axis| tool[axis] + centre_m[axis])
    };
    Path {
        dt_s,
        position_m: (0..n).map(tool).collect(),
    }
}

/// Command of one axis and the step that meets its corners.
fn knots(machine: &Machine, hold: Hold, dt_s: f64, positions: Vec<f64>) -> (Knots, f64) {
    let own = machine
        .interpolation_s
        .filter(|own| *own > dt_s * (1.0 + 1e-9));
    match (own, hold) {
        (Some(own), _) => {
            let end_s = dt_s * positions.len() as f64;
            let fine = Knots::smooth(0.0, dt_s, positions);
            let count = (end_s / own).ceil() as usize + 1;
            let vertices = (0..=count)
                .map(|k| fine.at(k as f64 * own, k as f64 * own)[0])
                .collect();
            (Knots::chords(0.0, own, vertices), own / (own / dt_s).ceil())
        }
        (None, Hold::Cubic) => (Knots::smooth(0.0, dt_s, positions), dt_s),
        (None, Hold::Chord) => (Knots::chords(0.0, dt_s, positions), dt_s),
    }
}

impl Path {
    /// One turn as a ballbar records it: from `start_s` (the command passes the start angle of `test`) for
    /// `turn_s`, about the centre of `test`. Positions between set-points come from a cubic; beyond the
    /// path the tool stands.
    pub fn lap(&self, test: &CircleTest, start_s: f64, turn_s: f64) -> Trace {
        let n = test
            .samples
            .unwrap_or_else(|| super::circle::ballbar_samples(turn_s))
            .max(1);
        if self.position_m.is_empty() {
            return Trace::new(test, turn_s, vec![[f64::NAN; 2]; n]);
        }
        let axes = [test.frame.first(), test.frame.second()].map(|direction| {
            let along = |p: &[f64; 3]| -> f64 {
                (0..3)
                    .map(|axis| direction[axis] * (p[axis] - test.centre_m[axis]))
                    .sum()
            };
            let positions = self.position_m.iter().map(along).collect();
            Knots::smooth(0.0, self.dt_s, positions)
        });
        let at = |i: usize| {
            let t = start_s + turn_s * i as f64 / n as f64;
            std::array::from_fn(|axis| axes[axis].at(t, t)[0])
        };
        Trace::new(test, turn_s, (0..n).map(at).collect())
    }

    /// Duration of one turn at a constant feed, s.
    pub fn turn_s(test: &CircleTest) -> f64 {
        TAU * test.radius_m / test.feed_m_s
    }
}

#[cfg(test)]
mod tests {
    use super::super::circle::circle;
    use super::super::machine::{AccDec, PositionLoop, SecondOrder};
    use super::*;
    use giotto_shared::Direction;

    /// Set-points of a circle from standstill at full speed, three turns.
    fn set_points(test: &CircleTest, dt: f64) -> Vec<[f64; 3]> {
        let omega = f64::from(test.direction.sign()) * test.feed_m_s / test.radius_m;
        let n = (3.0 * Path::turn_s(test) / dt) as usize;
        let point = |i: usize| {
            let (sin, cos) = (test.start_angle_rad + omega * dt * i as f64).sin_cos();
            let (first, second) = (test.frame.first(), test.frame.second());
            [0, 1, 2].map(|k| test.centre_m[k] + test.radius_m * (cos * first[k] + sin * second[k]))
        };
        (0..n).map(point).collect()
    }

    #[test]
    fn set_points_of_a_circle_give_the_circle() {
        let mut machine = Machine {
            acc_dec: AccDec::MovingAverage(0.03),
            servo: [PositionLoop {
                kv_per_s: 30.0,
                feed_forward: 0.2,
            }; 3],
            mechanics: [Some(SecondOrder {
                omega_n_rad_s: 70.0,
                zeta: 0.6,
            }); 3],
            dead_time_s: [0.0033, 0.0041, 0.0021],
            squareness_rad: [50e-6, -30e-6, 80e-6],
            scale: [1e-5, -2e-5, 4e-5],
            backlash_m: [10e-6, -5e-6, 7e-6],
            radius_offset_m: 3e-6,
            ..Machine::default()
        };
        machine.straightness_per_m[0][1] = 1e-3;
        machine.straightness_per_m[1][2] = -5e-4;
        machine.lateral_play_m[2][0] = 4e-6;
        let frames = [
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.4, -0.5, 0.7],
        ];
        let frames = frames.map(|normal| Frame::across(normal).unwrap());
        for (frame, direction) in frames
            .into_iter()
            .flat_map(|f| [(f, Direction::Ccw), (f, Direction::Cw)])
        {
            let mut test = CircleTest::new(0.1, 0.7, direction);
            test.centre_m = [0.4, -0.3, 0.2];
            test.frame = frame;
            test.start_angle_rad = 0.6;
            let positions = set_points(&test, 1e-3);
            let set_points = SetPoints {
                dt_s: 1e-3,
                position_m: &positions,
                centre_m: test.centre_m,
                frame: test.frame,
                started_s: 0.0,
                hold: Hold::Cubic,
            };
            let turn = Path::turn_s(&test);
            let lap = drive(&machine, &set_points).lap(&test, 1.5 * turn, turn);
            let mut shifted = test;
            shifted.start_angle_rad += f64::from(direction.sign()) * std::f64::consts::PI;
            let direct = circle(&machine, &shifted);
            let off: Vec<f64> = lap
                .deviation_m
                .iter()
                .zip(&direct.deviation_m)
                .map(|(a, b)| (a - b).abs())
                .collect();
            // Only where an axis crosses its gap: there the load starts with a corner that 1 ms rounds off.
            assert!(off.iter().all(|o| *o < 1.5e-6), "{direction:?}");
            assert!(
                off.iter().filter(|o| **o > 1e-8).count() < 40,
                "{direction:?}"
            );
        }
    }

    /// Chord between 1 ms set-points: f²dt²/(12R) = 0.41 µm, which cubics do not lose.
    #[test]
    fn hold_of_the_drives() {
        let test = CircleTest::new(0.1, 0.7, Direction::Ccw);
        let positions = set_points(&test, 1e-3);
        let turn = Path::turn_s(&test);
        let mean = |hold, interpolation_s| {
            let machine = Machine {
                servo: [PositionLoop {
                    kv_per_s: 100.0,
                    feed_forward: 0.0,
                }; 3],
                interpolation_s,
                ..Machine::default()
            };
            let centre_m = [0.0; 3];
            let set_points = SetPoints {
                dt_s: 1e-3,
                position_m: &positions,
                centre_m,
                frame: test.frame,
                started_s: 0.0,
                hold,
            };
            drive(&machine, &set_points)
                .lap(&test, turn, turn)
                .mean_deviation_m()
        };
        let smooth = mean(Hold::Cubic, None);
        let ideal = 0.1 * ((1.0 + 0.07_f64.powi(2)).powf(-0.5) - 1.0);
        assert!((smooth - ideal).abs() < 1e-9, "{smooth:e} {ideal:e}");
        let chord = 0.49 / 1.2;
        assert!((mean(Hold::Chord, None) - smooth + chord * 1e-6).abs() < 0.01e-6);
        assert!((mean(Hold::Cubic, Some(0.008)) - smooth + chord * 64e-6).abs() < 0.3e-6);
    }

    #[test]
    fn rests_where_it_is_told() {
        let machine = Machine {
            servo: [PositionLoop {
                kv_per_s: 30.0,
                feed_forward: 0.0,
            }; 3],
            dead_time_s: [0.0105; 3],
            ..Machine::default()
        };
        let set_points = |position_m| SetPoints {
            dt_s: 1e-3,
            position_m,
            centre_m: [1.0, 2.0, 0.0],
            frame: Frame::default(),
            started_s: 0.0,
            hold: Hold::Cubic,
        };
        let path = drive(&machine, &set_points(&[[0.25, -0.5, 0.1]; 50]));
        assert!(
            path.position_m
                .iter()
                .all(|p| (p[0] - 0.25).abs() < 1e-12 && (p[1] + 0.5).abs() < 1e-12)
        );
        assert!(drive(&machine, &set_points(&[])).position_m.is_empty());
        let one = drive(&machine, &set_points(&[[0.25, -0.5, 0.1]]));
        assert!((one.position_m[0][0] - 0.25).abs() < 1e-12);
    }
}
