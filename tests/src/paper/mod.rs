//! Reproduction of the source paper (Slamani, Nubiola, Bonev 2012): its circles, its model, its numbers.
//!
//! | file | holds |
//! |---|---|
//! | here | the paper's machine and circles, measured sample by sample, and fitted as a user would |
//! | `study` | many seeds: prediction of 150 and 300 mm, coverage of the intervals |
//! | `printed` | which printed numbers follow from the printed model, and which do not |
pub mod printed;
pub mod study;

use giotto::fit::{FitError, Observation, Options, RadiusFit, fit_circle};
use giotto_shared::model::RadiusModel;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// The paper's coefficients (Table 1).
pub const PAPER: RadiusModel<f64> = RadiusModel {
    beta1_s2: -23.29e-6,
    beta2_s4: -0.23e-6,
};
/// Its radii, m.
pub const RADII_M: [f64; 3] = [0.1, 0.15, 0.3];
/// Offsets of the radii, m: the first is Table 1's β0, the others are ours (the paper prints none).
pub const OFFSETS_M: [f64; 3] = [1.95927e-6, -14e-6, 38e-6];
/// Its lowest and highest feed, m/s.
pub const FEED_M_S: [f64; 2] = [0.02, 0.7];
/// Feeds per radius. 13 feeds both ways give the n = 26 that F(0.05; 1; 24) suggests; the paper prints no list.
pub const FEEDS: usize = 13;

/// How the circles are measured.
#[derive(Clone, Copy, Debug)]
pub struct Measurement {
    /// Samples a turn.
    pub samples: usize,
    /// Standard deviation of one sample, m.
    pub noise_m: f64,
    /// Standard deviation of the radius between runs, m.
    pub spread_m: f64,
    /// Resolution of the instrument, m.
    pub resolution_m: f64,
}

impl Default for Measurement {
    fn default() -> Self {
        Self {
            samples: 1000,
            noise_m: 1e-6,
            spread_m: 0.5e-6,
            resolution_m: 0.1e-6,
        }
    }
}

/// The paper's feeds, evenly from the lowest to the highest, m/s.
pub fn feeds_m_s() -> impl Iterator<Item = f64> + Clone {
    let [low, high] = FEED_M_S;
    (0..FEEDS).map(move |i| low + (high - low) * i as f64 / (FEEDS - 1) as f64)
}

/// Runs every circle of the paper once in each direction and measures it: an off-centre bar, an oval that grows with
/// the radius, noise, resolution; then the least-squares circle.
pub fn campaign(seed: u64, how: Measurement) -> Vec<Observation> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut x, mut y) = (vec![0.0; how.samples], vec![0.0; how.samples]);
    let mut runs = Vec::with_capacity(RADII_M.len() * FEEDS * 2);
    for (radius_m, offset_m) in RADII_M.into_iter().zip(OFFSETS_M) {
        for feed_m_s in feeds_m_s() {
            for _direction in 0..2 {
                let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
                let spread = how.spread_m * normal();
                let mean = offset_m + spread + PAPER.radius_error_m(radius_m, feed_m_s);
                let centre = [30e-6 * normal(), 30e-6 * normal()];
                let oval = 150e-6 * radius_m;
                let actual = radius_m + mean;
                for (i, (x, y)) in x.iter_mut().zip(&mut y).enumerate() {
                    let (sin, cos) = (TAU * i as f64 / how.samples as f64).sin_cos();
                    // Length of the bar to a circle whose centre is off, exactly.
                    let along = centre[0] * cos + centre[1] * sin;
                    let across = centre[1] * cos - centre[0] * sin;
                    let form = oval * (2.0 * sin * cos) + how.noise_m * normal();
                    let length = along + (actual * actual - across * across).sqrt() + form;
                    let shown = radius_m
                        + ((length - radius_m) / how.resolution_m).round() * how.resolution_m;
                    (*x, *y) = (shown * cos, shown * sin);
                }
                // Cannot fail: the points are a circle up to micrometres.
                if let Ok(fit) = fit_circle(&x, &y) {
                    let radius_error_m = fit.circle.radius - radius_m;
                    runs.push(Observation {
                        radius_m,
                        feed_m_s,
                        radius_error_m,
                        out_of_roundness_m: None,
                    });
                }
            }
        }
    }
    runs
}

/// Fits the campaign at R = 100 mm alone and predicts the rest.
///
/// # Errors
/// As [`RadiusFit::new`].
pub fn fit(runs: &[Observation], options: Options) -> Result<RadiusFit, FitError> {
    RadiusFit::new(
        runs,
        Options {
            train_radius_m: Some(RADII_M[0]),
            ..options
        },
    )
}
