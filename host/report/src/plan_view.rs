//! A program in plan view: what is cut, arcs in the colour of their correction. Colours by class, as in `chart`.
use super::chart::ticks;
use super::number::{escape, plain};
use std::fmt::Write;

/// A move of a program.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Where it begins, mm; `None` where the program does not say.
    pub from_mm: [Option<f64>; 3],
    /// Where it ends, mm.
    pub to_mm: [Option<f64>; 3],
    /// On what it goes there; straight on without.
    pub curve: Option<Curve>,
    /// What it is.
    pub sort: Sort,
    /// What hovering shows; nothing where it is empty.
    pub label: String,
}

/// An arc in a plane of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Indices in XYZ of the plane's first and second axis and of the one across.
    pub axes: [usize; 3],
    /// In the plane, mm.
    pub centre_mm: [f64; 2],
    /// Positive from the first axis to the second.
    pub sweep_rad: f64,
}

/// What a move is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sort {
    /// Not at a feed.
    Rapid,
    /// Straight at a feed, which no correction changes.
    Line,
    /// An arc whose radius was changed, µm.
    Corrected(f64),
    /// An arc that was left.
    Left,
}

/// A drawing with its key, and what it shows in words.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanView {
    /// The `<svg>` element and its key.
    pub svg: String,
    /// What it shows.
    pub caption: String,
}

const WIDTH: f64 = 520.0;
const TALLEST: f64 = 620.0;
const LEFT: f64 = 46.0;
const BOTTOM: f64 = 40.0;
const TOP: f64 = 10.0;
const RIGHT: f64 = 14.0;
/// Steps of the colour of a correction.
const SHADES: usize = 5;
/// Of more corrected or left arcs than so many, those of one colour are one line without labels.
const MOST_LABELS: usize = 4000;
/// Chords that an arc of another plane is drawn with.
const CHORDS: usize = 48;

/// One view for each plane that has arcs, the one with most of them first; `id` tells them apart on the page.
pub fn plan_views(strokes: &[Stroke], id: &str) -> Vec<PlanView> {
    let mut planes: Vec<([usize; 3], usize)> = Vec::new();
    for curve in strokes.iter().filter_map(|s| s.curve) {
        match planes.iter_mut().find(|(axes, _)| *axes == curve.axes) {
            Some((_, count)) => *count += 1,
            None => planes.push((curve.axes, 1)),
        }
    }
    planes.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let largest = strokes.iter().fold(0.0, |most, s| match s.sort {
        Sort::Corrected(um) => f64::max(most, um.abs()),
        _ => most,
    });
    planes
        .iter()
        .enumerate()
        .filter_map(|(k, (axes, count))| {
            let view = View::of(strokes, *axes)?;
            let names = axes.map(|axis| ["X", "Y", "Z"][axis]);
            Some(PlanView {
                svg: view.svg(strokes, &format!("{id}-{k}"), largest) + &key(largest),
                caption: format!(
                    "{count} arc{} in the plane {}{}, seen against {}; mm",
                    if *count == 1 { "" } else { "s" },
                    names[0],
                    names[1],
                    names[2]
                ),
            })
        })
        .collect()
}

/// Colour of a correction: 1 to [`SHADES`].
fn shade(um: f64, largest: f64) -> usize {
    let share = um.abs() / largest.max(f64::MIN_POSITIVE);
    ((share * SHADES as f64).ceil() as usize).clamp(1, SHADES)
}

fn key(largest: f64) -> String {
    let line = |class: &str| {
        format!(
            "<svg viewBox=\"0 0 26 14\" aria-hidden=\"true\"><path class=\"{class}\" d=\"M1 7H25\"/></svg>"
        )
    };
    let mut out = String::from("<ul class=\"key\" aria-label=\"Key of the drawing\">");
    if largest > 0.0 {
        for k in 1..=SHADES {
            let to = largest * k as f64 / SHADES as f64;
            let words = if k == 1 {
                "radius changed by up to "
            } else {
                "to "
            };
            let _ = write!(
                out,
                "<li>{} {words}{} µm</li>",
                line(&format!("stroke d{k}")),
                super::number::number(to)
            );
        }
    }
    for (class, words) in [
        ("stroke left-arc", "arc left as it was"),
        ("stroke straight", "line"),
        ("stroke rapid", "rapid"),
    ] {
        let _ = write!(out, "<li>{} {words}</li>", line(class));
    }
    out + "</ul>"
}

/// Millimetres of a plane on paper.
struct View {
    axes: [usize; 3],
    low: [f64; 2],
    high: [f64; 2],
    scale: f64,
}

