//! From the chosen explanations to findings: estimate, interval, probability, share, look-alikes.
mod estimate;
mod joined;

use estimate::estimate;
use joined::join_axes;

use super::duration::Clamp;
use super::explained::{Explained, energies};
use super::finding::{Estimate, Finding, Largest};
use super::hypothesis::Kind;
use super::linear::solve;
use super::roughness::{self, Teeth};
use super::search::{columns_of, evidence, select};
use super::statement;
use super::status::{Status, TIE};
use super::tone::Tone;
use crate::causes::{Cause, Effect, Evidence, Fitted, Site, shown_by};
use giotto_shared::model::Element;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// No probability is certain: a statement about a machine from one campaign.
const HIGHEST: f64 = 0.999;

/// What the parts of an explanation take of the misfit.
struct Shares {
    /// Energy of everything that is explained, m².
    total: f64,
    /// Samples of all runs.
    samples: f64,
}

impl Shares {
    /// Of an energy, %.
    fn percent(&self, energy: f64) -> f64 {
        if self.total > 0.0 {
            100.0 * energy / self.total
        } else {
            0.0
        }
    }

    /// Root mean square over all samples, µm.
    fn rms_um(&self, energy: f64) -> f64 {
        (energy / self.samples).sqrt() * 1e6
    }

    /// A finding by evidence of its own, with what it takes.
    fn plain(&self, effect: Effect, probability: f64, energy: f64) -> Finding {
        let (share, rms) = (self.percent(energy), self.rms_um(energy));
        plain(effect, probability, share, rms)
    }
}

/// Findings, largest share first. `clamp_energy_m2` is what the clamp's slower feed explains.
pub fn findings(found: &Explained, clamp: Option<(Clamp, f64)>) -> Vec<Finding> {
    let weights = found.all();
    let (each, _) = energies(found, &weights);
    let tone_energies: Vec<f64> = found.tones.iter().map(Tone::whole_energy_m2).collect();
    let tone_energy: f64 = tone_energies.iter().sum();
    let teeth_energies: Vec<f64> = found
        .teeth
        .iter()
        .map(|teeth| roughness::energy_m2(teeth, &found.runs))
        .collect();
    let shares = Shares {
        total: each.iter().sum::<f64>()
            + tone_energy
            + teeth_energies.iter().sum::<f64>()
            + clamp.map_or(0.0, |(_, energy)| energy),
        samples: found
            .runs
            .iter()
            .map(|run| run.deviation_m.len() as f64)
            .sum(),
    };
    let out = found
        .chosen
        .par_iter()
        .enumerate()
        .filter_map(|(at, _)| of_signature(found, &weights, at, each[at], &shares))
        .collect();
    let (pieces, unexplained) = unexplained_energy(found, &each);
    let out = without_bent(out, (pieces, unexplained), found);
    let mut out = join_axes(out);
    out.extend(clamp.and_then(|(clamp, energy)| of_clamp(found, clamp, energy, &shares)));
    let hidden_by_pieces = pieces >= PIECES && tone_energy < 9.0 * unexplained;
    if !hidden_by_pieces {
        let tones = found.tones.iter().zip(tone_energies);
        out.extend(tones.filter_map(|(tone, energy)| {
            let finding = tone_finding(tone, shares.percent(energy), shares.rms_um(energy))?;
            Some(Finding {
                effect_um: statement::of_tone(found, tone),
                ..finding
            })
        }));
    }
    let teeth = found.teeth.iter().zip(teeth_energies);
    out.extend(teeth.filter_map(|(teeth, energy)| {
        let odds = 0.5 * teeth.significance.powi(2) - 14.0;
        Some(Finding {
            effect_um: statement::of_teeth(found, teeth),
            ..shares.plain(teeth_effect(teeth)?, sigmoid(odds), energy)
        })
    }));
    out.sort_by(|a, b| b.share_percent.total_cmp(&a.share_percent));
    out
}

