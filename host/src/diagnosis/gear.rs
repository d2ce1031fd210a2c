//! The ratio of a joint's gear, by the spectrum over the joint's angle.
//!
//! `r = lever·A·sin(w·q + φ)` is one frequency over the joint's angle q, whatever the circle and the speed. What pulls at each
//! angle, folded into fine bins, holds every ratio at once in one transform, as for the pitch of a slide (`pitch`).
use super::design_column::Column;
use super::survey::Prepared;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// The best ratio of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Best {
    /// Waves to a turn of the joint.
    pub ratio: f64,
    /// What it takes off χ², the rest taken as orthogonal.
    pub gain: f64,
}

/// Bins to the shortest wave.
const BINS: f64 = 12.0;
/// Points of the spectrum to one wave more or less over the range.
const FINENESS: f64 = 4.0;

/// Scans the ratios of a joint. `whitened` is V⁻¹ times what other explanations leave, so that its product with a column is
/// that column's pull.
pub fn scan(
    runs: &[Prepared],
    [lowest, highest]: [f64; 2],
    whitened: &Column,
    noise_m2: f64,
    joint: usize,
) -> Option<Best> {
    let (low, high) = runs
        .iter()
        .filter_map(|run| run.view.arm.as_ref())
        .map(|arm| arm.orbit.range_rad(joint))
        .fold((f64::MAX, f64::MIN), |(low, high), [a, b]| {
            (low.min(a), high.max(b))
        });
    let range = (high - low).max(0.0);
    let bins_per_rad = BINS * highest / TAU;
    // `own` is read at twice the frequency.
    let length = ((FINENESS * range * bins_per_rad) as usize + 1).next_power_of_two();
    let mut pull = vec![Complex::new(0.0, 0.0); length];
    let mut own = pull.clone();
    for (index, run) in runs.iter().enumerate() {
        let Some(arm) = &run.view.arm else { continue };
        let pulls = whitened.samples(run, index);
        for (at, (psi, value)) in run.view.psi_rad.iter().zip(&pulls).enumerate() {
            if run.hidden.get(at).is_some_and(|hidden| *hidden) {
                continue;
            }
            let [q, _, lever] = arm.orbit.at(joint, *psi);
            let place = (((q - low).max(0.0) * bins_per_rad) as usize).min(length - 1);
            pull[place].re += lever * value;
            own[place].re += lever * lever;
        }
    }
    let transform = FftPlanner::new().plan_fft_forward(length);
    transform.process(&mut pull);
    transform.process(&mut own);
    let step = TAU * bins_per_rad / length as f64;
    let whole = own[0].re;
    let first = (lowest / step).ceil().max(1.0) as usize;
    let last = ((highest / step) as usize).min(length / 4);
    (first..=last)
        .map(|k| {
            let (p, d) = (pull[k], own[2 * k]);
            // Products of lever·cos and lever·sin among themselves.
            let (cc, ss, cs) = (0.5 * (whole + d.re), 0.5 * (whole - d.re), 0.5 * d.im);
            let determinant = cc * ss - cs * cs;
            let gain = if determinant > 1e-6 * whole * whole {
                (p.re * p.re * ss + p.im * p.im * cc - 2.0 * p.re * p.im * cs) / determinant
            } else {
                0.0
            };
            Best {
                ratio: k as f64 * step,
                gain: noise_m2 * gain,
            }
        })
        .max_by(|a, b| a.gain.total_cmp(&b.gain))
}
