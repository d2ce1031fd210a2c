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
pub mod delay;
pub mod design_column;
pub mod duration;
pub mod explain;
pub mod explained;
pub mod feed_override;
pub mod finding;
pub mod gain;
pub mod gear;
pub mod gram;
pub mod hypothesis;
pub mod influence;
pub mod like_arm;
pub mod linear;
pub mod low_orders;
pub mod material;
pub mod misfit;
pub mod omnibus;
pub mod pattern;
pub mod picture;
pub mod pitch;
pub mod products;
pub mod propose;
pub mod recommendation;
pub mod residual_waves;
pub mod roughness;
pub mod run_order;
pub mod search;
pub mod shape;
pub mod spread;
pub mod statement;
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
use crate::causes::{Effect, Evidence};
use crate::model_file::{ModelFile, Servo};
use crate::simulation::Arm;
use crate::simulation::machine::{Machine, MachineError};
use baseline::Size;
use delay::{Explanation, explain_all};
use duration::{Clamp, Durations};
use explain::Start;
use explained::Explained;
use serde::Serialize;
use status::Ground;
use survey::{Survey, believed_feed_m_s};

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
/// Fewest runs whose scatter says anything.
const FEWEST_RUNS: usize = 6;

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
    let baseline = Simulation::of(&session, options)?;
    let seen = session.without(&baseline);
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
    let mut explanation = explain_all(&survey, &baseline.start, baseline.delay_s);
    let like_arm = like_arm::is_like_arm(&explanation.found);
    if like_arm {
        like_arm::take_out_slides(&mut explanation.found);
    }
    let clamp = match durations {
        Durations::Clamped(clamp) if !like_arm && !knows_clamp(&baseline.known) => Some(clamp),
        _ => None,
    };
    let ties = verdict::ties(&explanation.found);
    explanation.found.tied = ties.iter().map(|(item, _)| *item).collect();
    let proof = prove(
        &seen,
        &mut explanation.found,
        &baseline,
        clamp,
        &ground,
        options.seed,
    );
    let found = &explanation.found;
    let stated = state(
        &explanation,
        &session.campaign,
        clamp,
        &durations,
        &ground,
        proof.as_ref(),
    );
    let cannot_tell = open_questions(ground.cannot_tell, &explanation, &ties, like_arm);
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
        worth_writing: is_worth_writing(&stated.findings, &model, proof.as_ref()),
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
    recommend(&mut diagnosis, like_arm);
    Ok(diagnosis)
}

/// Adds the one thing to do.
fn recommend(diagnosis: &mut Diagnosis, like_arm: bool) {
    diagnosis.recommendation = recommendation::of(diagnosis);
    if like_arm {
        diagnosis.unexplained.present = true;
        diagnosis.recommendation = like_arm::recommendation();
    }
}

