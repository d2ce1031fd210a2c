//! What a machine leaves beside two circles or lines that meet, and the step of the command that takes most of it off.
//!
//! The machine of a model (`chain`) is driven along the two stretches, in the plane and at their true curvature. The step may
//! not begin on the block of a line, which stands untouched, nor have a corner: it meets what is missing as well as its nodes
//! can, with the least largest error. Where a line meets an arc remains, as a share of the offset (the tests hold the numbers):
//!
//! | machine | κ4/κ2² | remains |
//! |---|---|---|
//! | a lag | 6 | 0.2 % |
//! | second order, ζ 0.95 | 1.4 | 0.5 % |
//! | a lag of 20 ms, an average of 40 ms | 3.3 | 1.9 % |
//! | an average alone | −1.2 | 9 % |
//!
//! An average alone answers before the joint, on the line that may not be touched, and what is left of that is no matter of
//! shape. The summary of `giotto compensate` names the arcs whose joints keep more than 5 %.
use super::chain::{Chain, STEP};
use super::least_squares::least_largest;
use super::transition::Transition;

/// How the path is travelled about a joint, in units of the chain's time. Speeds are shares of the feed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pace {
    /// Through it at speed.
    Through,
    /// From rest in it; the speed is reached after so long.
    From { ramp: f64 },
    /// To rest in it: the last `stretch` units of way at `speed`, and `ramp` long from the feed to rest.
    To { ramp: f64, speed: f64, stretch: f64 },
}

impl Pace {
    /// Way behind the joint at a time. At time 0 the machine is told to be there; from rest or to rest, to stand there.
    fn way(self, t: f64) -> f64 {
        match self {
            Self::Through => t,
            Self::From { ramp } => match t {
                t if t <= 0.0 => 0.0,
                t if t < ramp => 0.5 * t * t / ramp,
                t => t - 0.5 * ramp,
            },
            Self::To { .. } if t >= 0.0 => 0.0,
            Self::To {
                ramp,
                speed,
                stretch,
            } => {
                let slowing = speed * ramp;
                if t > -slowing {
                    return -0.5 * t * t / ramp;
                }
                let stop_way = 0.5 * speed * slowing;
                let even = (stretch - stop_way).max(0.0) / speed;
                let before = -slowing - t;
                if before < even || speed >= 1.0 {
                    return -stop_way - speed * before;
                }
                let (x, change) = (before - even, (1.0 - speed) * ramp);
                let braked = x.min(change);
                let way = speed * braked + 0.5 * braked * braked / ramp.max(f64::MIN_POSITIVE);
                -stop_way - speed * even - way - (x - braked)
            }
        }
    }

    /// When it is so far before the joint.
    fn time_before(self, way: f64) -> f64 {
        match self {
            Self::Through => -way,
            Self::From { .. } => 0.0,
            Self::To { ramp, speed, .. } => {
                // The way falls evenly with time.
                let (mut early, mut late) = (-way / speed - 2.0 * ramp, 0.0);
                for _ in 0..50 {
                    let middle = 0.5 * (early + late);
                    if self.way(middle) < -way {
                        early = middle;
                    } else {
                        late = middle;
                    }
                }
                late
            }
        }
    }

    /// When it is so far behind the joint, or stands.
    fn time_behind(self, way: f64) -> f64 {
        match self {
            Self::Through => way,
            Self::From { ramp } => way + ramp,
            Self::To { .. } => 0.0,
        }
    }
}

/// A joint of two circles or lines in units of the chain's time and the way made in it; curvatures and offsets are positive
/// to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Before the joint and behind it.
    pub(super) curvature: [f64; 2],
    /// Of the command from the path.
    pub(super) offset: [f64; 2],
    /// The step begins so far before the joint.
    pub(super) lead: f64,
    pub(super) pace: Pace,
    /// The command runs at the feed, beside a circle as well, and so turns about its centre at another rate.
    pub(super) at_feed: bool,
}

impl Corner {
    /// Ways along the path where the command has made these ways, 0 at the joint, with a step of a length and a shape.
    fn along(&self, ways: &[f64], length: f64, shape: Transition) -> Vec<f64> {
        if !self.at_feed {
            return ways.to_vec();
        }
        let rise = self.offset[1] - self.offset[0];
        let rate = |way: f64| {
            let offset = self.offset[0] + rise * shape.at((way + self.lead) / length);
            (1.0 - self.curvature_at(way) * offset).recip()
        };
        let joint = ways.partition_point(|way| *way < 0.0);
        let mut along = vec![0.0; ways.len()];
        let (mut from, mut place) = (0.0, 0.0);
        for k in joint..ways.len() {
            place += (ways[k] - from) * rate(place);
            (from, along[k]) = (ways[k], place);
        }
        (from, place) = (0.0, 0.0);
        for k in (0..joint).rev() {
            // The rate before the joint.
            place += (ways[k] - from) * rate(place.min(-f64::MIN_POSITIVE));
            (from, along[k]) = (ways[k], place);
        }
        along
    }

    fn curvature_at(&self, way: f64) -> f64 {
        self.curvature[usize::from(way >= 0.0)]
    }

