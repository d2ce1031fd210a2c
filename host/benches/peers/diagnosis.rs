//! A whole diagnosis: a NumPy and SciPy script that does the same work by the same algorithm.
use crate::Error;
use crate::python::{Peers, store};
use crate::table::{Table, Times};
use crate::timing::timed;
use giotto::diagnosis::{Diagnosis, Options, diagnose};
use giotto::simulation::{self, Plan};
use giotto_shared::Axis;
use serde_json::json;
use std::path::Path;

const ROUNDS: usize = 5;
/// Estimates of both, share.
const SAME: f64 = 0.01;
/// Gains on runs left out of both, percentage points.
const SAME_GAIN: f64 = 0.5;
/// 78 runs of 1000 samples: the paper's grid on a machine with geometry and a reversal error.
const PLAN: &str = r#"
[campaign]
name = "bench"
machine = "simulated two-axis machine"
[machine]
squareness_um_per_m = 80.0
both = { omega_n_rad_s = 38.0, zeta = 0.72 }
x = { scale_um_per_m = 45.0, backlash_um = 8.0 }
y = { scale_um_per_m = -45.0 }
[instrument]
noise_um = 1.0
spread_um = 0.2
resolution_um = 0.1
setup_spread_um = 5.0
[grid]
radii_mm = [100.0, 150.0, 300.0]
feeds_mm_s = [20.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0, 600.0, 620.0]
directions = ["ccw", "cw"]
order = "random"
"#;

/// Runs the part.
pub(crate) fn run(peers: &mut Peers) -> Result<Table, Error> {
    let mut table = Table::new(
        "Whole diagnosis",
        "samples",
        &["giotto", "NumPy and SciPy"],
        &["over the script"],
    );
    let campaign = simulation::campaign(&Plan::parse(PLAN, Path::new("bench.toml"))?, 1);
    let samples = campaign
        .runs
        .first()
        .map_or(0, |run| run.samples.deviation_m.len());
    if campaign
        .runs
        .iter()
        .any(|run| run.samples.deviation_m.len() != samples)
    {
        return Err("the script needs runs of equal length".into());
    }
    let directory = tempfile::tempdir()?;
    let column =
        |name: &str, of: &dyn Fn(&giotto::campaign::Run) -> Vec<f64>| -> Result<_, Error> {
            let path = directory.path().join(format!("{name}.bin"));
            store(
                &path,
                &campaign.runs.iter().flat_map(of).collect::<Vec<_>>(),
            )?;
            Ok(path)
        };
    let data = json!({
        "radius": column("radius", &|r| vec![r.radius_m])?,
        "feed": column("feed", &|r| vec![r.feed_m_s])?,
        "sign": column("sign", &|r| vec![r.sign()])?,
        "started": column("started", &|r| vec![r.started_s.unwrap_or(0.0)])?,
        "time": column("time", &|r| r.samples.time_s.clone().unwrap_or_default())?,
        "theta": column("theta", &|r| r.samples.angle_rad.clone())?,
        "deviation": column("deviation", &|r| r.samples.deviation_m.clone())?,
    });
    let (mut ours, mut theirs) = (Times::default(), Times::default());
    let mut agreement = Agreement::default();
    for _ in 0..ROUNDS {
        let (seconds, found) = timed(|| diagnose(&campaign, &Options::default()));
        ours.push(seconds);
        let (seconds, value) = peers.run("diagnosis", &data)?;
        theirs.push(seconds);
        agreement = Agreement::of(&found?, &value)?;
    }
    let total = samples * campaign.runs.len();
    table.row(total, &[&ours, &theirs], &[theirs.median() / ours.median()]);
    table.remark(format!(
        "{} runs of {samples} samples; bar 20×. Both do the same work by the same algorithm: bases, noise and scatter, lag, \
         every cause and pattern as columns, the search with its pruning, shapes, tangents, tones, teeth, refinement until \
         settled, intervals, probabilities, {} folds with every circle left out simulated in time, 1000 resamples. The script \
         works on all runs at once in arrays, with one thread of the BLAS, since two take as long; giotto uses all cores, and \
         makes the words and what plots draw besides",
        campaign.runs.len(),
        agreement.folds
    ));
    table.remark(format!(
        "the same {} causes are found; estimates agree to {:.0e}, half-widths of their intervals to {:.0e}, gains on runs left \
         out ({:.2} and {:.2} %) to {:.0e} points",
        agreement.causes,
        agreement.estimates,
        agreement.half_widths,
        agreement.gains[0],
        agreement.gains[1],
        (agreement.gains[0] - agreement.gains[1]).abs()
    ));
    Ok(table)
}

/// How far the answers are apart.
#[derive(Clone, Copy, Debug, Default)]
struct Agreement {
    causes: usize,
    folds: f64,
    /// Largest departure of an estimate, and of the half-width of an interval, share.
    estimates: f64,
    half_widths: f64,
    /// Of giotto and of the script, %.
    gains: [f64; 2],
}

impl Agreement {
    /// Of a diagnosis and what the script says: gain, its interval, folds by radius and by speed, then of each finding cause,
    /// axis (−1: none), estimate and half-width. Answers that are not the same are an error.
    fn of(ours: &Diagnosis, theirs: &[f64]) -> Result<Self, Error> {
        let gain = ours.gain.as_ref().ok_or("giotto leaves no run out")?;
        let Some(([percent, _, _, by_radius, by_feed], findings)) = theirs.split_first_chunk()
        else {
            return Err("the script says too little".into());
        };
        let (findings, []) = findings.as_chunks::<4>() else {
            return Err("the script does not say all of a finding".into());
        };
        let mut agreement = Self {
            causes: findings.len(),
            folds: by_radius + by_feed,
            gains: [gain.percent, *percent],
            ..Self::default()
        };
        for finding in &ours.findings {
            let place = finding
                .axis
                .map_or(-1.0, |axis| if axis == Axis::X { 0.0 } else { 1.0 });
            let cause = f64::from(finding.cause as u8);
            let same = findings
                .iter()
                .find(|other| other[0] == cause && other[1] == place);
            let Some([_, _, value, half]) = same else {
                return Err(format!("the script does not find {:?}", finding.cause).into());
            };
            let estimate = &finding.estimate;
            let half_width = 0.5 * (estimate.ci95[1] - estimate.ci95[0]);
            agreement.estimates = agreement
                .estimates
                .max((value / estimate.value - 1.0).abs());
            agreement.half_widths = agreement.half_widths.max((half / half_width - 1.0).abs());
        }
        let same = findings.len() == ours.findings.len()
            && agreement.estimates < SAME
            && (percent - gain.percent).abs() < SAME_GAIN;
        if same {
            Ok(agreement)
        } else {
            Err(format!("answers differ: {agreement:?}").into())
        }
    }
}
