//! One run by itself.
use super::harmonics::{self, Harmonic};
use super::points::Polar;
use super::size;
use crate::campaign::{self, Direction, Run};
use giotto_shared::circle::{self, CircleError, Merge};
use std::f64::consts::TAU;

/// Sectors whose means stand for the samples of a long run.
pub(super) const SECTORS: usize = 1 << 17;

/// What one run shows.
#[derive(Clone, Debug, PartialEq)]
pub struct RunAnalysis {
    /// File of the run.
    pub file: String,
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// Direction of travel.
    pub direction: Direction,
    /// Feed by the measured duration of the turn and the programmed radius, m/s.
    pub measured_feed_m_s: Option<f64>,
    /// Centre of the least-squares circle, m: about the programmed centre, or in the coordinates of the file
    /// where it holds positions.
    pub centre_m: [f64; 2],
    /// The same about the centre that the instrument measured from, m.
    pub set_up_m: [f64; 2],
    /// Radius of the least-squares circle minus programmed radius, m. On an arc, or where samples are missing or lie unevenly,
    /// the mean radius of the whole circle with its form, as far as the samples tell.
    pub radius_error_m: f64,
    /// Standard error of `radius_error_m` within this run, m, for samples as correlated as these are, and for the form that was
    /// not seen. It says nothing of the spread between runs.
    pub radius_error_se_m: f64,
    /// Largest minus smallest distance from the least-squares centre, m (G of ISO 230-4).
    pub out_of_roundness_m: f64,
    /// Orders from 2 on about the least-squares circle; empty where the samples do not cover the turn.
    pub harmonics: Vec<Harmonic>,
    /// Standard deviation of the sample noise, m, from second differences: form and eccentricity do not enter.
    pub noise_m: f64,
    /// Largest and smallest deviation from the nominal circle, m.
    pub deviation_range_m: [f64; 2],
    /// Angle that the samples cover, rad; `None` for a whole turn.
    pub arc_rad: Option<f64>,
    /// Number of samples.
    pub samples: usize,
}

impl RunAnalysis {
    /// Distance of the circle's centre from where the instrument was centred, m. It shows in the first wave of the
    /// deviation: where a file holds positions its coordinates are no offset.
    pub fn centre_offset_m(&self) -> f64 {
        self.set_up_m[0].hypot(self.set_up_m[1])
    }
}

/// Extremes and lagged products of residuals.
#[derive(Clone, Copy, Debug)]
struct Residuals {
    distance: [f64; 2],
    deviation: [f64; 2],
    squares: f64,
    products: f64,
    pairs: f64,
}

impl Default for Residuals {
    fn default() -> Self {
        let nothing = [f64::INFINITY, f64::NEG_INFINITY];
        Self {
            distance: nothing,
            deviation: nothing,
            squares: 0.0,
            products: 0.0,
            pairs: 0.0,
        }
    }
}

impl Merge for Residuals {
    fn merge(&mut self, other: &Self) {
        let widen = |a: &mut [f64; 2], b: &[f64; 2]| *a = [a[0].min(b[0]), a[1].max(b[1])];
        widen(&mut self.distance, &other.distance);
        widen(&mut self.deviation, &other.deviation);
        self.squares += other.squares;
        self.products += other.products;
        self.pairs += other.pairs;
    }
}

