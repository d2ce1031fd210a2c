//! The paper's Figures 8–11 for any campaign, as SVG with the numbers that they draw; 2–7 are in `forms`.
use giotto::campaign::Direction;
use giotto::fit::{Part, Point};
use giotto_shared::model::RadiusModel;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// One drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// File name.
    pub file: String,
    /// The SVG document.
    pub svg: String,
    /// What it draws, one row a point: the file of the same name with `.csv`.
    pub csv: String,
}

/// Why a drawing failed; in memory it does not.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file} cannot be drawn: {why}")]
pub struct FigureError {
    file: &'static str,
    why: String,
}

const SIZE: (u32, u32) = (760, 500);
const FONT: &str = "sans-serif";
/// Told apart by people who cannot tell red from green, and in print (after Okabe and Ito).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];
/// Room for the key under the axes, pixels.
const KEY_HEIGHT: u32 = 28;
/// Steps of a drawn curve.
const CURVE_STEPS: usize = 100;

/// A run in a figure.
struct Mark {
    /// Acceleration, m/s², and value, µm.
    at: (f64, f64),
    /// Whether the run was fitted: filled; predicted ones are hollow.
    fitted: bool,
    /// CCW is a circle, CW a triangle.
    direction: Direction,
    feed_m_s: f64,
}

/// Points of one radius.
struct Series {
    radius_m: f64,
    points: Vec<Mark>,
    curve: Vec<(f64, f64)>,
}

/// Figures 8 (radius error), 9 (out-of-roundness, where known), 10 (measured and predicted, offsets removed) and 11
/// (residuals), each against the centripetal acceleration f²/R. `directions` are those of the points, in their order.
///
/// # Errors
/// [`FigureError`] if the drawing library fails.
///
/// ```
/// use giotto::campaign::Direction;
/// use giotto::fit::{Observation, RadiusFit};
/// use giotto_report::figures::figures;
///
/// let runs: Vec<Observation> = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
///     .into_iter()
///     .flat_map(|feed_m_s| [0.1, 0.2].map(|radius_m| Observation {
///         radius_m,
///         feed_m_s,
///         radius_error_m: -200e-6 * feed_m_s * feed_m_s / radius_m + 1e-6 * (90.0 * feed_m_s).sin(),
///         out_of_roundness_m: None,
///     }))
///     .collect();
/// let fit = RadiusFit::new(&runs, Default::default())?;
/// let drawn = figures(&fit.points(&runs), &[Direction::Ccw; 12], &fit.model)?;
/// // Figure 9 needs out-of-roundness, which these runs have not.
/// let names: Vec<&str> = drawn.iter().map(|figure| figure.file.as_str()).collect();
/// assert_eq!(names, ["figure08.svg", "figure10.svg", "figure11.svg"]);
/// // Each holds the numbers that it draws: a line a run and its head.
/// assert!(drawn[0].svg.contains("<svg") && drawn[0].csv.lines().count() > 12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn figures(
    points: &[Point],
    directions: &[Direction],
    model: &RadiusModel<f64>,
) -> Result<Vec<Figure>, FigureError> {
    let points: Vec<(&Point, Direction)> = points.iter().zip(directions.iter().copied()).collect();
    let points = points.as_slice();
    let mut figures = vec![draw(
        "figure08.svg",
        "Radius size error",
        "radius size error, µm",
        &series(points, None, |p| Some(p.observation.radius_error_m)),
    )?];
    if points
        .iter()
        .any(|(p, _)| p.observation.out_of_roundness_m.is_some())
    {
        let roundness = series(points, None, |p| p.observation.out_of_roundness_m);
        figures.push(draw(
            "figure09.svg",
            "Out-of-roundness",
            "out-of-roundness, µm",
            &roundness,
        )?);
    }
    figures.push(draw(
        "figure10.svg",
        "Measured (marks) and predicted (lines) radius size error, offsets removed",
        "radius size error, µm",
        &series(points, Some(model), |p| Some(p.measured_m())),
    )?);
    figures.push(draw(
        "figure11.svg",
        "Residuals: measured minus predicted",
        "residual, µm",
        &series(points, None, |p| Some(p.residual_m())),
    )?);
    Ok(figures)
}

