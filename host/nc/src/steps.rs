//! Steps behind joints, each shape worked out once.
use super::chain::{Chain, Response};
use super::transition::{Corner, Joint, Pace, Transition};
use std::cell::RefCell;
use std::collections::HashMap;

/// A step as it is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub(super) length_mm: f64,
    pub(super) shape: Transition,
    /// Largest error that it leaves, mm.
    pub(super) remaining_mm: f64,
}

/// A step longer than this many base lengths answers slowly enough to be taken as smooth.
const LONGEST: f64 = 4.0;
/// Steps come in lengths that differ by a part in so many, and share a shape where their curvatures and heights do.
const LENGTH_GRAIN: f64 = 64.0;
const CURVATURE_GRAIN: f64 = 32.0;
const HEIGHT_GRAIN: f64 = 256.0;
/// More shapes than a program has arcs of different size are thrown away at once.
const MOST_SHAPES: usize = 16_384;

/// What decides about a shape, rounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    length: i32,
    lead: bool,
    ramp: i32,
    curvature: [i32; 2],
    height: [i32; 2],
}

/// Shape and largest error in units.
type Shapes = HashMap<Key, (Transition, f64)>;

/// Two stretches that meet, in mm; curvatures and offsets are positive to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meeting {
    pub(super) feed_mm_s: f64,
    /// 1/mm, before the joint and behind it.
    pub(super) curvature: [f64; 2],
    /// Of the command from the path, mm.
    pub(super) offset_mm: [f64; 2],
    pub(super) side: Side,
}

/// Where the step is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Behind the joint, passed at speed.
    Behind,
    /// Behind the joint, from rest in it.
    FromRest,
    /// Before the joint, passed at speed.
    Before,
    /// Before the joint, to rest in it.
    ToRest,
}

/// The steps of one machine.
#[derive(Debug)]
pub(super) struct Steps {
    response: Option<Response>,
    base: f64,
    acceleration_mm_s2: f64,
    shapes: RefCell<Shapes>,
}

/// Length over which a step answers best, in units of the chain.
pub(super) fn base_length(chain: Chain) -> f64 {
    match chain {
        Chain::LagAverage { lag, average } => 1.6 * lag + 1.1 * average,
        Chain::FeedForward { .. } => 1.6,
        // The offset swings back as far as the machine swings over.
        Chain::SecondOrder { zeta } => {
            let k = 1e-2;
            let kappa2 = 4.0 * zeta * zeta - 2.0;
            let kappa2 = if kappa2.abs() < 1e-3 { 1e-3 } else { kappa2 };
            let corner = Corner {
                curvature: [0.0, k],
                offset: [0.0, -0.5 * kappa2 * k],
                lead: 0.0,
                pace: Pace::Through,
            };
            let errors = [2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0].map(|length| {
                let joint = Joint::new(chain, corner, length);
                (length, joint.remaining(joint.best(nodes(chain))))
            });
            let least = errors.iter().map(|e| e.1).fold(f64::INFINITY, f64::min);
            errors
                .iter()
                .find(|(_, error)| *error <= 1.2 * least)
                .map_or(3.0, |e| e.0)
        }
    }
}

/// Free nodes of a step.
pub(super) const fn nodes(chain: Chain) -> usize {
    match chain {
        Chain::LagAverage { .. } | Chain::SecondOrder { .. } | Chain::FeedForward { .. } => 2,
    }
}

impl Steps {
    pub(super) fn new(response: Option<Response>, acceleration_mm_s2: f64) -> Self {
        Self {
            response,
            base: response.map_or(0.0, |r| base_length(r.chain)),
            acceleration_mm_s2,
            shapes: RefCell::default(),
        }
    }

    /// Seconds over which the machine averages its command; 0 where nothing is known.
    pub(super) fn unit_s(&self) -> f64 {
        self.response.map_or(0.0, |r| r.unit_s)
    }