impl View {
    /// `None` where nothing of the program is known in this plane.
    fn of(strokes: &[Stroke], axes: [usize; 3]) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut any = false;
        // Rapid moves from far away would make the part small.
        for stroke in strokes.iter().filter(|s| s.sort != Sort::Rapid) {
            for p in points(stroke, axes).unwrap_or_default() {
                any = true;
                for i in 0..2 {
                    (low[i], high[i]) = (low[i].min(p[i]), high[i].max(p[i]));
                }
            }
        }
        if !any || (0..2).any(|i| !(high[i] - low[i]).is_finite()) {
            return None;
        }
        let size = (high[0] - low[0]).max(high[1] - low[1]).max(1e-3);
        for i in 0..2 {
            (low[i], high[i]) = (low[i] - 0.05 * size, high[i] + 0.05 * size);
        }
        let scale = ((WIDTH - LEFT - RIGHT) / (high[0] - low[0]))
            .min((TALLEST - TOP - BOTTOM) / (high[1] - low[1]));
        Some(Self {
            axes,
            low,
            high,
            scale,
        })
    }

    fn width(&self) -> f64 {
        LEFT + self.scale * (self.high[0] - self.low[0])
    }

    fn height(&self) -> f64 {
        TOP + self.scale * (self.high[1] - self.low[1])
    }

    fn x(&self, mm: f64) -> f64 {
        LEFT + self.scale * (mm - self.low[0])
    }

    fn y(&self, mm: f64) -> f64 {
        self.height() - self.scale * (mm - self.low[1])
    }

    fn svg(&self, strokes: &[Stroke], id: &str, largest: f64) -> String {
        // Narrow parts stand in the middle.
        let aside = 0.5 * (WIDTH - RIGHT - self.width());
        let mut out = format!(
            "<svg class=\"plan\" viewBox=\"{:.1} 0 {WIDTH} {:.1}\" role=\"img\" aria-labelledby=\"{id}-d\"><desc id=\"{id}-d\">Plan view of the program, arcs in the colour of their correction</desc>",
            -aside,
            self.height() + BOTTOM
        );
        self.grid(&mut out);
        let arcs = strokes
            .iter()
            .filter(|s| matches!(s.sort, Sort::Corrected(_) | Sort::Left));
        let labelled = arcs.count() <= MOST_LABELS;
        // Each class is one path, drawn over those before it.
        let mut paths = vec![String::new(); SHADES + 3];
        let mut single = String::new();
        for stroke in strokes {
            let Some(path) = self.path(stroke) else {
                continue;
            };
            let class = match stroke.sort {
                Sort::Rapid => 0,
                Sort::Line => 1,
                Sort::Left => 2,
                Sort::Corrected(um) => 2 + shade(um, largest),
            };
            if labelled && class >= 2 && !stroke.label.is_empty() {
                let _ = write!(
                    single,
                    "<path class=\"stroke {}\" d=\"{path}\"><title>{}</title></path>",
                    class_name(class),
                    escape(&stroke.label)
                );
            } else {
                paths[class] += &path;
            }
        }
        for (class, path) in paths.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            let _ = write!(
                out,
                "<path class=\"stroke {}\" d=\"{path}\"/>",
                class_name(class)
            );
        }
        out += &single;
        out + "</svg>"
    }

    fn grid(&self, out: &mut String) {
        let (bottom, right) = (self.height(), self.width());
        let count = |size: f64| (size / 75.0).clamp(2.0, 7.0);
        for v in ticks(self.low[0], self.high[0], count(right - LEFT)) {
            let at = self.x(v);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{at:.1} {TOP}V{bottom:.1}\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 16.0,
                plain(v).replace('-', "−")
            );
        }
        for v in ticks(self.low[1], self.high[1], count(bottom - TOP)) {
            let at = self.y(v);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{right:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 5.0,
                at + 4.0,
                plain(v).replace('-', "−")
            );
        }
        let names = self.axes.map(|axis| ["X", "Y", "Z"][axis]);
        let _ = write!(
            out,
            "<text class=\"title\" x=\"{right:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text><text class=\"title\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            bottom + 32.0,
            names[0],
            LEFT - 30.0,
            TOP + 10.0,
            names[1]
        );
    }

    fn path(&self, stroke: &Stroke) -> Option<String> {
        let [a, b, _] = self.axes;
        let from = [stroke.from_mm[a]?, stroke.from_mm[b]?];
        let to = [stroke.to_mm[a]?, stroke.to_mm[b]?];
        let mut out = format!("M{:.2} {:.2}", self.x(from[0]), self.y(from[1]));
        match stroke.curve {
            Some(curve) if curve.axes == self.axes => {
                // An `A` goes less than once round: in parts of less than half a turn.
                let parts = (curve.sweep_rad.abs() / 2.0).ceil().clamp(1.0, 8.0) as usize;
                // More than a turn looks like one.
                let sweep = curve
                    .sweep_rad
                    .clamp(-std::f64::consts::TAU, std::f64::consts::TAU);
                let r = (from[0] - curve.centre_mm[0]).hypot(from[1] - curve.centre_mm[1]);
                let clockwise = u8::from(sweep < 0.0);
                for k in 1..=parts {
                    let p = turned(from, curve.centre_mm, sweep * k as f64 / parts as f64);
                    let _ = write!(
                        out,
                        "A{0:.2} {0:.2} 0 0 {clockwise} {1:.2} {2:.2}",
                        r * self.scale,
                        self.x(p[0]),
                        self.y(p[1])
                    );
                }
            }
            Some(_) => {
                for p in points(stroke, self.axes)? {
                    let _ = write!(out, "L{:.2} {:.2}", self.x(p[0]), self.y(p[1]));
                }
            }
            None => {
                let _ = write!(out, "L{:.2} {:.2}", self.x(to[0]), self.y(to[1]));
            }
        }
        Some(out)
    }
}

