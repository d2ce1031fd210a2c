//! The pitch of a periodic error, by the spectrum over the place along its axis.
//!
//! `r = A·cosψ·sin(w·x + φ)` with `x = R·cosψ` is one frequency over x, whatever the radius. What pulls at each
//! place, folded into fine bins of x, holds every pitch at once in one transform; 1 % of a gain is lost to the bins.
use super::design_column::Column;
use super::survey::Prepared;
use giotto_shared::Actuator;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// The best pitch of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Best {
    /// Pitch, m.
    pub pitch_m: f64,
    /// What it takes off χ², its two phases taken as orthogonal to each other and to the rest.
    pub gain: f64,
}

/// Bins to the shortest wave.
const BINS: f64 = 12.0;
/// Points of the spectrum to one wave more or less over the longest travel.
const FINENESS: f64 = 4.0;

/// Scans the pitches from half the largest circle down to `finest_wave_per_m`. `whitened` is V⁻¹ times what other
/// explanations leave, so that its product with a column is that column's pull.
pub fn scan(
    runs: &[Prepared],
    whitened: &Column,
    noise_m2: f64,
    axis: Actuator,
    finest_wave_per_m: f64,
) -> Option<Best> {
    let at_axis = axis.index();
    // How far from the middle of all circles the axis goes.
    let (low, high) = runs.iter().fold((f64::MAX, f64::MIN), |(low, high), run| {
        let (centre, radius) = (run.view.centre_m[at_axis], run.view.radius_m);
        (low.min(centre - radius), high.max(centre + radius))
    });
    let (middle_m, radius_m) = (0.5 * (low + high), 0.5 * (high - low).max(0.0));
    let travel_m = 2.0 * radius_m;
    let bins_per_m = BINS * finest_wave_per_m;
    // `own` is read at twice the frequency.
    let length = ((FINENESS * travel_m * bins_per_m) as usize + 1).next_power_of_two();
    let mut pull = vec![Complex::new(0.0, 0.0); length];
    let mut own = pull.clone();
    for (index, run) in runs.iter().enumerate() {
        let pulls = whitened.samples(run, index);
        for (at, (direction, value)) in run.view.direction.iter().zip(&pulls).enumerate() {
            if run.hidden.get(at).is_some_and(|hidden| *hidden) {
                continue;
            }
            let along = direction[at_axis];
            let from = run.view.centre_m[at_axis] - middle_m + radius_m;
            let place = ((from + run.view.radius_m * along) * bins_per_m) as usize;
            pull[place.min(length - 1)].re += along * value;
            own[place.min(length - 1)].re += along * along;
        }
    }
    let transform = FftPlanner::new().plan_fft_forward(length);
    transform.process(&mut pull);
    transform.process(&mut own);
    let step_per_m = bins_per_m / length as f64;
    let middle = radius_m * bins_per_m - 0.5;
    let whole = own[0].re;
    let lowest = (1.0 / (radius_m * step_per_m)).ceil() as usize;
    let highest = ((finest_wave_per_m / step_per_m) as usize).min(length / 4);
    (lowest.max(1)..=highest)
        .map(|k| {
            // From the first bin to the middle of the travel, where x = 0.
            let turn = Complex::cis(std::f64::consts::TAU * k as f64 * middle / length as f64);
            let (pull, doubled) = (pull[k] * turn, (own[2 * k] * turn * turn).re);
            let energy = [0.5 * (whole + doubled), 0.5 * (whole - doubled)];
            let part = |pull: f64, own: f64| {
                if own > 1e-6 * whole {
                    pull * pull / own
                } else {
                    0.0
                }
            };
            let gain = noise_m2 * (part(pull.re, energy[0]) + part(pull.im, energy[1]));
            Best {
                pitch_m: 1.0 / (k as f64 * step_per_m),
                gain,
            }
        })
        .max_by(|a, b| a.gain.total_cmp(&b.gain))
}
