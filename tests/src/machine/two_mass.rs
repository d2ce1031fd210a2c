//! Friction at the end of a spring: the guide holds the table, the drive winds the spring up, the loop rings.
//!
//! Another law than that of [`super::friction`]: the force comes from three slipping elements (Maxwell) that let go one
//! after the other, and the loop answers as a mass on a spring does, with an overshoot. What is seen is a wind-up that
//! stays (a lost motion of about twice `windup_m`) and a spike that rings.
use super::linear::SecondOrder;

/// Friction of one slide with the stiffness of its drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoMass {
    /// Wind-up of the spring under full friction, m.
    pub windup_m: f64,
    /// Deviation of the motor's side when the force changes over at once, before its loop works it off, m.
    pub peak_m: f64,
    /// Time in which the loop works the force off, s.
    pub decay_s: f64,
    /// Natural frequency of table and spring, rad/s.
    pub omega_rad_s: f64,
    /// Damping of it, below 1.
    pub zeta: f64,
    /// Travel over which the last element lets go, m; the others at a third and a ninth of it.
    pub travel_m: f64,
}

/// Its state.
#[derive(Clone, Debug)]
pub struct TwoMassState {
    law: TwoMass,
    elements: [f64; 3],
    forget: f64,
    integral: f64,
    ring: SecondOrder,
}

/// Share of each element in the force.
const SHARES: [f64; 3] = [0.5, 0.3, 0.2];

impl TwoMassState {
    /// At rest, spring slack.
    pub fn new(law: &TwoMass, step_s: f64) -> Self {
        Self {
            law: *law,
            elements: [0.0; 3],
            forget: (-step_s / law.decay_s).exp(),
            integral: 0.0,
            ring: SecondOrder::new(law.omega_rad_s, law.zeta, step_s, 0.0),
        }
    }

    /// Deviation of the table, m, after the drive has travelled `travel_m` more.
    pub fn step(&mut self, travel_m: f64) -> f64 {
        let mut force = 0.0;
        for (k, share) in SHARES.iter().enumerate() {
            let reach = self.law.travel_m / 3.0_f64.powi(k as i32);
            self.elements[k] = (self.elements[k] + 2.0 * travel_m / reach).clamp(-1.0, 1.0);
            force += share * self.elements[k];
        }
        self.integral = force + (self.integral - force) * self.forget;
        // Half of the change over a reversal: the force goes from −1 to 1.
        let spike = 0.5 * self.law.peak_m * (force - self.integral);
        -self.ring.step(self.law.windup_m * force + spike)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spring_stays_wound_and_the_spike_rings() {
        let law = TwoMass {
            windup_m: 2e-6,
            peak_m: 10e-6,
            decay_s: 0.05,
            omega_rad_s: 200.0,
            zeta: 0.3,
            travel_m: 3e-6,
        };
        let mut state = TwoMassState::new(&law, 1e-4);
        for _ in 0..20_000 {
            state.step(1e-5);
        }
        assert!((state.step(1e-5) + 2e-6).abs() < 1e-9, "behind its travel");
        let after: Vec<f64> = (0..20_000).map(|_| state.step(-1e-5)).collect();
        let peak = after.iter().copied().fold(f64::MIN, f64::max);
        assert!(peak > 12e-6, "wind-up, spike and overshoot: {peak}");
        assert!((after[19_999] - 2e-6).abs() < 1e-9, "wound the other way");
    }
}
