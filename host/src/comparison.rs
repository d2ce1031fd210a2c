//! Before and after: figure by figure and cause by cause, with intervals.
//!
//! An interval of a single change is a 95 % one. A change is *called* one only where it would be surprising among all
//! figures of the comparison: one comparison of two campaigns of an unchanged machine in [`RARELY`] says otherwise.
//! Intervals of figures hold set-up, repeatability, temperature and sampling; the instrument is taken for the same.
use crate::causes::remedy::spoken;
use crate::fit::critical_t;
use crate::summary::{CauseFigure, Summary};
use crate::units;
use serde::Serialize;

/// One comparison in so many calls something changed that did not.
pub const RARELY: f64 = 500.0;

/// A figure before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FigureChange {
    /// Which.
    pub figure: &'static str,
    /// Programmed radius, mm.
    pub radius_mm: f64,
    /// Programmed feed, mm/s.
    pub feed_mm_s: f64,
    /// Before, µm.
    pub before_um: f64,
    /// After, µm.
    pub after_um: f64,
    /// After less before, µm.
    pub change_um: f64,
    /// 95 % interval of the change, µm.
    pub ci95_um: [f64; 2],
    /// Whether it is surprising among all figures.
    pub changed: bool,
}

/// What became of a cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// Found after, not before, and larger than doubt.
    Appeared,
    /// Found before, not after, and it was larger than doubt.
    Gone,
    /// Found in both, and different.
    Changed,
    /// Nothing that these data can tell.
    Same,
}

/// A cause before and after; 0 where it was not found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CauseChange {
    /// Name in the closed list.
    pub cause: String,
    /// Name for a person.
    #[serde(skip)]
    pub name: String,
    /// Where.
    pub actuators: String,
    /// Contract's unit.
    pub unit: String,
    /// Before; `None` where it was not found.
    pub before: Option<f64>,
    /// After.
    pub after: Option<f64>,
    /// After less before.
    pub change: f64,
    /// 95 % interval of the change.
    pub ci95: [f64; 2],
    /// What became of it.
    pub fate: Fate,
}

/// Two campaigns set side by side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the first.
    pub before: String,
    /// Name of the second.
    pub after: String,
    /// Figures that both have.
    pub figures: Vec<FigureChange>,
    /// Causes that either has.
    pub causes: Vec<CauseChange>,
    /// Circles that only one of them has.
    pub unmatched: usize,
    /// In words, what changed most first.
    pub words: Vec<String>,
}

/// Quantiles of Student's t: of one change, and of one among many.
struct Quantiles {
    single: f64,
    among: f64,
}

fn quantiles(free: usize, many: usize) -> Quantiles {
    let free = free.max(1);
    let t = |probability: f64| critical_t(probability, free).unwrap_or(f64::INFINITY);
    Quantiles {
        single: t(0.05),
        among: t(1.0 / (RARELY * many.max(1) as f64)),
    }
}

/// Compares two campaigns.
///
/// ```
/// use giotto::comparison::{Fate, compare};
/// use giotto::simulation::{self, Plan};
/// use giotto::summary::Summary;
/// use giotto::{analysis, diagnosis};
/// # use std::path::Path;
/// let summary = |backlash_um: f64| -> Result<Summary, Box<dyn std::error::Error>> {
///     let plan = Plan::parse(
///         &format!(
///             "[machine]\nboth = {{ kv_per_s = 50.0 }}\ny = {{ backlash_um = {backlash_um:?} }}\n\
///              [grid]\nradii_mm = [50.0, 100.0, 150.0]\nfeeds_mm_s = [20.0, 100.0, 300.0]"
///         ),
///         Path::new("plan.toml"),
///     )?;
///     let campaign = simulation::campaign(&plan, 1);
///     let report = analysis::of_campaign(&campaign).map_err(|(_, error)| error)?;
///     Ok(Summary::of(&report, &diagnosis::diagnose(&campaign, &Default::default())?))
/// };
/// // The screw of Y was adjusted.
/// let change = compare(&summary(12.0)?, &summary(4.0)?);
/// let cause = change.causes.iter().find(|c| c.cause == "backlash").unwrap();
/// assert_eq!(cause.fate, Fate::Changed);
/// assert!((cause.change + 0.008).abs() < 0.001);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn compare(before: &Summary, after: &Summary) -> Comparison {
    let shared: Vec<_> = before
        .figures
        .iter()
        .filter_map(|b| Some((b, after.figure(b)?)))
        .collect();
    let mut either: Vec<&CauseFigure> = before.causes.iter().collect();
    either.extend(after.causes.iter().filter(|c| before.cause(c).is_none()));
    let many = shared.len() + either.len();
    // The scatter between runs is known from so many runs.
    let free = before.runs.min(after.runs).saturating_sub(3);
    let q = quantiles(free, many);
    let figures: Vec<FigureChange> = shared
        .iter()
        .map(|(b, a)| {
            let change_um = a.value_um - b.value_um;
            let standard = a.standard_um.hypot(b.standard_um);
            FigureChange {
                figure: b.figure,
                radius_mm: b.radius_mm,
                feed_mm_s: b.feed_mm_s,
                before_um: b.value_um,
                after_um: a.value_um,
                change_um,
                ci95_um: [-1.0, 1.0].map(|s| change_um + s * q.single * standard),
                changed: change_um.abs() > q.among * standard,
            }
        })
        .collect();
    let causes = either
        .into_iter()
        .map(|cause| cause_change(cause, before, after, &q))
        .collect::<Vec<_>>();
    let unmatched = before.figures.len() + after.figures.len() - 2 * figures.len();
    let words = words(&figures, &causes, unmatched);
    Comparison {
        before: before.name.clone(),
        after: after.name.clone(),
        figures,
        causes,
        unmatched,
        words,
    }
}

