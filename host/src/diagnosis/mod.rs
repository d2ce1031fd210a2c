//! What the simulation gets wrong, and why.
//!
//! A campaign is prepared ([`survey`]), its noise and its scatter between runs are measured ([`spread`]),
//! causes and nameless patterns compete for it ([`search`], [`mod@explain`]) in their best shapes ([`shape`],
//! [`tangent`]); tones in time ([`tone`]), teeth at
//! low speed ([`roughness`]) and the duration of the turns ([`duration`]) are looked at for themselves. What
//! is found is stated with its doubts ([`verdict`], [`unexplained`]) and proven on runs left out ([`gain`]).
pub mod baseline;
pub mod basis;
pub mod column;
pub mod duration;
pub mod explain;
pub mod explained;
pub mod finding;
pub mod gain;
pub mod item;
pub mod ledger;
pub mod linear;
pub mod material;
pub mod misfit;
pub mod pattern;
pub mod picture;
pub mod pitch;
pub mod places;
pub mod products;
pub mod propose;
pub mod roughness;
pub mod search;
pub mod shape;
pub mod spread;
pub mod survey;
pub mod tangent;
pub mod tone;
pub mod unexplained;
pub mod vector;
pub mod verdict;

pub use finding::{Estimate, Finding, Unexplained};
pub use gain::Gain;

use crate::campaign::Campaign;
use crate::causes::Effect;
use crate::model_file::{ModelFile, Servo};
use crate::simulation::machine::{Machine, MachineError};
use baseline::{Size, fit_lag};
use duration::Durations;
use explain::{Start, explain};
use serde::Serialize;
use survey::{Response, believed_feed_m_s};

/// What a diagnosis may be told.
#[derive(Clone, Debug)]
pub struct Options {
    /// The simulation to start from; without it one servo lag with fitted kv.
    pub model: Option<ModelFile>,
    /// Seed of the bootstrap.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            model: None,
            seed: 1,
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

/// Fewest runs whose scatter says anything.
const FEWEST_RUNS: usize = 6;

/// Diagnoses a campaign.
///
/// # Errors
/// No runs, or a given model that cannot be simulated.
pub fn diagnose(campaign: &Campaign, options: &Options) -> Result<Diagnosis, DiagnosisError> {
    // From within the pool: who stands outside waits for a thread to wake up each time that work is shared.
    rayon::scope(|_| within_pool(campaign, options))
}

fn within_pool(campaign: &Campaign, options: &Options) -> Result<Diagnosis, DiagnosisError> {
    if !campaign
        .runs
        .iter()
        .any(|run| run.samples.deviation_m.len() >= 16)
    {
        return Err(DiagnosisError::Empty);
    }
    let given = options
        .model
        .as_ref()
        .map(Machine::from_model)
        .transpose()?;
    let programmed: Vec<Size> = campaign
        .runs
        .iter()
        .map(|run| Size::of(run, run.feed_m_s))
        .collect();
    let believed: Vec<Size> = campaign
        .runs
        .iter()
        .map(|run| Size::of(run, believed_feed_m_s(run)))
        .collect();
    let (start, name) = match &options.model {
        Some(model) => (
            Start {
                response: Response::of(&model.servo),
                own_fourth_order: !matches!(model.servo, Servo::Lag { .. }),
            },
            format!("the given model of {}", model.machine),
        ),
        None => {
            let response = fit_lag(&believed);
            let name = if response.a_s2 > 0.0 {
                format!("one servo lag, kv = {:.1} /s", response.a_s2.powf(-0.5))
            } else {
                "an ideal servo (circles do not shrink with speed)".to_string()
            };
            (
                Start {
                    response,
                    own_fourth_order: false,
                },
                name,
            )
        }
    };
    let known = options
        .model
        .as_ref()
        .map(|model| model.effects.clone())
        .unwrap_or_default();
    let cleaned = without_known(campaign, &start, &known);
    let campaign_seen = cleaned.as_ref().unwrap_or(campaign);
    let durations = duration::read(campaign);
    let clamp = match durations {
        Durations::Clamped(clamp) if !knows_clamp(&known) => Some(clamp),
        _ => None,
    };
    let found = explain(campaign_seen, &start);
    let clamp_energy = clamp.map(|clamp| {
        let energy = campaign
            .runs
            .iter()
            .zip(programmed.iter().zip(&believed))
            .map(|(run, (p, b))| {
                let off = run.radius_m
                    * (found.response.gain(p.omega_rad_s) - found.response.gain(b.omega_rad_s));
                off * off * run.samples.deviation_m.len() as f64
            })
            .sum::<f64>();
        (clamp, energy)
    });
    let mut cannot_tell = poverty(campaign);
    // Labels that the clock contradicts, and not as a clamp would: nothing that depends on them can be believed.
    let contradicted =
        matches!(durations, Durations::Unexplained { runs, .. } if 4 * runs > campaign.runs.len());
    let too_poor = campaign.runs.len() < FEWEST_RUNS || contradicted;
    if contradicted {
        cannot_tell.push("the turns did not last as the programmed radius and feed say: check which file belongs to which run".into());
    }
    let findings = if too_poor {
        Vec::new()
    } else {
        verdict::findings(&found, clamp_energy)
    };
    let unexplained = if too_poor {
        Unexplained::default()
    } else {
        unexplained::describe(&found, &durations)
    };
    let effects: Vec<Effect> = known
        .iter()
        .cloned()
        .chain(findings.iter().flat_map(|f| f.effects.clone()))
        .collect();
    let gain = (!too_poor)
        .then(|| gain::measure(campaign_seen, &found, given.as_ref(), clamp, options.seed));
    let gain = gain.filter(|gain| gain.folds != [0, 0]);
    let in_sample = misfit::rms_um(&found);
    let (heldout_base, heldout_extended) = gain.as_ref().map_or((in_sample, in_sample), |gain| {
        (gain.baseline_rms_um, gain.extended_rms_um)
    });
    Ok(Diagnosis {
        noise_um: found.spread.noise_m() * 1e6,
        spread_um: found.spread.order_m2[0].sqrt() * 1e6,
        baseline: Baseline {
            name,
            heldout_rms_um: heldout_base,
        },
        unexplained,
        extended: Extended {
            heldout_rms_um: heldout_extended,
        },
        gain_percent: gain.as_ref().map_or(0.0, |gain| gain.percent),
        misfit: misfit::split(&found),
        gain,
        cannot_tell,
        seed: options.seed,
        picture: picture::draw(campaign, campaign_seen, &found),
        model: gain::extended_model(campaign, &found, effects),
        findings,
    })
}

fn knows_clamp(known: &[Effect]) -> bool {
    known
        .iter()
        .any(|effect| effect.cause() == crate::causes::Cause::FeedClamp)
}

/// The campaign with what the given effects do taken out, by the simulation with and without them.
fn without_known(campaign: &Campaign, start: &Start, known: &[Effect]) -> Option<Campaign> {
    if known.is_empty() {
        return None;
    }
    let plain = gain::machine(&start.response, &[], None);
    let with = gain::machine(&start.response, known, None);
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
fn poverty(campaign: &Campaign) -> Vec<String> {
    let distinct = |key: &dyn Fn(&crate::campaign::Run) -> f64| {
        let mut values: Vec<f64> = campaign.runs.iter().map(key).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * b.abs().max(1e-12));
        values.len()
    };
    let mut out = Vec::new();
    if campaign.runs.len() < FEWEST_RUNS {
        out.push(format!(
            "{} run(s): the scatter between runs cannot be measured, so nothing can be called real; measure at least {FEWEST_RUNS}, better 26",
            campaign.runs.len()
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
