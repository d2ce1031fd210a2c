//! What the simulation gets wrong, and why.
//!
//! A campaign is prepared ([`survey`]), its noise and its scatter between runs are measured ([`spread`]),
//! causes and nameless patterns compete for it ([`search`], [`mod@explain`]) in their best shapes ([`shape`],
//! [`tangent`]); tones in time ([`tone`]), teeth at
//! low speed ([`roughness`]) and the duration of the turns ([`duration`]) are looked at for themselves. What
//! is found is stated with its doubts ([`verdict`], [`unexplained`]) and proven on runs left out ([`veto`], [`gain`]).
//! What is left must be noise ([`omnibus`]). Before all this come what a session brings along: an override for all runs
//! ([`feed_override`]), a spoilt run ([`influence`]), a delay that is not known ([`delay`]).
pub mod angular_bins;
pub mod arm;
pub mod at_work;
pub mod baseline;
mod by_slide;
mod claims;
pub mod delay;
pub mod design_column;
pub mod duration;
pub mod explain;
pub mod explained;
pub mod feed_override;
pub mod finding;
mod footing;
pub mod gain;
pub mod gear;
pub mod gram;
pub mod hypothesis;
pub mod influence;
mod known;
pub mod like_arm;
pub mod linear;
pub mod low_orders;
pub mod material;
pub mod misfit;
pub mod omnibus;
mod other_way;
pub mod pattern;
pub mod picture;
pub mod pitch;
pub mod products;
mod proof;
pub mod propose;
pub mod recommendation;
pub mod residual_waves;
pub mod roughness;
pub mod run_order;
pub mod search;
mod session;
pub mod shape;
mod simplex;
mod spectrum;
pub mod spread;
pub mod statement;
mod static_size;
pub mod status;
pub mod survey;
pub mod tangent;
pub mod tone;
pub mod unexplained;
pub mod vector;
pub mod verdict;
pub mod veto;

pub use at_work::as_uncorrected;
pub use delay::Delay;
pub use finding::{Estimate, Finding, Unexplained};
pub use gain::Gain;
pub use influence::LeftOut;
pub use recommendation::{Action, Recommendation};
pub use status::Status;

use crate::campaign::{Campaign, Run};
use crate::model_file::ModelFile;
use crate::simulation::machine::MachineError;
use claims::Stated;
use delay::{Explanation, explain_all};
use duration::Durations;
use explained::Explained;
use footing::Footing;
use known::Simulation;
use serde::Serialize;
use session::Session;
use survey::Survey;

pub use footing::ASSUMED_REPEATABILITY_M;

/// What a diagnosis may be told.
#[derive(Clone, Debug)]
pub struct Options {
    /// The simulation to start from; without it one servo lag with fitted kv.
    pub model: Option<ModelFile>,
    /// The model whose table was at work while these circles were measured.
    pub corrected_by: Option<ModelFile>,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Known scatter of the size between runs of one circle, m; that of the campaign where it states one.
    pub repeatability_m: Option<f64>,
    /// Looks at every run, spoilt or not.
    pub keep_all: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            model: None,
            corrected_by: None,
            seed: 1,
            repeatability_m: None,
            keep_all: false,
        }
    }
}

/// The simulation as it stood.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Baseline {
    /// What it is, in words.
    pub name: String,
    /// Its root mean square error on runs left out, µm.
    pub heldout_rms_um: f64,
}

/// The simulation as extended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Extended {
    /// Its root mean square error on runs left out, µm.
    pub heldout_rms_um: f64,
}

