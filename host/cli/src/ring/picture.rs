//! The circle that was farthest off, before and after, as SVG.
use super::prove::{Measured, Pair, Proof};
use giotto_shared::Direction;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Radius of a nominal circle in the picture.
const NOMINAL: f64 = 100.0;
/// Largest deviation before, drawn.
const LARGEST: f64 = 62.0;
/// Width of a panel and height of the picture.
const PANEL: f64 = 290.0;
const HEIGHT: f64 = 400.0;
/// Middle of the circles from above.
const MIDDLE: f64 = 210.0;
/// Points of a turn that are drawn; each is the mean of its neighbours.
const POINTS: usize = 360;
/// By how much the last panel is magnified over the first two.
const CLOSER: f64 = 10.0;

/// The circle with the largest size error without correction, run both ways: before and after at the same
/// magnification of the deviation, and after once more, magnified ten times further. Empty without circles.
pub fn picture(proof: &Proof) -> String {
    let farthest = |a: &&Pair, b: &&Pair| {
        let error = |p: &Pair| p.before.analysis.radius_error_m.abs();
        error(a).total_cmp(&error(b))
    };
    let Some(worst) = proof.circles.iter().max_by(farthest) else {
        return String::new();
    };
    let (radius_m, feed_m_s) = (
        worst.before.analysis.radius_m,
        worst.before.analysis.feed_m_s,
    );
    let both: Vec<&Pair> = proof
        .circles
        .iter()
        .filter(|p| {
            p.before.analysis.radius_m == radius_m && p.before.analysis.feed_m_s == feed_m_s
        })
        .collect();
    let largest = both
        .iter()
        .flat_map(|p| &p.before.samples.deviation_m)
        .fold(1e-9_f64, |largest, deviation| largest.max(deviation.abs()));
    let scale = LARGEST / largest;
    let mut svg = String::new();
    let width = 3.0 * PANEL;
    // Writing to a String cannot fail.
    let _ = write!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT}" font-family="sans-serif" font-size="13" fill="#222">
<title>Circle before and after correction, simulated machine</title>
<rect width="100%" height="100%" fill="#fff"/>
<text x="{}" y="24" text-anchor="middle" font-size="15">R {:.0} mm at {:.0} mm/s on a simulated machine; neither radius nor speed was measured before</text>
"##,
        width / 2.0,
        radius_m * 1e3,
        feed_m_s * 1e3,
    );
    #[allow(clippy::type_complexity, reason = "a table of panels, read once")]
    let panels: [(&str, f64, fn(&Pair) -> &Measured); 3] = [
        ("before", 1.0, |p| &p.before),
        ("after", 1.0, |p| &p.after),
        ("after", CLOSER, |p| &p.after),
    ];
    for (index, (title, closer, of)) in panels.into_iter().enumerate() {
        let x = PANEL * (index as f64 + 0.5);
        let magnification = scale * closer * radius_m / NOMINAL;
        let runs: Vec<&Measured> = both.iter().map(|p| of(p)).collect();
        panel(&mut svg, x, title, &runs, scale * closer, magnification);
    }
    for (row, (direction, words)) in [
        (Direction::Ccw, "counter-clockwise"),
        (Direction::Cw, "clockwise"),
    ]
    .into_iter()
    .enumerate()
    {
        let x = width / 2.0 - 150.0 + 170.0 * row as f64;
        let _ = writeln!(
            svg,
            r##"<path d="M{x} 384h24" stroke="{}" stroke-width="2"/><text x="{}" y="388">{words}</text>"##,
            colour(direction),
            x + 30.0
        );
    }
    svg.push_str("</svg>\n");
    svg
}

fn colour(direction: Direction) -> &'static str {
    match direction {
        Direction::Ccw => "#0b6fb8",
        Direction::Cw => "#d1550f",
    }
}

/// One panel: `scale` is picture units a metre of deviation.
fn panel(
    svg: &mut String,
    x: f64,
    title: &str,
    runs: &[&Measured],
    scale: f64,
    magnification: f64,
) {
    let ring_m = ring(scale);
    let _ = writeln!(
        svg,
        r##"<g transform="translate({x} {MIDDLE})"><text y="-160" text-anchor="middle" font-weight="bold">{title}</text>"##
    );
    let _ = writeln!(
        svg,
        r##"<text y="-142" text-anchor="middle" fill="#666">deviation × {magnification:.0}</text>"##
    );
    for (radius, dash) in [
        (NOMINAL, ""),
        (NOMINAL - ring_m * scale, "3 4"),
        (NOMINAL + ring_m * scale, "3 4"),
    ] {
        let _ = writeln!(
            svg,
            r##"<circle r="{radius:.1}" fill="none" stroke="#999" stroke-dasharray="{dash}"/>"##
        );
    }
    for run in runs {
        let _ = writeln!(
            svg,
            r##"<path d="{}" fill="none" stroke="{}" stroke-width="1.6"/>"##,
            outline(run, scale),
            colour(run.analysis.direction)
        );
    }
    let mean = |of: fn(&Measured) -> f64| {
        runs.iter().map(|r| of(r)).sum::<f64>() / runs.len().max(1) as f64 * 1e6
    };
    let _ = writeln!(
        svg,
        r##"<g paint-order="stroke" stroke="#fff" stroke-width="4"><text y="-6" text-anchor="middle">radius {:+.2} µm</text><text y="12" text-anchor="middle">form {:.1} µm</text></g><text y="150" text-anchor="middle" fill="#666">dashed: ±{:.0} µm</text></g>"##,
        mean(|r| r.analysis.radius_error_m),
        mean(|r| r.analysis.out_of_roundness_m),
        ring_m * 1e6
    );
}

/// A round length that is drawn 8 to 20 units long, m.
fn ring(scale: f64) -> f64 {
    let wanted = 20.0 / scale;
    let decade = 10f64.powf(wanted.log10().floor());
    [5.0, 2.0, 1.0]
        .into_iter()
        .map(|k| k * decade)
        .find(|v| *v <= wanted)
        .unwrap_or(decade)
}

/// Closed path of a run, the means of its samples over equal parts of the turn.
fn outline(run: &Measured, scale: f64) -> String {
    let mut sums = [(0.0, 0.0); POINTS];
    for (angle, deviation) in run.samples.angle_rad.iter().zip(&run.samples.deviation_m) {
        let part = (angle.rem_euclid(TAU) / TAU * POINTS as f64) as usize;
        let (sum, count) = &mut sums[part.min(POINTS - 1)];
        *sum += deviation;
        *count += 1.0;
    }
    let mut path = String::new();
    for (part, (sum, count)) in sums
        .into_iter()
        .enumerate()
        .filter(|(_, (_, count))| *count > 0.0)
    {
        let (sin, cos) = ((part as f64 + 0.5) / POINTS as f64 * TAU).sin_cos();
        let r = NOMINAL + scale * sum / count;
        let _ = write!(
            path,
            "{}{:.1} {:.1}",
            if path.is_empty() { 'M' } else { 'L' },
            r * cos,
            -r * sin
        );
    }
    path.push('Z');
    path
}
