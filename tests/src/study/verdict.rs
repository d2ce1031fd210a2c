//! One campaign judged: was the truth found, and nothing else?
use super::{Finding, Outcome};
use crate::effects::{Hidden, Seat, Truth};

/// How one answer compares with the truth.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// The first finding is a hidden effect.
    pub top_right: bool,
    /// Every hidden effect is among the findings and nothing that is not there.
    pub exact: bool,
    /// Findings that are neither hidden nor physically there (`~`).
    pub false_findings: Vec<String>,
    /// First finding, or `unexplained`, or `nothing`.
    pub top: String,
    /// Everything named, for the list of failures.
    pub said: String,
    /// Effects that belong to one axis and were found: on the right one?
    pub axis: Vec<bool>,
    /// Effects found: name, and whether the 95 % interval covers the truth.
    pub covered: Vec<(String, bool)>,
    /// Stated probability of each finding and whether it is there.
    pub stated: Vec<(f64, bool)>,
    /// Gain over the baseline as a share of what the perfect model gains.
    pub gain_share: Option<f64>,
    /// Something was named and the extended simulation is worse than the baseline on runs left out.
    pub negative_gain: bool,
    /// Flashing was recommended where the extended simulation is no better than the baseline on runs left out.
    pub bad_flash: bool,
    /// Something was called unexplained.
    pub unexplained: bool,
    /// Whether exactly the spoilt run was left out, where one was spoilt.
    pub spoilt_named: Option<bool>,
}

/// Share of what a perfect model leaves that it has to gain for a gain to be judged.
const SOMETHING: f64 = 0.1;

/// Judges `outcome` against the truth of `case`.
pub fn judge(case: &Hidden, outcome: &Outcome) -> Verdict {
    let must = |cause: &str| {
        case.truth
            .iter()
            .any(|t| t.accept.iter().any(|a| a == cause))
    };
    let may = |cause: &str| {
        case.truth
            .iter()
            .any(|t| t.accept.iter().any(|a| a.strip_prefix('~') == Some(cause)))
    };
    let causes: Vec<&str> = outcome.findings.iter().map(|f| f.cause.as_str()).collect();
    let found = |t: &Truth| t.accept.iter().any(|a| causes.contains(&a.as_str()));
    let unlisted = case.truth.iter().any(|t| t.accept.is_empty());
    let false_findings: Vec<String> = causes
        .iter()
        .filter(|c| !must(c) && !may(c))
        .map(|c| (*c).to_owned())
        .collect();
    let listed_found = case
        .truth
        .iter()
        .filter(|t| !t.accept.is_empty())
        .all(found);
    let mut verdict = Verdict {
        top_right: causes.first().is_some_and(|c| must(c)),
        exact: listed_found && false_findings.is_empty() && (!unlisted || outcome.unexplained),
        top: causes
            .first()
            .map_or(
                if outcome.unexplained {
                    "unexplained"
                } else {
                    "nothing"
                },
                |c| *c,
            )
            .to_owned(),
        stated: outcome
            .findings
            .iter()
            .map(|f| (f.probability, must(&f.cause) || may(&f.cause)))
            .collect(),
        ..Verdict::default()
    };
    verdict.said = outcome
        .findings
        .iter()
        .map(|f| {
            let axis: String = f.actuators.iter().map(|a| format!(" {a}")).collect();
            format!(
                "{}{axis} {:.3e} [{:.3e}, {:.3e}] {} p {:.2}",
                f.cause, f.value, f.ci95[0], f.ci95[1], f.unit, f.probability
            )
        })
        .chain(outcome.unexplained.then(|| "unexplained".to_owned()))
        .collect::<Vec<_>>()
        .join("; ");
    for truth in &case.truth {
        let mut same = outcome
            .findings
            .iter()
            .filter(|f| truth.accept.contains(&f.cause));
        let Some(first) = same.clone().next() else {
            continue;
        };
        if truth.seat != Seat::Whole {
            let alike = || case.truth.iter().filter(|t| t.effect == truth.effect);
            let right = |f: &Finding| alike().any(|t| sits(t, &f.actuators));
            // Each right angle and each slide is one of its own; lags of three slides are told by two differences.
            let single = truth.effect == "squareness" || matches!(truth.seat, Seat::Slide(_));
            let named = !single || same.clone().any(|f| own(truth, f));
            verdict.axis.push(named && same.clone().all(right));
        }
        let at = same
            .clone()
            .find(|f| own(truth, f))
            .or_else(|| same.find(|f| sits(truth, &f.actuators)))
            .unwrap_or(first);
        let value = value_for(truth, &at.actuators);
        if value.is_nan() {
            continue;
        }
        let inside = at.ci95[0] <= value && value <= at.ci95[1];
        verdict.covered.push((truth.effect.clone(), inside));
    }
    if let (false, false, Some(perfect_um)) = (case.truth.is_empty(), unlisted, case.perfect_um) {
        let possible = outcome.baseline_um - perfect_um;
        // Where nothing can be foretold nothing can be gained, and the ratio says nothing.
        if possible > SOMETHING * perfect_um {
            verdict.gain_share = Some((outcome.baseline_um - outcome.extended_um) / possible);
        }
    }
    verdict.negative_gain =
        !outcome.findings.is_empty() && outcome.extended_um > outcome.baseline_um;
    verdict.bad_flash = outcome.flash && outcome.extended_um >= outcome.baseline_um;
    verdict.unexplained = outcome.unexplained;
    verdict.spoilt_named = case
        .spoilt
        .as_ref()
        .map(|file| outcome.left_out == [file.as_str()]);
    verdict.false_findings = false_findings;
    verdict
}