/// Analyses one run. `turn_s` is its duration where the run itself does not keep time.
///
/// # Errors
/// Samples through which no circle goes; a run that [`campaign::read`] accepted has one.
pub fn of_run(run: &Run, turn_s: Option<f64>) -> Result<RunAnalysis, CircleError> {
    let samples = &run.samples;
    let points = Polar::new(run.radius_m, &samples.angle_rad, &samples.deviation_m);
    // Circle and form of a long run follow from the means of neighbours: over a sector of 2π/2¹⁷ the averaging
    // takes 2e-8 off the highest order.
    let sectors = points.sector_means(SECTORS);
    let smooth = match &sectors {
        Some((angle, deviation)) => Polar::new(run.radius_m, angle, deviation),
        None => points.clone(),
    };
    let fit = circle::fit(&smooth)?;
    let (centre, radius) = (fit.circle.centre, fit.circle.radius);
    let distance = |a: f64, v: f64| {
        let ((sin, cos), r) = (a.sin_cos(), run.radius_m + v);
        (r * cos - centre[0]).hypot(r * sin - centre[1])
    };
    let arc_rad = samples.arc_rad();
    let form = match arc_rad {
        None => harmonics::solve(&smooth, |a, v| distance(a, v) - radius),
        Some(_) => Vec::new(),
    };
    let table = sectors.is_some().then(|| harmonics::Tabulated::of(&form));
    let form_at = |a: f64| {
        table
            .as_ref()
            .map_or_else(|| harmonics::evaluate(&form, a), |t| t.at(a))
    };
    let seen: Residuals = points.fold(|angle, deviation| {
        let mut sums = Residuals::default();
        let mut before = None;
        for (&a, &v) in angle.iter().zip(deviation) {
            let d = distance(a, v);
            sums.distance = [sums.distance[0].min(d), sums.distance[1].max(d)];
            sums.deviation = [sums.deviation[0].min(v), sums.deviation[1].max(v)];
            let e = d - radius - form_at(a);
            sums.squares += e * e;
            if let Some(b) = before {
                sums.products += e * b;
                sums.pairs += 1.0;
            }
            before = Some(e);
        }
        sums
    });
    let turn_s = turn_s.or_else(|| run.turn_s());
    let noise_m = campaign::sample_noise(&samples.deviation_m);
    let se_m = radius_se(&fit, &seen, form.len(), samples.deviation_m.len() as f64);
    // Form that was not seen evenly passes for size.
    let (shift_m, se_m) = if arc_rad.is_some() || size::uneven(&samples.angle_rad) {
        size::correction(&points, |a, v| distance(a, v) - radius, noise_m)
            .map_or((0.0, se_m), |c| (c.value_m, c.se_m))
    } else {
        // Nearly even points: the orders fitted together with the size tell what a large form adds to it.
        (passed_for_size_m(&form), se_m)
    };
    Ok(RunAnalysis {
        file: run.file.clone(),
        radius_m: run.radius_m,
        feed_m_s: run.feed_m_s,
        direction: run.direction,
        measured_feed_m_s: turn_s.map(|t| TAU * run.radius_m / t),
        centre_m: centre,
        set_up_m: centre,
        radius_error_m: radius + shift_m - run.radius_m,
        radius_error_se_m: se_m,
        out_of_roundness_m: seen.distance[1] - seen.distance[0],
        harmonics: form.into_iter().filter(|h| h.order >= 2).collect(),
        noise_m,
        deviation_range_m: seen.deviation,
        arc_rad,
        samples: samples.deviation_m.len(),
    })
}

/// Mean distance from the least-squares circle of the orders that were fitted together, m: nothing for points that lie evenly.
fn passed_for_size_m(form: &[Harmonic]) -> f64 {
    let mean = form.first().filter(|harmonic| harmonic.order == 0);
    mean.map_or(0.0, |harmonic| harmonic.cos_m)
}

/// Standard error of the radius: the covariance of the fit, with the scatter that is left when the form is
/// taken out, and with fewer independent samples where neighbours are alike (AR(1): n(1−ρ)/(1+ρ)).
/// `n` is the number of samples, of which the fit may have seen the means of sectors.
fn radius_se(fit: &circle::CircleFit, seen: &Residuals, orders: usize, n: f64) -> f64 {
    let (Some(covariance), fitted) = (fit.covariance, fit.points as f64) else {
        return 0.0;
    };
    let free = (fitted - 3.0).max(1.0);
    if fit.rss <= 0.0 || seen.squares <= 0.0 {
        return 0.0;
    }
    // `covariance` holds rss/(n−3): replace it by the variance about circle and form.
    let parameters = (2 * orders.max(2) - 1).max(3) as f64;
    let variance = seen.squares / (n - parameters).max(1.0);
    let rho = (seen.products / seen.pairs.max(1.0)) / (seen.squares / n);
    let rho = rho.clamp(0.0, 1.0 - 1.0 / n);
    let inflation = (1.0 + rho) / (1.0 - rho);
    (covariance[2][2] * variance / (fit.rss / free) * inflation * fitted / n)
        .max(0.0)
        .sqrt()
}