/// The whole diagnosis, in the contract's form.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// Noise of a sample, µm.
    pub noise_um: f64,
    /// Scatter of the size between runs, µm.
    pub spread_um: f64,
    /// Where it started.
    pub baseline: Baseline,
    /// What was found, largest share first.
    pub findings: Vec<Finding>,
    /// What has no name.
    pub unexplained: Unexplained,
    /// Where it ended.
    pub extended: Extended,
    /// 100·(1 − extended/baseline) of the root mean square errors on runs left out.
    pub gain_percent: f64,
    /// The gain in detail; nothing where no run can be left out.
    pub gain: Option<Gain>,
    /// The misfit of the baseline, by kind.
    pub misfit: misfit::Misfit,
    /// What these runs cannot tell, and what is missing.
    pub cannot_tell: Vec<String>,
    /// What was taken otherwise than the campaign says, in words.
    pub notes: Vec<String>,
    /// Runs that were not looked at.
    pub left_out: Vec<LeftOut>,
    /// Delay of the machine behind its command, where the circles show it.
    pub delay_s: Option<Delay>,
    /// The one thing to do now.
    pub recommendation: Recommendation,
    /// Whether the extended model was written to a file; who writes it says so.
    pub model_written: bool,
    /// Whether there is anything in the model that can be called real: without it no file is written.
    #[serde(skip)]
    pub worth_writing: bool,
    /// Whether a table was at work whose model was not given: only what it leaves is known.
    #[serde(skip)]
    pub at_work: bool,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// The extended model.
    #[serde(skip)]
    pub model: ModelFile,
    /// Run by run, what the plots of a report draw.
    #[serde(skip)]
    pub picture: Vec<picture::RunPicture>,
}

/// Why a campaign cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiagnosisError {
    /// The given model cannot be simulated.
    #[error("the model cannot be simulated: {0}")]
    Model(#[from] MachineError),
    /// Nothing to look at.
    #[error("the campaign has no runs with at least 16 samples")]
    Empty,
}

/// Fewest samples of a run that can show a form.
const FEWEST_SAMPLES: usize = 16;

/// Diagnoses a campaign.
///
/// # Errors
/// No runs, or a given model that cannot be simulated.
///
/// ```
/// use giotto::diagnosis::{Action, Options, Status, diagnose};
/// use giotto::simulation::{self, Plan};
/// # use std::path::Path;
/// // A machine whose X is not square to Y by 60 µm/m.
/// let plan = Plan::parse(
///     "[machine]\nboth = { kv_per_s = 50.0 }\nsquareness_um_per_m = 60.0\n\
///      [grid]\nradii_mm = [50.0, 100.0, 150.0]\nfeeds_mm_s = [20.0, 100.0, 300.0]",
///     Path::new("plan.toml"),
/// )?;
/// let found = diagnose(&simulation::campaign(&plan, 1), &Options::default())?;
/// let first = &found.findings[0];
/// assert_eq!(first.cause.id(), "squareness");
/// assert_eq!(first.status, Status::Certain);
/// let [low, high] = first.estimate.ci95;
/// assert!(low < 60.0 && 60.0 < high && high - low < 10.0);
/// // What it says is to be done something about.
/// assert_ne!(found.recommendation.action, Action::Nothing);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn diagnose(campaign: &Campaign, options: &Options) -> Result<Diagnosis, DiagnosisError> {
    // From within the pool: who stands outside waits for a thread to wake up each time that work is shared.
    rayon::scope(|_| match &options.corrected_by {
        Some(model) => at_work::diagnose(campaign, model, options),
        None => {
            let mut diagnosis = within_pool(campaign, options)?;
            if campaign.table.is_some() {
                at_work::withhold(&mut diagnosis);
            }
            Ok(diagnosis)
        }
    })
}

