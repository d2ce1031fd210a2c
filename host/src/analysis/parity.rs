//! What is the same both ways round, and what flips.
use crate::campaign::Run;
use std::f64::consts::TAU;

/// Even and odd part of a pair of runs on a grid of angles.
#[derive(Clone, Debug, PartialEq)]
pub struct EvenOdd {
    /// Angles of the grid, rad, from 0 to below 2π.
    pub angle_rad: Vec<f64>,
    /// (CCW + CW)/2, m.
    pub even_m: Vec<f64>,
    /// (CCW − CW)/2, m.
    pub odd_m: Vec<f64>,
}

/// Deviations of a run averaged over `sectors` equal sectors whose middles are k·2π/`sectors`. An empty sector
/// takes the line between its neighbours.
pub fn profile(run: &Run, sectors: usize) -> Vec<f64> {
    let (mut sum, mut count) = (vec![0.0; sectors], vec![0.0; sectors]);
    for (a, v) in run.samples.angle_rad.iter().zip(&run.samples.deviation_m) {
        let k = (a.rem_euclid(TAU) / TAU * sectors as f64).round() as usize % sectors.max(1);
        sum[k] += v;
        count[k] += 1.0;
    }
    let filled: Vec<usize> = (0..sectors).filter(|&k| count[k] > 0.0).collect();
    let mean = |k: usize| sum[k] / count[k];
    let mut profile = vec![0.0; sectors];
    for (i, &from) in filled.iter().enumerate() {
        let to = filled[(i + 1) % filled.len()];
        let gap = if to > from {
            to - from
        } else {
            to + sectors - from
        };
        for step in 0..gap {
            profile[(from + step) % sectors] =
                mean(from) + (mean(to) - mean(from)) * step as f64 / gap as f64;
        }
    }
    profile
}

/// Splits a pair of runs of the same radius and feed.
///
/// ```
/// use giotto::analysis::even_odd;
/// use giotto::campaign::Direction;
/// use giotto::simulation::{self, Plan};
/// # use std::path::Path;
/// // A radius error is the same both ways round; the lag of a single axis flips.
/// let plan = Plan::parse(
///     "[machine]\nx = { kv_per_s = 50.0 }\ny = { kv_per_s = 60.0 }\n[instrument]\n\
///      [grid]\nradii_mm = [100.0]\nfeeds_mm_s = [100.0]\norder = \"listed\"",
///     Path::new("plan.toml"),
/// )?;
/// let campaign = simulation::campaign(&plan, 1);
/// let [ccw, cw] = &campaign.runs[..] else { unreachable!() };
/// assert_eq!(cw.direction, Direction::Cw);
/// let split = even_odd(cw, ccw, 72);
/// let largest = |values: &[f64]| values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
/// // ½fΔτ = 0.5 · 0.1 m/s · 3.3 ms = 167 µm.
/// assert!((largest(&split.odd_m) - 167e-6).abs() < 5e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn even_odd(cw: &Run, ccw: &Run, sectors: usize) -> EvenOdd {
    let (a, b) = (profile(ccw, sectors), profile(cw, sectors));
    EvenOdd {
        angle_rad: (0..sectors)
            .map(|k| TAU * k as f64 / sectors as f64)
            .collect(),
        even_m: a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect(),
        odd_m: a.iter().zip(&b).map(|(a, b)| 0.5 * (a - b)).collect(),
    }
}