fn series(
    points: &[(&Point, Direction)],
    model: Option<&RadiusModel<f64>>,
    value: impl Fn(&Point) -> Option<f64>,
) -> Vec<Series> {
    let mut all: Vec<Series> = Vec::new();
    for (p, direction) in points {
        let radius_m = p.observation.radius_m;
        let Some(value) = value(p) else { continue };
        let mark = Mark {
            at: (p.observation.f2_r(), value * 1e6),
            fitted: p.part == Part::Train,
            direction: *direction,
            feed_m_s: p.observation.feed_m_s,
        };
        match all
            .iter_mut()
            .find(|s| (s.radius_m - radius_m).abs() < 1e-9)
        {
            Some(s) => s.points.push(mark),
            None => all.push(Series {
                radius_m,
                points: vec![mark],
                curve: Vec::new(),
            }),
        }
    }
    all.sort_by(|a, b| a.radius_m.total_cmp(&b.radius_m));
    if let Some(model) = model {
        for s in &mut all {
            let top = s.points.iter().map(|p| p.at.0).fold(0.0, f64::max);
            let at = |i: usize| {
                let acceleration = top * i as f64 / CURVE_STEPS as f64;
                (
                    acceleration,
                    1e6 * model.radius_error_m(s.radius_m, (acceleration * s.radius_m).sqrt()),
                )
            };
            s.curve = (0..=CURVE_STEPS).map(at).collect();
        }
    }
    all
}

/// A range that holds all values and zero, with room around them.
fn room(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let margin = 0.05 * (high - low).max(1e-3);
    low - margin..high + margin
}

fn draw(
    file: &'static str,
    title: &str,
    value: &str,
    series: &[Series],
) -> Result<Figure, FigureError> {
    let mut svg = String::new();
    render(&mut svg, title, value, series).map_err(|why| FigureError { file, why })?;
    Ok(Figure {
        file: file.to_owned(),
        svg,
        csv: csv(series),
    })
}

/// The numbers of a figure: one row a run.
fn csv(series: &[Series]) -> String {
    let mut out = String::from("radius_mm,feed_mm_s,direction,part,acceleration_m_s2,value_um\n");
    for s in series {
        for p in &s.points {
            let way = if p.direction == Direction::Ccw {
                "ccw"
            } else {
                "cw"
            };
            let part = if p.fitted { "fitted" } else { "predicted" };
            let (x, y) = p.at;
            let feed = trimmed_mm(p.feed_m_s);
            out += &format!(
                "{},{feed},{way},{part},{x:.6},{y:.6}\n",
                trimmed_mm(s.radius_m)
            );
        }
    }
    out
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn render(svg: &mut String, title: &str, value: &str, series: &[Series]) -> Result<(), String> {
    let words = |e: &dyn std::fmt::Display| e.to_string();
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE).map_err(|e| words(&e))?;
    let marks = || series.iter().flat_map(|s| s.points.iter());
    let lines = || series.iter().flat_map(|s| s.curve.iter());
    let x = room(marks().map(|p| p.at.0));
    let y = room(marks().map(|p| p.at.1).chain(lines().map(|p| p.1)));
    let mut chart: Chart<'_, '_> = ChartBuilder::on(&root)
        .caption(format!("{title} (circles: CCW, triangles: CW)"), (FONT, 16))
        .margin(14)
        .margin_bottom(14 + KEY_HEIGHT)
        .x_label_area_size(44)
        .y_label_area_size(62)
        .build_cartesian_2d(x, y)
        .map_err(|e| words(&e))?;
    chart
        .configure_mesh()
        .x_desc("programmed centripetal acceleration f²/R, m/s²")
        .y_desc(value)
        .axis_desc_style((FONT, 14))
        .label_style((FONT, 12))
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .draw()
        .map_err(|e| words(&e))?;
    for (s, colour) in series.iter().zip(COLOURS.iter().cycle()) {
        let colour = *colour;
        chart
            .draw_series(LineSeries::new(
                s.curve.iter().copied(),
                colour.stroke_width(1),
            ))
            .map_err(|e| words(&e))?;
        let style = |p: &Mark| fill(colour, p.fitted);
        let of = |direction| s.points.iter().filter(move |p| p.direction == direction);
        let round = of(Direction::Ccw).map(|p| Circle::new(p.at, 4, style(p)));
        chart.draw_series(round).map_err(|e| words(&e))?;
        let filled = of(Direction::Cw).filter(|p| p.fitted);
        let filled = filled.map(|p| EmptyElement::at(p.at) + Polygon::new(TRIANGLE, style(p)));
        chart.draw_series(filled).map_err(|e| words(&e))?;
        let hollow = of(Direction::Cw).filter(|p| !p.fitted);
        let hollow = hollow.map(|p| EmptyElement::at(p.at) + PathElement::new(TRIANGLE, style(p)));
        chart.draw_series(hollow).map_err(|e| words(&e))?;
    }
    drop(chart);
    // The key has a line of its own: nothing lies under it.
    let y = (SIZE.1 - KEY_HEIGHT / 2 - 8) as i32;
    for (i, (s, colour)) in series.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let x = 80 + 200 * i as i32;
        let fitted = s.points.iter().any(|p| p.fitted);
        let text = format!(
            "R {} mm, {}",
            trimmed_mm(s.radius_m),
            if fitted { "fitted" } else { "predicted" }
        );
        root.draw(&Circle::new((x, y), 4, fill(*colour, fitted)))
            .map_err(|e| words(&e))?;
        root.draw(&Text::new(text, (x + 12, y - 6), (FONT, 13)))
            .map_err(|e| words(&e))?;
    }
    root.present().map_err(|e| words(&e))
}

