//! A machine from a model file: elements whose cumulants are those of the fitted radius law.
use super::arm::Arm;
use super::machine::{Machine, MachineError, PositionLoop, SecondOrder};
use crate::model_file::{ModelFile, Servo};
use giotto_shared::model::{Cumulants, Element};

impl Machine {
    /// The machine of a model: its servo law, and its effects as their causes put them in.
    ///
    /// `Lag` and `SecondOrder` are taken as they are, `Beta` becomes [`Cumulants::chain`]: the simplest stable chain with its
    /// κ2 and κ4.
    ///
    /// The chain agrees with Eq. 15 through ω⁴ and departs from it by terms of ω⁶: for the paper's β by
    /// 0.3 µm of 120 µm at R = 100 mm, 700 mm/s (ω = 7 rad/s).
    ///
    /// # Errors
    /// Coefficients that are not finite, or that only a machine slower than the simulation allows can have.
    pub fn from_model(model: &ModelFile) -> Result<Self, MachineError> {
        let mut machine = Self::from_servo(&model.servo)?;
        if let Some(delay_s) = model.delay_s {
            machine.set_delay(delay_s);
        }
        machine.arm = model.kinematics.map(Arm::sound);
        for effect in &model.effects {
            effect.cause().model().apply(effect, &mut machine);
        }
        machine.check()?;
        Ok(machine)
    }

    /// Gives every axis so much delay behind the command, s: what their chain does not have of it is dead time.
    pub fn set_delay(&mut self, delay_s: f64) {
        let mechanics = self.mechanics[0].map_or(0.0, |m| m.element().delay_s());
        let own_s = mechanics + self.servo[0].element().delay_s();
        self.dead_time_s = [(delay_s - own_s).max(0.0); 3];
    }

    /// As [`Self::from_model`], without effects.
    ///
    /// # Errors
    /// As [`Self::from_model`].
    pub fn from_servo(servo: &Servo) -> Result<Self, MachineError> {
        let mut machine = Self::default();
        if let Some(element) = servo.element() {
            machine.set_servo(element);
        } else {
            let beta = servo.beta();
            for (name, value) in [("beta1_s2", beta.beta1_s2), ("beta2_s4", beta.beta2_s4)] {
                if !value.is_finite() {
                    return Err(MachineError {
                        name,
                        value,
                        allowed: "finite numbers",
                    });
                }
            }
            machine.set_chain(Cumulants::from(beta).chain().into_iter().flatten());
        }
        machine.check()?;
        Ok(machine)
    }

    /// Gives every axis a chain of elements, at most one of each kind.
    fn set_chain(&mut self, chain: impl IntoIterator<Item = Element<f64>>) {
        for element in chain {
            self.set_servo(element);
        }
    }

    /// Gives every axis this element: a lag, with feed-forward or without, as the position loop, a second-order element as
    /// the mechanics. Elements that belong to the command are left out: no model holds them.
    pub fn set_servo(&mut self, element: Element<f64>) {
        for axis in 0..3 {
            self.set_axis(axis, element);
        }
    }

    /// The same of one axis (0 X, 1 Y, 2 Z).
    pub(super) fn set_axis(&mut self, axis: usize, element: Element<f64>) {
        match element {
            Element::Lag { kv_per_s } => {
                self.servo[axis] = PositionLoop {
                    kv_per_s,
                    feed_forward: 0.0,
                }
            }
            Element::FeedForwardLag {
                kv_per_s,
                feed_forward,
            } => {
                self.servo[axis] = PositionLoop {
                    kv_per_s,
                    feed_forward,
                }
            }
            Element::SecondOrder {
                omega_n_rad_s,
                zeta,
            } => {
                self.mechanics[axis] = Some(SecondOrder {
                    omega_n_rad_s,
                    zeta,
                })
            }
            _ => {}
        }
    }
}

impl PositionLoop {
    /// The loop as an element.
    pub fn element(&self) -> Element<f64> {
        Element::FeedForwardLag {
            kv_per_s: self.kv_per_s,
            feed_forward: self.feed_forward,
        }
    }
}

