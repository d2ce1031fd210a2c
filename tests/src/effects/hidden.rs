//! A campaign with its truth, whatever machine it was measured on.
use super::Truth;
use giotto::campaign::Campaign;

/// What is handed to `diagnose`, and what is known of it.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// What was hidden, in words.
    pub name: String,
    /// Seed.
    pub seed: u64,
    /// Wanted misfit of each effect, in units of the noise.
    pub strength: f64,
    /// Standard deviation of a sample, m.
    pub noise_m: f64,
    /// Standard deviation of a run's size, m.
    pub scatter_m: f64,
    /// Each effect.
    pub truth: Vec<Truth>,
    /// What was measured.
    pub campaign: Campaign,
    /// What the true machine leaves, rms over all samples, each run's centre removed, µm; `None` where that is no
    /// measure (labels changed, runs spoilt).
    pub perfect_um: Option<f64>,
    /// Second-order model (ωn rad/s, ζ) to be given as `--model`.
    pub model: Option<[f64; 2]>,
    /// The contract's `[kinematics]`, if it is given.
    pub kinematics: Option<String>,
    /// The file of a run that was spoilt.
    pub spoilt: Option<String>,
}

/// What `clean` leaves of `measured`, run by run in the same order, each run's centre removed, rms, µm.
pub fn left_um(measured: &Campaign, clean: &Campaign) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (run, truth) in measured.runs.iter().zip(&clean.runs) {
        let left: Vec<f64> = run
            .samples
            .deviation_m
            .iter()
            .zip(&truth.samples.deviation_m)
            .map(|(a, b)| a - b)
            .collect();
        let n = left.len() as f64;
        let (mut cos, mut sin) = (0.0, 0.0);
        for (x, angle) in left.iter().zip(&run.samples.angle_rad) {
            cos += 2.0 * x * angle.cos() / n;
            sin += 2.0 * x * angle.sin() / n;
        }
        for (x, angle) in left.iter().zip(&run.samples.angle_rad) {
            sum += (x - cos * angle.cos() - sin * angle.sin()).powi(2);
        }
        count += n;
    }
    1e6 * (sum / count).sqrt()
}