    /// The step of a meeting, within the acceleration that is allowed.
    pub(super) fn step(&self, meeting: &Meeting) -> Step {
        let rise_mm = (meeting.offset_mm[1] - meeting.offset_mm[0]).abs();
        let gentle_mm = |shape: Transition| {
            meeting.feed_mm_s * (shape.curvature() * rise_mm / self.acceleration_mm_s2).sqrt()
        };
        let unit_mm = meeting.feed_mm_s * self.unit_s();
        let (Some(response), true) = (self.response, unit_mm > 0.0 && rise_mm > 0.0) else {
            return Step {
                length_mm: gentle_mm(Transition::SMOOTH),
                shape: Transition::SMOOTH,
                remaining_mm: 0.0,
            };
        };
        let base = match meeting.side {
            Side::Behind => self.base,
            // The machine falls behind as it gets going.
            Side::FromRest => 1.6 * self.base,
            Side::Before | Side::ToRest => 0.6 * self.base,
        };
        let longest = LONGEST * base;
        // Up to the next length that there is.
        let coarse = |length: f64| ((length.ln() * LENGTH_GRAIN).ceil() / LENGTH_GRAIN).exp();
        let mut length = coarse(base);
        let (mut shape, mut left) = self.shape(response.chain, meeting, unit_mm, length);
        // A longer step is a flatter one; a few rounds find where both agree.
        for _ in 0..4 {
            let gentle = gentle_mm(shape) / unit_mm;
            if gentle <= length {
                break;
            }
            length = coarse(gentle.min(longest));
            (shape, left) = self.shape(response.chain, meeting, unit_mm, length);
        }
        if gentle_mm(shape) / unit_mm > length * 1.05 {
            length = (gentle_mm(Transition::SMOOTH) / unit_mm).max(longest);
            shape = Transition::SMOOTH;
            let corner = self.corner(meeting, unit_mm, length);
            left = Joint::new(response.chain, corner, length.min(64.0)).remaining(shape);
        }
        Step {
            length_mm: length * unit_mm,
            shape,
            remaining_mm: left * unit_mm,
        }
    }

    /// A meeting in units.
    fn corner(&self, meeting: &Meeting, unit_mm: f64, length: f64) -> Corner {
        let ramp = meeting.feed_mm_s / self.acceleration_mm_s2 / self.unit_s();
        let (lead, pace) = match meeting.side {
            Side::Behind => (0.0, Pace::Through),
            Side::FromRest => (0.0, Pace::From(ramp)),
            Side::Before => (length, Pace::Through),
            Side::ToRest => (length, Pace::To(ramp)),
        };
        Corner {
            curvature: meeting.curvature.map(|k| k * unit_mm),
            offset: meeting.offset_mm.map(|o| o / unit_mm),
            lead,
            pace,
        }
    }

    fn shape(
        &self,
        chain: Chain,
        meeting: &Meeting,
        unit_mm: f64,
        length: f64,
    ) -> (Transition, f64) {
        let grain = |v: f64, grain: f64| {
            if v == 0.0 {
                return 0;
            }
            // Odd to the left, even to the right; 0 is straight on.
            let steps = (v.abs().ln() * grain).round() as i32 + 100_000;
            2 * steps + i32::from(v > 0.0)
        };
        let back = |n: i32, grain: f64| {
            if n == 0 {
                return 0.0;
            }
            let size = (f64::from(n / 2 - 100_000) / grain).exp();
            if n % 2 == 1 { size } else { -size }
        };
        let exact = self.corner(meeting, unit_mm, length);
        let (ramp, lead) = match exact.pace {
            Pace::Through => (0.0, exact.lead > 0.0),
            Pace::From(ramp) | Pace::To(ramp) => (ramp, exact.lead > 0.0),
        };
        let greatest = exact
            .curvature
            .iter()
            .fold(0.0, |m, k| f64::max(m, k.abs()));
        let key = Key {
            length: grain(length, LENGTH_GRAIN),
            lead,
            ramp: grain(ramp, 8.0),
            curvature: exact.curvature.map(|k| grain(k, CURVATURE_GRAIN)),
            // In units of what the curvature asks for.
            height: exact.offset.map(|o| grain(o / greatest, HEIGHT_GRAIN)),
        };
        if let Some(found) = self.shapes.borrow().get(&key) {
            return *found;
        }
        let curvature = key.curvature.map(|k| back(k, CURVATURE_GRAIN));
        let rounded = curvature
            .iter()
            .fold(0.0, |m, k: &f64| f64::max(m, k.abs()));
        let ramp = back(key.ramp, 8.0);
        let corner = Corner {
            curvature,
            offset: key.height.map(|h| back(h, HEIGHT_GRAIN) * rounded),
            lead: exact.lead,
            pace: match exact.pace {
                Pace::Through => Pace::Through,
                Pace::From(_) => Pace::From(ramp),
                Pace::To(_) => Pace::To(ramp),
            },
        };
        let joint = Joint::new(chain, corner, length);
        let count = match meeting.side {
            Side::Behind | Side::FromRest => nodes(chain),
            // A freer shape swings farther than the acceleration allows.
            Side::Before | Side::ToRest => 1,
        };
        let shape = joint.best(count);
        // Curvatures are rounded; what remains goes with the true ones.
        let found = (
            shape,
            joint.remaining(shape) * greatest / rounded.max(f64::MIN_POSITIVE),
        );
        let mut shapes = self.shapes.borrow_mut();
        if shapes.len() >= MOST_SHAPES {
            shapes.clear();
        }
        shapes.insert(key, found);
        found
    }
}
