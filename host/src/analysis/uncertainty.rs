//! Expanded uncertainty (k = 2) of the figures of ISO 230-4, with its budget, in the manner of ISO/TR 230-9.
//!
//! | source | in G, G(b) | in F | in D, ΔR | standard uncertainty |
//! |---|---|---|---|---|
//! | instrument | yes | yes | yes | half of the expanded uncertainty of its certificate (k = 2) |
//! | set-up | e²/(4R) | e, as the instrument was centred | e²/(4R) | rectangular: a/√3; e is the measured offset |
//! | repeatability | – | yes | yes | scatter of repeated circles (n − 1), or the campaign's `repeatability_um` |
//! | temperature | – | yes | yes | α·R·a/√3, a half the range of temperature |
//! | sampling | √2·noise | √2·noise | standard error of the circle fit | noise within the run, and the arc between samples |
//!
//! What nobody measured or gave is assumed, and each part says which of the three it is. Repeatability that nobody
//! knows is not in the sum, and the budget says so.
use super::iso230::{Iso230, pairs};
use super::report::Report;
use super::run::RunAnalysis;
use serde::Serialize;
use std::f64::consts::{SQRT_2, TAU};

/// Coverage factor of the expanded uncertainty: about 95 %.
pub const COVERAGE: f64 = 2.0;
/// Expansion of steel, 1/K.
const EXPANSION_PER_K: f64 = 11.5e-6;
/// Expanded uncertainty (k = 2) that is assumed of an instrument, m: what makers of ballbars state.
const ASSUMED_INSTRUMENT_M: f64 = 0.7e-6;
/// Half range of temperature that is assumed where no run states one, K.
const ASSUMED_TEMPERATURE_K: f64 = 1.0;

/// What is known of how the circles were measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conditions {
    /// Expanded uncertainty (k = 2) of the instrument by its certificate, m.
    pub instrument_m: Option<f64>,
    /// Half the range of the temperature, K; else that of the campaign.
    pub temperature_k: Option<f64>,
    /// Scatter of a circle's size between runs, m (standard deviation); else from circles that were repeated.
    pub repeatability_m: Option<f64>,
}

/// Where a part of the uncertainty comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The instrument's calibration.
    Instrument,
    /// Centring.
    SetUp,
    /// Scatter between runs.
    Repeatability,
    /// Expansion.
    Temperature,
    /// Noise and spacing of the samples.
    Sampling,
}

/// How a part is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Known {
    /// From these data.
    Measured,
    /// Told by the user or the campaign.
    Given,
    /// A usual value.
    Assumed,
    /// Not known, and so not in the sum.
    Missing,
}

/// One line of the budget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Where it comes from.
    pub source: Source,
    /// Standard uncertainty, m.
    pub standard_m: f64,
    /// How it is known.
    pub known: Known,
}

/// The budget of one figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Its lines.
    pub parts: [Part; 5],
}

impl Budget {
    /// Root of the sum of squares, m.
    pub fn standard_m(&self) -> f64 {
        let squares = self.parts.iter().map(|p| p.standard_m * p.standard_m);
        squares.sum::<f64>().sqrt()
    }

    /// Expanded uncertainty, k = 2, m.
    pub fn expanded_m(&self) -> f64 {
        COVERAGE * self.standard_m()
    }

    /// Standard uncertainty of a change between two set-ups of one instrument, m: its calibration cancels.
    pub fn of_change_m(&self) -> f64 {
        let parts = self.parts.iter().filter(|p| p.source != Source::Instrument);
        parts
            .map(|p| p.standard_m * p.standard_m)
            .sum::<f64>()
            .sqrt()
    }
}

/// Budgets of the figures of a pair, where the figure is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iso230Budget {
    /// Of G, clockwise.
    pub g_cw: Option<Budget>,
    /// Of G, counter-clockwise.
    pub g_ccw: Option<Budget>,
    /// Of G(b).
    pub g_b: Option<Budget>,
    /// Of both F.
    pub f: Budget,
    /// Of D.
    pub d: Option<Budget>,
}