fn class_name(class: usize) -> &'static str {
    [
        "rapid", "straight", "left-arc", "d1", "d2", "d3", "d4", "d5",
    ][class]
}

fn turned(from: [f64; 2], centre: [f64; 2], angle: f64) -> [f64; 2] {
    let r = [from[0] - centre[0], from[1] - centre[1]];
    let (sin, cos) = angle.sin_cos();
    [
        centre[0] + r[0] * cos - r[1] * sin,
        centre[1] + r[0] * sin + r[1] * cos,
    ]
}

/// Points of a move as it is seen in a plane; `None` where it is not known there.
fn points(stroke: &Stroke, [a, b, _]: [usize; 3]) -> Option<Vec<[f64; 2]>> {
    let flat = |p: [Option<f64>; 3]| Some([p[a]?, p[b]?]);
    let (from, to) = (flat(stroke.from_mm)?, flat(stroke.to_mm)?);
    let Some(curve) = stroke.curve else {
        return Some(vec![from, to]);
    };
    let [c, d, across] = curve.axes;
    let start = [stroke.from_mm[c]?, stroke.from_mm[d]?];
    let height = |share: f64| {
        let [from, to] = [stroke.from_mm[across], stroke.to_mm[across]].map(|h| h.unwrap_or(0.0));
        from + share * (to - from)
    };
    let place = |k: usize| {
        let share = k as f64 / CHORDS as f64;
        let mut p = [0.0; 3];
        [p[c], p[d]] = turned(start, curve.centre_mm, share * curve.sweep_rad);
        p[across] = height(share);
        [p[a], p[b]]
    };
    Some((0..=CHORDS).map(place).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn arc(axes: [usize; 3], sweep_rad: f64, sort: Sort) -> Stroke {
        let at = |x: f64| {
            let mut p = [Some(0.0); 3];
            p[axes[0]] = Some(x);
            p
        };
        let end = if sweep_rad.abs() < TAU { -10.0 } else { 10.0 };
        Stroke {
            from_mm: at(10.0),
            to_mm: at(end),
            curve: Some(Curve {
                axes,
                centre_mm: [0.0; 2],
                sweep_rad,
            }),
            sort,
            label: "line <4>".into(),
        }
    }

    #[test]
    fn each_plane_with_arcs_is_seen_and_colours_follow_the_correction() {
        let strokes = [
            arc([0, 1, 2], PI, Sort::Corrected(10.0)),
            arc([0, 1, 2], -TAU, Sort::Corrected(-1.0)),
            arc([2, 0, 1], PI, Sort::Left),
        ];
        let views = plan_views(&strokes, "v");
        assert_eq!(views.len(), 2);
        assert!(views[0].caption.starts_with("2 arcs in the plane XY"));
        assert!(views[1].caption.starts_with("1 arc in the plane ZX"));
        let svg = &views[0].svg;
        assert!(svg.contains("class=\"stroke d5\"") && svg.contains("class=\"stroke d1\""));
        assert!(svg.contains("line &lt;4&gt;") && !svg.contains("NaN"));
        // The half turn goes over the top of the paper: counter-clockwise is flag 0 where y grows downwards.
        assert!(svg.contains(" 0 0 0 ") && svg.contains(" 0 0 1 "));
    }

    #[test]
    fn what_is_not_known_is_not_drawn() {
        let unknown = Stroke {
            from_mm: [None; 3],
            ..arc([0, 1, 2], PI, Sort::Left)
        };
        assert!(plan_views(&[unknown], "v").is_empty());
        assert!(plan_views(&[], "v").is_empty());
    }

    #[test]
    fn many_arcs_are_drawn_without_labels() {
        let strokes = vec![arc([0, 1, 2], PI, Sort::Corrected(3.0)); MOST_LABELS + 1];
        let views = plan_views(&strokes, "v");
        assert!(!views[0].svg.contains("<title>"));
    }
}
