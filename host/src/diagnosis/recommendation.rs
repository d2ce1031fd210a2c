//! The one thing to do now, and what it should bring.
use super::status::Status;
use super::{Diagnosis, Gain};
use serde::Serialize;

/// What kind of thing it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// Put the extended model on the controller.
    Flash,
    /// Set something right on the machine.
    Adjust,
    /// Measure what is missing.
    Measure,
    /// Look at what matches no cause.
    Look,
    /// Nothing.
    #[default]
    Nothing,
}

/// The recommendation.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recommendation {
    /// What kind of thing to do.
    pub action: Action,
    /// In words, without commands.
    pub words: String,
    /// The command that does it or leads to it; `None`: it is done by hand. [`CAMPAIGN`] and [`MODEL`] stand for files that
    /// only the caller knows.
    pub command: Option<String>,
}

/// Stands for the campaign in a command.
pub const CAMPAIGN: &str = "CAMPAIGN";
/// Stands for the file of the extended model in a command.
pub const MODEL: &str = "EXTENDED.toml";

/// Whether a model is proven: the whole interval of its gain is above 0, and it foretells runs left out better than the
/// simulation as it stood, the paper's β1 and β2 alone, and no model.
pub fn is_proven(gain: &Gain) -> bool {
    gain.ci95_percent[0] > 0.0
        && gain.extended_rms_um < gain.baseline_rms_um
        && gain.extended_rms_um < gain.beta_rms_um
        && gain.extended_rms_um < gain.no_model_rms_um
}

const PLAN: &str = "giotto plan CAMPAIGN";

/// What to do about a diagnosis.
pub fn of(d: &Diagnosis) -> Recommendation {
    let say = |action, words: String, command: Option<&str>| Recommendation {
        action,
        words,
        command: command.map(str::to_string),
    };
    let proven = d.gain.as_ref().is_some_and(is_proven);
    let Some(first) = d.findings.first() else {
        return match (d.unexplained.present, &d.gain, d.cannot_tell.first()) {
            (true, ..) => say(
                Action::Look,
                "look at the place and the law of what is unexplained; further runs would narrow it down".into(),
                Some(PLAN),
            ),
            (false, None, Some(missing)) => say(Action::Measure, missing.clone(), Some(PLAN)),
            _ => say(
                Action::Nothing,
                "nothing is to be done beyond the radius model, which giotto fit makes where the circles change with speed".into(),
                None,
            ),
        };
    };
    if first.status == Status::Provisional && !proven {
        return say(
            Action::Measure,
            format!(
                "these circles show {} first ({:.1} µm at most), provisionally: measure the shortest session that makes it certain",
                first.title(),
                first.effect_um.max
            ),
            Some(PLAN),
        );
    }
    if !d.findings.iter().any(|f| f.compensable) {
        return say(
            Action::Adjust,
            format!(
                "{} ({:.1} µm rms of the circles' error, {:.0} % of the misfit)",
                first.remedy, first.rms_um, first.share_percent
            ),
            None,
        );
    }
    if !proven {
        return say(
            Action::Adjust,
            format!(
                "{}; the extended model is not proven on runs left out, so there is nothing to flash",
                first.remedy
            ),
            None,
        );
    }
    let expected = match expected_um(d) {
        Some([now, then]) if then < now => {
            format!(
                ": circles that it has not seen are off by {now:.1} µm rms now, by {then:.1} µm expected with it"
            )
        }
        _ => String::new(),
    };
    say(
        Action::Flash,
        format!("write the extended model into the controller{expected}"),
        Some("giotto flash EXTENDED.toml --port PORT"),
    )
}

/// Root mean square error of circles on runs left out, µm: as measured, and with the correction, which leaves
/// what the extended model does not predict and what it predicts but no controller corrects.
pub fn expected_um(d: &Diagnosis) -> Option<[f64; 2]> {
    let gain = d.gain.as_ref()?;
    let stays: f64 = d
        .findings
        .iter()
        .filter(|f| !f.compensable)
        .map(|f| f.rms_um.powi(2))
        .sum();
    Some([
        gain.no_model_rms_um,
        (gain.extended_rms_um.powi(2) + stays).sqrt(),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_is_proven_only_against_all_three() {
        let gain = Gain {
            extended_rms_um: 1.0,
            baseline_rms_um: 2.0,
            beta_rms_um: 2.0,
            no_model_rms_um: 5.0,
            floor_rms_um: 0.9,
            percent: 50.0,
            ci95_percent: [30.0, 60.0],
            of_perfect_percent: 90.0,
            folds: [3, 4],
        };
        assert!(is_proven(&gain));
        assert!(!is_proven(&Gain {
            ci95_percent: [-1.0, 60.0],
            ..gain.clone()
        }));
        assert!(!is_proven(&Gain {
            beta_rms_um: 0.9,
            ..gain.clone()
        }));
        assert!(!is_proven(&Gain {
            no_model_rms_um: 0.9,
            ..gain
        }));
    }
}
