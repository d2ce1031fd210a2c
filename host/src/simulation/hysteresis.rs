//! What remembers the last reversal of an axis: backlash, friction, lateral play.
use super::command::hermite;
use super::machine::{Friction, Machine};

/// Travel back from the extreme after which a reversal counts, m: below it rounding and a decaying
/// oscillation at standstill would be taken for reversals.
const REVERSAL_TRAVEL_M: f64 = 1e-8;

/// A way no longer than this is rounding and says nothing of the direction, m.
const ROUNDING_M: f64 = 1e-13;

/// Pieces of a step in which friction turns its sign.
const PIECES: u32 = 8;

/// Share of the step at which the velocity is zero, if it changes sign within.
pub(super) fn turning_point([p0, v0, p1, v1]: [f64; 4], h: f64) -> Option<f64> {
    if v0 * v1 >= 0.0 {
        return None;
    }
    // Velocity·h = c + 2a·s + 3b·s², of which one root lies within; the other form avoids cancellation.
    let (m0, m1) = (v0 * h, v1 * h);
    let (a, b) = (3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1);
    let root = (a * a - 3.0 * b * m0).max(0.0).sqrt();
    let q = -(a + root.copysign(a));
    [m0 / q, q / (3.0 * b)]
        .into_iter()
        .find(|s| (0.0..=1.0).contains(s))
}

/// What an axis remembers of its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hysteresis {
    half_backlash_m: f64,
    friction: Option<Friction>,
    /// Height of the pulse that an answer of 1 makes, m.
    pulse_m: f64,
    pub(super) sign: f64,
    /// Extreme of the present stroke.
    extreme_m: f64,
    /// Place of the last reversal.
    reversal_m: Option<f64>,
    /// Where the play has left the load.
    load_m: f64,
    /// Last place.
    last_m: f64,
    /// Friction, −1…1, and the answers of the loop to its changes.
    slide: f64,
    answers: [f64; 2],
    /// A whole step, and what it keeps of the answers.
    step_s: f64,
    step_keeps: [f64; 2],
}

impl Hysteresis {
    /// Whether anything on an axis depends on the way.
    pub(super) fn needed(machine: &Machine, axis: usize) -> bool {
        machine.backlash_m[axis] != 0.0
            || machine.friction[axis].is_some()
            || machine.lateral_play_m[axis] != [0.0; 3]
    }

    /// `None` for an axis on which nothing does.
    pub(super) fn new(
        machine: &Machine,
        axis: usize,
        [position_m, velocity_m_s]: [f64; 2],
        step_s: f64,
    ) -> Option<Self> {
        let half_backlash_m = 0.5 * machine.backlash_m[axis];
        let sign = if velocity_m_s == 0.0 {
            0.0
        } else {
            velocity_m_s.signum()
        };
        let friction = machine.friction[axis];
        Self::needed(machine, axis).then(|| Self {
            half_backlash_m,
            friction,
            pulse_m: friction.map_or(0.0, |f| 0.5 * f.peak_m / f.highest()),
            sign,
            extreme_m: position_m,
            reversal_m: None,
            load_m: position_m - sign * half_backlash_m.abs(),
            last_m: position_m,
            slide: sign,
            answers: [0.0; 2],
            step_s,
            step_keeps: friction.map_or([0.0; 2], |f| keeps(f, step_s)),
        })
    }

    /// Goes along a step `y` from share to share, by way of its turning point and, while friction is turning
    /// its sign, in pieces.
    pub(super) fn follow(&mut self, y: [f64; 4], [from, to]: [f64; 2], turn: &mut Option<f64>) {
        let mut from = from;
        let mut turning = self.is_turning();
        if let Some(s) = turn.take_if(|s| *s <= to) {
            self.visit(y, from, s);
            from = s;
            turning = self.friction.is_some();
        }
        let mut last = from;
        if turning {
            for k in 1..PIECES {
                let s = from + (to - from) * f64::from(k) / f64::from(PIECES);
                self.visit(y, last, s);
                last = s;
            }
        }
        self.visit(y, last, to);
    }

    /// Whether friction is between its two signs.
    fn is_turning(&self) -> bool {
        self.friction.is_some_and(|f| f.presliding_m > 0.0) && self.slide.abs() < 0.999
    }

    fn visit(&mut self, y: [f64; 4], from: f64, to: f64) {
        let x = if to < 1.0 {
            hermite(y, self.step_s, to)[0]
        } else {
            y[2]
        };
        self.notice(self.step_s * (to - from), x);
    }

    /// Takes notice of the drive's position after `since_s`; every extreme has to be visited.
    fn notice(&mut self, since_s: f64, x: f64) {
        let gap = self.half_backlash_m.abs();
        // Not clamp(): it panics where x is NaN.
        self.load_m = self.load_m.max(x - gap).min(x + gap);
        if let Some(friction) = self.friction {
            self.rub(friction, since_s, x);
        }
        let ahead = x - self.extreme_m;
        if self.sign == 0.0 {
            if ahead.abs() > REVERSAL_TRAVEL_M {
                self.sign = ahead.signum();
                self.extreme_m = x;
            }
        } else if ahead * self.sign >= 0.0 {
            self.extreme_m = x;
        } else if ahead.abs() > REVERSAL_TRAVEL_M {
            self.reversal_m = Some(self.extreme_m);
            self.sign = -self.sign;
            self.extreme_m = x;
        }
    }

