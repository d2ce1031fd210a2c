//! The paper's Figures 2 to 7 for any campaign: form errors on polar axes, as SVG, with the numbers that they draw.
//!
//! | figure | shows |
//! |---|---|
//! | 2, 3, 4 | CW and CCW at the lowest (a) and highest (b) feed; smallest, middle and largest radius |
//! | 5 | largest radius, CW, lowest, middle and highest feed |
//! | 6 | lowest feed, CW, smallest, middle and largest radius |
//! | 7 | smallest radius, CW, lowest, middle and highest feed |
use super::figures::Figure;
use super::number::{escape, plain};
use giotto::campaign::Direction;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Form error of one run: deviation from the nominal circle about the least-squares centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// File of the run.
    pub file: String,
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// Direction.
    pub direction: Direction,
    /// Polar angles, rad.
    pub angle_rad: Vec<f64>,
    /// Deviations, m.
    pub deviation_m: Vec<f64>,
}

/// Sectors of a drawn turn: 1° each.
const SECTORS: usize = 360;
const SIZE: f64 = 760.0;
const HEIGHT: f64 = 430.0;
/// Radius of the nominal circle on the page, and the reach of the deviation about it.
const NOMINAL: f64 = 105.0;
const REACH: f64 = 52.0;
const COLOURS: [&str; 3] = ["#0072b2", "#d55e00", "#009e73"];

/// One panel: its title and what it draws.
struct Panel<'a> {
    title: String,
    curves: Vec<(&'a Form, String)>,
}

/// Smallest, middle and largest of what there is.
fn three(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values.dedup();
    match values.len() {
        0..=3 => values,
        n => vec![values[0], values[n / 2], values[n - 1]],
    }
}

/// The figures that the campaign has circles for.
pub fn forms(all: &[Form]) -> Vec<Figure> {
    let radii = three(all.iter().map(|f| f.radius_m).collect());
    let find = |radius: f64, feed: f64, direction| {
        let like =
            |f: &&Form| f.radius_m == radius && f.feed_m_s == feed && f.direction == direction;
        all.iter().find(like)
    };
    let feeds = |radius: f64, direction: Option<Direction>| {
        let of = all.iter().filter(|f| {
            f.radius_m == radius && direction.is_none_or(|direction| f.direction == direction)
        });
        three(of.map(|f| f.feed_m_s).collect())
    };
    let mut out = Vec::new();
    for (radius, number) in radii.iter().zip(2..=4) {
        let feeds = feeds(*radius, None);
        let mut ends = vec![feeds.first(), feeds.last()];
        ends.dedup();
        let panels: Vec<Panel<'_>> = ends
            .into_iter()
            .flatten()
            .zip(["(a)", "(b)"])
            .map(|(feed, letter)| Panel {
                title: format!("{letter} R {} mm, {} mm/s", mm(*radius), mm(*feed)),
                curves: [(Direction::Ccw, "CCW"), (Direction::Cw, "CW")]
                    .into_iter()
                    .filter_map(|(d, name)| Some((find(*radius, *feed, d)?, name.to_owned())))
                    .collect(),
            })
            .collect();
        push(&mut out, number, "Form errors, CW and CCW", &panels);
    }
    // One direction: clockwise as in the paper, or the one that was measured.
    let way = if all.iter().any(|f| f.direction == Direction::Cw) {
        Direction::Cw
    } else {
        Direction::Ccw
    };
    let word = if way == Direction::Cw { "CW" } else { "CCW" };
    let by_feed = |radius: Option<&f64>| -> Vec<Panel<'_>> {
        let panel = radius.map(|radius| Panel {
            title: format!("R {} mm, {word}", mm(*radius)),
            curves: feeds(*radius, Some(way))
                .into_iter()
                .filter_map(|feed| Some((find(*radius, feed, way)?, format!("{} mm/s", mm(feed)))))
                .collect(),
        });
        panel.into_iter().collect()
    };
    push(
        &mut out,
        5,
        "Form errors by speed, largest radius",
        &by_feed(radii.last()),
    );
    let lowest = |radius: f64| feeds(radius, Some(way)).first().copied();
    let by_radius = Panel {
        title: format!("lowest speed of each radius, {word}"),
        curves: radii
            .iter()
            .filter_map(|radius| {
                let feed = lowest(*radius)?;
                let words = format!("R {} mm, {} mm/s", mm(*radius), mm(feed));
                Some((find(*radius, feed, way)?, words))
            })
            .collect(),
    };
    push(&mut out, 6, "Form errors by radius", &[by_radius]);
    push(
        &mut out,
        7,
        "Form errors by speed, smallest radius",
        &by_feed(radii.first()),
    );
    out
}

fn mm(si: f64) -> String {
    plain(si * 1e3)
}

