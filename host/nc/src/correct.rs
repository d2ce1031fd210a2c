//! Which arcs are corrected, and how they meet their neighbours.
use super::blend::{Entry, Exit, Piece, pieces};
use super::inverse::{Inverse, Twin};
use super::state::{Action, Arc, Plane, Straight};
use super::steps::{Meeting, Side, Step};
use super::word::{Line, Sort};
use super::{Fate, FreeSide, Led, Left, Options};

/// Smallest correction worth a block, mm.
const NEGLIGIBLE_MM: f64 = 5e-4;
/// Directions closer than this are one, rad (3°): controllers pass such a corner at speed.
const TANGENT_RAD: f64 = 0.0524;
/// Offsets that need no step between them, mm.
const SAME_OFFSET_MM: f64 = 1e-5;

/// What is to be done with an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plan {
    pub(super) twin: Twin,
    pub(super) entry: Entry,
    pub(super) exit: Exit,
    /// The machine stands where it begins, and where it ends.
    pub(super) rests: [bool; 2],
}

impl Plan {
    /// Largest share of the correction that remains as an error at a joint of the arc; what is not known counts as nothing.
    pub(super) fn joint_share(&self) -> f64 {
        let share = |remaining_mm: f64| remaining_mm / self.twin.delta_mm.abs();
        let exit = match self.exit {
            Exit::Held => 0.0,
            Exit::RunOut { step, .. } | Exit::Inside { step, .. } => share(step.remaining_mm),
        };
        share(self.entry.step.remaining_mm).max(exit)
    }

    pub(super) fn fate(&self, arc: &Arc, pieces: &[Piece], led: Led) -> Fate {
        let slower = pieces.iter().filter(|p| p.speed < 1.0);
        // The sum of nothing is −0.
        let lost_mm = slower.fold(0.0, |sum, p| sum + p.length_mm * (1.0 / p.speed - 1.0));
        Fate::Corrected {
            radius_mm: arc.radius_mm,
            feed_mm_s: arc.feed_mm_s,
            delta_mm: self.twin.delta_mm,
            blocks: pieces.len(),
            joint_share: self.joint_share(),
            slower_s: lost_mm / arc.feed_mm_s,
            led,
        }
    }
}

/// A line keeps at least this much of its length behind a run-out, mm.
const LINE_LEFT_MM: f64 = 0.1;
/// What a step at one end of an arc may take of its length, so that one at the other end has room.
const ROOM_SHARE: f64 = 0.45;

/// A line as it is run, and what the law makes of its arc.
#[derive(Clone, Debug)]
pub(super) struct Visit<'a> {
    /// From 0.
    pub(super) index: usize,
    pub(super) line: Line<'a>,
    pub(super) action: Action,
    pub(super) twin: Option<Result<Twin, Left>>,
    /// Where the comment before it says that there is no material.
    pub(super) free_side: Option<FreeSide>,
}

impl<'a> Visit<'a> {
    pub(super) fn new(index: usize, line: Line<'a>, action: Action, law: &Law<'_>) -> Self {
        let twin = match &action {
            Action::Arc(arc) => Some(twin(arc, law)),
            Action::LostArc(left) => Some(Err(*left)),
            Action::Nothing | Action::Line(_) | Action::Stop | Action::Other => None,
        };
        Self {
            index,
            line,
            action,
            twin,
            free_side: None,
        }
    }

    /// Whether what lies before and what lies behind can be decided apart.
    pub(super) fn is_wall(&self) -> bool {
        match self.action {
            Action::Nothing => false,
            Action::Arc(_) => !matches!(self.twin, Some(Ok(_))),
            Action::Line(_) | Action::LostArc(_) | Action::Stop | Action::Other => true,
        }
    }
}

/// What decides about arcs.
pub(super) struct Law<'a> {
    pub(super) inverse: &'a Inverse,
    pub(super) options: &'a Options,
    /// Shortest block, mm.
    pub(super) least_mm: f64,
    /// Last stretch of an arc whose offset ends inside it, mm: it leaves the arc's own G-code in force.
    pub(super) tail_mm: f64,
}