fn within_pool(campaign: &Campaign, options: &Options) -> Result<Diagnosis, DiagnosisError> {
    let long_enough = |run: &Run| run.samples.deviation_m.len() >= FEWEST_SAMPLES;
    if !campaign.runs.iter().any(long_enough) {
        return Err(DiagnosisError::Empty);
    }
    let session = Session::of(campaign, options);
    let baseline = Simulation::of(&session.campaign, options)?;
    let seen = baseline.taken_from(&session.campaign);
    let durations = duration::read(&session.campaign);
    let survey = if baseline.known.is_empty() {
        session.survey
    } else {
        Survey::new(&seen)
    };
    let ground = Footing::of(
        &session.campaign,
        &durations,
        baseline.start.repeatability_m,
    );
    let (mut explanation, like_arm) = explained(&survey, &baseline, &ground);
    let clamp = match durations {
        Durations::Clamped(clamp) if !like_arm && !known::knows_clamp(&baseline.known) => {
            Some(clamp)
        }
        _ => None,
    };
    let ties = verdict::ties(&explanation.found);
    explanation.found.tied = ties.iter().map(|(item, _)| *item).collect();
    let proof = proof::prove(
        &seen,
        &mut explanation.found,
        &baseline,
        clamp,
        &ground,
        options.seed,
    );
    let found = &explanation.found;
    let stated = claims::state(
        &explanation,
        &session.campaign,
        clamp,
        &durations,
        &ground,
        proof.as_ref(),
    );
    let cannot_tell = claims::open_questions(ground.cannot_tell, &explanation, &ties, like_arm);
    let model = extended_model(&session.campaign, &survey, found, &baseline, &stated);
    let picture = pictured(&session.campaign, &session.places, &seen, found);
    // Where no run can be left out, what the search leaves of the runs it saw.
    let in_sample_um = misfit::rms_um(found);
    let heldout_um = |of: &dyn Fn(&Gain) -> f64| proof.as_ref().map_or(in_sample_um, of);
    let mut diagnosis = Diagnosis {
        noise_um: found.spread.noise_m() * 1e6,
        spread_um: found.spread.order_m2[0].sqrt() * 1e6,
        baseline: Baseline {
            name: baseline.name,
            heldout_rms_um: heldout_um(&|gain| gain.baseline_rms_um),
        },
        unexplained: stated.unexplained,
        extended: Extended {
            heldout_rms_um: heldout_um(&|gain| gain.extended_rms_um),
        },
        gain_percent: proof.as_ref().map_or(0.0, |gain| gain.percent),
        misfit: misfit::split(found),
        worth_writing: proof::is_worth_writing(&stated.findings, &model, proof.as_ref()),
        gain: proof,
        cannot_tell,
        notes: session.notes,
        left_out: session.left_out,
        delay_s: explanation.delay,
        recommendation: Recommendation::default(),
        model_written: false,
        at_work: false,
        seed: options.seed,
        picture,
        model,
        findings: stated.findings,
    };
    recommend(&mut diagnosis, options.model.is_some(), like_arm);
    Ok(diagnosis)
}

/// What explains the survey, without causes that it cannot carry, and whether the machine looks like an arm.
fn explained(survey: &Survey, baseline: &Simulation, ground: &Footing) -> (Explanation, bool) {
    let mut explanation = explain_all(survey, &baseline.start, baseline.delay_s);
    let like_arm = like_arm::is_like_arm(&explanation.found);
    if like_arm {
        like_arm::take_out_slides(&mut explanation.found);
    }
    by_slide::split(&mut explanation.found);
    if ground.measured_scatter {
        omnibus::take_out_pieces(&mut explanation.found);
    }
    (explanation, like_arm)
}

/// Adds the one thing to do; `given` says whether it started from a model of the user's.
fn recommend(diagnosis: &mut Diagnosis, given: bool, like_arm: bool) {
    diagnosis.recommendation = recommendation::of(diagnosis);
    if given && diagnosis.recommendation.action == recommendation::Action::Nothing {
        diagnosis.recommendation.words =
            "nothing is to be added to the given model: it explains these circles".to_owned();
    }
    if like_arm {
        diagnosis.unexplained.present = true;
        diagnosis.recommendation = like_arm::recommendation();
    }
}

/// What the plots of a report draw, run by run; `places` are those of the runs in the given campaign.
fn pictured(
    campaign: &Campaign,
    places: &[usize],
    seen: &Campaign,
    found: &Explained,
) -> Vec<picture::RunPicture> {
    let mut picture = picture::draw(campaign, seen, found);
    for run in &mut picture {
        run.index = places[run.index];
    }
    picture
}

/// What was known and what was found, as one model with the delay with which its gain was proven.
fn extended_model(
    campaign: &Campaign,
    survey: &Survey,
    found: &Explained,
    baseline: &Simulation,
    stated: &Stated,
) -> ModelFile {
    let known = baseline.known.iter().cloned();
    let effects = known
        .chain(stated.findings.iter().flat_map(|f| f.effects.clone()))
        .collect();
    let delay_s = survey.inferred().then_some(found.lag.tau_s.max(0.0));
    gain::extended_model(campaign, found, effects, delay_s)
}
