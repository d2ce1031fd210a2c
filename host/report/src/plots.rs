//! Plots of all runs: the collapse test, sizes and forms over the acceleration, what is left.
use super::chart::{Chart, Point};
use super::number::{fixed, plain};
use super::page_content::ways;
use giotto::analysis;
use giotto::campaign::{Campaign, Direction};
use giotto::diagnosis::Diagnosis;

fn shape_of(radii: &[f64], radius_m: f64) -> usize {
    radii.iter().position(|r| *r == radius_m).unwrap_or(0)
}

pub(super) fn collapse(campaign: &Campaign, d: &Diagnosis, radii: &[f64]) -> String {
    let ratio = |size_m: f64, radius_m: f64| 1e3 * (size_m / radius_m).ln_1p();
    let points = d
        .picture
        .iter()
        .map(|p| {
            let run = &campaign.runs[p.index];
            let at = [p.omega_rad_s.powi(2), ratio(p.size_m[0], run.radius_m)];
            Point {
                at,
                shape: shape_of(radii, run.radius_m),
                class: if run.direction == Direction::Ccw {
                    "ccw"
                } else {
                    "cw"
                },
                label: format!(
                    "{}: R {} mm, {} mm/s, {}: ω² {} rad²/s², ln(Rm/R) {} · 10⁻³",
                    run.file,
                    plain(run.radius_m * 1e3),
                    plain(run.feed_m_s * 1e3),
                    ways(run.direction),
                    fixed(at[0], 2),
                    fixed(at[1], 4)
                ),
            }
        })
        .collect();
    // One curve each: both models shrink a circle by its ω alone, but for the named causes.
    let mut before: Vec<[f64; 2]> = d
        .picture
        .iter()
        .map(|p| {
            let radius = campaign.runs[p.index].radius_m;
            [
                p.omega_rad_s.powi(2),
                ratio(p.size_m[0] - p.size_m[1], radius),
            ]
        })
        .collect();
    before.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let fastest = d.picture.iter().map(|p| p.omega_rad_s).fold(0.0, f64::max);
    let response = d.model.servo.response();
    let after = (0..=60)
        .map(|i| fastest * f64::from(i) / 60.0)
        .map(|omega| [omega * omega, 1e3 * response.gain(omega).ln()])
        .collect();
    Chart {
        id: "collapse".into(),
        description: format!(
            "ln(Rm/R) against ω² for {} runs. Values of each run are in the table of runs.",
            d.picture.len()
        ),
        titles: ["ω², rad²/s²".into(), "ln(Rm/R), 10⁻³".into()],
        points,
        curves: vec![("before", before), ("after", after)],
    }
    .svg()
}

pub(super) fn residuals(campaign: &Campaign, d: &Diagnosis, radii: &[f64]) -> String {
    let mut points = Vec::new();
    for (k, class, words) in [
        (0, "measured", "measured"),
        (1, "before", "left before"),
        (2, "after", "left after"),
    ] {
        points.extend(d.picture.iter().map(|p| {
            let run = &campaign.runs[p.index];
            let at = [run.feed_m_s.powi(2) / run.radius_m, p.size_m[k] * 1e6];
            Point {
                at,
                shape: shape_of(radii, run.radius_m),
                class,
                label: format!(
                    "{}: R {} mm, {} mm/s, {}: {} m/s², {words} {} µm",
                    run.file,
                    plain(run.radius_m * 1e3),
                    plain(run.feed_m_s * 1e3),
                    ways(run.direction),
                    fixed(at[0], 3),
                    fixed(at[1], 2)
                ),
            }
        }));
    }
    Chart {
        id: "residuals".into(),
        description: format!(
            "Radius error of {} runs over the programmed centripetal acceleration: as measured, and what the simulation leaves before and after. Values of each run are in the table of runs.",
            d.picture.len()
        ),
        titles: ["centripetal acceleration f²/R, m/s²".into(), "radius error, µm".into()],
        points,
        curves: Vec::new(),
    }
    .svg()
}

/// Sizes or forms of all runs over the centripetal acceleration, directions apart.
pub(super) fn over_acceleration(
    report: Option<&analysis::Report>,
    radii: &[f64],
    id: &str,
) -> String {
    let size = id == "sizes";
    let words = if size {
        "radius error"
    } else {
        "out-of-roundness"
    };
    let point = |run: &analysis::RunAnalysis| {
        let value = if size {
            run.radius_error_m
        } else {
            run.out_of_roundness_m
        } * 1e6;
        let at = [run.feed_m_s.powi(2) / run.radius_m, value];
        Point {
            at,
            shape: shape_of(radii, run.radius_m),
            class: if run.direction == Direction::Ccw {
                "ccw"
            } else {
                "cw"
            },
            label: format!(
                "{}: R {} mm, {} mm/s, {}: {} m/s², {words} {} µm",
                run.file,
                plain(run.radius_m * 1e3),
                plain(run.feed_m_s * 1e3),
                ways(run.direction),
                fixed(at[0], 3),
                fixed(value, 1)
            ),
        }
    };
    let runs = report
        .map(|report| report.runs.as_slice())
        .unwrap_or_default();
    Chart {
        id: id.into(),
        description: format!(
            "{words} of {} runs over the programmed centripetal acceleration, both directions.",
            runs.len()
        ),
        titles: [
            "centripetal acceleration f²/R, m/s²".into(),
            format!("{words}, µm"),
        ],
        points: runs.iter().map(point).collect(),
        curves: Vec::new(),
    }
    .svg()
}
