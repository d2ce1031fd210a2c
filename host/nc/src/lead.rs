//! Leads of full circles that begin or end at a stop on their wall.
//!
//! Where a machine starts on the wall it is slow, and where it stops it goes straight on to the place where its command stands:
//! the circle is not round there. A lead is a circle of its own on the free side that touches the wall in that very place, run
//! once before the wall is reached at speed, and once after it was left. It begins and ends where the program stands, so that no
//! other line changes; it lies on the free side altogether, and so cuts nothing.
use super::arc::{Arc, sub};
use super::blend::{Entry, Exit, Piece, pieces};
use super::correct::{Law, Plan, Visit, decide};
use super::state::Action;
use super::word::{Line, Sort};
use std::f64::consts::TAU;

/// Where there is no material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreeSide {
    /// The circle is the wall of a hole.
    Inside,
    /// The circle is the wall of a boss.
    Outside,
}

/// Whether full circles get leads, and on which side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Leads {
    /// None.
    #[default]
    No,
    /// On the side that the comment before a circle names; none where it names neither.
    ByName,
    /// On one side throughout.
    On(FreeSide),
}

/// What became of the leads of an arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Led {
    /// None is asked for, or it needs none.
    #[default]
    Not,
    /// It has them.
    Tangent,
    /// It would need them, and nobody says which side is free.
    SideUnknown,
    /// It would need them, and no lead can be run there.
    NoRoom,
}

/// Words of comments that name a hole or a boss, in capitals.
const HOLES: [&str; 7] = [
    "HOLE", "BORE", "POCKET", "BOHRUNG", "TASCHE", "PERÇAGE", "ALÉSAGE",
];
const BOSSES: [&str; 6] = ["BOSS", "STUD", "ISLAND", "ZAPFEN", "INSEL", "BOSSAGE"];

/// Radii of a lead as shares of the circle's, the better first: the less the curvature changes, the less remains.
const INSIDE: [f64; 3] = [0.75, 0.5, 0.3];
const OUTSIDE: [f64; 4] = [1.0, 0.75, 0.5, 0.3];

impl Leads {
    /// The free side of what a comment names: `None` where the line has no comment or names neither.
    pub(super) fn named(text: &[u8]) -> Option<FreeSide> {
        let at = text.iter().position(|b| matches!(b, b'(' | b';'))?;
        let comment = String::from_utf8_lossy(&text[at..]).to_uppercase();
        let any = |names: &[&str]| names.iter().any(|name| comment.contains(name));
        match (any(&HOLES), any(&BOSSES)) {
            (true, false) => Some(FreeSide::Inside),
            (false, true) => Some(FreeSide::Outside),
            _ => None,
        }
    }

    /// The side for a circle whose comment names `named`.
    pub(super) fn side(self, named: Option<FreeSide>) -> Option<FreeSide> {
        match self {
            Self::No => None,
            Self::ByName => named,
            Self::On(side) => Some(side),
        }
    }
}

/// A circle with leads: what is run before it, the circle itself, what is run behind it.
pub(super) struct Lead {
    pub(super) plan: Plan,
    pub(super) pieces: Vec<Piece>,
}

/// Whether an arc is a full circle that begins or ends at a stop.
pub(super) fn needed(arc: &Arc, plan: &Plan) -> bool {
    let closed = sub(arc.start, arc.end).map(f64::abs) < [1e-9; 2];
    closed && arc.sweep_rad.abs() > TAU - 1e-6 && plan.rests != [false; 2]
}

/// Leads of a circle on its free side; `None` where they cannot be run. `own_code`: the motion behind the arc says its own
/// G-code, so that a lead may end in another than that of the arc.
pub(super) fn lead(
    arc: &Arc,
    plan: &Plan,
    law: &Law<'_>,
    side: FreeSide,
    own_code: bool,
) -> Option<Lead> {
    if side == FreeSide::Outside && plan.rests[1] && !own_code {
        return None;
    }
    let sizes = match side {
        FreeSide::Inside => INSIDE.as_slice(),
        FreeSide::Outside => OUTSIDE.as_slice(),
    };
    sizes
        .iter()
        .find_map(|size| sized(arc, plan, law, &touching(arc, side, *size)))
}