/// Conditions of a report with what the data themselves say.
#[derive(Clone, Copy, Debug)]
struct Resolved {
    instrument: (f64, Known),
    repeatability: (f64, Known),
    temperature_k: (f64, Known),
}

fn resolve(report: &Report, conditions: &Conditions) -> Resolved {
    let instrument = match conditions.instrument_m {
        Some(given) => (given / COVERAGE, Known::Given),
        None => (ASSUMED_INSTRUMENT_M / COVERAGE, Known::Assumed),
    };
    let given = conditions.repeatability_m.or(report.repeatability_m);
    let repeatability = match (given, repeated(&report.runs)) {
        (Some(given), _) => (given, Known::Given),
        (None, Some(measured)) => (measured, Known::Measured),
        (None, None) => (0.0, Known::Missing),
    };
    let temperature_k = match (conditions.temperature_k, report.temperature_half_range_k) {
        (Some(given), _) => (given, Known::Given),
        (None, Some(measured)) => (measured, Known::Measured),
        (None, None) => (ASSUMED_TEMPERATURE_K, Known::Assumed),
    };
    Resolved {
        instrument,
        repeatability,
        temperature_k,
    }
}

/// Standard deviation of the size of circles that were repeated (same radius, feed and direction), pooled; `None`
/// where none was.
fn repeated(runs: &[RunAnalysis]) -> Option<f64> {
    let mut groups: Vec<(&RunAnalysis, Vec<f64>)> = Vec::new();
    for run in runs {
        let same = |other: &RunAnalysis| {
            other.radius_m == run.radius_m
                && other.feed_m_s == run.feed_m_s
                && other.direction == run.direction
        };
        match groups.iter_mut().find(|(first, _)| same(first)) {
            Some((_, sizes)) => sizes.push(run.radius_error_m),
            None => groups.push((run, vec![run.radius_error_m])),
        }
    }
    let (mut squares, mut free) = (0.0, 0.0);
    for (_, sizes) in &groups {
        let n = sizes.len() as f64;
        let mean = sizes.iter().sum::<f64>() / n;
        squares += sizes.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        free += n - 1.0;
    }
    (free > 0.0).then(|| (squares / free).sqrt())
}

/// Half of what a range may miss between two samples: the form's curvature over half a spacing.
fn missed_m(run: &RunAnalysis) -> f64 {
    let spacing = run.arc_rad.unwrap_or(TAU) / run.samples.max(1) as f64;
    let curvature: f64 = run
        .harmonics
        .iter()
        .map(|h| (h.order as f64).powi(2) * h.cos_m.hypot(h.sin_m))
        .sum();
    curvature * (0.5 * spacing).powi(2) / 2.0
}

/// What of the runs of a figure enters its budget.
struct Runs<'a>(Vec<&'a RunAnalysis>);

impl Runs<'_> {
    fn largest(&self, of: impl Fn(&RunAnalysis) -> f64) -> f64 {
        self.0.iter().map(|run| of(run)).fold(0.0, f64::max)
    }

    /// Of G(b): ISO 230-4 means two directions of one set-up. What their centres lie apart is in the range, and whether
    /// set-up or machine made it nobody can tell.
    fn budget_of_both(&self, resolved: &Resolved) -> Budget {
        let mut budget = self.budget(resolved, false, false);
        if let [one, other] = self.0.as_slice() {
            let [a, b] = [one.set_up_m, other.set_up_m];
            let apart = (a[0] - b[0]).hypot(a[1] - b[1]) / 3f64.sqrt();
            for part in &mut budget.parts {
                if part.source == Source::SetUp {
                    part.standard_m = part.standard_m.hypot(apart);
                }
            }
        }
        budget
    }

    fn budget(&self, resolved: &Resolved, size: bool, nominal: bool) -> Budget {
        let third = 3f64.sqrt();
        let radius_m = self.largest(|run| run.radius_m);
        let offset = self.largest(|run| run.centre_offset_m());
        let bent = offset * offset / (4.0 * radius_m.max(f64::MIN_POSITIVE));
        let set_up = if nominal { offset } else { bent } / third;
        let sampling = if size && !nominal {
            // Of the mean of its circles.
            let squares = self.0.iter().map(|run| run.radius_error_se_m.powi(2));
            squares.sum::<f64>().sqrt() / self.0.len() as f64
        } else {
            let noise = SQRT_2 * self.largest(|run| run.noise_m);
            noise.hypot(self.largest(missed_m) / third)
        };
        let (repeatability, repeatability_known) = resolved.repeatability;
        let (half_range, temperature_known) = resolved.temperature_k;
        let only_size = |v: f64| if size { v } else { 0.0 };
        // D is the mean of the two directions; F is decided by one of them.
        let averaged = if nominal {
            1.0
        } else {
            (self.0.len() as f64).sqrt()
        };
        let part = |source, standard_m, known| Part {
            source,
            standard_m,
            known,
        };
        Budget {
            parts: [
                part(
                    Source::Instrument,
                    resolved.instrument.0,
                    resolved.instrument.1,
                ),
                part(Source::SetUp, set_up, Known::Measured),
                part(
                    Source::Repeatability,
                    only_size(repeatability / averaged),
                    repeatability_known,
                ),
                part(
                    Source::Temperature,
                    only_size(EXPANSION_PER_K * radius_m * half_range / third),
                    temperature_known,
                ),
                part(Source::Sampling, sampling, Known::Measured),
            ],
        }
    }
}

