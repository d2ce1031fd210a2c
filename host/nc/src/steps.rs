//! Steps at joints, each shape worked out once.
use super::chain::{Chain, Response};
use super::joint::{Corner, Joint, Pace};
use super::transition::Transition;
use super::{Keep, Options};
use std::cell::RefCell;
use std::collections::HashMap;

/// A step as it is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub(super) length_mm: f64,
    pub(super) shape: Transition,
    /// Largest error that it leaves, mm.
    pub(super) remaining_mm: f64,
    /// Speed along it as a share of the feed; below 1 only to a stop.
    pub(super) speed: f64,
}

impl Step {
    /// No way and no change.
    pub(super) const NONE: Self = Self {
        length_mm: 0.0,
        shape: Transition::SMOOTH,
        remaining_mm: 0.0,
        speed: 1.0,
    };
}

/// Curvatures, heights, limits and the like share a shape where they differ by less than a part in so many.
const CURVATURE_GRAIN: f64 = 32.0;
/// Curvatures and heights against the greatest curvature: what they are off by is an error all along the arc.
const RATIO_GRAIN: f64 = 1024.0;
const COARSE_GRAIN: f64 = 8.0;
/// A step with so little of its height left is as good as needed.
const GOOD: f64 = 0.007;
/// From so much of its height on, a step to a stop is run more slowly.
const SLOW_FROM: f64 = 0.05;
/// How slowly, as shares of the feed.
const SPEEDS: [f64; 2] = [0.5, 0.35];
/// A longer or a finer step must leave so much less.
const WORTH: f64 = 0.9;
/// What lengths are tried where the acceleration asks for longer ones, in units of the usual length.
const LONGER: [f64; 6] = [1.0, 1.3, 1.7, 2.2, 3.0, 4.0];
/// More shapes than a program has arcs of different size are thrown away at once.
const MOST_SHAPES: usize = 16_384;

/// What decides about a shape, rounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    side: Side,
    ramp: i32,
    greatest: i32,
    /// In units of the greatest.
    curvature: [i32; 2],
    /// In units of what the greatest curvature asks for.
    height: [i32; 2],
    limit: i32,
    room: i32,
}

/// A step in units of the chain.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    length: f64,
    shape: Transition,
    left: f64,
    speed: f64,
}

/// Two stretches that meet, in mm; curvatures and offsets are positive to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meeting {
    pub(super) feed_mm_s: f64,
    /// 1/mm, before the joint and behind it.
    pub(super) curvature: [f64; 2],
    /// Of the command from the path, mm.
    pub(super) offset_mm: [f64; 2],
    pub(super) side: Side,
    /// Way that there is for the step, mm; a longer one is chosen only where none fits.
    pub(super) room_mm: f64,
}

/// Where the step is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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

/// Lengths, in units of that at which a step answers best, with the number of nodes between its ends; short ones first.
const fn candidates(side: Side) -> &'static [(f64, usize)] {
    match side {
        Side::Behind => &[(1.0, 2), (1.0, 3), (1.5, 3), (1.5, 4)],
        // The machine falls behind as it gets going.
        Side::FromRest => &[(1.6, 2), (1.6, 3), (2.2, 3), (3.0, 3)],
        Side::Before => &[(0.6, 1), (0.4, 1), (0.6, 2), (1.0, 2)],
        Side::ToRest => &[(0.3, 1), (0.5, 1), (0.75, 1), (0.3, 2), (0.5, 2), (0.75, 2)],
    }
}

/// The steps of one machine.
#[derive(Debug)]
pub(super) struct Steps {
    response: Option<Response>,
    base: f64,
    acceleration_mm_s2: f64,
    /// Whether the feed is kept, not the angular rate.
    at_feed: bool,
    /// Whether the last stretch before a stop may be run more slowly.
    slows: bool,
    shapes: RefCell<HashMap<Key, Found>>,
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
                at_feed: true,
            };
            let errors = [2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0].map(|length| {
                (
                    length,
                    Joint::new(chain, corner, length, Transition::SMOOTH)
                        .best(&even(2))
                        .1,
                )
            });
            let least = errors.iter().map(|e| e.1).fold(f64::INFINITY, f64::min);
            errors
                .iter()
                .find(|(_, error)| *error <= 1.2 * least)
                .map_or(3.0, |e| e.0)
        }
    }
}

/// Places of so many nodes evenly between 0 and 1.
pub(super) fn even(count: usize) -> Vec<f64> {
    let parts = (count + 1) as f64;
    (1..=count).map(|i| i as f64 / parts).collect()
}

