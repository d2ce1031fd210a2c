//! The largest that a corrected path asks for, from rest to constant rate, by a sweep over its ramp.
use crate::engine::zones::Built;
use giotto_shared::law::AngularMotion;
use giotto_shared::path::FeedRamp;

/// Places of a ramp that are looked at.
const STEPS: u32 = 48;

/// Of an arc with a radius of 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Worst {
    /// Offset.
    pub(super) gain: f64,
    /// Rate of change of the offset, 1/s.
    pub(super) slew_per_s: f64,
    /// Acceleration of the commanded path, centripetal and along it together, 1/s².
    pub(super) acceleration_per_s2: f64,
}

/// On an arc whose constant rate is `rate` rad/s.
pub(super) fn on_arc(zone: Option<&Built>, rate: f64, ramp_s: f64) -> Worst {
    let mut worst = Worst::default();
    // A falling ramp is a rising one run backwards; there κ3 has the other sign.
    for sense in [1.0, -1.0] {
        let h = ramp_s / f64::from(STEPS);
        let mut sweep = (0..=STEPS).map(|i| Place::at(zone, rate, ramp_s, sense, h * f64::from(i)));
        let mut before = sweep.next().unwrap_or_default();
        let mut here = before;
        for after in sweep {
            worst.add(&before, &here, &after, h);
            (before, here) = (here, after);
        }
        worst.add(&before, &here, &here, h);
        if zone.is_none_or(|zone| zone.third_s3 == 0.0) {
            break;
        }
    }
    worst
}

/// Gain less one, and how the angle moves.
#[derive(Clone, Copy, Default)]
struct Place {
    radial: f64,
    tangential: f64,
    rate: f64,
    acceleration: f64,
}

impl Place {
    fn at(zone: Option<&Built>, rate: f64, ramp_s: f64, sense: f64, time_s: f64) -> Self {
        let ramp = FeedRamp { from_m_s: 0.0, to_m_s: rate, duration_s: ramp_s };
        let [_, rate, acceleration, jerk, snap] = ramp.at(time_s);
        let Some(zone) = zone else { return Self { rate, acceleration, ..Self::default() } };
        let gain = zone.operator.gain(&AngularMotion { rate, acceleration, jerk, snap });
        let radial = gain.radial - 3.0 * sense * zone.third_s3 * rate * acceleration;
        Self { radial, tangential: gain.tangential, rate, acceleration }
    }
}

impl Worst {
    fn add(&mut self, before: &Place, here: &Place, after: &Place, h: f64) {
        let (w, a) = (here.rate, here.acceleration);
        let (re, im) = (here.radial, here.tangential);
        let first = |b: f64, a: f64| (a - b) / (2.0 * h);
        let (re1, im1) = (first(before.radial, after.radial), first(before.tangential, after.tangential));
        let second = |b: f64, c: f64, a: f64| (b - 2.0 * c + a) / (h * h);
        let re2 = second(before.radial, re, after.radial);
        let im2 = second(before.tangential, im, after.tangential);
        self.gain = self.gain.max(libm::hypot(re, im));
        // |d/dt (G − 1)e^{iθ}| = |G′ + iω(G − 1)|.
        self.slew_per_s = self.slew_per_s.max(libm::hypot(re1 - w * im, im1 + w * re));
        // d²/dt² G e^{iθ} = (G″ + 2iωG′ + (iα − ω²)G) e^{iθ}.
        let along = re2 - 2.0 * w * im1 - w * w * (1.0 + re) - a * im;
        let across = im2 + 2.0 * w * re1 - w * w * im + a * (1.0 + re);
        self.acceleration_per_s2 = self.acceleration_per_s2.max(libm::hypot(along, across));
    }
}

/// Largest acceleration on a line up to a speed, m/s².
pub(super) fn on_line(zone: Option<&Built>, speed: f64, ramp_s: f64) -> f64 {
    let ramp = FeedRamp { from_m_s: 0.0, to_m_s: speed, duration_s: ramp_s };
    let h = ramp_s / f64::from(STEPS);
    let place = |i: u32| {
        let [_, _, acceleration, _, snap] = ramp.at(h * f64::from(i));
        let offset = zone.map_or(0.0, |zone| zone.operator.offset(acceleration, snap));
        [acceleration, offset]
    };
    let (mut before, mut here, mut worst) = (place(0), place(0), 0.0f64);
    for i in 1..=STEPS {
        let after = place(i);
        worst = worst.max(libm::fabs(here[0] + (before[1] - 2.0 * here[1] + after[1]) / (h * h)));
        (before, here) = (here, after);
    }
    worst
}
