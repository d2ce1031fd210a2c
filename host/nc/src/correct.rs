//! Which arcs are corrected, and how they meet their neighbours.
use super::blend::{Entry, Exit, INSIDE_CURVATURE, Piece, pieces};
use super::inverse::{Inverse, Twin};
use super::state::{Action, Arc, Plane, Straight};
use super::transition::Transition;
use super::word::Line;
use super::{Left, Options};

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
}

/// What an offset that ends inside its arc leaves of itself at the end (`blend`).
const INSIDE_SHARE: f64 = 0.4;

impl Plan {
    /// Largest share of the correction that remains as an error at a joint of the arc; what is not known counts as nothing.
    pub(super) fn joint_share(&self) -> f64 {
        let known = |shape: Transition| {
            Some(shape.remaining())
                .filter(|share| share.is_finite())
                .unwrap_or(0.0)
        };
        let delta = self.twin.delta_mm;
        let entry = known(self.entry.shape) * ((delta - self.entry.from_mm) / delta).abs();
        let exit = match self.exit {
            Exit::Held => 0.0,
            Exit::RunOut { shape, .. } => known(shape),
            Exit::Inside { .. } => INSIDE_SHARE,
        };
        entry.max(exit)
    }
}

/// Length of the step from standstill in units of σ·f: a lag has (1 − exp(−t/σ))².
const START_RESPONSES: f64 = 3.0;
/// A step longer than this many σ·f answers slowly enough to be taken as smooth.
const LONGEST_RESPONSES: f64 = 6.0;
/// A line keeps at least this much of its length behind a run-out, mm.
const LINE_LEFT_MM: f64 = 0.1;

/// One decision a line; `None` where there is no arc. Arcs that would need a block shorter than `least_mm` are left.
pub(super) fn decide(
    lines: &[Line<'_>],
    actions: &[Action],
    inverse: &Inverse,
    options: &Options,
    least_mm: f64,
) -> Vec<Option<Result<Plan, Left>>> {
    let mut twins: Vec<Option<Result<Twin, Left>>> = actions
        .iter()
        .map(|action| match action {
            Action::Arc(arc) => Some(twin(arc, inverse, options)),
            Action::LostArc(left) => Some(Err(*left)),
            Action::Nothing | Action::Line(_) | Action::Other => None,
        })
        .collect();
    // An arc that turns out too short may have carried on its neighbour's offset: until nothing changes.
    loop {
        let room = Room {
            lines,
            actions,
            twins: &twins,
            inverse,
            options,
            least_mm,
        };
        let plans: Vec<_> = (0..lines.len()).map(|i| room.plan(i)).collect();
        let mut changed = false;
        for (twin, plan) in twins.iter_mut().zip(&plans) {
            if let (Some(Ok(_)), Some(Err(left))) = (&twin, plan) {
                *twin = Some(Err(*left));
                changed = true;
            }
        }
        if !changed {
            return plans;
        }
    }
}

fn twin(arc: &Arc, inverse: &Inverse, options: &Options) -> Result<Twin, Left> {
    if arc.plane != Plane::Xy && !options.all_planes {
        return Err(Left::OtherPlane);
    }
    let twin = inverse.twin(arc.radius_mm, arc.feed_mm_s)?;
    if twin.delta_mm.abs() < NEGLIGIBLE_MM {
        Err(Left::Negligible)
    } else {
        Ok(twin)
    }
}

/// What a decision looks at.
struct Room<'a> {
    lines: &'a [Line<'a>],
    actions: &'a [Action],
    twins: &'a [Option<Result<Twin, Left>>],
    inverse: &'a Inverse,
    options: &'a Options,
    least_mm: f64,
}