/// Standard error of an estimate by its interval.
fn standard(cause: &CauseFigure) -> f64 {
    (cause.ci95[1] - cause.ci95[0]).abs() / (2.0 * 1.96)
}

fn cause_change(
    like: &CauseFigure,
    before: &Summary,
    after: &Summary,
    q: &Quantiles,
) -> CauseChange {
    let (b, a) = (before.cause(like), after.cause(like));
    let value = |c: Option<&CauseFigure>| c.map_or(0.0, |c| c.value);
    // Where it was not found it is known no better than where it was.
    let doubt = |c: Option<&CauseFigure>| standard(c.unwrap_or(like));
    let change = value(a) - value(b);
    let standard = doubt(a).hypot(doubt(b));
    let told = before.proven && after.proven && change.abs() > q.among * standard;
    let fate = match (told, b, a) {
        (false, ..) => Fate::Same,
        (true, None, _) => Fate::Appeared,
        (true, _, None) => Fate::Gone,
        (true, Some(_), Some(_)) => Fate::Changed,
    };
    CauseChange {
        cause: like.cause.clone(),
        name: like.name.clone(),
        actuators: like.actuators.clone(),
        unit: like.unit.clone(),
        before: b.map(|c| c.value),
        after: a.map(|c| c.value),
        change,
        ci95: [-1.0, 1.0].map(|s| change + s * q.single * standard),
        fate,
    }
}

/// `backlash of X`, `squareness of X and Y`.
pub fn title(name: &str, actuators: &str) -> String {
    if actuators.is_empty() {
        name.to_owned()
    } else {
        let places: Vec<String> = actuators.split(' ').map(spoken).collect();
        format!("{name} of {}", places.join(" and "))
    }
}

/// A figure for a person.
pub fn figure_name(figure: &str) -> &'static str {
    match figure {
        "radius_error_cw" => "ΔR cw",
        "radius_error_ccw" => "ΔR ccw",
        other => crate::analysis::tolerance::name(other),
    }
}

