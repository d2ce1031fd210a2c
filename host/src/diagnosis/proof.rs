//! The proof on runs left out, with its veto.
use super::duration::Clamp;
use super::explained::Explained;
use super::footing::Footing;
use super::known::Simulation;
use super::{Finding, Gain, gain, recommendation, veto};
use crate::campaign::Campaign;
use crate::model_file::ModelFile;

/// The proof on runs left out, with its veto: causes without which they are foretold better are taken out.
pub(super) fn prove(
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
        let best = fewer_causes(found)
            .map(|fewer| (measure(&fewer), fewer))
            .min_by(|a, b| a.0.extended_rms_um.total_cmp(&b.0.extended_rms_um));
        let Some((better, fewer)) = best else { break };
        (gain, *found) = (better, fewer);
    }
    Some(gain).filter(|gain| gain.folds != [0, 0])
}

/// The same with one cause less: of the chosen ones, and of those that have evidence of their own.
fn fewer_causes(found: &Explained) -> impl Iterator<Item = Explained> {
    let without_item = |item: usize| {
        let mut fewer = found.clone();
        veto::take_out(&mut fewer, item);
        fewer
    };
    let without_teeth = |index: usize| {
        let mut fewer = found.clone();
        fewer.teeth.remove(index);
        fewer
    };
    let items: Vec<usize> = found.stated().collect();
    items
        .into_iter()
        .map(without_item)
        .chain((0..found.teeth.len()).map(without_teeth))
}

/// Whether a model holds something that can be called real: causes that are proven on runs left out, or, without any, a
/// servo that foretells them better than no model.
pub(super) fn is_worth_writing(
    findings: &[Finding],
    model: &ModelFile,
    gain: Option<&Gain>,
) -> bool {
    let Some(gain) = gain else { return false };
    if findings.is_empty() {
        model.servo.response().a_s2 != 0.0 && gain.baseline_rms_um < gain.no_model_rms_um
    } else {
        recommendation::is_proven(gain)
    }
}
