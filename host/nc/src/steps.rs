//! Steps behind joints, each shape worked out once.
use super::chain::{Chain, Response};
use super::transition::{Joint, Transition};
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
/// Steps come in lengths that differ by a part in so many, and share a shape where their heights do.
const LENGTH_GRAIN: f64 = 64.0;
const HEIGHT_GRAIN: f64 = 1024.0;
/// More shapes than a program has arcs of different size are thrown away at once.
const MOST_SHAPES: usize = 4096;

/// Shape and largest error in units, by length and height.
type Shapes = HashMap<(i32, i32), (Transition, f64)>;

/// The steps of one machine.
#[derive(Debug)]
pub(super) struct Steps {
    response: Option<Response>,
    base: f64,
    shapes: RefCell<Shapes>,
}

/// Length over which a step answers best, in units of the chain.
pub(super) fn base_length(chain: Chain) -> f64 {
    match chain {
        Chain::LagAverage { lag, average } => 1.6 * lag + 1.1 * average,
        Chain::FeedForward { .. } => 1.6,
        // The offset swings back as far as the machine swings over.
        Chain::SecondOrder { zeta } => {
            let errors = [2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0].map(|length| {
                let joint = Joint::new(chain, length);
                let rise = 2.0 * zeta * zeta - 1.0;
                let rise = if rise.abs() < 1e-3 { 1e-3 } else { rise };
                (
                    length,
                    joint.remaining(joint.best(rise, nodes(chain)), rise),
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

/// Free nodes of a step.
const fn nodes(chain: Chain) -> usize {
    match chain {
        Chain::LagAverage { .. } => 1,
        Chain::SecondOrder { .. } | Chain::FeedForward { .. } => 2,
    }
}

impl Steps {
    pub(super) fn new(response: Option<Response>) -> Self {
        Self {
            response,
            base: response.map_or(0.0, |r| base_length(r.chain)),
            shapes: RefCell::default(),
        }
    }

    /// Seconds over which the machine averages its command; 0 where nothing is known.
    pub(super) fn unit_s(&self) -> f64 {
        self.response.map_or(0.0, |r| r.unit_s)
    }

    /// The step of `rise_mm` at `feed_mm_s` where the curvature changes by so much, 1/mm, within an acceleration.
    pub(super) fn step(
        &self,
        feed_mm_s: f64,
        rise_mm: f64,
        curvature: f64,
        acceleration_mm_s2: f64,
    ) -> Step {
        let gentle_mm = |shape: Transition| {
            feed_mm_s * (shape.curvature() * rise_mm.abs() / acceleration_mm_s2).sqrt()
        };
        let unit_mm = feed_mm_s * self.unit_s();
        let across_mm = unit_mm * unit_mm * curvature;
        let height = rise_mm / across_mm;
        let (Some(response), true) = (self.response, height.is_finite() && height != 0.0) else {
            return Step {
                length_mm: gentle_mm(Transition::SMOOTH),
                shape: Transition::SMOOTH,
                remaining_mm: 0.0,
            };
        };
        let longest = LONGEST * self.base;
        // Up to the next length that there is.
        let coarse = |length: f64| ((length.ln() * LENGTH_GRAIN).ceil() / LENGTH_GRAIN).exp();
        let mut length = coarse(self.base);
        let (mut shape, mut left) = self.shape(response.chain, length, height);
        // A longer step is a flatter one; a few rounds find where both agree.
        for _ in 0..4 {
            let gentle = gentle_mm(shape) / unit_mm;
            if gentle <= length {
                break;
            }
            length = coarse(gentle.min(longest));
            (shape, left) = self.shape(response.chain, length, height);
        }
        let needed = gentle_mm(shape) / unit_mm;
        if needed > length * 1.05 {
            length = (gentle_mm(Transition::SMOOTH) / unit_mm).max(longest);
            shape = Transition::SMOOTH;
            left = Joint::new(response.chain, length.min(8.0 * longest)).remaining(shape, height);
        }
        Step {
            length_mm: length * unit_mm,
            shape,
            remaining_mm: left * across_mm.abs(),
        }
    }

    fn shape(&self, chain: Chain, length: f64, height: f64) -> (Transition, f64) {
        let grain = |v: f64, grain: f64| (v.abs().ln() * grain).round() as i32;
        let rounded = grain(height, HEIGHT_GRAIN);
        let key = (
            grain(length, LENGTH_GRAIN),
            2 * rounded + i32::from(height < 0.0),
        );
        if let Some(found) = self.shapes.borrow().get(&key) {
            return *found;
        }
        let height = (f64::from(rounded) / HEIGHT_GRAIN).exp().copysign(height);
        let joint = Joint::new(chain, length);
        let shape = joint.best(height, nodes(chain));
        let found = (shape, joint.remaining(shape, height));
        let mut shapes = self.shapes.borrow_mut();
        if shapes.len() >= MOST_SHAPES {
            shapes.clear();
        }
        shapes.insert(key, found);
        found
    }
}
