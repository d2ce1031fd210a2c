//! The ballbar (or laser tracker) and the day it had: set-up, spread between runs, drift, noise.
use super::run::{Lap, simulate};
use super::{Machine, Plan, Test};
use giotto::campaign::{Campaign, Run, Samples};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use std::f64::consts::PI;

/// How the spread between runs is distributed; all have the same standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Normal.
    Normal,
    /// Student's t with five degrees of freedom: now and then a run is far off.
    Heavy,
    /// Uniform.
    Flat,
}

impl Shape {
    /// A draw with unit standard deviation.
    pub fn draw(self, rng: &mut impl Rng) -> f64 {
        match self {
            Self::Normal => StandardNormal.sample(rng),
            Self::Heavy => match StudentT::new(5.0) {
                Ok(t) => t.sample(rng) * (3.0_f64 / 5.0).sqrt(),
                Err(_) => 0.0,
            },
            Self::Flat => (rng.random::<f64>() - 0.5) * 12.0_f64.sqrt(),
        }
    }
}

/// Spread between runs that are programmed alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Of the radius, m.
    pub radius_m: f64,
    /// Of the second harmonic (each of cosine and sine), m.
    pub oval_m: f64,
    /// Of the third and fourth harmonics (each of cosine and sine), m.
    pub lobes_m: f64,
    /// Distribution.
    pub shape: Shape,
}

/// How the machine is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instrument {
    /// Standard deviation of one sample, m.
    pub noise_m: f64,
    /// Resolution, m; 0: none.
    pub resolution_m: f64,
    /// Spread between runs.
    pub spread: Spread,
    /// Where the centre of measurement lies off the centre of the circles, m.
    pub offset_m: [f64; 2],
    /// How far out of the plane of the circle it lies, m.
    pub height_m: f64,
    /// Random change of the reading from first to last sample of a run, standard deviation, m.
    pub drift_m: f64,
    /// Period to which time stamps are rounded, s; 0: none.
    pub tick_s: f64,
    /// The instrument gives angles of its own (a tracker) instead of time alone.
    pub sees_angle: bool,
    /// Start times are recorded.
    pub knows_start: bool,
}

impl Instrument {
    /// An instrument that adds nothing.
    pub fn perfect() -> Self {
        Self {
            noise_m: 0.0,
            resolution_m: 0.0,
            spread: Spread {
                radius_m: 0.0,
                oval_m: 0.0,
                lobes_m: 0.0,
                shape: Shape::Normal,
            },
            offset_m: [0.0; 2],
            height_m: 0.0,
            drift_m: 0.0,
            tick_s: 0.0,
            sees_angle: false,
            knows_start: true,
        }
    }

    /// Runs `plan` on `machine` and records it. `seed` fixes every draw.
    pub fn measure(&self, machine: &Machine, plan: &Plan, seed: u64) -> Campaign {
        let runs = plan
            .tests
            .iter()
            .enumerate()
            .map(|(index, test)| {
                // A stream a run: leaving runs out does not change the others.
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                rng.set_stream(index as u64 + 1);
                let lap = simulate(
                    machine,
                    test,
                    plan.length_s,
                    rng.random_range(0.0..2.0 * PI),
                );
                self.record(&lap, test, index, &mut rng)
            })
            .collect();
        Campaign {
            name: "hidden".into(),
            machine: "machine under test".into(),
            repeatability_m: None,
            table: None,
            runs,
        }
    }

    fn record(&self, lap: &Lap, test: &Test, index: usize, rng: &mut ChaCha8Rng) -> Run {
        let n = lap.position_m.len();
        let s = self.spread;
        let size = s.radius_m * s.shape.draw(rng);
        let wobble: Vec<[f64; 2]> = [s.oval_m, s.lobes_m, s.lobes_m]
            .iter()
            .map(|scale| [0, 1].map(|_| scale * s.shape.draw(rng)))
            .collect();
        let drift = self.drift_m * Shape::Normal.draw(rng);
        let (mut angle_rad, mut deviation_m, mut time_s) = (
            Vec::with_capacity(n),
            Vec::with_capacity(n),
            Vec::with_capacity(n),
        );
        for (k, p) in lap.position_m.iter().enumerate() {
            let share = k as f64 / n as f64;
            let even = test.start_angle_rad + test.sign() * 2.0 * PI * share;
            let seen = [p[0] - self.offset_m[0], p[1] - self.offset_m[1]];
            let mut r = seen[0].hypot(seen[1]).hypot(self.height_m) - test.radius_m
                + size
                + drift * (share - 0.5);
            for (order, [c, q]) in (2..).zip(&wobble) {
                let (sin, cos) = (f64::from(order) * even).sin_cos();
                r += c * cos + q * sin;
            }
            let noise: f64 = StandardNormal.sample(rng);
            r += self.noise_m * noise;
            if self.resolution_m > 0.0 {
                r = (r / self.resolution_m).round() * self.resolution_m;
            }
            deviation_m.push(r);
            let t = lap.turn_s * share;
            time_s.push(if self.tick_s > 0.0 {
                (t / self.tick_s).round() * self.tick_s
            } else {
                t
            });
            // A measured angle is that of the measured point, unwrapped along the even one.
            let own = seen[1].atan2(seen[0]);
            let own = own + 2.0 * PI * ((even - own) / (2.0 * PI)).round();
            angle_rad.push(if self.sees_angle { own } else { even });
        }
        Run {
            file: format!("run{index:03}.csv"),
            radius_m: test.radius_m,
            feed_m_s: test.feed_m_s,
            direction: test.direction,
            start_angle_rad: test.start_angle_rad,
            started_s: self.knows_start.then_some(test.started_s),
            temperature_c: None,
            centre_m: None,
            frame: giotto::campaign::Frame::default(),
            setup: None,
            samples: Samples {
                angle_rad,
                deviation_m,
                time_s: Some(time_s),
                angle_inferred: !self.sees_angle,
            },
        }
    }
}
