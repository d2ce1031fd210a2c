//! What is kept of a campaign and its diagnosis: the figures that comparison and history set side by side.
use crate::analysis::uncertainty::{Conditions, of_report, of_sizes};
use crate::analysis::{Report, tolerance};
use crate::campaign::Direction;
use crate::diagnosis::{Diagnosis, Finding};
use serde::Serialize;

/// A figure of the circles of one radius and feed: the mean over its repeats.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// `radius_error_cw`, `radius_error_ccw`, or a figure of ISO 230-4.
    pub figure: &'static str,
    /// Programmed radius, mm.
    pub radius_mm: f64,
    /// Programmed feed, mm/s.
    pub feed_mm_s: f64,
    /// Its value, µm.
    pub value_um: f64,
    /// Standard uncertainty of a change of it between two campaigns with one instrument, µm.
    pub standard_um: f64,
    /// How many circles it is the mean of.
    pub circles: usize,
}

/// A cause as it was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CauseFigure {
    /// Name in the closed list.
    pub cause: String,
    /// Its name for a person.
    pub name: String,
    /// Where it sits: `x`, `y`, `joint1`; empty for the machine as a whole.
    pub actuators: String,
    /// Contract's unit.
    pub unit: String,
    /// Value in that unit.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// What it does to the circles, µm rms.
    pub rms_um: f64,
    /// Probability that it is there.
    pub probability: f64,
}

/// A campaign in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the campaign.
    pub name: String,
    /// Machine.
    pub machine: String,
    /// Number of runs.
    pub runs: usize,
    /// Whether there were enough runs to call something real, and so to say that something is not there.
    pub proven: bool,
    /// Noise of a sample, µm.
    pub noise_um: f64,
    /// Scatter of the size between runs, µm.
    pub spread_um: f64,
    /// Root mean square of what has no name, µm.
    pub unexplained_um: f64,
    /// Figures of the circles.
    pub figures: Vec<Figure>,
    /// Causes that were found.
    pub causes: Vec<CauseFigure>,
}

/// Where a finding sits. The only place of comparison and history that looks.
fn actuators(finding: &Finding) -> String {
    finding.place()
}

impl Summary {
    /// Of an analysis and a diagnosis of the same campaign.
    pub fn of(report: &Report, diagnosis: &Diagnosis) -> Self {
        let causes = diagnosis.findings.iter().map(|f| CauseFigure {
            cause: f.cause.id().to_owned(),
            name: f.cause.model().words().name.to_owned(),
            actuators: actuators(f),
            unit: f.estimate.unit.to_owned(),
            value: f.estimate.value,
            ci95: f.estimate.ci95,
            rms_um: f.rms_um,
            probability: f.probability,
        });
        Self {
            name: report.name.clone(),
            machine: report.machine.clone(),
            runs: report.runs.len(),
            proven: diagnosis.gain.is_some(),
            noise_um: diagnosis.noise_um,
            spread_um: diagnosis.spread_um,
            unexplained_um: if diagnosis.unexplained.present {
                diagnosis.unexplained.rms_um
            } else {
                0.0
            },
            figures: figures(report, diagnosis.spread_um * 1e-6),
            causes: causes.collect(),
        }
    }

    /// A figure by its name and circle.
    pub fn figure(&self, like: &Figure) -> Option<&Figure> {
        self.figures.iter().find(|f| {
            f.figure == like.figure
                && f.radius_mm == like.radius_mm
                && f.feed_mm_s == like.feed_mm_s
        })
    }

    /// A cause by its name and place.
    pub fn cause(&self, like: &CauseFigure) -> Option<&CauseFigure> {
        let same = |c: &&CauseFigure| c.cause == like.cause && c.actuators == like.actuators;
        self.causes.iter().find(same)
    }
}

fn figures(report: &Report, spread_m: f64) -> Vec<Figure> {
    let conditions = Conditions {
        repeatability_m: report.repeatability_m.or(Some(spread_m)),
        ..Conditions::default()
    };
    let mm = |si: f64| (si * 1e9).round() / 1e6;
    let mut out: Vec<Figure> = Vec::new();
    // Sums first: values and variances of all circles of a kind.
    let mut add = |figure, radius_m: f64, feed_m_s: f64, value_m: f64, standard_m: f64| {
        let (radius_mm, feed_mm_s) = (mm(radius_m), mm(feed_m_s));
        let same = |f: &&mut Figure| {
            f.figure == figure && f.radius_mm == radius_mm && f.feed_mm_s == feed_mm_s
        };
        let (value_um, variance) = (value_m * 1e6, (standard_m * 1e6).powi(2));
        match out.iter_mut().find(same) {
            Some(f) => {
                f.value_um += value_um;
                f.standard_um += variance;
                f.circles += 1;
            }
            None => out.push(Figure {
                figure,
                radius_mm,
                feed_mm_s,
                value_um,
                standard_um: variance,
                circles: 1,
            }),
        }
    };
    for (run, budget) in report.runs.iter().zip(of_sizes(report, &conditions)) {
        let figure = if run.direction == Direction::Ccw {
            "radius_error_ccw"
        } else {
            "radius_error_cw"
        };
        add(
            figure,
            run.radius_m,
            run.feed_m_s,
            run.radius_error_m,
            budget.of_change_m(),
        );
    }
    for (iso, budget) in report.iso230_4.iter().zip(of_report(report, &conditions)) {
        let named = tolerance::FIGURES
            .into_iter()
            .zip(tolerance::figures(iso, &budget));
        for (name, figure) in named {
            if let Some((value_m, budget)) = figure {
                add(
                    name,
                    iso.radius_m,
                    iso.feed_m_s,
                    value_m,
                    budget.of_change_m(),
                );
            }
        }
    }
    for figure in &mut out {
        let n = figure.circles as f64;
        figure.value_um /= n;
        figure.standard_um = figure.standard_um.sqrt() / n;
    }
    let key = |f: &Figure| (f.radius_mm, f.feed_mm_s);
    out.sort_by(|a, b| {
        key(a)
            .partial_cmp(&key(b))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    out
}