impl Steps {
    pub(super) fn new(response: Option<Response>, options: &Options) -> Self {
        Self {
            response,
            base: response.map_or(0.0, |r| base_length(r.chain)),
            acceleration_mm_s2: options.acceleration_mm_s2,
            at_feed: options.keep == Keep::Feed,
            slows: options.slow_to_stops,
            shapes: RefCell::default(),
        }
    }

    /// The step of a meeting, within the acceleration that is allowed.
    pub(super) fn step(&self, meeting: &Meeting) -> Step {
        let rise_mm = (meeting.offset_mm[1] - meeting.offset_mm[0]).abs();
        let Some(response) = self
            .response
            .filter(|r| r.unit_s * meeting.feed_mm_s > 0.0 && rise_mm > 0.0)
        else {
            let shape = Transition::SMOOTH;
            let bend = shape.curvature() * rise_mm / self.acceleration_mm_s2;
            return Step {
                length_mm: meeting.feed_mm_s * bend.sqrt(),
                shape,
                ..Step::NONE
            };
        };
        let unit_mm = meeting.feed_mm_s * response.unit_s;
        let found = self.found(response, meeting, unit_mm, rise_mm);
        Step {
            length_mm: found.length * unit_mm,
            shape: found.shape,
            remaining_mm: found.left * unit_mm,
            speed: found.speed,
        }
    }

    /// The step for the rounded meeting, from the store or worked out anew.
    fn found(&self, response: Response, meeting: &Meeting, unit_mm: f64, rise_mm: f64) -> Found {
        let unit_s = response.unit_s;
        let curvature = meeting.curvature.map(|k| k * unit_mm);
        let greatest = curvature.iter().fold(0.0, |m, k| f64::max(m, k.abs()));
        let ramp = match meeting.side {
            Side::Behind | Side::Before => 0.0,
            Side::FromRest | Side::ToRest => meeting.feed_mm_s / self.acceleration_mm_s2 / unit_s,
        };
        let key = Key {
            side: meeting.side,
            ramp: grain(ramp, COARSE_GRAIN),
            greatest: grain(greatest, CURVATURE_GRAIN),
            curvature: curvature.map(|k| grain(k / greatest, RATIO_GRAIN)),
            height: meeting
                .offset_mm
                .map(|o| grain(o / unit_mm / greatest, RATIO_GRAIN)),
            limit: below(self.acceleration_mm_s2 * unit_s * unit_s / rise_mm),
            room: below((meeting.room_mm / unit_mm).min(20.0 * self.base)),
        };
        let scale = back(key.greatest, CURVATURE_GRAIN);
        let rounded = key.curvature.map(|k| back(k, RATIO_GRAIN) * scale);
        let known = self.shapes.borrow().get(&key).copied();
        let mut found = known.unwrap_or_else(|| {
            let search = Search {
                chain: response.chain,
                base: self.base,
                side: meeting.side,
                curvature: rounded,
                offset: key.height.map(|h| back(h, RATIO_GRAIN) * scale),
                ramp: back(key.ramp, COARSE_GRAIN),
                at_feed: self.at_feed,
                limit: back(key.limit, COARSE_GRAIN),
                room: back(key.room, COARSE_GRAIN),
            };
            let found = search.run(self.slows);
            let mut shapes = self.shapes.borrow_mut();
            if shapes.len() >= MOST_SHAPES {
                shapes.clear();
            }
            shapes.insert(key, found);
            found
        });
        // Curvatures are rounded; what remains goes with the true ones.
        found.left *= greatest / scale.max(f64::MIN_POSITIVE);
        found
    }
}

/// A number on a grid of its logarithm: odd to the left, even to the right, 0 for 0.
fn grain(v: f64, grain: f64) -> i32 {
    if v == 0.0 {
        return 0;
    }
    let steps = (v.abs().ln() * grain).round() as i32 + 100_000;
    2 * steps + i32::from(v > 0.0)
}

/// The next number of the grid that is not above a positive one.
fn below(v: f64) -> i32 {
    let steps = (v.max(1e-9).ln() * COARSE_GRAIN + 1e-9).floor() as i32 + 100_000;
    2 * steps + 1
}

/// The number of a place of the grid.
fn back(n: i32, grain: f64) -> f64 {
    if n == 0 {
        return 0.0;
    }
    let size = (f64::from(n / 2 - 100_000) / grain).exp();
    if n % 2 == 1 { size } else { -size }
}