/// The budgets of the pairs of a report, in their order.
pub fn of_report(report: &Report, conditions: &Conditions) -> Vec<Iso230Budget> {
    let resolved = resolve(report, conditions);
    let grouped = pairs(
        report
            .runs
            .iter()
            .map(|run| (run.radius_m, run.feed_m_s, run.direction)),
    );
    let of = |(pair, iso): (&[Option<usize>; 2], &Iso230)| {
        let run = |i: Option<usize>| i.map(|i| &report.runs[i]);
        let both: Vec<&RunAnalysis> = pair.iter().filter_map(|i| run(*i)).collect();
        let form =
            |i: Option<usize>| run(i).map(|run| Runs(vec![run]).budget(&resolved, false, false));
        let both = Runs(both);
        Iso230Budget {
            g_cw: form(pair[0]),
            g_ccw: form(pair[1]),
            g_b: iso.g_b_m.map(|_| both.budget_of_both(&resolved)),
            f: both.budget(&resolved, true, true),
            d: iso.d_m.map(|_| both.budget(&resolved, true, false)),
        }
    };
    let flat = grouped.concat();
    flat.iter().zip(&report.iso230_4).map(of).collect()
}

/// The budget of the size of each run's circle, in their order.
pub fn of_sizes(report: &Report, conditions: &Conditions) -> Vec<Budget> {
    let resolved = resolve(report, conditions);
    let of = |run| Runs(vec![run]).budget(&resolved, true, false);
    report.runs.iter().map(of).collect()
}

/// Whether a figure holds a tolerance (ISO 14253-1): only beyond its uncertainty is it certain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Figure and uncertainty lie within the tolerance.
    Pass,
    /// The tolerance lies within the uncertainty of the figure: neither can be proven.
    Undecided,
    /// Figure less uncertainty lies beyond the tolerance.
    Fail,
}

/// Decides a figure against a tolerance, all in m.
///
/// ```
/// use giotto::analysis::uncertainty::{Verdict, decide};
///
/// // 8 µm ± 1 µm against 10 µm; then too close to tell; then certainly beyond.
/// assert_eq!(decide(8e-6, 1e-6, 10e-6), Verdict::Pass);
/// assert_eq!(decide(9.5e-6, 1e-6, 10e-6), Verdict::Undecided);
/// assert_eq!(decide(-12e-6, 1e-6, 10e-6), Verdict::Fail);
/// ```
pub fn decide(figure_m: f64, expanded_m: f64, tolerance_m: f64) -> Verdict {
    let size = figure_m.abs();
    if size + expanded_m <= tolerance_m {
        Verdict::Pass
    } else if size - expanded_m > tolerance_m {
        Verdict::Fail
    } else {
        Verdict::Undecided
    }
}

