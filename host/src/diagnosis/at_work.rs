//! The step after a correction: circles that a table has corrected show the remainder of its model alone. A model of the
//! remainder would take the correction away again, so what the table did is counted back in first; what is found then
//! is the machine as it is without a table.
use super::recommendation::{Action, CAMPAIGN, Recommendation};
use super::{Diagnosis, DiagnosisError, Options};
use crate::campaign::{Campaign, Samples};
use crate::model_file::ModelFile;
use crate::simulation::machine::{Machine, MachineError};
use crate::simulation::{CircleTest, Trace, circle};
use std::f64::consts::{PI, TAU};

/// Share by which a run may lie outside the ranges of the model and still be corrected: rounding of the file.
const ROUNDING: f64 = 1e-6;
/// Samples of a simulated turn: a quarter of a degree.
const SAMPLES: usize = 1440;

/// The campaign as it would have been measured without the table of `model`: to every run inside the model's ranges is added
/// what the model foretells and a controller corrects. Runs outside were not corrected and stay.
///
/// # Errors
/// A model that cannot be simulated.
pub fn as_uncorrected(campaign: &Campaign, model: &ModelFile) -> Result<Campaign, MachineError> {
    let mut corrected = model.clone();
    corrected
        .effects
        .retain(|effect| effect.cause().model().is_compensable(effect));
    let machine = Machine::from_model(&corrected)?;
    let within = |[low, high]: [f64; 2], si: f64| {
        let milli = si * 1e3;
        milli >= low * (1.0 - ROUNDING) && milli <= high * (1.0 + ROUNDING)
    };
    let mut out = campaign.clone();
    // What was counted back in is no longer corrected.
    out.table = None;
    for run in &mut out.runs {
        let valid = &model.valid;
        if !within(valid.radius_mm, run.radius_m) || !within(valid.feed_mm_s, run.feed_m_s) {
            continue;
        }
        let test = CircleTest {
            samples: Some(SAMPLES),
            ..CircleTest::of(run)
        };
        add(&circle(&machine, &test), run.sign(), &mut run.samples);
    }
    Ok(out)
}

/// Diagnoses the machine as it is without its table, and says so.
pub(super) fn diagnose(
    campaign: &Campaign,
    model: &ModelFile,
    options: &Options,
) -> Result<Diagnosis, DiagnosisError> {
    let whole = as_uncorrected(campaign, model)?;
    let mut diagnosis = super::within_pool(&whole, options)?;
    diagnosis.notes.push(
        "a table was at work: what it corrects was counted back in, and what is listed is the machine without it; the \
         extended model replaces that table's"
            .to_owned(),
    );
    let left = super::within_pool(campaign, options)?;
    if left.findings.is_empty() && !left.unexplained.present && !left.worth_writing {
        diagnosis.recommendation = Recommendation {
            action: Action::Nothing,
            words:
                "nothing is to be done: these circles show nothing that the table at work leaves"
                    .to_owned(),
            command: None,
        };
    }
    Ok(diagnosis)
}

/// Of a corrected machine whose model was not given only the remainder is known: no model is written of it.
pub(super) fn withhold(diagnosis: &mut Diagnosis) {
    diagnosis.at_work = true;
    diagnosis.worth_writing = false;
    diagnosis.notes.push(
        "a table was at work: what is listed is what it leaves, and a model of that alone would take the correction away"
            .to_owned(),
    );
    let flashed = diagnosis.recommendation.action == Action::Flash;
    if flashed {
        diagnosis.recommendation = Recommendation {
            action: Action::Look,
            words: "look for the model whose table was at work and diagnose with it: what is left is then added to it"
                .to_owned(),
            command: Some(format!("giotto diagnose {CAMPAIGN} --corrected-by MODEL.toml")),
        };
    }
}

/// Adds what is foretold at the angle of each sample: that of the command where it was inferred, else that of the place.
fn add(foretold: &Trace, sign: f64, samples: &mut Samples) {
    let n = foretold.deviation_m.len();
    let start = foretold.angle_rad.first().copied().unwrap_or(0.0);
    let at = |values: &[f64], angle: f64| {
        let place = (sign * (angle - start)).rem_euclid(TAU) / TAU * n as f64;
        let (k, part) = (place.floor() as usize % n, place.fract());
        values[k] + part * (values[(k + 1) % n] - values[k])
    };
    let places = foretold.position_m.iter().zip(&foretold.angle_rad);
    let behind: Vec<f64> = places
        .map(|([x, y], command)| (y.atan2(*x) - command + PI).rem_euclid(TAU) - PI)
        .collect();
    for (y, angle) in samples.deviation_m.iter_mut().zip(&samples.angle_rad) {
        let mut command = *angle;
        if !samples.angle_inferred {
            // The place lies behind its command by little: twice is enough.
            for _ in 0..2 {
                command = angle - at(&behind, command);
            }
        }
        *y += at(&foretold.deviation_m, command);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::{self, Plan};
    use std::path::Path;

    const MODEL: &str = "format = 2\ncampaign = \"lab\"\nmachine = \"mill\"\n[servo]\nkind = \"lag\"\nkv_per_s = 40.0\n\
         [valid]\nradius_mm = [90.0, 150.0]\nfeed_mm_s = [50.0, 300.0]\n\
         [[effect]]\ncause = \"squareness\"\nplane = \"xy\"\nvalue = 80.0\nci95 = [79.0, 81.0]\n";

    /// Circles of a machine that the table leaves nothing of become those of the machine itself, inside the ranges of
    /// the model.
    #[test]
    fn what_the_table_took_away_is_back() {
        let plan = |machine: &str| {
            let text = format!(
                "[machine]\n{machine}[grid]\nradii_mm = [50.0, 100.0]\nfeeds_mm_s = [200.0]\n"
            );
            simulation::campaign(&Plan::parse(&text, Path::new("plan.toml")).unwrap(), 1)
        };
        let model = ModelFile::parse(MODEL, Path::new("model.toml")).unwrap();
        let uncorrected = as_uncorrected(&plan(""), &model).unwrap();
        let machine = "both = { kv_per_s = 40.0 }\nsquareness_um_per_m = 80.0\n";
        let itself = plan(machine);
        for (a, b) in uncorrected.runs.iter().zip(&itself.runs) {
            let pairs = || a.samples.deviation_m.iter().zip(&b.samples.deviation_m);
            let off = pairs().fold(0.0, |most, (a, b)| f64::max(most, (a - b).abs()));
            let size = pairs().fold(0.0, |most, (_, b)| f64::max(most, b.abs()));
            if a.radius_m > 0.09 {
                assert!(off < 0.01 * size && size > 5e-6, "{off:e} of {size:e}");
            } else {
                assert!(off > 0.5 * size, "outside nothing is added: {off:e}");
            }
        }
    }
}
