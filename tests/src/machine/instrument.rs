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
    /// Of each harmonic from the fifth to the eighth, m.
    pub high_m: f64,
    /// Exponents of f and R by which all of it grows (1 at 0.5 m/s and at 0.15 m).
    pub grows: [f64; 2],
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
    /// Where the centre of measurement lies off the centre of the circles, in their plane, m.
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
    /// Angle over which the noise of a sample is forgotten, rad; 0: white.
    pub memory_rad: f64,
    /// Standard deviation of the time at which a sample is really taken, s.
    pub jitter_s: f64,
    /// How far the set-up creeps over the campaign, m.
    pub creep_m: [f64; 2],
    /// Standard deviation of the set-up from run to run (each coordinate), m.
    pub moves_m: f64,
    /// The set-up is made anew for each radius, this far apart, m.
    pub per_radius_m: f64,
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
                high_m: 0.0,
                grows: [0.0; 2],
                shape: Shape::Normal,
            },
            offset_m: [0.0; 2],
            height_m: 0.0,
            drift_m: 0.0,
            tick_s: 0.0,
            sees_angle: false,
            knows_start: true,
            memory_rad: 0.0,
            jitter_s: 0.0,
            creep_m: [0.0; 2],
            moves_m: 0.0,
            per_radius_m: 0.0,
        }
    }

    /// Runs `plan` on `machine` and records it. `seed` fixes every draw.
    pub fn measure(&self, machine: &Machine, plan: &Plan, seed: u64) -> Campaign {
        self.watch(plan, seed, |test, phase| {
            simulate(machine, test, plan.length_s, phase)
        })
    }

    /// Records whatever runs the tests of `plan`; it is given each test and a phase for what does not know when a lap
    /// begins.
    pub fn watch(&self, plan: &Plan, seed: u64, run: impl Fn(&Test, f64) -> Lap) -> Campaign {
        let runs = plan
            .tests
            .iter()
            .enumerate()
            .map(|(index, test)| {
                // A stream a run: leaving runs out does not change the others.
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                rng.set_stream(index as u64 + 1);
                let lap = run(test, rng.random_range(0.0..2.0 * PI));
                let share = test.started_s / plan.length_s.max(1.0);
                let offset_m = self.offset_of(test, share, seed, &mut rng);
                self.record(&lap, test, index, offset_m, &mut rng)
            })
            .collect();
        Campaign {
            name: "hidden".into(),
            machine: "machine under test".into(),
            repeatability_m: None,
            table: None,
            kinematics: None,
            runs,
        }
    }

    /// Where the centre of measurement lies in one run. Draws only what can differ from run to run.
    fn offset_of(&self, test: &Test, share: f64, seed: u64, rng: &mut ChaCha8Rng) -> [f64; 2] {
        let mut own = [0.0; 2];
        if self.moves_m > 0.0 {
            own = own.map(|_| self.moves_m * Shape::Normal.draw(rng));
        }
        let mut of_radius = ChaCha8Rng::seed_from_u64(seed ^ test.radius_m.to_bits());
        let anew = [0, 1].map(|_| self.per_radius_m * Shape::Normal.draw(&mut of_radius));
        [0, 1].map(|k| self.offset_m[k] + own[k] + anew[k] + share * self.creep_m[k])
    }

    fn record(
        &self,
        lap: &Lap,
        test: &Test,
        index: usize,
        offset_m: [f64; 2],
        rng: &mut ChaCha8Rng,
    ) -> Run {
        let n = lap.position_m.len();
        let s = self.spread.grown(test);
        // A tilted plane is known from points alone, and so is a start from rest.
        let sees_angle = self.sees_angle || test.plane.is_tilted() || test.from_rest;
        let size = s.radius_m * s.shape.draw(rng);
        let wobble: Vec<[f64; 2]> = [s.oval_m, s.lobes_m, s.lobes_m]
            .iter()
            .map(|scale| [0, 1].map(|_| scale * s.shape.draw(rng)))
            .collect();
        let mut wobble = wobble;
        if s.high_m > 0.0 {
            wobble.extend((5..=8).map(|_| [0, 1].map(|_| s.high_m * s.shape.draw(rng))));
        }
        let drift = self.drift_m * Shape::Normal.draw(rng);
        let keep = if self.memory_rad > 0.0 {
            (-2.0 * PI / n as f64 / self.memory_rad).exp()
        } else {
            0.0
        };
        let mut noise: f64 = if keep > 0.0 {
            StandardNormal.sample(rng)
        } else {
            0.0
        };
        let (mut angle_rad, mut deviation_m, mut time_s) = (
            Vec::with_capacity(n),
            Vec::with_capacity(n),
            Vec::with_capacity(n),
        );
        for k in 0..n {
            let p = self.place_at(lap, k, rng);
            let share = k as f64 / n as f64;
            let even = match &lap.angle_rad {
                Some(angles) => angles[k],
                None => test.start_angle_rad + test.sign() * 2.0 * PI * share,
            };
            let [x, y, across] = test.plane.coordinates(p);
            let seen = [x - offset_m[0], y - offset_m[1]];
            let mut r = seen[0].hypot(seen[1]).hypot(across - self.height_m) - test.radius_m
                + size
                + drift * (share - 0.5);
            for (order, [c, q]) in (2..).zip(&wobble) {
                let (sin, cos) = (f64::from(order) * even).sin_cos();
                r += c * cos + q * sin;
            }
            let fresh: f64 = StandardNormal.sample(rng);
            noise = keep * noise + (1.0 - keep * keep).sqrt() * fresh;
            r += self.noise_m * noise;
            if self.resolution_m > 0.0 {
                r = (r / self.resolution_m).round() * self.resolution_m;
            }
            deviation_m.push(r);
            // Samples of a turn are spread over it; those from rest to rest come as often.
            let t = match lap.angle_rad {
                Some(_) => lap.turn_s * k as f64 / test.samples as f64,
                None => lap.turn_s * share,
            };
            time_s.push(if self.tick_s > 0.0 {
                (t / self.tick_s).round() * self.tick_s
            } else {
                t
            });
            // A measured angle is that of the measured point, unwrapped along the even one.
            let own = seen[1].atan2(seen[0]);
            let own = own + 2.0 * PI * ((even - own) / (2.0 * PI)).round();
            angle_rad.push(if sees_angle { own } else { even });
        }
        Run {
            file: format!("run{index:03}.csv"),
            radius_m: test.radius_m,
            feed_m_s: test.feed_m_s,
            direction: test.direction,
            start_angle_rad: test.start_angle_rad,
            started_s: self.knows_start.then_some(test.started_s),
            temperature_c: None,
            centre_m: (test.centre_m != [0.0; 3]).then_some(test.centre_m),
            frame: test.plane.frame(),
            setup: None,
            samples: Samples {
                angle_rad,
                deviation_m,
                time_s: Some(time_s),
                angle_inferred: !sees_angle,
            },
        }
    }

    /// The place at which sample `k` was really taken.
    fn place_at(&self, lap: &Lap, k: usize, rng: &mut ChaCha8Rng) -> [f64; 3] {
        let here = lap.position_m[k];
        if self.jitter_s == 0.0 {
            return here;
        }
        let n = lap.position_m.len();
        let late = self.jitter_s * Shape::Normal.draw(rng) * n as f64 / lap.turn_s;
        // Along the circle: a chord over several samples would be shorter than the way.
        let whole = late.floor();
        let share = late - whole;
        let at = |by: f64| lap.position_m[(k as f64 + by).rem_euclid(n as f64) as usize];
        let (a, b) = (at(whole), at(whole + 1.0));
        let size = |p: [f64; 3]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let p = [0, 1, 2].map(|i| a[i] + share * (b[i] - a[i]));
        let longer = (size(a) + share * (size(b) - size(a))) / size(p);
        p.map(|x| x * longer)
    }
}

impl Spread {
    /// As it is in one test.
    fn grown(mut self, test: &Test) -> Self {
        let [f, r] = self.grows;
        if self.grows != [0.0; 2] {
            let by = (test.feed_m_s / 0.5).powf(f) * (test.radius_m / 0.15).powf(r);
            for x in [
                &mut self.radius_m,
                &mut self.oval_m,
                &mut self.lobes_m,
                &mut self.high_m,
            ] {
                *x *= by;
            }
        }
        self
    }
}