/// A budget in one sentence: each source with its standard uncertainty in µm and how it is known.
pub fn words(budget: &Budget) -> String {
    let one = |p: &Part| {
        let source = match p.source {
            Source::Instrument => "instrument",
            Source::SetUp => "set-up",
            Source::Repeatability => "repeatability",
            Source::Temperature => "temperature",
            Source::Sampling => "sampling",
        };
        let um = p.standard_m * 1e6;
        match p.known {
            Known::Missing => format!("{source} unknown (repeat a circle) and not counted"),
            Known::Assumed => format!("{source} {um:.2} (assumed)"),
            Known::Given => format!("{source} {um:.2} (given)"),
            Known::Measured => format!("{source} {um:.2}"),
        }
    };
    let parts: Vec<String> = budget.parts.iter().map(one).collect();
    format!(
        "Budget of F, first circle, µm (k = 1): {}.",
        parts.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::of_campaign;
    use crate::simulation::{CircleTest, Instrument, Machine, Plan, PlannedTest, campaign};
    use giotto_shared::Direction;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// The same pair, measured again and again with noise, scatter and set-ups of its own: the figures stay within their
    /// expanded uncertainty of their mean about as often as k = 2 promises, and not always.
    #[test]
    fn figures_scatter_as_their_uncertainty_says() {
        let test = |direction| PlannedTest {
            test: CircleTest::new(0.1, 0.1, direction),
            timed: false,
        };
        let plan = Plan {
            name: "pair".into(),
            machine_name: "simulated".into(),
            machine: Machine {
                squareness_rad: [40e-6, 0.0, 0.0],
                ..Machine::default()
            },
            instrument: Instrument {
                setup_spread_m: 0.0,
                spread_m: 1e-6,
                ..Instrument::ballbar()
            },
            tests: vec![test(Direction::Ccw), test(Direction::Cw)],
            shuffle: false,
        };
        // Both directions of a pair share their set-up; each pair has its own.
        let mut random = ChaCha8Rng::seed_from_u64(15);
        let mut set_up = || [0, 1].map(|_| Normal::new(0.0, 15e-6).unwrap().sample(&mut random));
        let conditions = Conditions {
            instrument_m: Some(1e-9),
            temperature_k: Some(1e-6),
            repeatability_m: Some(1e-6),
        };
        let (mut values, mut expanded) = (Vec::new(), Vec::new());
        for seed in 0..60 {
            let mut plan = plan.clone();
            plan.instrument.setup_m = set_up();
            let report = of_campaign(&campaign(&plan, seed)).unwrap();
            let budget = of_report(&report, &conditions)[0];
            let iso = report.iso230_4[0];
            values.push([iso.g_b_m.unwrap(), iso.d_m.unwrap(), iso.f_max_m]);
            expanded.push([budget.g_b, budget.d, Some(budget.f)].map(|b| b.unwrap().expanded_m()));
        }
        for figure in 0..3 {
            let mean = values.iter().map(|v| v[figure]).sum::<f64>() / values.len() as f64;
            let within = values.iter().zip(&expanded);
            let within = within
                .filter(|(v, u)| (v[figure] - mean).abs() <= u[figure])
                .count();
            assert!(within >= 51, "{figure}: {within} of 60 within k = 2");
            // Not a blanket: the standard deviation is at least a fifth of what the budget says.
            let variance = values
                .iter()
                .map(|v| (v[figure] - mean).powi(2))
                .sum::<f64>()
                / 59.0;
            let said = expanded.iter().map(|u| u[figure]).sum::<f64>() / 60.0 / COVERAGE;
            assert!(
                variance.sqrt() > 0.2 * said,
                "{figure}: {} {said}",
                variance.sqrt()
            );
        }
    }

    #[test]
    fn a_tolerance_inside_the_uncertainty_decides_nothing() {
        assert_eq!(decide(5e-6, 1e-6, 7e-6), Verdict::Pass);
        assert_eq!(decide(-5e-6, 1e-6, 5.5e-6), Verdict::Undecided);
        assert_eq!(decide(5e-6, 1e-6, 4.5e-6), Verdict::Undecided);
        assert_eq!(decide(-5e-6, 1e-6, 3.5e-6), Verdict::Fail);
    }
}
