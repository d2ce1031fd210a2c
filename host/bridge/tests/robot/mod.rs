//! A robot of our own on the other side of each door: it shares no code with the bridge.
#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may fail where it stands"
)]
pub mod bytes;
pub mod net;

use giotto_shared::model::Cumulants;
use giotto_shared::table::{self, Limits, MAX_IMAGE_BYTES, Table, Travel, Zone};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// A place, mm.
pub type Place = [f64; 3];

/// Servo of each axis: a moving average, then a lag, s.
pub const AVERAGE_S: f64 = 0.040;
pub const LAG_S: f64 = 0.020;
/// The robot's inner cycle, s.
pub const INNER_S: f64 = 1e-3;

/// A table for it, by the cumulants of these two: τ² + T²/12, 6τ⁴ − T⁴/120.
pub fn table_image() -> Vec<u8> {
    table_with(SLEW_AND_OFFSET)
}

/// The same with other bounds, m/s and m.
pub fn table_with([slew_m_s, offset_m]: [f64; 2]) -> Vec<u8> {
    let kappa2 = LAG_S * LAG_S + AVERAGE_S * AVERAGE_S / 12.0;
    let kappa4 = 6.0 * LAG_S.powi(4) - AVERAGE_S.powi(4) / 120.0;
    let zone = Zone {
        place_m: None,
        radius_m: [0.02, 0.3],
        feed_m_s: [0.02, 0.4],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: kappa2 as f32,
            kappa4_s4: kappa4 as f32,
        },
        terms: Default::default(),
    };
    let table = Table {
        machine: "robot of the tests".try_into().unwrap(),
        zones: [zone].into_iter().collect(),
        limits: Limits {
            offset_m: offset_m as f32,
            slew_m_s: slew_m_s as f32,
        },
        arm: None,
    };
    let mut bytes = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

/// Bounds of that table: m/s and m.
pub const SLEW_AND_OFFSET: [f64; 2] = [0.05, 0.004];

/// The servos of three axes.
pub struct Servos {
    window: VecDeque<Place>,
    sum: Place,
    place: Place,
}

impl Servos {
    pub fn new(at: Place) -> Self {
        let count = (AVERAGE_S / INNER_S).round() as usize;
        Self {
            window: std::iter::repeat_n(at, count).collect(),
            sum: at.map(|c| c * count as f64),
            place: at,
        }
    }

    /// One inner cycle; where the tool then is.
    pub fn step(&mut self, command: Place) -> Place {
        let oldest = self.window.pop_front().unwrap();
        self.window.push_back(command);
        let count = self.window.len() as f64;
        let share = 1.0 - (-INNER_S / LAG_S).exp();
        for axis in 0..3 {
            self.sum[axis] += command[axis] - oldest[axis];
            self.place[axis] += share * (self.sum[axis] / count - self.place[axis]);
        }
        self.place
    }
}

/// One circle of the robot's program.
#[derive(Clone, Copy, Debug)]
pub struct Circle {
    pub radius: f64,
    pub feed: f64,
    pub ccw: bool,
    pub laps: f64,
    pub starts_s: f64,
}

/// Time in which the feed rises and falls, s, and the rest between two circles.
const RISE_S: f64 = 0.8;
const REST_S: f64 = 1.5;

impl Circle {
    fn steady_s(&self) -> f64 {
        TAU * self.radius * self.laps / self.feed - RISE_S
    }

    fn ends_s(&self) -> f64 {
        self.starts_s + self.steady_s() + 2.0 * RISE_S
    }

    pub fn centre(&self) -> Place {
        [-self.radius, 0.0, 0.0]
    }

    /// From the origin and back to it.
    fn at(&self, time_s: f64) -> Place {
        // Way of a rise with a smooth feed: ∫ s³(10 − 15s + 6s²).
        let rise = |s: f64| {
            let s = s.clamp(0.0, 1.0);
            RISE_S * self.feed * s.powi(4) * (2.5 - 3.0 * s + s * s)
        };
        let t = time_s - self.starts_s;
        let after = t - RISE_S - self.steady_s();
        let way = if t < RISE_S {
            rise(t / RISE_S)
        } else if after < 0.0 {
            rise(1.0) + self.feed * (t - RISE_S)
        } else {
            let left = rise(1.0 - after / RISE_S);
            TAU * self.radius * self.laps - left
        };
        let angle = way / self.radius;
        let y = self.radius * angle.sin();
        [
            self.radius * (angle.cos() - 1.0),
            if self.ccw { y } else { -y },
            0.0,
        ]
    }

