//! The simulation that a diagnosis starts from, and what its effects do to a campaign.
use super::explain::Start;
use super::footing::{ASSUMED_REPEATABILITY_M, FEWEST_RUNS};
use super::{DiagnosisError, Options, arm, gain};
use crate::campaign::Campaign;
use crate::causes::{Effect, Evidence};
use crate::model_file::{ModelFile, Servo};
use crate::simulation::Arm;
use crate::simulation::machine::Machine;

/// The simulation as it stands.
pub(super) struct Simulation {
    pub(super) start: Start,
    pub(super) name: String,
    /// As a machine without its effects, if a model was given.
    pub(super) given: Option<Machine>,
    /// Effects of the given model.
    pub(super) known: Vec<Effect>,
    /// Delay of the given model, s.
    pub(super) delay_s: Option<f64>,
}

impl Simulation {
    pub(super) fn of(campaign: &Campaign, options: &Options) -> Result<Self, DiagnosisError> {
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

    /// The campaign with what the given effects do taken out, by the simulation with and without them.
    pub(super) fn taken_from(&self, campaign: &Campaign) -> Campaign {
        if self.known.is_empty() {
            return campaign.clone();
        }
        let machine = |effects: &[Effect]| {
            let response = &self.start.response;
            gain::machine(response, effects, self.delay_s, campaign.kinematics)
        };
        let (plain, with) = (machine(&[]), machine(&self.known));
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
        out
    }
}

pub(super) fn knows_clamp(known: &[Effect]) -> bool {
    known
        .iter()
        .any(|effect| effect.cause().model().evidence() == Evidence::Duration)
}