/// One decision a line; `None` where there is no arc. Twins of arcs that turn out too short are taken back.
pub(super) fn decide(visits: &mut [Visit<'_>], law: &Law<'_>) -> Vec<Option<Result<Plan, Left>>> {
    // An arc that turns out too short may have carried on its neighbour's offset: until nothing changes.
    loop {
        let room = Room { visits, law };
        let plans: Vec<_> = (0..visits.len()).map(|i| room.plan(i)).collect();
        let mut changed = false;
        for (visit, plan) in visits.iter_mut().zip(&plans) {
            if let (Some(Ok(_)), Some(Err(left))) = (&visit.twin, plan) {
                visit.twin = Some(Err(*left));
                changed = true;
            }
        }
        if !changed {
            return plans;
        }
    }
}

/// The same for motions that are no lines of RS-274.
pub(super) fn decide_actions(actions: &[Action], law: &Law<'_>) -> Vec<Option<Result<Plan, Left>>> {
    let nothing = Line {
        text: b"",
        end: b"",
        words: Vec::new(),
        sort: Sort::Plain,
    };
    let mut visits: Vec<Visit<'_>> = actions
        .iter()
        .map(|action| Visit::new(0, nothing.clone(), *action, law))
        .collect();
    decide(&mut visits, law)
}

fn twin(arc: &Arc, law: &Law<'_>) -> Result<Twin, Left> {
    if arc.plane != Plane::Xy && !law.options.all_planes {
        return Err(Left::OtherPlane);
    }
    let twin = law.inverse.twin(arc.radius_mm, arc.feed_mm_s)?;
    if twin.delta_mm.abs() < NEGLIGIBLE_MM {
        return Err(Left::Negligible);
    }
    match arc.exact_stop {
        Some(because) => Err(Left::ExactStop(because)),
        None => Ok(twin),
    }
}

/// What a decision looks at.
struct Room<'a, 'b> {
    visits: &'a [Visit<'b>],
    law: &'a Law<'a>,
}

impl Room<'_, '_> {
    fn plan(&self, i: usize) -> Option<Result<Plan, Left>> {
        let twin = match self.visits[i].twin? {
            Ok(twin) => twin,
            Err(left) => return Some(Err(left)),
        };
        let Action::Arc(arc) = &self.visits[i].action else {
            return None;
        };
        let (entry, exit) = (self.entry(i, arc, twin), self.exit(i, arc, twin));
        let room = entry.step.length_mm + exit.inside_mm() < arc.length_mm();
        let long = |piece: &Piece| piece.length_mm >= self.law.least_mm;
        let fits = room && pieces(arc, twin.delta_mm, entry, exit).iter().all(long);
        Some(if fits {
            let rests =
                [false, true].map(|after| matches!(self.neighbour(i, arc, after), Neighbour::Rest));
            Ok(Plan {
                twin,
                entry,
                exit,
                rests,
            })
        } else {
            Err(Left::TooShort)
        })
    }

    /// Curvature, 1/mm, and offset, mm, of an arc to the left; in the units of a feed.
    fn left(arc: &Arc, delta_mm: f64, feed_mm_s: f64) -> (f64, f64) {
        let side = arc.sweep_rad.signum();
        let faster = arc.feed_mm_s / feed_mm_s;
        // What a joint asks for goes with the acceleration across.
        (side * faster * faster / arc.radius_mm, -side * delta_mm)
    }

    /// The step on a stretch of `room_mm` where two stretches meet, each a curvature and an offset.
    fn step(&self, f: f64, stretches: [(f64, f64); 2], side: Side, room_mm: f64) -> Step {
        self.law.inverse.step(&Meeting {
            feed_mm_s: f,
            curvature: stretches.map(|s| s.0),
            offset_mm: stretches.map(|s| s.1),
            side,
            room_mm,
        })
    }

    fn entry(&self, i: usize, arc: &Arc, twin: Twin) -> Entry {
        let f = arc.feed_mm_s;
        let own = Self::left(arc, twin.delta_mm, f);
        let straight = (0.0, 0.0);
        let room = ROOM_SHARE * arc.length_mm();
        let (from_mm, held, step) = match self.neighbour(i, arc, false) {
            Neighbour::Corrected(before, other) => {
                // The same offset in space is outward of one and inward of the other where the turn changes.
                let from_mm = other.delta_mm * (before.sweep_rad * arc.sweep_rad).signum();
                if (twin.delta_mm - from_mm).abs() < SAME_OFFSET_MM {
                    return Entry {
                        from_mm,
                        step: Step::NONE,
                        held: true,
                    };
                }
                let before = Self::left(before, other.delta_mm, f);
                (
                    from_mm,
                    true,
                    self.step(f, [before, own], Side::Behind, room),
                )
            }
            Neighbour::Line { .. } | Neighbour::OtherArc => (
                0.0,
                false,
                self.step(f, [straight, own], Side::Behind, room),
            ),
            Neighbour::Rest => {
                let stretches = [(own.0, 0.0), own];
                (0.0, false, self.step(f, stretches, Side::FromRest, room))
            }
        };
        Entry {
            from_mm,
            step,
            held,
        }
    }