fn words(figures: &[FigureChange], causes: &[CauseChange], unmatched: usize) -> Vec<String> {
    let mut out = Vec::new();
    for cause in causes.iter().filter(|c| c.fate != Fate::Same) {
        let shown = units::shown(cause.change, cause.ci95, &cause.unit);
        let title = title(&cause.name, &cause.actuators);
        let at = |v: Option<f64>| {
            let value = v.unwrap_or(0.0);
            let shown = units::shown(value, [value; 2], &cause.unit);
            format!("{} {}", shown.value, shown.unit)
        };
        let how = match cause.fate {
            Fate::Appeared => format!("{title} appeared: {}", at(cause.after)),
            Fate::Gone => format!("{title} is gone; it was {}", at(cause.before)),
            _ => format!("{title}: {} became {}", at(cause.before), at(cause.after)),
        };
        out.push(format!(
            "{how} (change {}, 95 %: {} to {} {}).",
            shown.value, shown.low, shown.high, shown.unit
        ));
    }
    let mut changed: Vec<&FigureChange> = figures.iter().filter(|f| f.changed).collect();
    changed.sort_by(|a, b| b.change_um.abs().total_cmp(&a.change_um.abs()));
    if let Some(first) = changed.first() {
        let better = |f: &&FigureChange| f.after_um.abs() < f.before_um.abs();
        let smaller = changed.iter().copied().filter(|f| better(f)).count();
        out.push(format!(
            "{} of {} figures changed, {smaller} of them for the better; most {} at R {} mm, {} mm/s: {} µm became {} µm.",
            changed.len(),
            figures.len(),
            figure_name(first.figure),
            first.radius_mm,
            first.feed_mm_s,
            units::number(first.before_um),
            units::number(first.after_um)
        ));
    }
    if figures.is_empty() {
        out.push(
            "No circle of one radius, feed and direction is in both: only causes can be compared."
                .into(),
        );
    } else if out.is_empty() {
        out.push(format!(
            "Nothing changed that these runs can tell: {} figures and {} causes agree within their intervals.",
            figures.len(),
            causes.len()
        ));
    }
    if unmatched > 0 && !figures.is_empty() {
        out.push(format!(
            "{unmatched} figures have no counterpart in the other campaign."
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::of_campaign;
    use crate::diagnosis::{Options, diagnose};
    use crate::simulation::machine::PositionLoop;
    use crate::simulation::{CircleTest, Instrument, Machine, Plan, PlannedTest, campaign};
    use giotto_shared::Direction;

    /// A mill with backlash on X and axes that are not square, measured with scatter and set-ups of its own.
    fn measured(backlash_m: f64, squareness_rad: f64, seed: u64) -> Summary {
        let mut tests = Vec::new();
        for radius_m in [0.1, 0.15] {
            for feed_m_s in [0.02, 0.08, 0.2] {
                for direction in [Direction::Ccw, Direction::Cw] {
                    let test = CircleTest {
                        samples: Some(250),
                        ..CircleTest::new(radius_m, feed_m_s, direction)
                    };
                    tests.push(PlannedTest { test, timed: false });
                }
            }
        }
        let plan = Plan {
            name: format!("seed {seed}"),
            machine_name: "mill".into(),
            machine: Machine {
                servo: [PositionLoop {
                    kv_per_s: 40.0,
                    feed_forward: 0.0,
                }; 3],
                backlash_m: [backlash_m, 0.0, 0.0],
                squareness_rad: [squareness_rad, 0.0, 0.0],
                ..Machine::default()
            },
            instrument: Instrument {
                spread_m: 0.7e-6,
                // One set-up a campaign.
                setup_m: [10e-6 * (seed as f64).sin(), 10e-6 * (seed as f64).cos()],
                setup_spread_m: 0.0,
                ..Instrument::ballbar()
            },
            tests,
            shuffle: true,
        };
        let campaign = campaign(&plan, seed);
        let diagnosis = diagnose(&campaign, &Options::default()).unwrap();
        Summary::of(&of_campaign(&campaign).unwrap(), &diagnosis)
    }

    #[test]
    fn of_210_pairs_of_one_machine_at_most_one_is_said_to_differ() {
        let all: Vec<Summary> = (0..21).map(|seed| measured(6e-6, 60e-6, seed)).collect();
        let mut false_alarms = Vec::new();
        for (k, before) in all.iter().enumerate() {
            for after in &all[k + 1..] {
                let comparison = compare(before, after);
                assert!(!comparison.figures.is_empty() && !comparison.causes.is_empty());
                let changed = comparison.figures.iter().any(|f| f.changed)
                    || comparison.causes.iter().any(|c| c.fate != Fate::Same);
                if changed {
                    false_alarms.push(comparison.words);
                }
            }
        }
        assert!(false_alarms.len() <= 1, "{false_alarms:#?}");
    }

    #[test]
    fn what_changed_is_named_with_its_size_and_what_did_not_is_not() {
        let (before, after) = (measured(6e-6, 60e-6, 1), measured(12e-6, 60e-6, 2));
        let comparison = compare(&before, &after);
        let of = |cause: &str| comparison.causes.iter().find(|c| c.cause == cause).unwrap();
        let backlash = of("backlash");
        assert_eq!(backlash.fate, Fate::Changed, "{:?}", comparison.words);
        assert!(
            (backlash.change - 0.006).abs() < 0.001,
            "{}",
            backlash.change
        );
        assert!(backlash.ci95[0] < 0.006 && 0.006 < backlash.ci95[1]);
        assert_eq!(of("squareness").fate, Fate::Same);
        assert!(
            comparison.words[0].contains("backlash of X"),
            "{:?}",
            comparison.words
        );
        let gone = compare(&after, &measured(0.0, 60e-6, 3));
        assert!(
            gone.causes
                .iter()
                .any(|c| c.cause == "backlash" && c.fate == Fate::Gone)
        );
        assert!(
            gone.figures
                .iter()
                .filter(|f| f.figure == "g_b")
                .all(|f| f.change_um < 0.0),
            "{:?}",
            gone.words
        );
    }
}
