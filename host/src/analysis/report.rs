//! Whole campaigns.
use super::iso230::{self, Iso230, Kept};
use super::run::{RunAnalysis, of_run};
use crate::campaign::{
    Campaign, CampaignError, Loaded, Location, Manifest, Note, Place, Problem, Run, Together,
};
use giotto_shared::circle::CircleError;
use rayon::prelude::*;

/// Analysis of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Name of the campaign.
    pub name: String,
    /// Machine under test.
    pub machine: String,
    /// One entry a run, in file order.
    pub runs: Vec<RunAnalysis>,
    /// One entry a pair, in order of first appearance.
    pub iso230_4: Vec<Iso230>,
    /// Where the circles of files with positions lie, by run.
    pub frames: Vec<Option<Location>>,
    /// Half the range of the temperatures that the runs state, K.
    pub temperature_half_range_k: Option<f64>,
    /// Known scatter of a circle's size between runs, m, if the campaign states it.
    pub repeatability_m: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<Note>,
}

/// Analysis of a campaign in memory.
///
/// # Errors
/// A run through which no circle goes, by index.
///
/// ```
/// use giotto::analysis;
/// use giotto::simulation::{self, Plan};
/// # use std::path::Path;
/// let plan = Plan::parse(
///     "[machine]\nboth = { kv_per_s = 50.0 }\n[grid]\nradii_mm = [100.0]\nfeeds_mm_s = [300.0]",
///     Path::new("plan.toml"),
/// )?;
/// let report = analysis::of_campaign(&simulation::campaign(&plan, 1)).map_err(|(_, e)| e)?;
/// // ΔR = −½ τ² f²/R of a lag of 20 ms: −180 µm, in both directions, which make one pair.
/// for run in &report.runs {
///     assert!((run.radius_error_m + 180e-6).abs() < 3e-6);
/// }
/// assert_eq!(report.iso230_4.len(), 1);
/// assert!(report.iso230_4[0].g_b_m.is_some_and(|g| g < 15e-6));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn of_campaign(campaign: &Campaign) -> Result<Report, (usize, CircleError)> {
    let runs: Result<Vec<_>, _> = campaign
        .runs
        .par_iter()
        .enumerate()
        .map(|(index, run)| of_run(run, None).map_err(|error| (index, error)))
        .collect();
    let runs = runs?;
    let groups = iso230::pairs(campaign.runs.iter().map(of));
    let keep = |run: &Run| {
        Kept::of(
            run.samples.angle_rad.clone(),
            run.samples.deviation_m.clone(),
        )
    };
    let iso: Vec<Vec<Iso230>> = groups
        .par_iter()
        .map(|group| {
            let pair = |[cw, ccw]: &[Option<usize>; 2]| {
                let [a, b] = [cw, ccw].map(|i| i.map(|i| (&runs[i], keep(&campaign.runs[i]))));
                iso230::of_pair(
                    a.as_ref().map(|(r, k)| (*r, k)),
                    b.as_ref().map(|(r, k)| (*r, k)),
                )
            };
            group.iter().filter_map(pair).collect()
        })
        .collect();
    let frames = vec![None; runs.len()];
    let (name, machine) = (campaign.name.clone(), campaign.machine.clone());
    Ok(Report {
        name,
        machine,
        runs,
        iso230_4: iso.concat(),
        frames,
        temperature_half_range_k: half_range(campaign.runs.iter().map(|r| r.temperature_c)),
        repeatability_m: campaign.repeatability_m,
        notes: Vec::new(),
    })
}

fn of(run: &Run) -> (f64, f64, crate::campaign::Direction) {
    (run.radius_m, run.feed_m_s, run.direction)
}

/// Half the range of what is stated; `None` if nothing is.
fn half_range(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let stated: Vec<f64> = values.flatten().collect();
    let low = stated.iter().copied().fold(f64::INFINITY, f64::min);
    let high = stated.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (high >= low).then_some(0.5 * (high - low))
}

/// What is left of a run when its samples are gone.
struct Done {
    index: usize,
    analysis: RunAnalysis,
    kept: Kept,
    loaded: Loaded,
}

/// A pair: its figures and its runs.
type Pair = (Option<Iso230>, Vec<Done>);