/// Names of the slides.
const SLIDES: [&str; 3] = ["x", "y", "z"];

/// Place among the pairs XY, YZ, ZX of two slides by name, and whether they come in the order of the plane.
fn pair_of(actuators: &[String]) -> Option<(usize, bool)> {
    let [a, b] = actuators else { return None };
    let index = |name: &str| SLIDES.iter().position(|s| *s == name);
    let (a, b) = (index(a)?, index(b)?);
    match (b + 3 - a) % 3 {
        1 => Some((a, true)),
        2 => Some((b, false)),
        _ => None,
    }
}

/// Whether a finding with these actuators sits where the truth does. A finding that names none can only mean the
/// one plane there was.
fn sits(truth: &Truth, actuators: &[String]) -> bool {
    match truth.seat {
        Seat::Whole => true,
        Seat::Slide(axis) => actuators.iter().any(|a| a == SLIDES[axis]),
        Seat::Joint(joint) => actuators
            .iter()
            .any(|a| *a == format!("joint{}", joint + 1)),
        Seat::Pair(_) if actuators.is_empty() => true,
        // Of a slide that differs from both others two pairs tell.
        Seat::Pair(_) => pair_of(actuators).is_some_and(|(pair, _)| {
            truth
                .by_pair
                .is_some_and(|v| v[pair].abs() > 1e-3 * truth.value.abs())
        }),
    }
}

/// Whether a finding names the very pair that the effect was hidden on.
fn own(truth: &Truth, finding: &Finding) -> bool {
    match truth.seat {
        Seat::Pair(pair) if !finding.actuators.is_empty() => {
            pair_of(&finding.actuators).is_some_and(|(k, _)| k == pair[0])
        }
        _ => sits(truth, &finding.actuators),
    }
}