/// A circle on the free side that touches an arc where it starts, run in the arc's direction there.
fn touching(arc: &Arc, side: FreeSide, size: f64) -> Arc {
    let to_centre = sub(arc.centre, arc.start);
    let (way, turn) = match side {
        FreeSide::Inside => (size, 1.0),
        FreeSide::Outside => (-size, -1.0),
    };
    Arc {
        centre: std::array::from_fn(|i| arc.start[i] + way * to_centre[i]),
        end: arc.start,
        radius_mm: size * arc.radius_mm,
        sweep_rad: turn * TAU.copysign(arc.sweep_rad),
        lift: None,
        shared: [None; 4],
        ..*arc
    }
}

fn sized(arc: &Arc, plan: &Plan, law: &Law<'_>, touching: &Arc) -> Option<Lead> {
    let mut led = *plan;
    let mut list = Vec::new();
    let factor = plan.twin.feed_factor;
    if plan.rests[0] {
        let [before, own] = met([touching, arc], law)?;
        led.entry = own.entry;
        list = lead_pieces(touching, &before, before.entry, Exit::Held, 0.0, factor);
    }
    let mut behind = Vec::new();
    if plan.rests[1] {
        let [own, after] = met([arc, touching], law)?;
        led.exit = own.exit;
        behind = lead_pieces(touching, &after, after.entry, after.exit, 1.0, factor);
    }
    if led.entry.step.length_mm + led.exit.inside_mm() >= arc.length_mm() {
        return None;
    }
    list.extend(pieces(arc, plan.twin.delta_mm, led.entry, led.exit));
    list.extend(behind);
    let long = list.iter().all(|p| p.length_mm >= law.least_mm);
    long.then_some(Lead {
        plan: led,
        pieces: list,
    })
}

/// How two arcs that are run one after the other from rest to rest are corrected.
fn met(arcs: [&Arc; 2], law: &Law<'_>) -> Option<[Plan; 2]> {
    let nothing = Line {
        text: b"",
        end: b"",
        words: Vec::new(),
        sort: Sort::Plain,
    };
    let mut visits = arcs.map(|arc| Visit::new(0, nothing.clone(), Action::Arc(*arc), law));
    let mut plans = decide(&mut visits, law).into_iter();
    let mut next = || plans.next()??.ok();
    Some([next()?, next()?])
}

/// The blocks of a lead: neither height nor shared words go on along it.
fn lead_pieces(
    arc: &Arc,
    plan: &Plan,
    entry: Entry,
    exit: Exit,
    share: f64,
    factor: f64,
) -> Vec<Piece> {
    let mut list = pieces(arc, plan.twin.delta_mm, entry, exit);
    for piece in &mut list {
        piece.speed *= plan.twin.feed_factor / factor;
        (piece.share, piece.beyond) = (share, true);
    }
    list
}

#[cfg(test)]
mod tests {
    use super::super::tests::{lag, model};
    use super::super::{Fate, Options, compensate};
    use super::*;
    use giotto::model_file::Servo;

    fn led(program: &str, leads: Leads) -> (String, Vec<Led>) {
        let options = Options {
            leads,
            ..Options::default()
        };
        let result = compensate(program.as_bytes(), &lag(), &options);
        let led = result.arcs.iter().map(|a| match a.fate {
            Fate::Corrected { led, .. } => led,
            Fate::Left(left) => panic!("{left}"),
        });
        let led = led.collect();
        (String::from_utf8(result.program).unwrap(), led)
    }

    const HEAD: &str = "G21 G17 G90 G94 F1500\nG0 X0 Y0\n";