/// Analysis of a campaign on disk: each pair of runs is read, analysed and forgotten, so that memory does not
/// grow with the samples. `progress` is called after each run.
///
/// # Errors
/// As [`crate::campaign::read`].
pub fn of_files(manifest: &Manifest, progress: impl Fn() + Sync) -> Result<Report, CampaignError> {
    let groups = iso230::pairs(
        manifest
            .runs
            .iter()
            .map(|r| (r.radius_m, r.feed_m_s, r.direction)),
    );
    let pairs: Vec<[Option<usize>; 2]> = groups.concat();
    let one = |index: usize| -> Result<Done, (usize, CampaignError)> {
        let done = read_and_analyse(manifest, index)?;
        progress();
        Ok(done)
    };
    let done: Vec<Result<Pair, (usize, CampaignError)>> = pairs
        .par_iter()
        .map(|pair| {
            let [cw, ccw] = pair.map(|i| i.map(one).transpose());
            let both = [cw?, ccw?];
            let [a, b] = [0, 1].map(|i: usize| both[i].as_ref().map(|d| (&d.analysis, &d.kept)));
            let iso = iso230::of_pair(a, b);
            let rest = both
                .into_iter()
                .flatten()
                .map(|d| Done {
                    kept: Kept::default(),
                    ..d
                })
                .collect();
            Ok((iso, rest))
        })
        .collect();
    // The first problem in file order, whichever pair met it.
    if let Some((_, error)) = done
        .iter()
        .filter_map(|r| r.as_ref().err())
        .min_by_key(|(index, _)| *index)
    {
        return Err(error.clone());
    }
    let mut together = Together::new(manifest);
    let (mut iso, mut runs) = (Vec::new(), Vec::new());
    for (pair, rest) in done.into_iter().flatten() {
        iso.extend(pair);
        runs.extend(rest);
    }
    runs.sort_by_key(|d| d.index);
    runs.iter().for_each(|d| together.add(d.index, &d.loaded));
    together.check()?;
    Ok(assembled(manifest, iso, runs))
}

/// Reads a run, analyses it and keeps what its pair needs.
fn read_and_analyse(manifest: &Manifest, index: usize) -> Result<Done, (usize, CampaignError)> {
    let mut loaded = manifest.load(index).map_err(|e| (index, e))?;
    let mut analysis = of_run(&loaded.run, loaded.turn_s).map_err(|e| {
        let at = Place::at(&manifest.runs[index].path, 2, 1);
        (
            index,
            CampaignError::new(
                at,
                Problem::NoCircle {
                    reason: e.to_string(),
                },
            ),
        )
    })?;
    if let Some(frame) = loaded.location {
        // The axes of the nearest coordinate plane, in its order.
        let normal = loaded.run.frame.normal();
        let across = (0..3).max_by(|a, b| normal[*a].total_cmp(&normal[*b]));
        let axes = [[1, 2], [2, 0], [0, 1]][across.unwrap_or(2)];
        let [a, b] = analysis.centre_m;
        analysis.centre_m = [frame.origin_m[axes[0]] + a, frame.origin_m[axes[1]] + b];
    }
    let samples = &mut loaded.run.samples;
    let kept = Kept::of(
        std::mem::take(&mut samples.angle_rad),
        std::mem::take(&mut samples.deviation_m),
    );
    Ok(Done {
        index,
        analysis,
        kept,
        loaded,
    })
}

/// The report of runs in file order.
fn assembled(manifest: &Manifest, iso: Vec<Iso230>, runs: Vec<Done>) -> Report {
    let mut report = Report {
        name: manifest.name.clone(),
        machine: manifest.machine.clone(),
        runs: Vec::with_capacity(runs.len()),
        iso230_4: iso,
        frames: Vec::with_capacity(runs.len()),
        temperature_half_range_k: half_range(runs.iter().map(|d| d.loaded.run.temperature_c)),
        repeatability_m: manifest.repeatability_m,
        notes: manifest.notes.clone(),
    };
    for done in runs {
        report.runs.push(done.analysis);
        report.frames.push(done.loaded.location);
        report.notes.extend(done.loaded.notes);
    }
    report
}