/// What these runs leave open, the weightiest first.
fn open_questions(
    poverty: Vec<String>,
    explanation: &Explanation,
    ties: &[(usize, crate::causes::Cause)],
    like_arm: bool,
) -> Vec<String> {
    let of_tie = |(item, other): &(usize, crate::causes::Cause)| {
        tie_words(&explanation.found, *item, *other)
    };
    let arm = like_arm.then(|| like_arm::WORDS.to_owned());
    arm.into_iter()
        .chain(poverty)
        .chain(explanation.words())
        .chain(ties.iter().map(of_tie))
        .collect()
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

/// Whether a model holds something that can be called real: causes that are proven on runs left out, or, without any, a
/// servo that foretells them better than no model.
fn is_worth_writing(findings: &[Finding], model: &ModelFile, gain: Option<&Gain>) -> bool {
    let Some(gain) = gain else { return false };
    if findings.is_empty() {
        model.servo.response().a_s2 != 0.0 && gain.baseline_rms_um < gain.no_model_rms_um
    } else {
        recommendation::is_proven(gain)
    }
}

/// What a session brought, made ready: one override for all taken in, a spoilt run left out.
struct Session {
    campaign: Campaign,
    survey: Survey,
    /// Index in the given campaign of each run looked at.
    places: Vec<usize>,
    notes: Vec<String>,
    left_out: Vec<LeftOut>,
}

/// One run in so many may be spoilt.
const ONE_SPOILT_IN: usize = 12;

impl Session {
    fn of(campaign: &Campaign, options: &Options) -> Self {
        let mut notes = Vec::new();
        let mut campaign = match feed_override::find(campaign) {
            Some(factor) => {
                notes.push(feed_override::words(factor));
                feed_override::applied(campaign, factor)
            }
            None => campaign.clone(),
        };
        let mut places: Vec<usize> = (0..campaign.runs.len()).collect();
        let mut left_out = Vec::new();
        let mut survey = Survey::new(&campaign);
        let most = if options.keep_all {
            0
        } else {
            (campaign.runs.len() / ONE_SPOILT_IN).max(1)
        };
        while left_out.len() < most {
            let Some(spoilt) = spoilt_of(&campaign, &survey, options) else {
                break;
            };
            let run = campaign.runs.remove(spoilt.run);
            places.remove(spoilt.run);
            left_out.push(LeftOut {
                file: run.file,
                reason: influence::reason(&spoilt),
            });
            survey = Survey::new(&campaign);
        }
        Self {
            campaign,
            survey,
            places,
            notes,
            left_out,
        }
    }

    /// The campaign with what the given effects do taken out.
    fn without(&self, baseline: &Simulation) -> Campaign {
        without_known(&self.campaign, baseline).unwrap_or_else(|| self.campaign.clone())
    }
}

fn spoilt_of(campaign: &Campaign, survey: &Survey, options: &Options) -> Option<influence::Spoilt> {
    let response = match &options.model {
        Some(model) => model.servo.response(),
        None => arm::fit_lag_of(campaign),
    };
    let (runs, _) = survey.prepare(&response, 0.0);
    let data = survey::misfit(&runs);
    let profiles = angular_bins::bin_means(&runs, &data);
    let means: Vec<f64> = runs
        .iter()
        .zip(data.low())
        .map(|(run, low)| low[0] / (run.visible().max(1) as f64).sqrt())
        .collect();
    influence::find(&runs, &profiles, &means)
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

/// The simulation as it stands.
struct Simulation {
    start: Start,
    name: String,
    /// As a machine without its effects, if a model was given.
    given: Option<Machine>,
    /// Effects of the given model.
    known: Vec<Effect>,
    /// Delay of the given model, s.
    delay_s: Option<f64>,
}

impl Simulation {
    fn of(session: &Session, options: &Options) -> Result<Self, DiagnosisError> {
        let campaign = &session.campaign;
        let stated = options.repeatability_m.or(campaign.repeatability_m);
        let assumed = (campaign.runs.len() < FEWEST_RUNS).then_some(ASSUMED_REPEATABILITY_M);
        let repeatability_m = stated.or(assumed).unwrap_or(0.0);
        let Some(model) = &options.model else {
            let response = arm::fit_lag_of(campaign);
            let name = if response.a_s2 > 0.0 {
                format!("one servo lag, kv = {:.1} /s", response.a_s2.powf(-0.5))
            } else if response.a_s2 < 0.0 {
                "circles that grow with speed, as no servo lag makes them".to_string()
            } else {
                "an ideal servo (circles do not shrink with speed)".to_string()
            };
            return Ok(Self {
                start: Start {
                    response,
                    own_fourth_order: false,
                    repeatability_m,
                    more_lag_s: 0.0,
                },
                name,
                given: None,
                known: Vec::new(),
                delay_s: None,
            });
        };
        // Refuses what cannot be simulated, its effects among it.
        Machine::from_model(model)?;
        let bare = ModelFile {
            effects: Vec::new(),
            ..model.clone()
        };
        Ok(Self {
            start: Start {
                response: model.servo.response(),
                own_fourth_order: !matches!(model.servo, Servo::Lag { .. }),
                repeatability_m,
                more_lag_s: 0.0,
            },
            name: format!("the given model of {}", model.machine),
            given: Some(Machine {
                arm: model.kinematics.or(campaign.kinematics).map(Arm::sound),
                ..Machine::from_model(&bare)?
            }),
            known: model.effects.clone(),
            delay_s: model.delay_s,
        })
    }
}

/// Scatter of the size between runs that is assumed where it is neither measured nor known, m: a ballbar set up with care.
pub const ASSUMED_REPEATABILITY_M: f64 = 1.5e-6;

/// What these runs allow to be said at all.
struct Footing {
    cannot_tell: Vec<String>,
    /// Whether the labels can be believed.
    believable: bool,
    /// Whether the scatter between runs is measured.
    measured_scatter: bool,
}

impl Footing {
    fn of(campaign: &Campaign, durations: &Durations, repeatability_m: f64) -> Self {
        let mut cannot_tell = poverty(campaign, repeatability_m);
        // Labels that the clock contradicts, and not as a clamp would: nothing that depends on them can be believed.
        let contradicted = matches!(durations, Durations::Unexplained { runs, .. } if 4 * runs > campaign.runs.len());
        if contradicted {
            cannot_tell.push("the turns did not last as the programmed radius and feed say: check which file belongs to which run".into());
        }
        Self {
            cannot_tell,
            believable: !contradicted,
            measured_scatter: campaign.runs.len() >= FEWEST_RUNS,
        }
    }
}

/// The proof on runs left out, with its veto: causes without which they are foretold better are taken out.
fn prove(
    seen: &Campaign,
    found: &mut Explained,
    baseline: &Simulation,
    clamp: Option<Clamp>,
    footing: &Footing,
    seed: u64,
) -> Option<Gain> {
    if !footing.believable || !footing.measured_scatter {
        return None;
    }
    veto::apply(found);
    let measure =
        |found: &Explained| gain::measure(seen, found, baseline.given.as_ref(), clamp, seed);
    let mut gain = measure(found);
    // The simulation in the time domain has the last word, where the closed forms were too sure.
    while gain.percent < 0.0 {
        let listed: Vec<usize> = found.stated().collect();
        let without = |&item: &usize| {
            let mut fewer = found.clone();
            veto::take_out(&mut fewer, item);
            (measure(&fewer), fewer)
        };
        let best = listed
            .iter()
            .map(without)
            .min_by(|a, b| a.0.extended_rms_um.total_cmp(&b.0.extended_rms_um));
        let Some((better, fewer)) = best else { break };
        (gain, *found) = (better, fewer);
    }
    Some(gain).filter(|gain| gain.folds != [0, 0])
}

/// Two names for one thing.
fn tie_words(found: &Explained, item: usize, other: crate::causes::Cause) -> String {
    let largest = statement::largest(found, item);
    let hypothesis::Kind::Cause { cause, .. } = found.items[item].kind else {
        return String::new();
    };
    format!(
        "up to {:.1} µm are {} or {}, which do the same to these circles: {}",
        largest.max,
        cause.model().words().name,
        other.model().words().name,
        cause.model().words().next
    )
}

/// What is said.
struct Stated {
    findings: Vec<Finding>,
    unexplained: Unexplained,
}

fn state(
    explanation: &Explanation,
    campaign: &Campaign,
    clamp: Option<Clamp>,
    durations: &Durations,
    footing: &Footing,
    proof: Option<&Gain>,
) -> Stated {
    let found = &explanation.found;
    if !footing.believable {
        return Stated {
            findings: Vec::new(),
            unexplained: Unexplained::default(),
        };
    }
    let mut findings = verdict::findings(
        found,
        clamp.map(|clamp| (clamp, clamp_energy_m2(campaign, found))),
    );
    explanation.doubt(&mut findings);
    arm::name_both(&mut findings, campaign.kinematics.as_ref());
    status::settle(
        &mut findings,
        Ground {
            measured_scatter: footing.measured_scatter,
            proven: proof.is_some_and(|gain| gain.ci95_percent[0] > 0.0),
        },
    );
    // Where the scatter is assumed, an interval that holds zero shows nothing.
    let shown = |[low, high]: [f64; 2]| footing.measured_scatter || !(low <= 0.0 && high >= 0.0);
    findings.retain(|finding| {
        finding.probability > status::TIE
            && finding.cause.model().allows(finding.estimate.value)
            && shown(finding.estimate.ci95)
    });
    let unexplained = if footing.measured_scatter {
        let mut unexplained = unexplained::describe(found, durations);
        omnibus::report(&mut unexplained, &omnibus::test(found));
        unexplained
    } else {
        Unexplained::default()
    };
    Stated {
        findings,
        unexplained,
    }
}

/// What the slower feed of a clamp explains, m².
fn clamp_energy_m2(campaign: &Campaign, found: &Explained) -> f64 {
    campaign
        .runs
        .iter()
        .map(|run| {
            let gain = |feed_m_s: f64| found.response.gain(feed_m_s / run.radius_m);
            let off = run.radius_m * (gain(run.feed_m_s) - gain(believed_feed_m_s(run)));
            off * off * run.samples.deviation_m.len() as f64
        })
        .sum()
}

fn knows_clamp(known: &[Effect]) -> bool {
    known
        .iter()
        .any(|effect| effect.cause().model().evidence() == Evidence::Duration)
}

/// The campaign with what the given effects do taken out, by the simulation with and without them.
fn without_known(campaign: &Campaign, baseline: &Simulation) -> Option<Campaign> {
    if baseline.known.is_empty() {
        return None;
    }
    let machine = |effects: &[Effect]| {
        let response = &baseline.start.response;
        gain::machine(response, effects, baseline.delay_s, campaign.kinematics)
    };
    let (plain, with) = (machine(&[]), machine(&baseline.known));
    let mut out = campaign.clone();
    for run in &mut out.runs {
        let test = crate::simulation::CircleTest::of(run);
        let without = crate::simulation::circle(&plain, &test);
        let with = crate::simulation::circle(&with, &test);
        for ((y, a), b) in run
            .samples
            .deviation_m
            .iter_mut()
            .zip(&with.deviation_m)
            .zip(&without.deviation_m)
        {
            *y -= a - b;
        }
    }
    Some(out)
}

/// What the campaign is too poor to tell.
fn poverty(campaign: &Campaign, repeatability_m: f64) -> Vec<String> {
    let distinct = |key: &dyn Fn(&Run) -> f64| {
        let mut values: Vec<f64> = campaign.runs.iter().map(key).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * b.abs().max(1e-12));
        values.len()
    };
    let mut out = Vec::new();
    if campaign.runs.len() < FEWEST_RUNS {
        let runs = campaign.runs.len();
        let s = if runs == 1 { "" } else { "s" };
        out.push(format!(
            "{runs} run{s}: the scatter between runs cannot be measured and is taken as {:.1} µm (--repeatability states another), so what is listed is provisional and nothing can be called real; measure at least {FEWEST_RUNS}, better 26",
            repeatability_m * 1e6
        ));
    }
    if distinct(&|run| run.feed_m_s) < 2 {
        let size = |run: &Run| Size::of(run, run.feed_m_s).error_m;
        let mean_m =
            campaign.runs.iter().map(size).sum::<f64>() / campaign.runs.len().max(1) as f64;
        out.push(format!(
            "the circles are {:.0} µm too {}, and at one speed a servo that lags, an offset of the radius and a scale look alike",
            (mean_m * 1e6).abs(),
            if mean_m < 0.0 { "small" } else { "large" }
        ));
    }
    if distinct(&|run| run.radius_m) < 2 {
        out.push("one radius: an offset of the radius, a scale error and a misfit of the servo's size law look alike; measure a second radius, at least half or twice as large".into());
    }
    if distinct(&|run| run.feed_m_s) < 3 {
        out.push("fewer than three speeds: what grows with the speed cannot be told from what does not; measure from slow to the highest safe speed".into());
    }
    if distinct(&|run| run.sign()) < 2 {
        out.push("one direction: what flips with the direction (backlash, play, servo mismatch) cannot be told from geometry; measure both directions".into());
    }
    if campaign.runs.iter().all(|run| run.started_s.is_none()) {
        out.push("no start times: drift can only be seen in the order of the runs".into());
    }
    out
}
