//! Tangent transitions between a programmed path and its corrected twin.
//!
//! The correction is an offset across the programmed path: δ on an arc, none on a line. A servo chain answers
//! after the command, so that the offset it needs begins to change at the joint and not before: for one lag
//! exactly as (s/σf)² over the way σf behind the joint, σ = √κ2. How the step goes on, and what remains at the
//! joint, is for `joint` to say. An arc's own blocks carry the change at its start; after its end the
//! following arc does, or a run-out along the following line, whose block then starts from a point farther along
//! it and is not touched. From standstill the machine falls behind only as it gets going, and the step is longer.
//! Where nothing may follow (a stop, a corner, increments, a word that acts where it stands), the offset ends inside the
//! arc, and what remains at that point is said. Pairs of arcs (biarcs) follow the step with a common
//! tangent at every joint.
use super::state::{Arc, sub};
use super::steps::Step;
use super::transition::Node;

/// How a corrected arc begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    /// Outward offset at the start, mm: that of the arc before, carried on.
    pub(super) from_mm: f64,
    /// How it gets to the arc's own offset; of no length: it is there already.
    pub(super) step: Step,
    /// It goes on where the corrected arc before it ends.
    pub(super) held: bool,
}

/// How a corrected arc ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Exit {
    /// With its offset: the next arc goes on from there.
    Held,
    /// The offset runs out along the line that follows.
    RunOut {
        step: Step,
        /// Direction of the line.
        along: [f64; 2],
    },
    /// The offset is gone at the programmed end.
    Inside {
        step: Step,
        /// A last stretch on the programmed circle, mm, so that the arc ends in its own G-code.
        tail_mm: f64,
    },
}

impl Exit {
    /// Way inside the arc, mm.
    pub(super) fn inside_mm(self) -> f64 {
        if let Self::Inside { step, tail_mm } = self {
            step.length_mm + tail_mm
        } else {
            0.0
        }
    }
}

/// One block of the corrected path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) end: [f64; 2],
    /// Centre of an arc; `None`: a line.
    pub(super) centre: Option<[f64; 2]>,
    pub(super) ccw: bool,
    /// Full turns beyond the first, P − 1.
    pub(super) more_turns: u32,
    /// Share of the programmed sweep at the end.
    pub(super) share: f64,
    pub(super) length_mm: f64,
    /// Behind the arc's end, on the line that follows.
    pub(super) beyond: bool,
    /// Share of the feed of the arc.
    pub(super) speed: f64,
}

/// An arc that bulges by less, mm, is written as a line: half the last digit of a program, and far from where the f32 of
/// small controllers takes a flat arc for a full circle.
const STRAIGHT_MM: f64 = 2e-5;

/// The corrected path of `arc` with radius R + δ.
pub(super) fn pieces(arc: &Arc, delta_mm: f64, entry: Entry, exit: Exit) -> Vec<Piece> {
    let course = Course::new(arc, delta_mm);
    let in_rad = entry.step.length_mm / arc.radius_mm;
    let out_rad = exit.inside_mm() / arc.radius_mm;
    let mut list = Vec::new();
    course.enter(&mut list, entry);
    let swept = course.total - in_rad - out_rad;
    let next = course.node(course.total - out_rad, delta_mm, 0.0);
    // P counts begun turns; exactly n turns end where they started and count n.
    let turns = (swept / std::f64::consts::TAU - 1e-9).ceil().max(1.0) - 1.0;
    list.push(Piece {
        more_turns: turns as u32,
        share: 1.0 - out_rad / course.total,
        length_mm: swept * (arc.radius_mm + delta_mm),
        ..course.round(next.0)
    });
    match exit {
        Exit::Held => {}
        Exit::Inside { step, tail_mm } => course.fade(&mut list, next, step, tail_mm),
        Exit::RunOut { step, along } => course.run_out(&mut list, next, step, along),
    }
    list
}

/// An arc and its offset.
struct Course<'a> {
    arc: &'a Arc,
    delta_mm: f64,
    /// Angle that it sweeps, rad, and 1 or −1 for CCW and CW.
    total: f64,
    side: f64,
    start_angle: f64,
}

impl<'a> Course<'a> {
    fn new(arc: &'a Arc, delta_mm: f64) -> Self {
        let [x, y] = sub(arc.start, arc.centre);
        Self {
            arc,
            delta_mm,
            total: arc.sweep_rad.abs(),
            side: arc.sweep_rad.signum(),
            start_angle: y.atan2(x),
        }
    }

    /// Place and direction of travel where the outward offset is `offset` mm and grows by `slope` per mm.
    fn node(&self, swept: f64, offset: f64, slope: f64) -> Stand {
        let (arc, side) = (self.arc, self.side);
        let (sin, cos) = (self.start_angle + side * swept).sin_cos();
        let r = arc.radius_mm + offset;
        let outward = slope * arc.radius_mm;
        let raw = [
            outward * cos - side * r * sin,
            outward * sin + side * r * cos,
        ];
        let norm = raw[0].hypot(raw[1]);
        (
            [arc.centre[0] + r * cos, arc.centre[1] + r * sin],
            raw.map(|v| v / norm),
        )
    }

    /// A block about the arc's centre.
    fn round(&self, end: [f64; 2]) -> Piece {
        Piece {
            end,
            centre: Some(self.arc.centre),
            ccw: self.side > 0.0,
            more_turns: 0,
            share: 1.0,
            length_mm: 0.0,
            beyond: false,
            speed: 1.0,
        }
    }