impl Room<'_> {
    fn plan(&self, i: usize) -> Option<Result<Plan, Left>> {
        let twin = match self.twins[i]? {
            Ok(twin) => twin,
            Err(left) => return Some(Err(left)),
        };
        let Action::Arc(arc) = &self.actions[i] else {
            return None;
        };
        let (entry, exit) = (self.entry(i, arc, twin), self.exit(i, arc, twin));
        let room = entry.length_mm + exit.inside_mm() < arc.length_mm();
        let long = |piece: &Piece| piece.length_mm >= self.least_mm;
        let fits = room
            && (self.least_mm == 0.0 || pieces(arc, twin.delta_mm, entry, exit).iter().all(long));
        Some(if fits {
            Ok(Plan { twin, entry, exit })
        } else {
            Err(Left::TooShort)
        })
    }

    fn entry(&self, i: usize, arc: &Arc, twin: Twin) -> Entry {
        match self.neighbour(i, arc, false) {
            Neighbour::Corrected(before, other) => {
                // The same offset in space is outward of one and inward of the other where the turn changes.
                let from_mm = other.delta_mm * (before.sweep_rad * arc.sweep_rad).signum();
                let rise = twin.delta_mm - from_mm;
                if rise.abs() < SAME_OFFSET_MM {
                    return Entry {
                        from_mm,
                        length_mm: 0.0,
                        shape: Transition::SMOOTH,
                    };
                }
                let (length_mm, shape) = self.step(arc, rise);
                Entry {
                    from_mm,
                    length_mm,
                    shape,
                }
            }
            Neighbour::Line(..) | Neighbour::OtherArc => {
                let (length_mm, shape) = self.step(arc, twin.delta_mm);
                Entry {
                    from_mm: 0.0,
                    length_mm,
                    shape,
                }
            }
            Neighbour::Rest => {
                let (f, a) = (arc.feed_mm_s, self.options.acceleration_mm_s2);
                let least = START_RESPONSES * f * self.inverse.response_s() + f * f / (2.0 * a);
                let shape = Transition::SMOOTH;
                let gentle = f * (shape.curvature() * twin.delta_mm.abs() / a).sqrt();
                Entry {
                    from_mm: 0.0,
                    length_mm: gentle.max(least),
                    shape,
                }
            }
        }
    }

    /// Length and shape of a step of so much, mm: as the machine answers, or longer where that would ask for more
    /// acceleration than is allowed.
    fn step(&self, arc: &Arc, rise_mm: f64) -> (f64, Transition) {
        let (f, a) = (arc.feed_mm_s, self.options.acceleration_mm_s2);
        let response = self.inverse.response();
        let unit_mm = f * self.inverse.response_s();
        let (mut length, mut shape) = (response.length(), response.transition(response.length()));
        if unit_mm > 0.0 {
            let gentle =
                |shape: Transition| f * (shape.curvature() * rise_mm.abs() / a).sqrt() / unit_mm;
            // A longer step is a flatter one; a few rounds find where both agree.
            for _ in 0..4 {
                if gentle(shape) <= length {
                    break;
                }
                length = gentle(shape).min(LONGEST_RESPONSES);
                shape = if length < LONGEST_RESPONSES {
                    response.transition(length)
                } else {
                    Transition::SMOOTH
                };
            }
            length = length.max(gentle(shape));
        }
        (length * unit_mm, shape)
    }

    fn exit(&self, i: usize, arc: &Arc, twin: Twin) -> Exit {
        let (f, a) = (arc.feed_mm_s, self.options.acceleration_mm_s2);
        let response_mm = f * self.inverse.response_s();
        let gentle = |curvature: f64| f * (curvature * twin.delta_mm.abs() / a).sqrt();
        let inside = Exit::Inside {
            length_mm: gentle(INSIDE_CURVATURE).max(0.25 * response_mm),
        };
        match self.neighbour(i, arc, true) {
            Neighbour::Corrected(..) => Exit::Held,
            Neighbour::Line(line, along) => {
                let (length_mm, shape) = self.step(arc, twin.delta_mm);
                let [first, second, third] = arc.plane.axes();
                let long = |s: f64, e: f64, t: f64, u: f64| {
                    (e - s).hypot(u - t) > length_mm + LINE_LEFT_MM
                };
                let reaches = match (
                    line.start[first],
                    line.end[first],
                    line.start[second],
                    line.end[second],
                ) {
                    (Some(s), Some(e), Some(t), Some(u)) => long(s, e, t, u),
                    _ => false,
                };
                let level = line.start[third] == line.end[third];
                if line.absolute && arc.modes.absolute && level && reaches {
                    Exit::RunOut {
                        length_mm,
                        shape,
                        along,
                    }
                } else {
                    inside
                }
            }
            Neighbour::OtherArc => inside,
            Neighbour::Rest => Exit::Inside {
                length_mm: inside.inside_mm().max(f * f / (2.0 * a)),
            },
        }
    }

    /// The motion before or after arc `i`, as far as it is tangent and passed at speed.
    fn neighbour(&self, i: usize, arc: &Arc, after: bool) -> Neighbour<'_> {
        let Some(other) = motion_beside(i, after, self.lines, self.actions) else {
            return Neighbour::Rest;
        };
        let tangent = arc.tangent(after);
        match &self.actions[other] {
            Action::Arc(next)
                if next.plane == arc.plane && parallel(tangent, next.tangent(!after)) =>
            {
                match self.twins[other] {
                    Some(Ok(twin)) => Neighbour::Corrected(next, twin),
                    _ => Neighbour::OtherArc,
                }
            }
            Action::Line(line) => match direction(line, arc).filter(|d| parallel(tangent, *d)) {
                Some(along) => Neighbour::Line(line, along),
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
    Line(&'a Straight, [f64; 2]),
    /// A tangent arc that is corrected too.
    Corrected(&'a Arc, Twin),
    /// A tangent arc that stays as it was.
    OtherArc,
}

/// The motion before or after, if nothing between stops the machine.
fn motion_beside(i: usize, after: bool, lines: &[Line<'_>], actions: &[Action]) -> Option<usize> {
    let mut at = i;
    loop {
        at = if after { at + 1 } else { at.checked_sub(1)? };
        match actions.get(at)? {
            // A dwell, a stop or a tool change is an M- or G4-word; a bare feed or comment is neither.
            Action::Nothing if lines[at].words.iter().all(|w| b"NF".contains(&w.letter)) => {}
            Action::Nothing | Action::Other | Action::LostArc(_) => return None,
            // M0, M1, M2, M30, M60 in a block act at its end.
            Action::Line(_) | Action::Arc(_) => {
                let stops = |m: i64| matches!(m, 0 | 10 | 20 | 300 | 600);
                let stopped = lines[at]
                    .words
                    .iter()
                    .any(|w| w.letter == b'M' && stops(w.tenths()));
                return (!stopped).then_some(at);
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
