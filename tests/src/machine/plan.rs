//! Which circles are run, in which order.
use super::Plane;
use giotto::campaign::Direction;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// One circle to be run.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// Direction of travel.
    pub direction: Direction,
    /// Polar angle of the first sample, rad.
    pub start_angle_rad: f64,
    /// Start since the campaign began, s.
    pub started_s: f64,
    /// Samples of the turn.
    pub samples: usize,
    /// How the circle lies in the machine.
    pub plane: Plane,
    /// Its centre in the machine, m.
    pub centre_m: [f64; 3],
    /// The turn begins and ends at rest, and all of it is recorded.
    pub from_rest: bool,
}

impl Test {
    /// +1 CCW, −1 CW.
    pub fn sign(&self) -> f64 {
        f64::from(self.direction.sign())
    }
}

/// A campaign of tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Tests in the order they are run.
    pub tests: Vec<Test>,
    /// Seconds the campaign takes.
    pub length_s: f64,
}

/// What is measured on which grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Radii, m.
    pub radii_m: Vec<f64>,
    /// Feeds, m/s.
    pub feeds_m_s: Vec<f64>,
    /// Most samples a turn.
    pub samples: usize,
    /// Fastest sampling of the instrument, Hz.
    pub rate_hz: f64,
    /// Polar angle where every lap begins, rad.
    pub start_angle_rad: f64,
    /// Runs in the order of the grid instead of a random one.
    pub sorted: bool,
    /// Planes, each with the whole grid.
    pub planes: Vec<Plane>,
    /// Runs are recorded from rest to rest.
    pub from_rest: bool,
}

impl Grid {
    /// The grid of the paper: R 100, 150, 300 mm, thirteen feeds from 20 to 700 mm/s, both directions.
    pub fn paper() -> Self {
        Self {
            radii_m: vec![0.1, 0.15, 0.3],
            feeds_m_s: [
                20., 50., 100., 150., 200., 250., 300., 350., 400., 450., 500., 600., 700.,
            ]
            .map(|f: f64| f / 1e3)
            .to_vec(),
            samples: 1000,
            rate_hz: 1000.0,
            start_angle_rad: 0.0,
            sorted: false,
            planes: vec![Plane::XY],
            from_rest: false,
        }
    }

    /// Another laboratory: two to five radii, seven to thirteen feeds, fewer samples, another start.
    pub fn drawn(rng: &mut ChaCha8Rng) -> Self {
        let radii: &[&[f64]] = &[
            &[0.05, 0.1, 0.2],
            &[0.08, 0.15, 0.25, 0.4],
            &[0.1, 0.15, 0.3],
            &[0.1, 0.3],
            &[0.05, 0.1, 0.15, 0.2, 0.3],
        ];
        let count = rng.random_range(7..=13);
        let (low, high) = (rng.random_range(0.01..0.05), rng.random_range(0.4..0.8));
        let bend = rng.random_range(0.8..1.8);
        let feeds = (0..count)
            .map(|k| low + (high - low) * (f64::from(k) / f64::from(count - 1)).powf(bend));
        Self {
            radii_m: radii[rng.random_range(0..radii.len())].to_vec(),
            // Programmed feeds are round numbers of mm/s.
            feeds_m_s: feeds.map(|f| (f * 200.0).round() / 200.0).collect(),
            samples: [360, 500, 720, 1000][rng.random_range(0..4)],
            rate_hz: [250.0, 500.0, 1000.0][rng.random_range(0..3)],
            start_angle_rad: [0.0, PI / 4.0, PI / 2.0, PI, -PI / 2.0][rng.random_range(0..5)],
            sorted: false,
            planes: vec![Plane::XY],
            from_rest: false,
        }
    }

    /// The tests of the grid in a random order (unless [`Grid::sorted`]), twenty-odd seconds apart.
    pub fn plan(&self, seed: u64) -> Plan {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut tests = Vec::new();
        for &plane in &self.planes {
            for &radius_m in &self.radii_m {
                for &feed_m_s in &self.feeds_m_s {
                    for direction in [Direction::Ccw, Direction::Cw] {
                        let turn_s = 2.0 * PI * radius_m / feed_m_s;
                        tests.push(Test {
                            radius_m,
                            feed_m_s,
                            direction,
                            start_angle_rad: self.start_angle_rad,
                            started_s: 0.0,
                            samples: self.samples.min((turn_s * self.rate_hz) as usize).max(32),
                            plane,
                            centre_m: [0.0; 3],
                            from_rest: self.from_rest,
                        });
                    }
                }
            }
        }
        if !self.sorted {
            tests.shuffle(&mut rng);
        }
        let mut clock = 0.0;
        for test in &mut tests {
            // Files give tenths of a second.
            test.started_s = (clock * 10.0_f64).round() / 10.0;
            clock += 1.5 * 2.0 * PI * test.radius_m / test.feed_m_s + 20.0;
        }
        Plan {
            tests,
            length_s: clock,
        }
    }
}
