//! Scatter plots as inline SVG: colours by class, so that they follow the page into the dark and onto paper.
use super::number::{escape, plain};
use std::fmt::Write;

/// A point of a plot.
#[derive(Clone, Debug)]
pub struct Point {
    /// Where.
    pub at: [f64; 2],
    /// Index of the shape: one a radius.
    pub shape: usize,
    /// CSS class: its colour.
    pub class: &'static str,
    /// What hovering shows.
    pub label: String,
}

/// A scatter plot with curves.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// Identifies it on the page.
    pub id: String,
    /// What it shows, for who cannot see it.
    pub description: String,
    /// Axis titles.
    pub titles: [String; 2],
    /// Points.
    pub points: Vec<Point>,
    /// Curves with their classes.
    pub curves: Vec<(&'static str, Vec<[f64; 2]>)>,
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 74.0;
const BOTTOM: f64 = 48.0;
const TOP: f64 = 12.0;
const RIGHT: f64 = 14.0;

/// Round values that divide a range into about `count` parts.
pub fn ticks(low: f64, high: f64, count: f64) -> Vec<f64> {
    let span = high - low;
    if span <= 0.0 || !span.is_finite() {
        return vec![low];
    }
    let rough = span / count;
    let power = 10f64.powf(rough.log10().floor());
    let step = power
        * [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .find(|m| m * power >= rough)
            .unwrap_or(10.0);
    let first = (low / step).ceil() as i64;
    (first..)
        .map(|k| k as f64 * step)
        .take_while(|v| *v <= high + 1e-9 * span)
        .take(50)
        .collect()
}

/// Smallest and largest, with a margin; never empty.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values
        .filter(|v| v.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| {
            [l.min(v), h.max(v)]
        });
    if low > high {
        return [0.0, 1.0];
    }
    let margin = if high > low {
        0.05 * (high - low)
    } else {
        0.5 * low.abs().max(1e-6)
    };
    [low - margin, high + margin]
}

impl Chart {
    /// The plot as one `<svg>` element.
    pub fn svg(&self) -> String {
        let all = || {
            self.points
                .iter()
                .map(|p| p.at)
                .chain(self.curves.iter().flat_map(|c| c.1.iter().copied()))
        };
        let x = range(all().map(|p| p[0]));
        // Zero belongs to every vertical axis here.
        let y = range(all().map(|p| p[1]).chain([0.0]));
        let px = |v: f64| LEFT + (v - x[0]) / (x[1] - x[0]) * (WIDTH - LEFT - RIGHT);
        let py = |v: f64| HEIGHT - BOTTOM - (v - y[0]) / (y[1] - y[0]) * (HEIGHT - BOTTOM - TOP);
        let mut out = format!(
            "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-labelledby=\"{0}-d\"><desc id=\"{0}-d\">{1}</desc>",
            self.id,
            escape(&self.description)
        );
        for v in ticks(x[0], x[1], 6.0) {
            let at = px(v);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{at:.1} {TOP}V{:.1}\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                HEIGHT - BOTTOM,
                HEIGHT - BOTTOM + 16.0,
                tick(v)
            );
        }
        for v in ticks(y[0], y[1], 5.0) {
            let at = py(v);
            let class = if v == 0.0 { "grid zero" } else { "grid" };
            let _ = write!(
                out,
                "<path class=\"{class}\" d=\"M{LEFT} {at:.1}H{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 6.0,
                at + 4.0,
                tick(v)
            );
        }
        let _ = write!(
            out,
            "<text class=\"title\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text><text class=\"title\" transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            0.5 * (LEFT + WIDTH - RIGHT),
            HEIGHT - 8.0,
            escape(&self.titles[0]),
            0.5 * (TOP + HEIGHT - BOTTOM),
            escape(&self.titles[1])
        );
        for (class, curve) in &self.curves {
            let _ = write!(out, "<path class=\"curve {class}\" d=\"");
            for (i, p) in curve.iter().enumerate() {
                let _ = write!(
                    out,
                    "{}{:.1} {:.1}",
                    if i == 0 { 'M' } else { 'L' },
                    px(p[0]),
                    py(p[1])
                );
            }
            out.push_str("\"/>");
        }
        for p in &self.points {
            let _ = write!(
                out,
                "<g class=\"{}\" transform=\"translate({:.1} {:.1})\">{}<title>{}</title></g>",
                p.class,
                px(p.at[0]),
                py(p.at[1]),
                shape(p.shape),
                escape(&p.label)
            );
        }
        out.push_str("</svg>");
        out
    }
}

fn tick(value: f64) -> String {
    let text = if value != 0.0 && value.abs() < 1e-3 {
        format!("{value:.0e}")
    } else {
        plain(value)
    };
    text.replace('-', "−")
}

/// Marks that differ without colour.
pub fn shape(index: usize) -> &'static str {
    match index % 5 {
        0 => "<circle r=\"3.6\"/>",
        1 => "<path d=\"M-3.4-3.4H3.4V3.4H-3.4Z\"/>",
        2 => "<path d=\"M0-4.6L4.4 3.4H-4.4Z\"/>",
        3 => "<path d=\"M0-4.8L4.8 0 0 4.8-4.8 0Z\"/>",
        _ => "<path d=\"M0 4.6L4.4-3.4H-4.4Z\"/>",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(
            ticks(0.0, 1.0, 5.0),
            vec![0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]
        );
        assert_eq!(ticks(-3.0, 7.0, 2.0), vec![0.0, 5.0]);
        assert_eq!(ticks(2.0, 2.0, 5.0), vec![2.0]);
    }

    #[test]
    fn a_chart_without_points_and_one_with_a_single_point_have_finite_coordinates() {
        let point = Point {
            at: [3.0, -2.0],
            shape: 7,
            class: "a",
            label: "<run>".into(),
        };
        for points in [vec![], vec![point]] {
            let svg = Chart {
                id: "c".into(),
                points,
                ..Chart::default()
            }
            .svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            assert!(!svg.contains("<run>"));
        }
    }
}