/// A chosen explanation that is a cause with one name.
fn of_signature(
    found: &Explained,
    weights: &[f64],
    at: usize,
    energy: f64,
    shares: &Shares,
) -> Option<Finding> {
    let item = found.chosen[at];
    let Kind::Cause { cause, site, .. } = &found.items[item].kind else {
        return None;
    };
    if found.tied.contains(&item) {
        return None;
    }
    let words = cause.model().words();
    let (value, half) = estimate(found, item);
    let ci95 = [value - half, value + half];
    // Beyond what a machine can have, it is something else.
    let effect = effect_of(found, item, value, ci95)?;
    let params = named(&effect);
    Some(Finding {
        cause: *cause,
        axis: site.axis(),
        actuators: site.actuators(),
        probability: probability(found, weights, at),
        status: Status::default(),
        effect_um: statement::largest(found, item),
        remedy: statement::remedy(*cause, &site.actuators(), value),
        estimate: Estimate {
            value,
            ci95,
            unit: words.unit,
        },
        share_percent: shares.percent(energy),
        rms_um: shares.rms_um(energy),
        indistinguishable_from: look_alikes(found, weights, at),
        compensable: effect.cause().model().is_compensable(&effect),
        next_measurement: words.next.to_string(),
        note: cause
            .model()
            .is_response()
            .then(|| dynamics_note(found, weights, at)),
        params,
        effects: vec![effect],
    })
}

/// A clamp on the feed, which the clock shows.
fn of_clamp(found: &Explained, clamp: Clamp, energy: f64, shares: &Shares) -> Option<Finding> {
    let value = clamp.limit_m_s2 * 1e3;
    let half = 2.0 * clamp.se_m_s2 * 1e3;
    let ci95 = [value - half, value + half];
    let cause = shown_by(Evidence::Duration)?.cause();
    let effect = Effect::new(cause, Site::Machine, value, ci95, []).ok()?;
    Some(Finding {
        effect_um: statement::of_slower_feed(found),
        ..shares.plain(effect, HIGHEST, energy)
    })
}

/// Number of patterns and their energy, m².
fn unexplained_energy(found: &Explained, each: &[f64]) -> (usize, f64) {
    found
        .chosen
        .iter()
        .zip(each)
        .filter(|(item, _)| !found.items[**item].listed())
        .fold((0, 0.0), |(count, sum), (_, energy)| {
            (count + 1, sum + energy)
        })
}

/// So many patterns side by side are pieces of one thing that none of them describes.
const PIECES: usize = 3;

/// Against all patterns, rms: below, a cause beside so many of them may be a further piece. One with shape parameters fits more.
const LARGER_THAN_PIECES: [f64; 2] = [1.0 / 3.0, 3.0];

/// Takes out findings that the best set does without, and those that may be pieces of something unlisted: where three
/// patterns or more were needed, a cause counts only if it is not far smaller than all of them, and one with shape parameters
/// only if it is far larger.
fn without_bent(
    findings: Vec<Finding>,
    (pieces, energy): (usize, f64),
    found: &Explained,
) -> Vec<Finding> {
    let samples: f64 = found
        .runs
        .iter()
        .map(|run| run.deviation_m.len() as f64)
        .sum();
    let unexplained_um = (energy / samples).sqrt() * 1e6;
    findings
        .into_iter()
        .filter(|f| {
            let flexible = f.cause.model().flexible();
            let piece = is_piece(f.rms_um, flexible, pieces, unexplained_um);
            // Teeth smear out of the zone in which they are hidden.
            let smear = flexible
                && found
                    .teeth
                    .iter()
                    .filter(|teeth| f.axis == Some(teeth.axis))
                    .any(|teeth| {
                        let teeth_um =
                            (roughness::energy_m2(teeth, &found.runs) / samples).sqrt() * 1e6;
                        f.rms_um < 0.25 * teeth_um
                    });
            f.probability > TIE && !piece && !smear
        })
        .collect()
}

/// Whether a cause of so much rms may be one more piece of what so many patterns describe.
fn is_piece(rms_um: f64, flexible: bool, pieces: usize, unexplained_um: f64) -> bool {
    pieces >= PIECES && rms_um < LARGER_THAN_PIECES[usize::from(flexible)] * unexplained_um
}

/// A finding without look-alikes of its own.
fn plain(effect: Effect, probability: f64, share_percent: f64, rms_um: f64) -> Finding {
    let words = effect.cause().model().words();
    Finding {
        cause: effect.cause(),
        axis: effect.site().axis(),
        actuators: effect.site().actuators(),
        probability,
        status: Status::default(),
        effect_um: Largest::default(),
        remedy: statement::remedy(effect.cause(), &effect.site().actuators(), effect.value()),
        estimate: Estimate {
            value: effect.value(),
            ci95: effect.ci95(),
            unit: words.unit,
        },
        share_percent,
        rms_um,
        indistinguishable_from: words
            .never_told_from
            .iter()
            .map(|s| (*s).to_string())
            .collect(),
        compensable: effect.cause().model().is_compensable(&effect),
        next_measurement: words.next.to_string(),
        note: None,
        params: named(&effect),
        effects: vec![effect],
    }
}

