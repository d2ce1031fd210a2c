//! Geometric circle fit: `circle-fit` and `scipy.optimize.least_squares`, and the time to read the points.
use crate::Error;
use crate::python::{Peers, store};
use crate::table::{Table, Times, growth};
use crate::timing::{repeats, timed_again};
use giotto::fit::fit_circle;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde_json::json;
use std::hint::black_box;

const SIZES: [usize; 5] = [1_000, 10_000, 100_000, 1_000_000, 10_000_000];
/// Above this the peers need more memory and patience than the comparison is worth.
const LARGEST_FOR_PEERS: usize = 1_000_000;
const SAME: f64 = 1e-9;

/// A turn of a 100 mm ballbar: 1 µm noise, a 10 µm oval, a centre off by tens of µm.
fn points(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(n as u64);
    (0..n)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
            let noise: f64 = StandardNormal.sample(&mut rng);
            let radius = 0.1 + 1e-6 * noise + 10e-6 * sin * cos;
            (30e-6 + radius * cos, -20e-6 + radius * sin)
        })
        .unzip()
}

/// Reads every number once, on all cores: the floor under any fit.
fn read(x: &[f64], y: &[f64]) -> f64 {
    let sum = |values: &[f64]| {
        let mut lanes = [0.0; 16];
        for part in values.chunks_exact(16) {
            lanes
                .iter_mut()
                .zip(part)
                .for_each(|(lane, value)| *lane += value);
        }
        lanes.iter().sum::<f64>()
    };
    x.par_chunks(32768)
        .zip(y.par_chunks(32768))
        .map(|(x, y)| sum(x) + sum(y))
        .sum()
}

/// Runs the part.
pub(crate) fn run(peers: &mut Peers) -> Result<Table, Error> {
    let mut table = Table::new(
        "Geometric circle fit",
        "points",
        &["giotto", "read", "circle-fit", "scipy"],
        &["over circle-fit", "over scipy", "giotto over read"],
    );
    let directory = tempfile::tempdir()?;
    let mut sizes = Vec::new();
    for n in SIZES {
        let (x, y) = points(n);
        let files = ["x", "y"].map(|name| directory.path().join(format!("{name}{n}.bin")));
        store(&files[0], &x)?;
        store(&files[1], &y)?;
        let data = json!({ "x": files[0], "y": files[1] });
        let mut times: [Times; 4] = std::array::from_fn(|_| Times::default());
        let rounds = if n > LARGEST_FOR_PEERS { 25 } else { 11 };
        for _ in 0..rounds {
            let repeats = repeats(n);
            let (seconds, fit) = timed_again(repeats, || fit_circle(&x, &y));
            let radius = fit?.circle.radius;
            times[0].push(seconds);
            times[1].push(timed_again(repeats, || read(black_box(&x), &y)).0);
            if n <= LARGEST_FOR_PEERS {
                for (k, peer) in ["circle-fit", "scipy"].into_iter().enumerate() {
                    let (seconds, found) = peers.repeat(peer, repeats, &data)?;
                    if (found[2] / radius - 1.0).abs() > SAME {
                        return Err(format!(
                            "{peer} finds a radius of {} where giotto finds {radius}",
                            found[2]
                        )
                        .into());
                    }
                    times[2 + k].push(seconds);
                }
            }
        }
        let median = times.each_ref().map(Times::median);
        sizes.push((n, median[0]));
        table.row(
            n,
            &times.each_ref(),
            &[
                median[2] / median[0],
                median[3] / median[0],
                median[0] / median[1],
            ],
        );
    }
    let of_large: Vec<_> = sizes
        .iter()
        .copied()
        .filter(|(n, _)| *n >= 100_000)
        .collect();
    table.remark(format!(
        "growth exponent {:.3} over all sizes, {:.3} from 1e5 points on (bar 1.02); bars: 30× the faster peer from 1e5 \
         points on, 1e7 points within 3× of the time to read them",
        growth(&sizes),
        growth(&of_large)
    ));
    table.remark(
        "peers run up to 1e6 points; scipy has the analytic Jacobian and MINPACK's lm, circle-fit its own lm"
            .to_owned(),
    );
    Ok(table)
}
