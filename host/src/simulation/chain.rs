//! The linear part of one axis: acc/dec filter, position loop and mechanics as one state space, stepped
//! exactly for a command that is cubic within a step.
use super::machine::{AccDec, Machine};
use nalgebra::{SMatrix, SVector};

/// Most states: filter, loop, and two of the mechanics.
const N: usize = 4;
type State = SVector<f64, N>;

/// ẋ = A x + B u, y = C x + D u, of unit static gain. Unused states stay zero.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chain {
    a: SMatrix<f64, N, N>,
    b: State,
    c: State,
    d: f64,
    /// State under a standing command of 1: 1 for lengths, 0 for velocities.
    rest: State,
    used: usize,
}

impl Chain {
    /// Chain of `axis` of a machine. A moving average is no finite state space: it is applied to the
    /// command, as is the dead time (linear, time-invariant elements may change places).
    pub(super) fn new(machine: &Machine, axis: usize) -> Self {
        let zero = State::zeros();
        let mut chain = Self { a: SMatrix::zeros(), b: zero, c: zero, d: 1.0, rest: zero, used: 0 };
        if let AccDec::Exponential(t) = machine.acc_dec {
            chain.first_order(1.0 / t, 0.0);
        }
        let servo = machine.servo[axis];
        if servo.kv_per_s.is_finite() {
            chain.first_order(servo.kv_per_s, servo.feed_forward);
        }
        if let Some(m) = machine.mechanics[axis] {
            chain.second_order(m.omega_n_rad_s, m.zeta);
        }
        chain
    }

    /// Whether the output is the input.
    pub(super) fn is_ideal(&self) -> bool {
        self.used == 0
    }

    /// Appends (1 + a·s/k)/(1 + s/k) = a + (1 − a)/(1 + s/k).
    fn first_order(&mut self, k: f64, a: f64) {
        let i = self.used;
        self.used += 1;
        for j in 0..i {
            self.a[(i, j)] = k * self.c[j];
        }
        self.a[(i, i)] = -k;
        self.b[i] = k * self.d;
        self.rest[i] = 1.0;
        self.c *= a;
        self.c[i] = 1.0 - a;
        self.d *= a;
    }

    /// Appends ωn²/(s² + 2ζωn s + ωn²); the velocity is kept divided by ωn, so that both states are lengths.
    fn second_order(&mut self, omega_n: f64, zeta: f64) {
        let (p, v) = (self.used, self.used + 1);
        self.used += 2;
        for j in 0..p {
            self.a[(v, j)] = omega_n * self.c[j];
        }
        self.b[v] = omega_n * self.d;
        self.rest[p] = 1.0;
        self.a[(p, v)] = omega_n;
        self.a[(v, p)] = -omega_n;
        self.a[(v, v)] = -2.0 * zeta * omega_n;
        self.c = State::zeros();
        self.c[p] = 1.0;
        self.d = 0.0;
    }
}

/// A chain made ready for steps of one length.
#[derive(Clone, Debug)]
pub(super) struct Stepper {
    phi: SMatrix<f64, N, N>,
    /// Weights of the command at both ends of the step: position, velocity; position, velocity.
    gamma: [State; 4],
    c: State,
    d: f64,
    /// ẏ = `ca`·x + `cb`·u + `d`·u̇.
    ca: State,
    cb: f64,
    x: State,
}