fn named(effect: &Effect) -> BTreeMap<String, f64> {
    let named = |(name, value): (&str, f64)| (name.to_owned(), value);
    effect.parameters().iter().map(named).collect()
}

/// Teeth as an effect of a machine.
pub fn teeth_effect(teeth: &Teeth) -> Option<Effect> {
    let (value, half) = (teeth.height_m * 1e6, 2.0 * teeth.se_m * 1e6);
    let ci95 = [value - half, value + half];
    let below = [("below_mm_s", teeth.below_m_s * 1e3)];
    let cause = shown_by(Evidence::Roughness)?.cause();
    Effect::new(cause, Site::One(teeth.axis), value, ci95, below).ok()
}

fn tone_finding(tone: &Tone, share: f64, rms: f64) -> Option<Finding> {
    let params = [
        ("amplitude_um", tone.amplitude_m * 1e6),
        ("frequency_hz", tone.frequency_hz),
    ];
    let law = sigmoid(tone.law_evidence.min(50.0));
    // The frequency is sharper than the model of it: a part in 1e5 for the clock of the instrument.
    let se_hz = tone.se_hz.hypot(1e-5 * tone.frequency_hz);
    let model = shown_by(Evidence::Tone(tone.amplitude))?;
    let site = tone
        .axis
        .map(Site::One)
        .filter(|site| model.seat().takes(*site))
        .unwrap_or(Site::Machine);
    let [value, half] = model.of_frequency(tone.frequency_hz, se_hz);
    let ci95 = [value - half, value + half];
    let effect = Effect::new(model.cause(), site, value, ci95, params).ok()?;
    let mut finding = plain(effect, law, share, rms);
    if tone.law_evidence < 3.0 {
        let other = shown_by(Evidence::Tone(tone.amplitude.other()));
        let name = other.map(|other| other.cause().id().to_string());
        finding.indistinguishable_from.extend(name);
    }
    Some(finding)
}

fn sigmoid(log_odds: f64) -> f64 {
    (1.0 / (1.0 + (-log_odds).exp())).min(HIGHEST)
}

/// Partial F of the fourth-order term beside all others (variances as estimated between runs), and what kind of
/// chain has such a response.
fn dynamics_note(found: &Explained, weights: &[f64], at: usize) -> String {
    let products = found.gram.white(weights);
    let gain = |set: &[usize]| {
        solve(&products, &columns_of(&found.nuisance, &found.items, set))
            .map_or(0.0, |solution| solution.gain)
    };
    let rest: Vec<usize> = found
        .chosen
        .iter()
        .enumerate()
        .filter(|(i, _)| *i != at)
        .map(|(_, c)| *c)
        .collect();
    let partial_f = gain(&found.chosen) - gain(&rest);
    let dof = found
        .runs
        .len()
        .saturating_sub(columns_of(&found.nuisance, &found.items, &found.chosen).len());
    let ratio = found.response.ratio();
    let class = match found.response.element() {
        Some(Element::SecondOrder {
            omega_n_rad_s,
            zeta,
        }) => {
            format!("a second-order response with ωn = {omega_n_rad_s:.1} rad/s, ζ = {zeta:.2}")
        }
        _ => "a lag with feed-forward, or friction".to_string(),
    };
    format!("partial F = {partial_f:.1} (1, {dof}); κ4/κ2² = {ratio:.0}: {class}")
}

/// Probability of a chosen explanation: the best set with it against the best set that does without its cause. Both
/// may take in what is too small to be stated.
fn probability(found: &Explained, weights: &[f64], at: usize) -> f64 {
    let products = found.gram.white(weights);
    let best = |start: &[usize], barred: &[usize]| {
        let set = select(&products, &found.nuisance, &found.items, start, barred);
        evidence(&products, &found.nuisance, &found.items, &set)
    };
    let rest: Vec<usize> = found
        .chosen
        .iter()
        .enumerate()
        .filter(|(i, _)| *i != at)
        .map(|(_, c)| *c)
        .collect();
    let same_cause: Vec<usize> = (0..found.items.len())
        .filter(
            |&i| match (&found.items[i].kind, &found.items[found.chosen[at]].kind) {
                (Kind::Cause { cause: a, .. }, Kind::Cause { cause: b, .. }) => a == b,
                _ => false,
            },
        )
        .collect();
    match (best(&found.chosen, &[]), best(&rest, &same_cause)) {
        (Some(with), Some(without)) => sigmoid(0.5 * (with - without)),
        _ => 0.5,
    }
}