    /// Feed and filters have settled.
    pub fn is_steady(&self, time_s: f64) -> bool {
        let settled = self.starts_s + RISE_S + 0.7;
        time_s > settled && time_s < self.starts_s + RISE_S + self.steady_s() - 0.1
    }
}

/// Circles one after the other, from rest to rest.
pub struct Program(pub Vec<Circle>);

impl Program {
    /// Circles that fill so many seconds.
    pub fn lasting(seconds: f64, laps: f64) -> Self {
        let kinds = [
            (100.0, 200.0, true),
            (50.0, 150.0, false),
            (150.0, 300.0, true),
            (40.0, 100.0, true),
            (80.0, 250.0, false),
        ];
        let (mut circles, mut starts_s) = (Vec::new(), 3.0);
        for (radius, feed, ccw) in kinds.into_iter().cycle() {
            let circle = Circle {
                radius,
                feed,
                ccw,
                laps,
                starts_s,
            };
            starts_s = circle.ends_s() + REST_S;
            if starts_s > seconds {
                break;
            }
            circles.push(circle);
        }
        Self(circles)
    }

    pub fn at(&self, time_s: f64) -> Place {
        let upcoming = self.0.partition_point(|c| c.starts_s <= time_s);
        let Some(circle) = upcoming.checked_sub(1).map(|k| self.0[k]) else {
            return [0.0; 3];
        };
        if time_s >= circle.ends_s() {
            [0.0; 3]
        } else {
            circle.at(time_s)
        }
    }

    pub fn seconds(&self) -> f64 {
        self.0.last().unwrap().ends_s() + 0.2
    }

    /// As a file of set-points.
    pub fn csv(&self, every_s: f64) -> String {
        let mut text = String::from("time_s,x_mm,y_mm,z_mm\n");
        for row in 0..(self.seconds() / every_s) as usize {
            let t = row as f64 * every_s;
            let [x, y, z] = self.at(t);
            text += &format!("{t:.6},{x:.9},{y:.9},{z:.9}\n");
        }
        text
    }
}

/// Radii seen on the steady part of each circle.
#[derive(Default)]
pub struct Ballbar {
    sums: Vec<(f64, u32)>,
}

impl Ballbar {
    /// The tool was here at this time; the path is so late.
    pub fn see(&mut self, program: &Program, time_s: f64, place: Place) {
        self.sums.resize(program.0.len(), (0.0, 0));
        let upcoming = program.0.partition_point(|c| c.starts_s <= time_s);
        let Some(index) = upcoming.checked_sub(1) else {
            return;
        };
        let circle = program.0[index];
        if circle.is_steady(time_s) {
            let [cx, cy, cz] = circle.centre();
            let radius =
                ((place[0] - cx).powi(2) + (place[1] - cy).powi(2) + (place[2] - cz).powi(2))
                    .sqrt();
            self.sums[index].0 += radius - circle.radius;
            self.sums[index].1 += 1;
        }
    }

    /// Root mean square over the circles of their mean radius error, mm.
    pub fn error(&self) -> f64 {
        let seen: Vec<f64> = self
            .sums
            .iter()
            .filter(|(_, count)| *count > 100)
            .map(|(sum, count)| sum / f64::from(*count))
            .collect();
        assert!(seen.len() >= 5, "{} circles were seen", seen.len());
        (seen.iter().map(|e| e * e).sum::<f64>() / seen.len() as f64).sqrt()
    }
}

/// The same program without a correction.
pub fn bare(program: &Program) -> f64 {
    let (mut servos, mut ballbar) = (Servos::new([0.0; 3]), Ballbar::default());
    for inner in 0..(program.seconds() / INNER_S) as usize {
        let time_s = inner as f64 * INNER_S;
        let place = servos.step(program.at(time_s));
        ballbar.see(program, time_s, place);
    }
    ballbar.error()
}