    fn exit(&self, i: usize, arc: &Arc, twin: Twin) -> Exit {
        let f = arc.feed_mm_s;
        let own = Self::left(arc, twin.delta_mm, f);
        let inside = |curvature: f64, side: Side| {
            let room = ROOM_SHARE * arc.length_mm();
            Exit::Inside {
                step: self.step(f, [own, (curvature, 0.0)], side, room),
                tail_mm: self.law.tail_mm,
            }
        };
        match self.neighbour(i, arc, true) {
            Neighbour::Corrected(..) => Exit::Held,
            Neighbour::Line { line, along, clean } => {
                let [first, second, third] = arc.plane.axes();
                let length = match (
                    line.start[first],
                    line.end[first],
                    line.start[second],
                    line.end[second],
                ) {
                    (Some(s), Some(e), Some(t), Some(u)) => (e - s).hypot(u - t),
                    _ => 0.0,
                };
                let room = length - LINE_LEFT_MM;
                let step = self.step(f, [own, (0.0, 0.0)], Side::Behind, room);
                let level = line.start[third] == line.end[third];
                let as_fast = line
                    .feed_mm_s
                    .is_none_or(|speed| (speed / f - 1.0).abs() < 1e-9);
                let plain = line.bare && clean && line.absolute && arc.modes.absolute;
                if plain && level && step.length_mm < room && as_fast {
                    Exit::RunOut { step, along }
                } else {
                    inside(0.0, Side::Before)
                }
            }
            Neighbour::OtherArc => inside(0.0, Side::Before),
            Neighbour::Rest => inside(own.0, Side::ToRest),
        }
    }

    /// The motion before or after arc `i`, as far as it is tangent and passed at speed.
    fn neighbour(&self, i: usize, arc: &Arc, after: bool) -> Neighbour<'_> {
        let Some((other, clean)) = motion_beside(i, after, self.visits) else {
            return Neighbour::Rest;
        };
        let tangent = arc.tangent(after);
        match &self.visits[other].action {
            Action::Arc(next)
                if next.plane == arc.plane && parallel(tangent, next.tangent(!after)) =>
            {
                match self.visits[other].twin {
                    Some(Ok(twin)) => Neighbour::Corrected(next, twin),
                    _ => Neighbour::OtherArc,
                }
            }
            Action::Line(line) => match direction(line, arc).filter(|d| parallel(tangent, *d)) {
                Some(along) => Neighbour::Line { line, along, clean },
                None => Neighbour::Rest,
            },
            _ => Neighbour::Rest,
        }
    }
}

/// What an arc meets.
enum Neighbour<'a> {
    /// Standstill, a corner, or nothing.
    Rest,
    /// A line along the arc's tangent.
    Line {
        line: &'a Straight,
        along: [f64; 2],
        /// Nothing stands between that acts where it stands.
        clean: bool,
    },
    /// A tangent arc that is corrected too.
    Corrected(&'a Arc, Twin),
    /// A tangent arc that stays as it was.
    OtherArc,
}

/// The motion before or after, if nothing between stops the machine, and whether only comments stand between.
fn motion_beside(i: usize, after: bool, visits: &[Visit<'_>]) -> Option<(usize, bool)> {
    let mut at = i;
    let mut clean = true;
    loop {
        at = if after { at + 1 } else { at.checked_sub(1)? };
        let visit = visits.get(at)?;
        let words = &visit.line.words;
        match visit.action {
            // A dwell, a stop or a tool change is an M- or G4-word; a bare feed or comment is neither.
            Action::Nothing
                if visit.line.sort == Sort::Plain
                    && words.iter().all(|w| b"NF".contains(&w.letter)) =>
            {
                clean &= words.iter().all(|w| w.letter == b'N') && !visit.line.speaks();
            }
            Action::Nothing | Action::Stop | Action::Other | Action::LostArc(_) => return None,
            // M0, M1, M2, M30, M60 in a block act at its end.
            Action::Line(_) | Action::Arc(_) => {
                let stopped = visit.line.has_m(&[0, 10, 20, 300, 600]);
                return (!stopped).then_some((at, clean));
            }
        }
    }
}

/// Direction of a line in the plane of an arc.
fn direction(line: &Straight, arc: &Arc) -> Option<[f64; 2]> {
    let [a, b, _] = arc.plane.axes();
    let d = [line.end[a]? - line.start[a]?, line.end[b]? - line.start[b]?];
    let length = d[0].hypot(d[1]);
    (length > 1e-6).then(|| [d[0] / length, d[1] / length])
}

fn parallel(a: [f64; 2], b: [f64; 2]) -> bool {
    let (dot, cross) = (a[0] * b[0] + a[1] * b[1], a[0] * b[1] - a[1] * b[0]);
    dot > 0.0 && cross.abs() < TANGENT_RAD
}