/// A triangle about a point, pixels; closed.
const TRIANGLE: [(i32, i32); 4] = [(-4, 3), (4, 3), (0, -5), (-4, 3)];

fn fill(colour: RGBColor, fitted: bool) -> ShapeStyle {
    if fitted {
        colour.filled()
    } else {
        colour.stroke_width(2)
    }
}

/// A radius in mm, without digits that rounding made.
fn trimmed_mm(radius_m: f64) -> f64 {
    (radius_m * 1e9).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto::fit::{Observation, Options, RadiusFit};

    #[test]
    fn figures_are_drawn_with_every_run_in_them() {
        let paper = RadiusModel {
            beta1_s2: -23.29e-6,
            beta2_s4: -0.23e-6,
        };
        let runs: Vec<Observation> = [(0.1, 1.96e-6), (0.15, -12e-6), (0.3, 40e-6)]
            .into_iter()
            .flat_map(|(radius_m, offset_m)| {
                (0..26).map(move |i| {
                    let feed_m_s = 0.02 + 0.68 * f64::from(i / 2) / 12.0;
                    Observation {
                        radius_m,
                        feed_m_s,
                        radius_error_m: offset_m + paper.radius_error_m(radius_m, feed_m_s),
                        out_of_roundness_m: Some(20e-6),
                    }
                })
            })
            .collect();
        let options = Options {
            train_radius_m: Some(0.1),
            ..Options::default()
        };
        let fit = RadiusFit::new(&runs, options).unwrap();
        let directions: Vec<Direction> = (0..runs.len())
            .map(|i| {
                if i % 2 == 0 {
                    Direction::Ccw
                } else {
                    Direction::Cw
                }
            })
            .collect();
        let figures = figures(&fit.points(&runs), &directions, &fit.model).unwrap();
        assert_eq!(figures.len(), 4);
        for figure in figures {
            // A circle for each CCW run and one for each radius in the key; triangles for the others.
            let circles = figure.svg.matches("<circle").count();
            assert_eq!(circles, 39 + 3, "{}", figure.file);
            assert_eq!(figure.csv.lines().count(), 1 + 78);
            assert_eq!(figure.csv.matches(",ccw,").count(), 39);
            assert!(figure.svg.contains("R 300 mm, predicted"));
        }
    }
}
