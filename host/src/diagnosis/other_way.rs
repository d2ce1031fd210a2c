//! A run with the label of the other direction: where angles follow from the time, its set-up offset lies mirrored.
use super::residual_waves::median;
use super::survey::Survey;

/// Fewest runs among which one can be said to be mirrored, and fewest of one radius: what bends the slides moves the centre by
/// radius.
const FEWEST: usize = 10;
const FEWEST_OF_RADIUS: usize = 4;
/// Distances of a run's set-up offset from the usual one, in medians of all: beyond the first it is another, within the second it
/// is the same. A median of a Rayleigh distribution is 1.18 σ: 8 of them are passed by one in 10^19, 4 by one in 10^5.
const ANOTHER: f64 = 8.0;
const SAME: f64 = 4.0;
/// Smallest distance that is one, m: a set-up repeats to about this.
const SMALLEST_M: f64 = 1e-6;
/// Delays that are tried on either side of none, first over all that is possible, then about the best.
const TRIED: i32 = 40;
/// Longest delay, s.
const LONGEST_S: f64 = 0.2;

/// First harmonics as they were recorded.
struct Offsets {
    /// Sense of travel, angular speed (rad/s), cosine and sine (m).
    runs: Vec<(f64, f64, [f64; 2])>,
    /// Runs of one radius, where they are enough.
    by_radius: Vec<Vec<usize>>,
}

/// The one run whose set-up offset lies with those of the others only if it was driven the other way round than its label says.
pub fn find(survey: &Survey) -> Option<usize> {
    let offsets = Offsets::of(survey);
    if !survey.inferred() || offsets.runs.len() < FEWEST {
        return None;
    }
    let fastest = offsets.runs.iter().map(|run| run.1).fold(0.0, f64::max);
    // A phase beyond ±π at the fastest run would be another branch.
    let mut widest_s = (std::f64::consts::PI / fastest).min(LONGEST_S);
    let mut delay_s = 0.0;
    for _ in 0..3 {
        let tried = (-TRIED..=TRIED).map(|i| delay_s + widest_s * f64::from(i) / f64::from(TRIED));
        let scattered = tried.map(|delay_s| (offsets.scatter(delay_s), delay_s));
        (_, delay_s) = scattered.min_by(|a, b| a.0.total_cmp(&b.0))?;
        widest_s /= f64::from(TRIED) / 2.0;
    }
    offsets.mirrored(delay_s)
}

impl Offsets {
    fn of(survey: &Survey) -> Self {
        let mut by_radius: Vec<(f64, Vec<usize>)> = Vec::new();
        for (run, (view, _)) in survey.set_ups().enumerate() {
            let same = |(radius_m, _): &&mut (f64, Vec<usize>)| {
                (*radius_m - view.radius_m).abs() < 1e-6 * view.radius_m
            };
            match by_radius.iter_mut().find(same) {
                Some((_, those)) => those.push(run),
                None => by_radius.push((view.radius_m, vec![run])),
            }
        }
        let groups = by_radius.into_iter().map(|(_, those)| those);
        Self {
            runs: survey
                .set_ups()
                .map(|(view, first)| (view.sign, view.omega_rad_s, first))
                .collect(),
            by_radius: groups
                .filter(|those| those.len() >= FEWEST_OF_RADIUS)
                .collect(),
        }
    }

    /// Places of the set-up with the turn of this delay taken back, each run driven as labelled or the other way.
    fn places(&self, delay_s: f64, other_way: bool) -> Vec<[f64; 2]> {
        let way = if other_way { -1.0 } else { 1.0 };
        let place = |&(sign, omega, [c, s]): &(f64, f64, [f64; 2])| {
            let (sin, cos) = (-way * sign * omega * delay_s).sin_cos();
            [c * cos - way * s * sin, c * sin + way * s * cos]
        };
        self.runs.iter().map(place).collect()
    }

    /// Distance of each place from the median of the usual ones of its radius; nothing where these are few.
    fn distances(&self, usual: &[[f64; 2]], places: &[[f64; 2]]) -> Vec<f64> {
        let mut out = vec![0.0; places.len()];
        for those in &self.by_radius {
            let [x, y] = [0, 1].map(|k| {
                let mut values: Vec<f64> = those.iter().map(|&run| usual[run][k]).collect();
                median(&mut values)
            });
            for &run in those {
                out[run] = (places[run][0] - x).hypot(places[run][1] - y);
            }
        }
        out
    }

    /// Median of the distances, m.
    fn scatter(&self, delay_s: f64) -> f64 {
        let places = self.places(delay_s, false);
        median(&mut self.distances(&places, &places))
    }

    fn mirrored(&self, delay_s: f64) -> Option<usize> {
        let labelled = self.places(delay_s, false);
        let distances = self.distances(&labelled, &labelled);
        let scatter = median(&mut distances.clone());
        let far_m = (ANOTHER * scatter).max(SMALLEST_M);
        let mut others = (0..distances.len()).filter(|&run| distances[run] > far_m);
        let (run, None) = (others.next()?, others.next()) else {
            return None;
        };
        let turned = self.distances(&labelled, &self.places(delay_s, true));
        (turned[run] < (SAME * scatter).max(0.5 * SMALLEST_M)).then_some(run)
    }
}
