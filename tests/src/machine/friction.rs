//! Friction as it is seen in position: a presliding (LuGre-like) force against a loop that integrates.

/// Friction of one axis. The force, in units of the Coulomb level, follows LuGre's bristles:
/// `dz/dx = (s − z·sgn v)/presliding`; the loop answers a force with a deviation that it works off,
/// `s·τi/((1+sτ1)(1+sτi))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Deviation at the top of the spike when the force changes over at once, m.
    pub peak_m: f64,
    /// Time in which the loop's integral works the force off, τi, s.
    pub decay_s: f64,
    /// Rise time of the velocity loop, τ1, s; below `decay_s`.
    pub rise_s: f64,
    /// Travel over which the force changes over, m.
    pub presliding_m: f64,
}

impl Friction {
    /// Largest value of the loop's answer to a unit step: `ρ^(ρ/(1−ρ))`, ρ = τ1/τi.
    pub fn step_peak(&self) -> f64 {
        let rho = self.rise_s / self.decay_s;
        rho.powf(rho / (1.0 - rho))
    }
}

/// State of the friction of one axis.
#[derive(Clone, Debug)]
pub struct FrictionState {
    gain_m: f64,
    presliding_m: f64,
    forget_integral: f64,
    forget_rise: f64,
    bristle: f64,
    integral: f64,
    risen: f64,
}

impl FrictionState {
    /// At rest, bristles straight.
    pub fn new(friction: &Friction, step_s: f64) -> Self {
        Self {
            gain_m: 0.5 * friction.peak_m / friction.step_peak(),
            presliding_m: friction.presliding_m,
            forget_integral: (-step_s / friction.decay_s).exp(),
            forget_rise: (-step_s / friction.rise_s).exp(),
            bristle: 0.0,
            integral: 0.0,
            risen: 0.0,
        }
    }

    /// Deviation of the axis, m, after it has travelled `travel_m` more.
    pub fn step(&mut self, travel_m: f64) -> f64 {
        let before = self.bristle;
        let sense = travel_m.signum();
        let bend = travel_m.abs() / self.presliding_m;
        self.bristle = if bend > 40.0 {
            sense
        } else {
            sense + (before - sense) * (-bend).exp()
        };
        // Two first-order parts in turn: what the integral has not yet taken over, then the rise.
        let force = 0.5 * (before + self.bristle);
        self.integral = force + (self.integral - force) * self.forget_integral;
        let left = self.bristle - self.integral;
        self.risen = left + (self.risen - left) * self.forget_rise;
        -self.gain_m * self.risen
    }
}

/// Sticking at low axis speed: the axis holds still until the loop has pulled `height_m`, then slips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StickSlip {
    /// Deviation at which the axis breaks loose, m.
    pub height_m: f64,
    /// Axis speed above which it slides freely, m/s.
    pub speed_m_s: f64,
    /// Time constant of the slip, s.
    pub slip_s: f64,
}

/// State of sticking and slipping of one axis.
#[derive(Clone, Debug)]
pub struct StickState {
    law: StickSlip,
    forget: f64,
    deviation: f64,
    sticking: bool,
}

impl StickState {
    /// Sliding, on its command.
    pub fn new(law: &StickSlip, step_s: f64) -> Self {
        Self {
            law: *law,
            forget: (-step_s / law.slip_s).exp(),
            deviation: 0.0,
            sticking: false,
        }
    }

    /// Deviation, m, after the loop has asked for `travel_m` more in `step_s`.
    pub fn step(&mut self, travel_m: f64, step_s: f64) -> f64 {
        if travel_m.abs() > self.law.speed_m_s * step_s {
            self.sticking = false;
        } else if !self.sticking && self.deviation.abs() < 0.1 * self.law.height_m {
            self.sticking = true;
        }
        if self.sticking {
            self.deviation -= travel_m;
            if self.deviation.abs() > self.law.height_m {
                self.sticking = false;
            }
        } else {
            self.deviation *= self.forget;
        }
        self.deviation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spike_has_its_height_its_side_and_its_decay() {
        let law = Friction {
            peak_m: 8e-6,
            decay_s: 0.04,
            rise_s: 0.001,
            presliding_m: 1e-6,
        };
        let h = 5e-5;
        let mut f = FrictionState::new(&law, h);
        for _ in 0..40_000 {
            f.step(1e-3);
        }
        let after: Vec<f64> = (0..4000).map(|_| f.step(-1e-3)).collect();
        let peak = after.iter().copied().fold(f64::MIN, f64::max);
        assert!(
            (peak / 8e-6 - 1.0).abs() < 0.02,
            "moving back after moving up: still up, {peak}"
        );
        let late = after[2000] / after[1200];
        assert!((late / (-800.0 * h / 0.04).exp() - 1.0).abs() < 0.01);
    }

    #[test]
    fn teeth_reach_their_height_only_at_low_speed() {
        let law = StickSlip {
            height_m: 5e-6,
            speed_m_s: 5e-3,
            slip_s: 1e-3,
        };
        let mut s = StickState::new(&law, 1e-3);
        let slow = (0..4000)
            .map(|_| s.step(1e-6, 1e-3))
            .fold(0.0_f64, f64::min);
        assert!(
            (slow + 5e-6).abs() < 1.5e-6,
            "it stays behind a rising command: {slow}"
        );
        let mut s = StickState::new(&law, 1e-3);
        assert_eq!(
            (0..4000)
                .map(|_| s.step(1e-5, 1e-3))
                .fold(0.0_f64, f64::min),
            0.0
        );
    }
}