    /// Friction follows the travel, the loop follows the friction.
    fn rub(&mut self, friction: Friction, since_s: f64, x: f64) {
        let way = x - self.last_m;
        self.last_m = x;
        let keeps = if since_s == self.step_s {
            self.step_keeps
        } else {
            keeps(friction, since_s)
        };
        let before = self.slide;
        let turned = if way.abs() <= ROUNDING_M {
            before
        } else {
            way.signum()
        };
        if turned == before {
            self.answers = std::array::from_fn(|i| keeps[i] * self.answers[i]);
            return;
        }
        let at_once = friction.presliding_m <= 0.0;
        let stay = if at_once {
            0.0
        } else {
            (-way.abs() / friction.presliding_m).exp()
        };
        self.slide = turned + (before - turned) * stay;
        let taus = [friction.decay_s, friction.rise_s];
        for ((answer, keep), tau) in self.answers.iter_mut().zip(keeps).zip(taus) {
            let ratio = since_s / tau;
            // A change spread evenly over the step, or with it all at its beginning.
            let take = if ratio > 1e-9 && !at_once {
                (1.0 - keep) / ratio
            } else {
                keep
            };
            *answer = keep * *answer + take * (self.slide - before);
        }
    }

    /// Offset of the load from the drive.
    pub(super) fn error_m(&self, x: f64, velocity: f64) -> f64 {
        // A negative step is an overcompensated play: the mirror image.
        let play = (self.load_m - x)
            * if self.half_backlash_m < 0.0 {
                -1.0
            } else {
                1.0
            };
        let Some((friction, turn_m)) = self.friction.zip(self.reversal_m) else {
            return play;
        };
        let pulse = self.pulse_m * (self.answers[0] - self.answers[1]);
        if friction.stick_slip_m == 0.0 {
            return play - pulse;
        }
        let slow = (-(velocity / friction.stick_speed_m_s).powi(2)).exp();
        let tooth =
            friction.stick_slip_m * slow * ((x - turn_m).abs() / friction.stick_travel_m).fract();
        play - pulse - self.sign * tooth
    }
}

/// What is left of the two answers after `since_s`; a rise of zero answers nothing.
fn keeps(friction: Friction, since_s: f64) -> [f64; 2] {
    [friction.decay_s, friction.rise_s].map(|tau| {
        if tau > 0.0 {
            (-since_s / tau).exp()
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_point_is_where_the_velocity_is_zero() {
        for y in [
            [0.0, 1.0, 0.1, -2.0],
            [0.0, -1e-9, 0.1, 3.0],
            [1.0, 2.0, 1.0, -2.0],
            [0.0, 1.0, 0.4, -1e-7],
        ] {
            let s = turning_point(y, 0.3).unwrap();
            assert!((hermite(y, 0.3, s)[1]).abs() < 1e-12, "{y:?}: {s}");
        }
        assert_eq!(turning_point([0.0, 1.0, 1.0, 1.0], 1.0), None);
        assert_eq!(turning_point([0.0, f64::NAN, 1.0, 1.0], 1.0), None);
    }

    #[test]
    fn play_lags_on_both_sides() {
        let machine = Machine {
            backlash_m: [2e-5, 0.0, 0.0],
            ..Machine::default()
        };
        let mut hysteresis = Hysteresis::new(&machine, 0, [0.0, 1.0], 1.0).unwrap();
        hysteresis.notice(1.0, 1e-3);
        assert!((hysteresis.error_m(1e-3, 1.0) + 1e-5).abs() < 1e-15);
        hysteresis.notice(1.0, 1e-3 - 5e-6);
        assert!(
            (hysteresis.error_m(1e-3 - 5e-6, -1.0) + 5e-6).abs() < 1e-15,
            "inside the gap the load stands"
        );
        hysteresis.notice(1.0, 0.0);
        assert!((hysteresis.error_m(0.0, -1.0) - 1e-5).abs() < 1e-15);
    }

    /// Two samples at nearly the same time: rounding may put the later one behind the earlier.
    #[test]
    fn rounding_is_no_reversal() {
        let friction = Friction {
            peak_m: 1e-5,
            ..Friction::default()
        };
        let machine = Machine {
            friction: [Some(friction), None, None],
            ..Machine::default()
        };
        let mut hysteresis = Hysteresis::new(&machine, 0, [0.0, 1.0], 1.0).unwrap();
        hysteresis.notice(1.0, 0.1);
        hysteresis.notice(1.0, 0.0);
        hysteresis.notice(1.0, 0.1);
        hysteresis.notice(1.0, 0.2);
        let before = hysteresis.error_m(0.2, 1.0);
        hysteresis.notice(1e-16, 0.2 - 2.0 * f64::EPSILON);
        assert!(
            (hysteresis.error_m(0.2, 1.0) - before).abs() < 1e-12,
            "{hysteresis:?}"
        );
    }
}