/// A meeting in units of the chain.
struct Search {
    chain: Chain,
    base: f64,
    side: Side,
    curvature: [f64; 2],
    offset: [f64; 2],
    /// Time from rest to the feed.
    ramp: f64,
    /// The command runs at the feed, not at the rate of the path.
    at_feed: bool,
    /// Largest curvature of a step of height 1.
    limit: f64,
    room: f64,
}

impl Search {
    fn run(&self, slows: bool) -> Found {
        let rise = (self.offset[1] - self.offset[0]).abs();
        let mut found = self.at_speed(1.0);
        if slows && self.side == Side::ToRest {
            for speed in SPEEDS {
                if found.left <= SLOW_FROM * rise {
                    break;
                }
                let slower = self.at_speed(speed);
                if slower.left < WORTH * found.left {
                    found = slower;
                }
            }
        }
        found
    }

    fn joint(&self, length: f64, speed: f64, guess: Transition) -> Joint {
        let ramp = self.ramp;
        let (lead, pace) = match self.side {
            Side::Behind => (0.0, Pace::Through),
            Side::FromRest => (0.0, Pace::From { ramp }),
            Side::Before => (length, Pace::Through),
            Side::ToRest => (
                length,
                Pace::To {
                    ramp,
                    speed,
                    stretch: length,
                },
            ),
        };
        let corner = Corner {
            curvature: self.curvature,
            offset: self.offset,
            lead,
            pace,
            at_feed: self.at_feed,
        };
        Joint::new(self.chain, corner, length, guess)
    }

    /// The best of the candidates that keep the acceleration, longer ones where none does.
    fn at_speed(&self, speed: f64) -> Found {
        let rise = (self.offset[1] - self.offset[0]).abs();
        // The acceleration across goes with the square of the speed.
        let limit = self.limit / (speed * speed);
        for longer in LONGER {
            let mut best: Option<Found> = None;
            for (factor, nodes) in candidates(self.side) {
                let length = factor * self.base * longer;
                if best.is_some() && length > self.room {
                    continue;
                }
                let (guess, _) = self
                    .joint(length, speed, Transition::SMOOTH)
                    .best(&even(*nodes));
                let (shape, left) = self.joint(length, speed, guess).best(&even(*nodes));
                let fits = |shape: Transition| shape.curvature() <= limit * length * length;
                let (shape, left) = if fits(shape) {
                    (shape, left)
                } else {
                    let smooth = Transition::SMOOTH;
                    let joint = self.joint(length, speed, smooth);
                    (smooth, joint.remaining(smooth))
                };
                if fits(shape) && best.is_none_or(|b| left < WORTH * b.left) {
                    best = Some(Found {
                        length,
                        shape,
                        left,
                        speed,
                    });
                }
                if best.is_some_and(|b| b.left <= GOOD * rise) {
                    break;
                }
            }
            if let Some(best) = best {
                return best;
            }
        }
        let shape = Transition::SMOOTH;
        let length = (shape.curvature() / limit).sqrt();
        // What is longer than the machine remembers is as good as steady.
        let left = self.joint(length.min(64.0), speed, shape).remaining(shape);
        Found {
            length,
            shape,
            left,
            speed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From a line into a flat arc that the machine makes too small by κ2/2 of its curvature: what the table of `joint` says.
    #[test]
    fn errors_are_those_of_the_table() {
        let sigma = (4e-4_f64 + 1.6e-3 / 12.0).sqrt();
        let both = Chain::LagAverage {
            lag: 0.02 / sigma,
            average: 0.04 / sigma,
        };
        let average = Chain::LagAverage {
            lag: 0.0,
            average: 12.0_f64.sqrt(),
        };
        let lag = Chain::LagAverage {
            lag: 1.0,
            average: 0.0,
        };
        let second = |zeta: f64| (Chain::SecondOrder { zeta }, 4.0 * zeta * zeta - 2.0);
        for ((chain, kappa2), most) in [
            ((lag, 1.0), 0.0025),
            ((both, 1.0), 0.020),
            ((average, 1.0), 0.09),
            (second(0.95), 0.006),
            (second(0.8), 0.012),
            (second(1.2), 0.005),
            (second(0.5), 0.005),
        ] {
            let k = 1e-3;
            let search = Search {
                chain,
                base: base_length(chain),
                side: Side::Behind,
                curvature: [0.0, k],
                offset: [0.0, -0.5 * kappa2 * k],
                ramp: 0.0,
                at_feed: true,
                limit: 1e3,
                room: 1e3,
            };
            let found = search.run(true);
            let share = found.left / (0.5 * kappa2.abs() * k);
            println!("{chain:?}: {share:.4} {found:?}");
            assert!(share < most, "{chain:?}: {share} {found:?}");
        }
    }
}