impl Stepper {
    /// At rest at `position_m`, ready for steps of `h` seconds. A chain that is not finite gives NaN.
    pub(super) fn new(chain: &Chain, h: f64, position_m: f64) -> Self {
        // Exponential of the chain driven by a cubic: u and its three derivatives (in steps) are states too.
        let mut augmented = SMatrix::<f64, 8, 8>::zeros();
        augmented.fixed_view_mut::<N, N>(0, 0).copy_from(&(chain.a * h));
        augmented.fixed_view_mut::<N, 1>(0, N).copy_from(&(chain.b * h));
        for k in N..7 {
            augmented[(k, k + 1)] = 1.0;
        }
        let e = match augmented.iter().all(|v| v.is_finite()) {
            true => augmented.exp(),
            false => SMatrix::repeat(f64::NAN),
        };
        let g: [State; 4] = std::array::from_fn(|k| e.fixed_view::<N, 1>(0, N + k).into_owned());
        // Cubic in s: p0 + m0·s + (3Δ − 2m0 − m1)s² + (m0 + m1 − 2Δ)s³, derivatives at s = 0 by factorials.
        let (g2, g3) = (g[2] * 2.0, g[3] * 6.0);
        let gamma =
            [g[0] - g2 * 3.0 + g3 * 2.0, (g[1] - g2 * 2.0 + g3) * h, g2 * 3.0 - g3 * 2.0, (g3 - g2) * h];
        let x = chain.rest * position_m;
        let phi = e.fixed_view::<N, N>(0, 0).into_owned();
        let ca = chain.a.transpose() * chain.c;
        Self { phi, gamma, c: chain.c, d: chain.d, ca, cb: chain.c.dot(&chain.b), x }
    }

    /// One step under the command `[u0, u̇0, u1, u̇1]`; the output in the same form.
    pub(super) fn step(&mut self, u: [f64; 4]) -> [f64; 4] {
        let start = self.output(u[0], u[1]);
        let g = &self.gamma;
        self.x = self.phi * self.x + g[0] * u[0] + g[1] * u[1] + g[2] * u[2] + g[3] * u[3];
        let end = self.output(u[2], u[3]);
        [start[0], start[1], end[0], end[1]]
    }

    fn output(&self, u: f64, slope: f64) -> [f64; 2] {
        [self.c.dot(&self.x) + self.d * u, self.ca.dot(&self.x) + self.cb * u + self.d * slope]
    }
}

#[cfg(test)]
mod tests {
    use super::super::machine::{PositionLoop, SecondOrder};
    use super::*;

    fn full() -> Machine {
        Machine {
            acc_dec: AccDec::Exponential(0.03),
            servo: [PositionLoop { kv_per_s: 40.0, feed_forward: 0.3 }; 2],
            mechanics: [Some(SecondOrder { omega_n_rad_s: 60.0, zeta: 0.4 }); 2],
            ..Machine::default()
        }
    }

    #[test]
    fn rest_is_rest() {
        for servo_only in [false, true] {
            let mut machine = full();
            if servo_only {
                machine.mechanics = [None; 2];
            }
            let mut stepper = Stepper::new(&Chain::new(&machine, 0), 0.01, 0.25);
            let y = stepper.step([0.25, 0.0, 0.25, 0.0]);
            for (got, want) in y.iter().zip([0.25, 0.0, 0.25, 0.0]) {
                assert!((got - want).abs() < 1e-12, "{y:?}");
            }
        }
    }

    /// Oracle: classical Runge–Kutta on the differential equations as physics writes them.
    #[test]
    fn step_agrees_with_runge_kutta() {
        let machine = full();
        let h = 0.02;
        let u = [0.1, 0.5, 0.13, -0.7];
        let mut stepper = Stepper::new(&Chain::new(&machine, 0), h, 0.1);
        let y = stepper.step(u);
        let command = |t: f64| super::super::command::hermite(u, h, t / h);
        let rate = |t: f64, z: [f64; 4]| {
            let [v, _] = command(t);
            let out = 0.3 * z[0] + 0.7 * z[1];
            [(v - z[0]) / 0.03, 40.0 * (z[0] - z[1]), z[3], 3600.0 * (out - z[2]) - 48.0 * z[3]]
        };
        let add = |z: [f64; 4], k: [f64; 4], s: f64| std::array::from_fn(|i| z[i] + s * k[i]);
        let (mut z, n) = ([0.1, 0.1, 0.1, 0.0], 4000);
        let dt = h / f64::from(n);
        for i in 0..n {
            let t = f64::from(i) * dt;
            let k1 = rate(t, z);
            let k2 = rate(t + dt / 2.0, add(z, k1, dt / 2.0));
            let k3 = rate(t + dt / 2.0, add(z, k2, dt / 2.0));
            let k4 = rate(t + dt, add(z, k3, dt));
            z = std::array::from_fn(|i| z[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        assert!((y[2] - z[2]).abs() < 1e-12 && (y[3] - z[3]).abs() < 1e-10, "{y:?} {z:?}");
    }
}