    /// Place and left normal of the path, from the joint along its tangent.
    fn path(&self, way: f64) -> ([f64; 2], [f64; 2]) {
        let k = self.curvature_at(way);
        let (sin, cos) = (k * way).sin_cos();
        let half = (0.5 * k * way).sin();
        let place = if k == 0.0 {
            [way, 0.0]
        } else {
            [sin / k, 2.0 * half * half / k]
        };
        (place, [-sin, cos])
    }

    /// How far to the left of the path a place lies, and the left normal there.
    fn aside(&self, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
        let k = self.curvature_at(x);
        let w = k * k * (x * x + y * y) - 2.0 * k * y;
        let left = (2.0 * y - k * (x * x + y * y)) / (1.0 + (1.0 + w).max(0.0).sqrt());
        let norm = (k * x).hypot(1.0 - k * y);
        (left, [-k * x / norm, (1.0 - k * y) / norm])
    }
}

/// A step about a joint of a chain.
pub(super) struct Joint {
    chain: Chain,
    corner: Corner,
    length: f64,
    /// Way of the command at each sample.
    ways: Vec<f64>,
    /// What is missing without a step, to the left.
    missing: Vec<f64>,
    /// Left normals of the path where the command and where the machine is.
    normals: Vec<[[f64; 2]; 2]>,
}

impl Joint {
    /// Of a step over `length` units, along which the command makes its way as along a step of shape `guess`.
    pub(super) fn new(chain: Chain, corner: Corner, length: f64, guess: Transition) -> Self {
        let pace = corner.pace;
        let begin = pace.time_before(corner.lead);
        // A line is travelled straight on; a circle must be in its stride.
        let settling = match pace {
            Pace::From { .. } => 0.0,
            _ => chain.settling(),
        };
        let end = pace.time_behind(length - corner.lead) + 3.0 * chain.delay() + 1.0;
        let all = ((end - begin + settling) / STEP) as usize + 1;
        let skipped = (settling / STEP) as usize;
        let ways: Vec<f64> = (0..all)
            .map(|k| pace.way(k as f64 * STEP + begin - settling))
            .collect();
        let ways = corner.along(&ways, length, guess);
        let command: Vec<([f64; 2], [f64; 2])> = ways
            .iter()
            .map(|way| {
                let (p, n) = corner.path(*way);
                let o = corner.offset[0];
                ([p[0] + o * n[0], p[1] + o * n[1]], n)
            })
            .collect();
        let start = command[0].0;
        let axis = |i: usize| -> Vec<f64> {
            let moved: Vec<f64> = command.iter().map(|(p, _)| p[i] - start[i]).collect();
            chain.apply(&moved)
        };
        let (x, y) = (axis(0), axis(1));
        let mut missing = Vec::with_capacity(all - skipped);
        let mut normals = Vec::with_capacity(all - skipped);
        for k in skipped..all {
            let (left, normal) = corner.aside([x[k] + start[0], y[k] + start[1]]);
            missing.push(-left);
            normals.push([command[k].1, normal]);
        }
        Self {
            chain,
            corner,
            length,
            ways: ways[skipped..].to_vec(),
            missing,
            normals,
        }
    }

    /// What is answered to a step of height 1, to the left of where the machine is.
    fn answer(&self, shape: Transition) -> Vec<f64> {
        let step: Vec<f64> = self
            .ways
            .iter()
            .map(|way| shape.at((way + self.corner.lead) / self.length))
            .collect();
        let axis = |i: usize| -> Vec<f64> {
            let moved: Vec<f64> = step
                .iter()
                .zip(&self.normals)
                .map(|(g, n)| g * n[0][i])
                .collect();
            self.chain.apply(&moved)
        };
        let (x, y) = (axis(0), axis(1));
        self.normals
            .iter()
            .enumerate()
            .map(|(k, n)| x[k] * n[1][0] + y[k] * n[1][1])
            .collect()
    }

    /// Height of the step.
    fn rise(&self) -> f64 {
        self.corner.offset[1] - self.corner.offset[0]
    }

    /// Largest error that a step leaves, in units.
    pub(super) fn remaining(&self, shape: Transition) -> f64 {
        let rise = self.rise();
        let left = self.missing.iter().zip(self.answer(shape));
        left.fold(0.0, |most, (m, a)| f64::max(most, (m - rise * a).abs()))
    }

    /// The best step through nodes at these shares of its length, and the largest error that it leaves, in units.
    pub(super) fn best(&self, places: &[f64]) -> (Transition, f64) {
        let rise = self.rise();
        let blank = Transition::blank(places);
        let end = self.answer(blank);
        let parts: Vec<Vec<f64>> = (0..blank.unknowns())
            .map(|i| {
                let mut values = vec![0.0; blank.unknowns()];
                values[i] = 1.0;
                let answer = self.answer(blank.with(&values));
                // A part contains the end of the step as well.
                answer.iter().zip(&end).map(|(a, e)| a - e).collect()
            })
            .collect();
        let target: Vec<f64> = self
            .missing
            .iter()
            .zip(&end)
            .map(|(m, e)| m / rise - e)
            .collect();
        match least_largest(&parts, &target) {
            Some((solved, most)) => (blank.with(&solved), most * rise.abs()),
            None => (Transition::SMOOTH, self.remaining(Transition::SMOOTH)),
        }
    }
}