/// Whether circles at one place cannot tell two causes from each other at all.
fn same_class(one: Cause, other: Cause) -> bool {
    let class = one.model().class();
    class.is_some() && class == other.model().class()
}

/// Chosen causes in whose place another cause does as well to the last digit, and its name: even odds are no finding.
pub fn ties(found: &Explained) -> Vec<(usize, Cause)> {
    let products = found.gram.white(&found.all());
    let worth = |set: &[usize]| evidence(&products, &found.nuisance, &found.items, set);
    let Some(best) = worth(&found.chosen) else {
        return Vec::new();
    };
    let twin = |(at, &own): (usize, &usize)| {
        let Kind::Cause { cause, .. } = found.items[own].kind else {
            return None;
        };
        let other = (0..found.items.len()).find(|&index| {
            let Kind::Cause { cause: other, .. } = found.items[index].kind else {
                return false;
            };
            let mut swapped = found.chosen.clone();
            swapped[at] = index;
            other != cause
                && !same_class(cause, other)
                && !found.chosen.contains(&index)
                && worth(&swapped).is_some_and(|worth| worth > best - EVEN)
        })?;
        match found.items[other].kind {
            Kind::Cause { cause, .. } => Some((own, cause)),
            Kind::Pattern(_) => None,
        }
    };
    found.chosen.iter().enumerate().filter_map(twin).collect()
}

/// Difference of evidence (2·ln of the odds) below which two names have even odds.
const EVEN: f64 = 0.4;

/// Other causes that would explain these data nearly as well in its place (evidence within 2·ln 20).
fn look_alikes(found: &Explained, weights: &[f64], at: usize) -> Vec<String> {
    let products = found.gram.white(weights);
    let best = evidence(&products, &found.nuisance, &found.items, &found.chosen).unwrap_or(0.0);
    let own = found.chosen[at];
    let Kind::Cause { cause, .. } = &found.items[own].kind else {
        return Vec::new();
    };
    let mut out: Vec<String> = cause
        .model()
        .words()
        .never_told_from
        .iter()
        .map(|s| (*s).to_string())
        .collect();
    for (index, item) in found.items.iter().enumerate() {
        let Kind::Cause { cause: other, .. } = &item.kind else {
            continue;
        };
        if other == cause || found.chosen.contains(&index) {
            continue;
        }
        let mut swapped = found.chosen.clone();
        swapped[at] = index;
        let close = evidence(&products, &found.nuisance, &found.items, &swapped)
            .is_some_and(|e| e > best - 6.0);
        let id = other.id().to_string();
        if close && !out.contains(&id) {
            out.push(id);
        }
    }
    out
}

/// A chosen explanation as an effect of a machine; `None` beyond what a machine can have.
fn effect_of(found: &Explained, item: usize, value: f64, ci95: [f64; 2]) -> Option<Effect> {
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    let amount = |column: &usize| {
        let at = columns.iter().position(|other| other == column);
        at.map_or(0.0, |at| found.solution.coefficients[at])
    };
    let amounts: Vec<f64> = found.items[item].columns.iter().map(amount).collect();
    effect_with(found, item, &amounts, value, ci95)
}

/// The same with other amounts of its columns.
pub fn effect_with(
    found: &Explained,
    item: usize,
    amounts: &[f64],
    value: f64,
    ci95: [f64; 2],
) -> Option<Effect> {
    let Kind::Cause { cause, site, shape } = &found.items[item].kind else {
        return None;
    };
    let fit = Fitted {
        site: *site,
        shape,
        amounts,
        first_view: &found.runs.first()?.view,
    };
    let stated = cause.model().stated(&fit);
    let stated = stated
        .into_iter()
        .map(|(parameter, value)| (parameter.name, value));
    Effect::new(*cause, *site, value, ci95, stated).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_small_beside_many_patterns() {
        // A third of the patterns' rms without shapes, three times with.
        for (flexible, bound_um) in [(false, 0.5), (true, 4.5)] {
            assert!(is_piece(0.95 * bound_um, flexible, 3, 1.5));
            assert!(!is_piece(1.05 * bound_um, flexible, 3, 1.5));
            assert!(
                !is_piece(0.01 * bound_um, flexible, 2, 1.5),
                "two patterns are no pieces"
            );
        }
    }
}
