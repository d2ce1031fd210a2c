//! Changes to the chain that a diagnosis asks for: a response of higher order, axes that differ.
use super::machine::{Machine, PositionLoop};
use giotto_shared::Plane;
use giotto_shared::model::{Element, Response};

impl Machine {
    /// Gives a chain of one lag per axis the fourth-order coefficient β2 (s⁴) beyond the lag's own 3κ2²/8, with
    /// κ2 as it is: (R/Rm)² = 1 + κ2ω² − 2β2ω⁴. Negative β2: second-order mechanics with ωn⁴ = −1/(2β2) instead
    /// of the loop; positive: feed-forward in the loop. A chain without a finite lag gets mechanics of its κ2 = 0.
    pub fn add_beta2(&mut self, beta2_s4: f64) {
        for axis in 0..3 {
            let lag = Element::Lag {
                kv_per_s: self.servo[axis].kv_per_s,
            };
            let wanted = Response {
                b_s4: -2.0 * beta2_s4,
                ..Response::of(&lag).unwrap_or_default()
            };
            match wanted.element() {
                Some(mechanics @ Element::SecondOrder { .. }) => {
                    self.set_axis(axis, mechanics);
                    self.servo[axis] = PositionLoop::default();
                }
                Some(servo @ Element::FeedForwardLag { .. }) => self.set_axis(axis, servo),
                _ => {}
            }
        }
    }

    /// Makes the first axis of a plane lag by `delta_tau_s` more than the second: in the gains of the loops where both have
    /// a finite one, else as dead time.
    pub fn split_lag(&mut self, plane: Plane, delta_tau_s: f64) {
        let axes = plane.axes().map(|axis| axis.index());
        let lags = axes.map(|axis| 1.0 / self.servo[axis].kv_per_s);
        let split = [lags[0] + 0.5 * delta_tau_s, lags[1] - 0.5 * delta_tau_s];
        if lags.iter().all(|lag| *lag > 0.0) && split.iter().all(|lag| *lag > 0.0) {
            for (axis, lag) in axes.into_iter().zip(split) {
                self.servo[axis].kv_per_s = 1.0 / lag;
            }
        } else {
            self.split_dead_time(plane, delta_tau_s);
        }
    }

    /// Delays the first axis of a plane by `delta_s` more than the second.
    pub fn split_dead_time(&mut self, plane: Plane, delta_s: f64) {
        let [first, second] = plane.axes().map(|axis| axis.index());
        self.dead_time_s[first] += delta_s.max(0.0);
        self.dead_time_s[second] += (-delta_s).max(0.0);
        // The mean of the two is what the third one has: only the difference is an error.
        self.dead_time_s[plane.normal().index()] += 0.5 * delta_s.abs();
    }

    /// Gives the first axis of a plane a second cumulant larger by `delta_kappa2_s2` than that of the second and the same
    /// delay: the loop or the mechanics take the one, dead time makes up for the other.
    pub fn split_bandwidth(&mut self, plane: Plane, delta_kappa2_s2: f64) {
        let mut delay = [0.0; 2];
        let shares = [0.5 * delta_kappa2_s2, -0.5 * delta_kappa2_s2];
        let axes = plane.axes().map(|axis| axis.index());
        for (at, (axis, share)) in axes.into_iter().zip(shares).enumerate() {
            let lag = Element::Lag {
                kv_per_s: self.servo[axis].kv_per_s,
            };
            let by_loop = lag.with_more_kappa2(share);
            let changed = match (by_loop, self.mechanics[axis]) {
                (Some(changed), _) if lag.delay_s() > 0.0 => Some(changed),
                (_, Some(mechanics)) => mechanics.element().with_more_kappa2(share),
                (by_loop, None) => by_loop,
            };
            if let Some((element, later_s)) = changed {
                if let Element::Lag { kv_per_s } = element {
                    // The feed-forward of the loop stays.
                    self.servo[axis].kv_per_s = kv_per_s;
                } else {
                    self.set_axis(axis, element);
                }
                delay[at] = later_s;
            }
        }
        self.split_dead_time(plane, delay[1] - delay[0]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CircleTest, circle};
    use super::*;
    use giotto_shared::Direction;

    /// Cosine and sine of order 2 of the radial deviation over the machine's angle.
    fn oval(machine: &Machine, radius_m: f64, feed_m_s: f64, direction: Direction) -> [f64; 2] {
        let trace = circle(machine, &CircleTest::new(radius_m, feed_m_s, direction));
        let n = trace.deviation_m.len() as f64;
        trace
            .position_m
            .iter()
            .zip(&trace.deviation_m)
            .fold([0.0; 2], |[c, s], (p, r)| {
                let psi = 2.0 * p[1].atan2(p[0]);
                [c + 2.0 / n * r * psi.cos(), s + 2.0 / n * r * psi.sin()]
            })
    }

    fn lag(kv_per_s: f64) -> Machine {
        Machine {
            servo: [PositionLoop {
                kv_per_s,
                feed_forward: 0.0,
            }; 3],
            ..Machine::default()
        }
    }

    #[test]
    fn unequal_bandwidth_is_a_quarter_of_the_centripetal_acceleration_and_even() {
        for direction in [Direction::Ccw, Direction::Cw] {
            let mut machine = lag(100.0);
            machine.split_bandwidth(Plane::Xy, 2e-6);
            // Slow enough that the delays' own third order, ½f·ω²·Δτ³/3, stays below the bound.
            let [cos, sin] = oval(&machine, 0.1, 0.15, direction);
            let expected = -0.25 * 2e-6 * 0.15 * 0.15 / 0.1;
            assert!(
                (cos - expected).abs() < 0.02 * expected.abs(),
                "{cos} {expected}"
            );
            assert!(sin.abs() < 0.02 * expected.abs(), "{sin}");
        }
    }

    #[test]
    fn unequal_lag_is_half_of_the_way_and_odd() {
        for (direction, sign) in [(Direction::Ccw, 1.0), (Direction::Cw, -1.0)] {
            let mut machine = lag(100.0);
            machine.split_lag(Plane::Xy, 4e-5);
            let [_, sin] = oval(&machine, 0.3, 0.2, direction);
            let expected = sign * 0.5 * 0.2 * 4e-5;
            assert!(
                (sin - expected).abs() < 0.02 * expected.abs(),
                "{sin} {expected}"
            );
        }
    }

    #[test]
    fn added_beta2_is_what_the_radius_shows_beyond_the_lag() {
        for beta2 in [-2e-8, 2e-8] {
            let mut machine = lag(100.0);
            machine.add_beta2(beta2);
            let (radius, feed) = (0.1, 0.2);
            let test = CircleTest::new(radius, feed, Direction::Ccw);
            let more = circle(&machine, &test).mean_deviation_m()
                - circle(&lag(100.0), &test).mean_deviation_m();
            let expected = beta2 * feed.powi(4) / radius.powi(3);
            assert!(
                (more - expected).abs() < 0.02 * expected.abs(),
                "{more} {expected}"
            );
        }
    }
}