fn push(out: &mut Vec<Figure>, number: usize, title: &str, panels: &[Panel<'_>]) {
    if panels.iter().all(|panel| panel.curves.is_empty()) {
        return;
    }
    out.push(Figure {
        file: format!("figure{number:02}.svg"),
        svg: svg(title, panels),
        csv: csv(panels),
    });
}

/// Mean of each degree, µm.
fn sectors(form: &Form) -> Vec<Option<f64>> {
    let mut sums = vec![(0.0, 0.0); SECTORS];
    for (angle, deviation) in form.angle_rad.iter().zip(&form.deviation_m) {
        let at = (angle.rem_euclid(TAU) / TAU * SECTORS as f64) as usize;
        let slot = &mut sums[at.min(SECTORS - 1)];
        slot.0 += deviation * 1e6;
        slot.1 += 1.0;
    }
    sums.into_iter()
        .map(|(sum, n)| (n > 0.0).then(|| sum / n))
        .collect()
}

/// The numbers of a figure: one row a point.
fn csv(panels: &[Panel<'_>]) -> String {
    let mut out = String::from("file,radius_mm,feed_mm_s,direction,angle_deg,deviation_um\n");
    for (form, _) in panels.iter().flat_map(|panel| &panel.curves) {
        let way = if form.direction == Direction::Ccw {
            "ccw"
        } else {
            "cw"
        };
        let file = form.file.replace('"', "\"\"");
        for (k, value) in sectors(form).into_iter().enumerate() {
            if let Some(value) = value {
                let _ = writeln!(
                    out,
                    "\"{file}\",{},{},{way},{}.5,{value:.4}",
                    mm(form.radius_m),
                    mm(form.feed_m_s),
                    k
                );
            }
        }
    }
    out
}

fn svg(title: &str, panels: &[Panel<'_>]) -> String {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {SIZE} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\"><rect width=\"{SIZE}\" height=\"{HEIGHT}\" fill=\"#fff\"/><text x=\"{}\" y=\"24\" font-size=\"17\" text-anchor=\"middle\">{}</text>",
        0.5 * SIZE,
        escape(title)
    );
    // One scale for all panels, so that they can be compared.
    let profiles: Vec<Vec<Vec<Option<f64>>>> = panels
        .iter()
        .map(|panel| panel.curves.iter().map(|(form, _)| sectors(form)).collect())
        .collect();
    let most = profiles
        .iter()
        .flatten()
        .flatten()
        .flatten()
        .fold(0.1, |m: f64, v| m.max(v.abs()));
    let power = 10f64.powf(most.log10().floor());
    let ring = power
        * [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .find(|m| m * power >= most)
            .unwrap_or(10.0);
    let width = SIZE / panels.len().max(1) as f64;
    for (at, (panel, profiles)) in panels.iter().zip(&profiles).enumerate() {
        let _ = write!(
            out,
            "<g transform=\"translate({:.1} 222)\">",
            (at as f64 + 0.5) * width
        );
        axes(&mut out, ring);
        for ((profile, (_, name)), colour) in profiles.iter().zip(&panel.curves).zip(COLOURS) {
            let mut d = String::new();
            let mut pen = false;
            for k in 0..=SECTORS {
                let Some(value) = profile[k % SECTORS] else {
                    pen = false;
                    continue;
                };
                let angle = (2 * (k % SECTORS) + 1) as f64 * PI / SECTORS as f64;
                let r = (NOMINAL + value / ring * REACH).max(0.0);
                let (sin, cos) = angle.sin_cos();
                let _ = write!(
                    d,
                    "{}{:.1} {:.1}",
                    if pen { 'L' } else { 'M' },
                    r * cos,
                    -r * sin
                );
                pen = true;
            }
            let _ = write!(
                out,
                "<path class=\"form\" d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"><title>{}</title></path>",
                escape(name)
            );
        }
        for (k, ((_, name), colour)) in panel.curves.iter().zip(COLOURS).enumerate() {
            let y = 190.0;
            let x = (k as f64 - 0.5 * (panel.curves.len() as f64 - 1.0)) * width.min(420.0) / 3.0;
            let _ = write!(
                out,
                "<path d=\"M{:.1} {y}h18\" stroke=\"{colour}\" stroke-width=\"2\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x - 40.0,
                x - 18.0,
                y + 4.0,
                escape(name)
            );
        }
        let _ = write!(
            out,
            "<text y=\"-182\" font-size=\"13\" text-anchor=\"middle\">{}</text></g>",
            escape(&panel.title)
        );
    }
    out.push_str("</svg>\n");
    out
}

/// Rings labelled in µm from the nominal circle, angles labelled in degrees.
fn axes(out: &mut String, ring: f64) {
    for k in -2..=2 {
        let r = NOMINAL + 0.5 * f64::from(k) * REACH;
        let stroke = if k == 0 { "#000" } else { "#ccc" };
        let sign = if k > 0 { "+" } else { "" };
        let label = plain(0.5 * f64::from(k) * ring).replace('-', "−");
        let (sin, cos) = (67.5f64).to_radians().sin_cos();
        let _ = write!(
            out,
            "<circle r=\"{r}\" fill=\"none\" stroke=\"{stroke}\"/><text x=\"{:.1}\" y=\"{:.1}\" fill=\"#555\" font-size=\"10\">{sign}{label} µm</text>",
            r * cos,
            -r * sin - 2.0
        );
    }
    for degrees in (0..360).step_by(45) {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        let _ = write!(
            out,
            "<path d=\"M0 0L{:.1} {:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" fill=\"#555\" text-anchor=\"middle\" font-size=\"10\">{degrees}°</text>",
            160.0 * cos,
            -160.0 * sin,
            172.0 * cos,
            -172.0 * sin + 3.0
        );
    }
}