    /// From the offset at the start to the arc's own.
    fn enter(&self, list: &mut Vec<Piece>, entry: Entry) {
        let mut last = self.node(0.0, entry.from_mm, 0.0);
        if entry.from_mm == 0.0 {
            last.0 = self.arc.start;
        }
        let in_rad = entry.step.length_mm / self.arc.radius_mm;
        if in_rad > 0.0 {
            let rise = self.delta_mm - entry.from_mm;
            for Node {
                place,
                value,
                slope,
            } in entry.step.shape.nodes()
            {
                let next = self.node(
                    place * in_rad,
                    entry.from_mm + rise * value,
                    rise * slope / entry.step.length_mm,
                );
                biarc(list, last, next, place * in_rad / self.total);
                last = next;
            }
        }
    }

    /// Back onto the programmed circle before its end.
    fn fade(&self, list: &mut Vec<Piece>, mut last: Stand, step: Step, tail_mm: f64) {
        let (arc, delta_mm) = (self.arc, self.delta_mm);
        let arc_pieces = list.len();
        // The programmed end may lie off the circle by the program's rounding; it stays.
        let [x, y] = sub(arc.end, arc.centre);
        let end_mm = x.hypot(y) - arc.radius_mm;
        let fall = end_mm - delta_mm;
        for Node {
            place,
            value,
            slope,
        } in step.shape.nodes()
        {
            let behind = (tail_mm + (1.0 - place) * step.length_mm) / arc.radius_mm;
            let mut next = self.node(
                self.total - behind,
                delta_mm + fall * value,
                fall * slope / step.length_mm,
            );
            if place >= 1.0 && tail_mm == 0.0 {
                next.0 = arc.end;
            }
            biarc(list, last, next, 1.0 - behind / self.total);
            last = next;
        }
        if tail_mm > 0.0 {
            list.push(Piece {
                length_mm: tail_mm,
                ..self.round(arc.end)
            });
        }
        list[arc_pieces..]
            .iter_mut()
            .for_each(|p| p.speed = step.speed);
    }

    /// Onto the line that follows.
    fn run_out(&self, list: &mut Vec<Piece>, mut last: Stand, step: Step, along: [f64; 2]) {
        let (arc, delta_mm) = (self.arc, self.delta_mm);
        let arc_pieces = list.len();
        // Outward of a CCW arc is to the right of travel.
        let across = [along[1] * self.side, -along[0] * self.side];
        for Node {
            place,
            value,
            slope,
        } in step.shape.nodes()
        {
            let (way, offset, tilt) = (
                place * step.length_mm,
                delta_mm * (1.0 - value),
                -delta_mm * slope / step.length_mm,
            );
            let norm = tilt.hypot(1.0);
            let place = std::array::from_fn(|i| arc.end[i] + way * along[i] + offset * across[i]);
            let direction = std::array::from_fn(|i| (along[i] + tilt * across[i]) / norm);
            biarc(list, last, (place, direction), 1.0);
            last = (place, direction);
        }
        list[arc_pieces..].iter_mut().for_each(|p| p.beyond = true);
    }
}

/// A place and a direction of travel.
type Stand = ([f64; 2], [f64; 2]);

/// Two arcs from node to node (place, direction) with a common tangent where they meet.
fn biarc(list: &mut Vec<Piece>, (p0, t0): Stand, (p1, t1): Stand, share: f64) {
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let v = sub(p1, p0);
    let t = [t0[0] + t1[0], t0[1] + t1[1]];
    // |t0 − t1|² instead of 2(1 − t0·t1), which loses its digits for nearly equal directions.
    let turn = sub(t0, t1);
    let (vt, vv) = (dot(v, t), dot(v, v));
    let d = vv / (vt + (vt * vt + dot(turn, turn) * vv).sqrt());
    let middle: [f64; 2] = std::array::from_fn(|i| 0.5 * (p0[i] + d * t0[i] + p1[i] - d * t1[i]));
    let before = list.last().map_or(0.0, |p: &Piece| p.share);
    list.push(piece(p0, middle, p0, t0, 0.5 * (before + share)));
    list.push(piece(middle, p1, p1, t1, share));
}

/// Arc from `from` to `end` that has direction `tangent` in `at`, one of the two.
fn piece(from: [f64; 2], end: [f64; 2], at: [f64; 2], tangent: [f64; 2], share: f64) -> Piece {
    let other = if at == from { end } else { from };
    let normal = [-tangent[1], tangent[0]];
    let [dx, dy] = sub(other, at);
    let radius = (dx * dx + dy * dy) / (2.0 * (normal[0] * dx + normal[1] * dy));
    let chord = dx.hypot(dy);
    let straight = !radius.is_finite() || chord * chord < 8.0 * STRAIGHT_MM * radius.abs();
    let half = if straight {
        0.0
    } else {
        (chord / (2.0 * radius.abs())).min(1.0).asin()
    };
    Piece {
        end,
        centre: (!straight).then(|| [at[0] + normal[0] * radius, at[1] + normal[1] * radius]),
        ccw: radius > 0.0,
        more_turns: 0,
        share,
        beyond: false,
        speed: 1.0,
        length_mm: if straight {
            chord
        } else {
            2.0 * half * radius.abs()
        },
    }
}