/// The true value of what a finding with these actuators names.
fn value_for(truth: &Truth, actuators: &[String]) -> f64 {
    match (truth.by_pair, pair_of(actuators)) {
        // A right angle has no order; a difference has.
        (Some(values), Some((pair, in_order))) if in_order || truth.effect == "squareness" => {
            values[pair]
        }
        (Some(values), Some((pair, _))) => -values[pair],
        // What is named of two joints is what the first has more than the second, whichever of them it was hidden in.
        _ if truth.seat == Seat::Joint(1) && actuators == ["joint1", "joint2"] => -truth.value,
        _ => truth.value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Case, Kind};
    use crate::machine::base::Variety;

    fn finding(cause: &str, actuators: &[&str], ci95: [f64; 2]) -> Finding {
        Finding {
            cause: cause.into(),
            actuators: actuators.iter().map(|a| (*a).to_owned()).collect(),
            probability: 0.9,
            value: 0.5 * (ci95[0] + ci95[1]),
            ci95,
            unit: String::new(),
            indistinguishable_from: Vec::new(),
        }
    }

    fn case(names: &[&str]) -> Hidden {
        Case::new(
            &Kind::Effects(names.iter().map(|s| (*s).to_owned()).collect()),
            3.0,
            5,
            Variety::Usual,
        )
        .unwrap()
        .hidden()
    }

    fn answer(findings: Vec<Finding>, unexplained: bool) -> Outcome {
        Outcome {
            findings,
            unexplained,
            baseline_um: 3.0,
            extended_um: 1.5,
            ..Outcome::default()
        }
    }

    #[test]
    fn right_wrong_and_beside() {
        let case = case(&["reversal_spike"]);
        let t = case.truth[0].clone();
        let axis: &[&str] = match t.seat {
            Seat::Slide(slide) => &SLIDES[slide..=slide],
            // On both slides of the pair.
            _ => &["x"],
        };
        let around = [0.9 * t.value, 1.1 * t.value];
        let v = judge(
            &case,
            &answer(vec![finding("reversal_spike", axis, around)], false),
        );
        assert!(v.top_right && v.exact && v.covered[0].1);
        let both = vec![
            finding("reversal_spike", axis, around),
            finding("higher_order_dynamics", &[], [0.0, 1.0]),
        ];
        let v = judge(&case, &answer(both.clone(), false));
        assert!(
            v.top_right && v.exact,
            "what is physically there may be named beside"
        );
        let turned = both.into_iter().rev().collect();
        assert!(
            !judge(&case, &answer(turned, false)).top_right,
            "but not first"
        );
        let v = judge(
            &case,
            &answer(vec![finding("backlash", &["x"], [0.0, 1.0])], false),
        );
        assert!(
            !v.top_right
                && !v.exact
                && v.false_findings == ["backlash"]
                && v.stated == [(0.9, false)]
        );
        let v = judge(
            &case,
            &answer(
                vec![finding("reversal_spike", axis, [0.0, 0.1 * t.value])],
                false,
            ),
        );
        assert!(v.exact && !v.covered[0].1);
    }

    #[test]
    fn sets_nulls_and_the_unlisted() {
        let pair = case(&["squareness", "thermal_drift"]);
        let [a, b] = ["squareness", "thermal_drift"].map(|c| finding(c, &[], [0.0, 1.0]));
        assert!(judge(&pair, &answer(vec![a.clone(), b], false)).exact);
        assert!(!judge(&pair, &answer(vec![a.clone()], false)).exact);
        let unlisted = case(&["unknown_bump"]);
        assert!(judge(&unlisted, &answer(Vec::new(), true)).exact);
        assert!(!judge(&unlisted, &answer(Vec::new(), false)).exact);
        assert!(!judge(&unlisted, &answer(vec![a], true)).exact);
    }

    #[test]
    fn the_perfect_model_leaves_noise_and_spread() {
        let kind = Kind::Effects(vec!["squareness".into()]);
        let case = Case::new(&kind, 3.0, 5, Variety::Usual).unwrap();
        let expected = (case.instrument.noise_m.powi(2)
            + case.instrument.spread.radius_m.powi(2)
            + case.instrument.spread.oval_m.powi(2))
        .sqrt()
            * 1e6;
        let got = case.perfect_um();
        assert!((got / expected - 1.0).abs() < 0.1, "{got} {expected}");
    }
}
