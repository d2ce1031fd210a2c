//! Stepwise fit with intervals: statsmodels.
use crate::Error;
use crate::python::{Peers, store};
use crate::table::{Table, Times};
use crate::timing::{repeats, timed_again};
use giotto::fit::{Observation, Options, RadiusFit};
use giotto_shared::model::RadiusModel;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;

const SIZES: [usize; 4] = [30, 300, 3_000, 10_000];
const ROUNDS: usize = 21;
const SAME: f64 = 1e-6;
const PAPER: RadiusModel<f64> = RadiusModel {
    beta1_s2: -23.29e-6,
    beta2_s4: -0.23e-6,
};

fn runs(n: usize) -> Vec<Observation> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(n as u64);
    (0..n)
        .map(|_| {
            let feed_m_s = rng.random_range(0.02..0.7);
            let noise: f64 = StandardNormal.sample(&mut rng);
            let radius_error_m = 2e-6 + PAPER.radius_error_m(0.1, feed_m_s) + 0.5e-6 * noise;
            Observation {
                radius_m: 0.1,
                feed_m_s,
                radius_error_m,
                out_of_roundness_m: None,
            }
        })
        .collect()
}

/// Runs the part.
pub(crate) fn run(peers: &mut Peers) -> Result<Table, Error> {
    let mut table = Table::new(
        "Stepwise fit with intervals",
        "runs",
        &["giotto", "statsmodels"],
        &["over statsmodels"],
    );
    let directory = tempfile::tempdir()?;
    for n in SIZES {
        let runs = runs(n);
        let column = |name: &str, of: fn(&Observation) -> f64| -> Result<_, Error> {
            let path = directory.path().join(format!("{name}{n}.bin"));
            store(&path, &runs.iter().map(of).collect::<Vec<_>>())?;
            Ok(path)
        };
        let data = json!({
            "feed": column("feed", |o| o.feed_m_s)?,
            "radius": column("radius", |o| o.radius_m)?,
            "error": column("error", |o| o.radius_error_m)?,
        });
        let (mut ours, mut theirs) = (Times::default(), Times::default());
        for _ in 0..ROUNDS {
            let (seconds, fit) =
                timed_again(repeats(n), || RadiusFit::new(&runs, Options::default()));
            let fit = fit?;
            ours.push(seconds);
            let (seconds, found) = peers.repeat("statsmodels", repeats(n), &data)?;
            theirs.push(seconds);
            let [b1, b2] = [fit.model.beta1_s2, fit.model.beta2_s4];
            let value = [
                [b1, fit.ci95[0][0], fit.ci95[0][1], b2].as_slice(),
                &[
                    fit.ci95[1][0],
                    fit.ci95[1][1],
                    fit.ratio95[0],
                    fit.ratio95[1],
                    fit.offsets_m[0].1,
                ],
                &[fit.deviation_m, fit.train.1],
            ]
            .concat();
            if value.len() != found.len()
                || value
                    .iter()
                    .zip(&found)
                    .any(|(a, b)| (a / b - 1.0).abs() > SAME)
            {
                return Err(
                    format!("statsmodels finds {found:?} where giotto finds {value:?}").into(),
                );
            }
        }
        table.row(n, &[&ours, &theirs], &[theirs.median() / ours.median()]);
    }
    table.remark(
        "one radius with its offset; β1, β2, κ4/κ2², their 95 % intervals, offset and scatter agree to 1e-6; bar 50×".to_owned(),
    );
    Ok(table)
}