    /// Every point of every arc of the output, by its ends and centres.
    fn radii(program: &str) -> Vec<f64> {
        let mut state = super::super::state::State::new(Default::default());
        let mut list = Vec::new();
        for (i, line) in super::super::word::lines(program.as_bytes()).enumerate() {
            if let Action::Arc(a) = state.step(i + 1, &line) {
                let from = (a.start[1] - a.centre[1]).atan2(a.start[0] - a.centre[0]);
                for k in 0..=100 {
                    let (sin, cos) = (from + a.sweep_rad * f64::from(k) / 100.0).sin_cos();
                    let x = a.centre[0] + a.radius_mm * cos;
                    list.push(x.hypot(a.centre[1] + a.radius_mm * sin));
                }
            }
        }
        list
    }

    #[test]
    fn leads_lie_on_the_free_side() {
        for code in ["G2", "G3"] {
            let hole = format!("{HEAD}G1 X20\n{code} X20 Y0 I-20 J0\nG1 X0\n");
            let (text, how) = led(&hole, Leads::On(FreeSide::Inside));
            assert_eq!(how, [Led::Tangent]);
            // The machine turns a circle of 15 mm 11.1 µm too small, and the command lies so far beyond; what the machine does is
            // tried in `tests/tests/nc_contour.rs`.
            let (least, most) = radii(&text).iter().fold((f64::MAX, 0.0), |(l, m), r| {
                (f64::min(l, *r), f64::max(m, *r))
            });
            assert!(most < 20.0113 && least < 11.0, "{least} {most}\n{text}");
            let boss = format!("{HEAD}G0 X30\nG1 X20\n{code} X20 Y0 I-20 J0\nG1 X30\n");
            let (text, how) = led(&boss, Leads::On(FreeSide::Outside));
            assert_eq!(how, [Led::Tangent]);
            let least = radii(&text).iter().copied().fold(f64::MAX, f64::min);
            assert!(least > 19.9887, "{least}\n{text}");
        }
    }

    #[test]
    fn the_side_is_told_named_or_asked_for() {
        let circle = "G1 X20\nG3 X20 Y0 I-20 J0\nG1 X0\n";
        for (comment, how) in [
            ("(hole 40)\n", Led::Tangent),
            ("(Boss)\n", Led::Tangent),
            ("(part)\n", Led::SideUnknown),
            ("(hole beside a boss)\n", Led::SideUnknown),
        ] {
            let program = format!("{HEAD}{comment}{circle}");
            assert_eq!(led(&program, Leads::ByName).1, [how], "{comment}");
            assert_eq!(led(&program, Leads::No).1, [Led::Not]);
        }
        // Arcs that need none get none: a quarter, and a circle that is reached at speed.
        let tangent = format!("{HEAD}G1 X20\nG1 Y30\nG3 X20 Y30 I-20\nG1 Y60\n");
        let program = format!("{HEAD}G1 X20\nG3 X0 Y20 I-20\nG1 X-30\n");
        for program in [tangent, program] {
            let (text, how) = led(&program, Leads::On(FreeSide::Inside));
            assert_eq!(how, [Led::Not]);
            assert_eq!(text, led(&program, Leads::No).0);
        }
    }

    /// A lead on the outside ends in the other G-code: only where the next motion says its own.
    #[test]
    fn modal_motion_is_kept() {
        let modal = format!("{HEAD}G0 X30\nG1 X20\nG3 X20 Y0 I-20 J0\nX20 Y0 I-20 J0\nG1 X30\n");
        let (_, how) = led(&modal, Leads::On(FreeSide::Outside));
        // The second circle goes on from the first at speed, without a G-word of its own.
        assert_eq!(how, [Led::Tangent; 2]);
        let model = model(Servo::Lag { kv_per_s: 43.3 });
        let options = Options {
            leads: Leads::On(FreeSide::Outside),
            ..Options::default()
        };
        let text = compensate(modal.as_bytes(), &model, &options).program;
        let text = String::from_utf8(text).unwrap();
        assert!(radii(&text).iter().all(|r| *r > 19.9887), "{text}");
    }
}
