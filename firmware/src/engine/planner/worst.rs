//! The largest that a corrected path asks for, from rest to constant rate, by a sweep over its ramp.
use super::law::{ArcLaw, LineLaw, Shape};
use super::timing::Motion;
use crate::engine::ramp::FIRST;

/// Places of a ramp that are looked at.
const STEPS: u16 = 48;

/// The shapes at the places of a ramp, in order.
fn sweep() -> impl Iterator<Item = Shape> {
    (0..=STEPS).map(|i| Shape::at(f32::from(i) * (2.0 / STEPS as f32) - 1.0))
}

/// Of a path that is scaled to an arc with a radius of 1; of a line, as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Worst {
    /// Offset.
    pub(super) gain: f32,
    /// Rate of change of the offset, 1/s.
    pub(super) slew_per_s: f32,
    /// Acceleration of the commanded path, centripetal and along it together, 1/s².
    pub(super) acceleration_per_s2: f32,
}

/// On an arc, in its rising and in its falling ramp.
pub(super) fn on_arc(law: Option<&ArcLaw>, motion: &Motion) -> Worst {
    let mut worst = Worst::default();
    let h = motion.ramp_s / f32::from(STEPS);
    for sense in [1.0, -1.0] {
        let (mut before, mut here) = (Place::default(), Place::default());
        // The last place twice: at constant rate nothing changes any more.
        for (i, after) in sweep().chain([Shape::at(1.0)]).enumerate() {
            let after = Place::at(law, motion, &after, sense);
            if i > 0 {
                worst.add(&before, &here, &after, h);
            }
            (before, here) = (here, after);
        }
    }
    worst
}

/// On an arc, in a stop from constant rate: braking (1/s) and jerk (1/s²) as shares of that rate.
pub(super) fn on_stop(law: Option<&ArcLaw>, motion: &Motion, [braking, jerk]: [f32; 2]) -> Worst {
    let edge_s = (braking / jerk).min(libm::sqrtf(1.0 / jerk));
    let (braking, all_s) = (jerk * edge_s, 1.0 / (jerk * edge_s) + edge_s);
    let h = all_s / f32::from(STEPS);
    let at = |place: u16| {
        let t = f32::from(place.min(STEPS)) * h;
        let (early, late) = (t.min(edge_s), all_s - t);
        let share = if t < edge_s {
            1.0 - 0.5 * jerk * early * early
        } else if late > edge_s {
            1.0 - braking * (t - 0.5 * edge_s)
        } else {
            0.5 * jerk * late * late
        };
        let shape = Shape {
            s: share,
            ..Shape::default()
        };
        let change = jerk * early.min(late);
        Place {
            acceleration: -motion.rate * change,
            ..Place::at(law, motion, &shape, 1.0)
        }
    };
    let mut worst = Worst::default();
    for place in 0..STEPS {
        worst.add(&at(place.saturating_sub(1)), &at(place), &at(place + 1), h);
    }
    worst
}

/// Gain less one, and how the angle moves.
#[derive(Clone, Copy, Default)]
struct Place {
    radial: f32,
    tangential: f32,
    rate: f32,
    acceleration: f32,
}

impl Place {
    fn at(law: Option<&ArcLaw>, motion: &Motion, f: &Shape, sense: f32) -> Self {
        let [radial, tangential] = law.map_or([0.0; 2], |law| law.gain(f, sense));
        let (rate, acceleration) = (
            motion.rate * f.s,
            motion.rate * FIRST / motion.ramp_s * f.w4,
        );
        Self {
            radial,
            tangential,
            rate,
            acceleration,
        }
    }
}

impl Worst {
    fn add(&mut self, before: &Place, here: &Place, after: &Place, h: f32) {
        let (w, a) = (here.rate, here.acceleration);
        let (re, im) = (here.radial, here.tangential);
        let first = |b: f32, a: f32| (a - b) / (2.0 * h);
        let (re1, im1) = (
            first(before.radial, after.radial),
            first(before.tangential, after.tangential),
        );
        let second = |b: f32, c: f32, a: f32| ((b - c) + (a - c)) / (h * h);
        let re2 = second(before.radial, re, after.radial);
        let im2 = second(before.tangential, im, after.tangential);
        let size = |x: f32, y: f32| libm::sqrtf(x * x + y * y);
        self.gain = self.gain.max(size(re, im));
        // |d/dt (G − 1)e^{iθ}| = |G′ + iω(G − 1)|.
        self.slew_per_s = self.slew_per_s.max(size(re1 - w * im, im1 + w * re));
        // d²/dt² G e^{iθ} = (G″ + 2iωG′ + (iα − ω²)G) e^{iθ}.
        let along = re2 - 2.0 * w * im1 - w * w * (1.0 + re) - a * im;
        let across = im2 + 2.0 * w * re1 - w * w * im + a * (1.0 + re);
        self.acceleration_per_s2 = self.acceleration_per_s2.max(size(along, across));
    }
}

/// On a line up to a speed, m/s: SI.
pub(super) fn on_line(law: Option<&LineLaw>, speed: f32, ramp_s: f32) -> Worst {
    let mut worst = Worst::default();
    let h = ramp_s / f32::from(STEPS);
    let (mut before, mut here) = (0.0f32, [0.0; 2]);
    for f in sweep() {
        let after = [
            speed * FIRST / ramp_s * f.w4,
            law.map_or(0.0, |law| law.along(&f)),
        ];
        let second = ((before - here[1]) + (after[1] - here[1])) / (h * h);
        worst.gain = worst.gain.max(after[1].abs());
        worst.slew_per_s = worst.slew_per_s.max((after[1] - here[1]).abs() / h);
        worst.acceleration_per_s2 = worst.acceleration_per_s2.max((here[0] + second).abs());
        (before, here) = (here[1], after);
    }
    worst
}