impl SecondOrder {
    /// The mechanics as an element.
    pub fn element(&self) -> Element<f64> {
        Element::SecondOrder {
            omega_n_rad_s: self.omega_n_rad_s,
            zeta: self.zeta,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CircleTest, circle};
    use super::*;
    use giotto_shared::Direction;

    fn beta(beta1_s2: f64, beta2_s4: f64) -> Result<Machine, MachineError> {
        Machine::from_servo(&Servo::Beta {
            beta1_s2,
            beta2_s4,
            half_width95: [0.0; 2],
        })
    }

    /// κ2 and κ4 of a chain from the table of elements, not from the formulas under test.
    fn cumulants(machine: &Machine) -> [f64; 2] {
        let servo = machine.servo[0];
        let (a2, t2) = (servo.feed_forward.powi(2), servo.kv_per_s.powi(-2));
        let mut k = [(1.0 - a2) * t2, 6.0 * (1.0 - a2 * a2) * t2 * t2];
        if let Some(m) = machine.mechanics[0] {
            let (w2, z2) = (m.omega_n_rad_s.powi(2), m.zeta.powi(2));
            k[0] += -2.0 * (1.0 - 2.0 * z2) / w2;
            k[1] += 12.0 * (8.0 * z2 * z2 - 8.0 * z2 + 1.0) / (w2 * w2);
        }
        k
    }

    #[test]
    fn every_sign_of_beta_has_a_chain_with_its_cumulants() {
        let cases = [
            (-23.29e-6, -0.23e-6),
            (-200e-6, 6e-8),
            (-200e-6, 1.2e-7),
            (-23.29e-6, 0.23e-6),
            (23.29e-6, 0.23e-6),
            (23.29e-6, -0.23e-6),
            (0.0, 2e-7),
            (0.0, -2e-7),
            (-50e-6, 0.0),
            (50e-6, 0.0),
        ];
        for (b1, b2) in cases {
            let machine = beta(b1, b2).unwrap();
            let [k2, k4] = cumulants(&machine);
            assert!((-k2 / 2.0 - b1).abs() < 1e-12, "{b1} {b2}: {machine:?}");
            assert!(
                (k2 * k2 / 8.0 + k4 / 24.0 - b2).abs() < 1e-14,
                "{b1} {b2}: {machine:?}"
            );
        }
        assert_eq!(beta(0.0, 0.0).unwrap(), Machine::default());
        assert_eq!(beta(f64::NAN, 0.0).unwrap_err().name, "beta1_s2");
        assert!(beta(-50.0, 0.0).is_err(), "a lag of ten seconds is refused");
    }

    #[test]
    fn lag_is_recognised() {
        let kv: f64 = 40.0;
        // Eq. 14 with its own fourth-order term: κ2²/8 + κ4/24 = 3/(8kv⁴).
        let machine = beta(-0.5 / (kv * kv), 0.375 / kv.powi(4)).unwrap();
        assert_eq!(machine.mechanics, [None; 3]);
        assert!(
            (machine.servo[0].kv_per_s - kv).abs() < 1e-9 * kv
                && machine.servo[0].feed_forward < 1e-4
        );
    }

    /// The paper's robot: second order with ωn near 38 rad/s and ζ near 0.72, and the radius errors of Eq. 15
    /// within the stated 0.3 µm over the paper's grid.
    #[test]
    fn papers_beta_is_a_second_order_machine() {
        let (b1, b2) = (-23.29e-6, -0.23e-6);
        let machine = beta(b1, b2).unwrap();
        let m = machine.mechanics[0].unwrap();
        assert!(
            (m.omega_n_rad_s - 38.0).abs() < 0.5 && (m.zeta - 0.72).abs() < 0.005,
            "{m:?}"
        );
        let mut worst: f64 = 0.0;
        for radius in [0.1, 0.15, 0.3] {
            for feed in [0.02, 0.2, 0.45, 0.7] {
                let trace = circle(&machine, &CircleTest::new(radius, feed, Direction::Ccw));
                let x1 = feed * feed / radius;
                let law = b1 * x1 + b2 * x1 * x1 / radius;
                worst = worst.max((trace.mean_deviation_m() - law).abs());
            }
        }
        assert!(worst < 0.3e-6 && worst > 0.05e-6, "{worst:e}");
    }
}
