//! What is left of the sizes, held against the order of the runs and against the radius: a shop that warms and cools
//! through the day, a bar of its own for each radius.
use super::explained::Explained;
use super::finding::Signature;
use super::linear;
use super::omnibus::{FALSE_ALARM, Leftover};
use super::residual_waves::median;
use std::f64::consts::TAU;

/// Fewest runs whose order says anything beside what is fitted to them.
const FEWEST_RUNS: usize = 12;
/// Smallest swing, rms, of interest: share of the noise of a sample.
const OF_NOISE: f64 = 0.4;
/// A size that is so many of its own standard deviations off counts as that many: one run is no swing.
const LARGEST: f64 = 3.0;

/// Tests what is left of the size of each run, m.
pub fn test(found: &Explained, sizes_m: &[f64]) -> Vec<Leftover> {
    if sizes_m.len() < FEWEST_RUNS {
        return Vec::new();
    }
    [
        swing(found, sizes_m, false),
        swing(found, sizes_m, true),
        of_a_radius(found, sizes_m),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Sizes on one scale, the far ones brought in.
fn calm(values: &[f64]) -> Vec<f64> {
    let middle = median(&mut values.to_vec());
    let mut off: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    // The median of |N(0, σ)| is 0.6745σ.
    let most = LARGEST * median(&mut off) / 0.6745;
    values
        .iter()
        .map(|value| (value - middle).clamp(-most, most))
        .collect()
}

/// Degrees of freedom that the model of the sizes takes from what is left: one for each column fitted, at most.
fn taken(found: &Explained) -> f64 {
    (found.nuisance.len() + found.chosen.len()) as f64
}

/// A swing over the time of the campaign, of the size or of its share of the radius.
fn swing(found: &Explained, sizes_m: &[f64], of_radius: bool) -> Option<Leftover> {
    let runs = &found.runs;
    let scale = |index: usize| {
        if of_radius {
            runs[index].view.radius_m / 0.15
        } else {
            1.0
        }
    };
    let values: Vec<f64> = sizes_m
        .iter()
        .enumerate()
        .map(|(index, size)| size / scale(index))
        .collect();
    let values = calm(&values);
    let n = values.len();
    let dof = n as f64 - 3.0 - taken(found);
    let total: f64 = {
        let mean = values.iter().sum::<f64>() / n as f64;
        values.iter().map(|value| (value - mean).powi(2)).sum()
    };
    // Half a cycle to one in four runs.
    let halves = n / 2;
    let (cycles, left) = (1..=halves)
        .map(|half| {
            let turn = |index: usize| 0.5 * half as f64 * TAU * runs[index].view.elapsed;
            let columns = [
                vec![1.0; n],
                (0..n).map(|index| turn(index).cos()).collect(),
                (0..n).map(|index| turn(index).sin()).collect(),
            ];
            let fitted = linear::fitted_values(&columns, &values);
            let left: f64 = values
                .iter()
                .zip(&fitted)
                .map(|(a, b)| (a - b).powi(2))
                .sum();
            (0.5 * half as f64, left)
        })
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let chance = (left / total.max(f64::MIN_POSITIVE)).powf(0.5 * dof) * 2.0 * halves as f64;
    let rms_m = ((total - left) / n as f64).sqrt();
    (chance < FALSE_ALARM && rms_m > OF_NOISE * found.spread.sample_m2.sqrt()).then(|| {
        let law = if of_radius { ", ∝ R" } else { "" };
        let when = format!("swings {cycles:.1} times over the campaign");
        leftover(
            rms_m,
            chance,
            when.clone(),
            f64::from(u8::from(of_radius)),
            format!("the size {when}{law}"),
        )
    })
}

/// One radius whose circles are off by a length that no law of R, f and direction gives.
fn of_a_radius(found: &Explained, sizes_m: &[f64]) -> Option<Leftover> {
    let values = calm(sizes_m);
    let mut radii: Vec<f64> = found.runs.iter().map(|run| run.view.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * *b);
    if radii.len() < 2 {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let total: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let of = |radius: f64| -> Vec<f64> {
        let here =
            |index: &usize| (found.runs[*index].view.radius_m - radius).abs() < 1e-6 * radius;
        (0..values.len())
            .filter(here)
            .map(|index| values[index])
            .collect()
    };
    let between: f64 = radii
        .iter()
        .map(|radius| {
            let own = of(*radius);
            let off = own.iter().sum::<f64>() / own.len() as f64 - mean;
            own.len() as f64 * off * off
        })
        .sum();
    let (k, dof) = (
        (radii.len() - 1) as f64,
        n - radii.len() as f64 - taken(found),
    );
    let f =
        between / k / ((total - between).max(1e-12 * total).max(f64::MIN_POSITIVE) / dof.max(1.0));
    let law = statrs::distribution::FisherSnedecor::new(k, dof.max(1.0)).ok()?;
    let chance = statrs::distribution::ContinuousCDF::sf(&law, f);
    let rms_m = (between / n).sqrt();
    (chance < FALSE_ALARM && rms_m > OF_NOISE * found.spread.sample_m2.sqrt()).then(|| {
        let words = "the size is off at each radius by a length of its own, which neither an offset nor a scale gives";
        leftover(rms_m, chance, String::new(), 0.0, words.to_string())
    })
}

fn leftover(
    rms_m: f64,
    chance: f64,
    when: String,
    radius_exponent: f64,
    words: String,
) -> Leftover {
    let rms_um = rms_m * 1e6;
    Leftover {
        signature: Signature {
            harmonic: Some(0),
            direction_parity: Some("even"),
            feed_exponent: Some(0.0),
            radius_exponent: Some(radius_exponent),
            when: (!when.is_empty()).then_some(when),
            words: vec![format!(
                "{words} ({rms_um:.2} µm rms): chance {chance:.1e} by noise"
            )],
            ..Signature::default()
        },
        rms_um,
        chance,
    }
}
