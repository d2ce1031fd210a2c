//! The linear part of one axis: acc/dec filter, position loop and mechanics as one state space, stepped
//! exactly for a command that is cubic within a step.
//!
//! A [`Stepper`] holds no more states than the chain has, and takes the command as knots or as a wave: cosine and sine
//! of an angle that grows evenly.
use super::machine::{AccDec, Machine};
use nalgebra::{Complex, SMatrix, SVector};

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
        let mut chain = Self {
            a: SMatrix::zeros(),
            b: zero,
            c: zero,
            d: 1.0,
            rest: zero,
            used: 0,
        };
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

    /// States in use; with none of them the output is the input.
    pub(super) fn states(&self) -> usize {
        self.used
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
pub(super) struct Discrete {
    chain: Chain,
    phi: SMatrix<f64, N, N>,
    /// Weights of the command at both ends of the step: position, velocity; position, velocity.
    gamma: [State; 4],
}

impl Discrete {
    /// For steps of `h` seconds. A chain that is not finite gives NaN.
    pub(super) fn new(chain: Chain, h: f64) -> Self {
        // Exponential of the chain driven by a cubic: u and its three derivatives (in steps) are states too.
        let mut augmented = SMatrix::<f64, 8, 8>::zeros();
        augmented
            .fixed_view_mut::<N, N>(0, 0)
            .copy_from(&(chain.a * h));
        augmented
            .fixed_view_mut::<N, 1>(0, N)
            .copy_from(&(chain.b * h));
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
        let gamma = [
            g[0] - g2 * 3.0 + g3 * 2.0,
            (g[1] - g2 * 2.0 + g3) * h,
            g2 * 3.0 - g3 * 2.0,
            (g3 - g2) * h,
        ];
        Self {
            phi: e.fixed_view::<N, N>(0, 0).into_owned(),
            gamma,
            chain,
        }
    }

    /// The chain.
    pub(super) fn chain(&self) -> &Chain {
        &self.chain
    }

    /// At rest at `position_m`, for commands `[u, u̇]` at both ends of each step.
    pub(super) fn at_rest<const S: usize>(&self, position_m: f64) -> Stepper<S, 4> {
        let (ca, cb) = self.slope();
        let look = [[self.chain.d, 0.0], [cb, self.chain.d]];
        self.stepper(
            self.gamma,
            [self.chain.c, ca],
            look,
            self.chain.rest * position_m,
        )
    }

    /// In the steady state under the command Re(`phasor`·e^{iψ}), which turns by `step_rad` a step and by `omega_rad_s`
    /// a second; `start` is (cos ψ, sin ψ) of now. The state is the one that the steps themselves reproduce: that of an
    /// endless run-in.
    pub(super) fn in_orbit<const S: usize>(
        &self,
        phasor: Complex<f64>,
        omega_rad_s: f64,
        step_rad: f64,
        start: [f64; 2],
    ) -> Stepper<S, 2> {
        let turn = Complex::cis(step_rad);
        let (here, there) = (phasor, phasor * turn);
        let [here_slope, there_slope] = [here, there].map(|u| Complex::new(0.0, omega_rad_s) * u);
        let weights = [here, here_slope, there, there_slope];
        let force = self
            .gamma
            .iter()
            .zip(weights)
            .fold(SVector::zeros(), |sum: SVector<_, N>, (g, w)| {
                sum + g.map(|g| Complex::from(g) * w)
            });
        // z·turn = Φz + force, which a chain that settles always has an answer to.
        let steps = SMatrix::<Complex<f64>, N, N>::from_diagonal_element(turn)
            - self.phi.map(Complex::from);
        let steady = steps
            .lu()
            .solve(&force)
            .unwrap_or_else(|| SVector::repeat(Complex::from(f64::NAN)));
        let (ca, cb) = self.slope();
        let look = [
            phasor * self.chain.d,
            phasor * cb + here_slope * self.chain.d,
        ]
        .map(parts);
        let state = steady.map(|z| z.re * start[0] - z.im * start[1]);
        self.stepper(
            [force.map(|w| w.re), force.map(|w| -w.im)],
            [self.chain.c, ca],
            look,
            state,
        )
    }

    /// ẏ = ca·x + cb·u + d·u̇: `(ca, cb)`.
    fn slope(&self) -> (State, f64) {
        (
            self.chain.a.transpose() * self.chain.c,
            self.chain.c.dot(&self.chain.b),
        )
    }

    fn stepper<const S: usize, const U: usize>(
        &self,
        force: [State; U],
        see: [State; 2],
        look: [[f64; 2]; 2],
        x: State,
    ) -> Stepper<S, U> {
        let short = |v: State| std::array::from_fn(|i| v[i]);
        let phi = std::array::from_fn(|j| short(self.phi.column(j).into_owned()));
        Stepper {
            phi,
            force: force.map(short),
            see: see.map(short),
            look,
            x: short(x),
        }
    }
}

/// What Re(`z`·e^{iψ}) takes of (cos ψ, sin ψ).
fn parts(z: Complex<f64>) -> [f64; 2] {
    [z.re, -z.im]
}

/// A chain of `S` states in motion, its command in `U` numbers a step.
#[derive(Clone, Debug)]
pub(super) struct Stepper<const S: usize, const U: usize> {
    /// Column by column.
    phi: [[f64; S]; S],
    force: [[f64; S]; U],
    /// Weights of the states, then of the command, in position and velocity.
    see: [[f64; S]; 2],
    look: [[f64; 2]; 2],
    x: [f64; S],
}

impl<const S: usize, const U: usize> Stepper<S, U> {
    /// One step under the command `u`.
    #[inline]
    pub(super) fn step(&mut self, u: [f64; U]) {
        let mut next = [0.0; S];
        let columns = self.force.iter().zip(u).chain(self.phi.iter().zip(self.x));
        for (column, by) in columns {
            next.iter_mut()
                .zip(column)
                .for_each(|(to, weight)| *to += weight * by);
        }
        self.x = next;
    }

    /// Position and velocity under the command of now: `[u, u̇]`, or cosine and sine.
    #[inline]
    pub(super) fn look(&self, u: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|k| {
            let command = self.look[k][0] * u[0] + self.look[k][1] * u[1];
            self.x
                .iter()
                .zip(&self.see[k])
                .fold(command, |sum, (x, weight)| sum + x * weight)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::machine::{PositionLoop, SecondOrder};
    use super::*;

    fn full() -> Machine {
        Machine {
            acc_dec: AccDec::Exponential(0.03),
            servo: [PositionLoop {
                kv_per_s: 40.0,
                feed_forward: 0.3,
            }; 3],
            mechanics: [Some(SecondOrder {
                omega_n_rad_s: 60.0,
                zeta: 0.4,
            }); 3],
            ..Machine::default()
        }
    }

    #[test]
    fn rest_is_rest() {
        for servo_only in [false, true] {
            let mut machine = full();
            if servo_only {
                machine.mechanics = [None; 3];
            }
            let mut stepper = Discrete::new(Chain::new(&machine, 0), 0.01).at_rest::<4>(0.25);
            let start = stepper.look([0.25, 0.0]);
            stepper.step([0.25, 0.0, 0.25, 0.0]);
            for y in [start, stepper.look([0.25, 0.0])] {
                assert!((y[0] - 0.25).abs() < 1e-12 && y[1].abs() < 1e-12, "{y:?}");
            }
        }
    }

    /// Oracle: classical Runge–Kutta on the differential equations as physics writes them.
    #[test]
    fn step_agrees_with_runge_kutta() {
        let machine = full();
        let h = 0.02;
        let u = [0.1, 0.5, 0.13, -0.7];
        let mut stepper = Discrete::new(Chain::new(&machine, 0), h).at_rest::<4>(0.1);
        stepper.step(u);
        let y = stepper.look([u[2], u[3]]);
        let command = |t: f64| super::super::command::hermite(u, h, t / h);
        let rate = |t: f64, z: [f64; 4]| {
            let [v, _] = command(t);
            let out = 0.3 * z[0] + 0.7 * z[1];
            [
                (v - z[0]) / 0.03,
                40.0 * (z[0] - z[1]),
                z[3],
                3600.0 * (out - z[2]) - 48.0 * z[3],
            ]
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
            z = std::array::from_fn(|i| {
                z[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
            });
        }
        assert!(
            (y[0] - z[2]).abs() < 1e-12 && (y[1] - z[3]).abs() < 1e-10,
            "{y:?} {z:?}"
        );
    }

    /// Oracle: the same steps from rest until nothing is left of the start.
    #[test]
    fn orbit_is_where_a_long_run_in_ends() {
        fn departure<const S: usize>(machine: &Machine) -> f64 {
            let (h, omega, amplitude) = (0.007_f64, -3.1, 0.2);
            let discrete = Discrete::new(Chain::new(machine, 0), h);
            assert_eq!(discrete.chain().states(), S);
            let phasor = Complex::from_polar(amplitude, 0.4);
            let wave = |k: i32| {
                let (sin, cos) = (omega * h * f64::from(k)).sin_cos();
                [cos, sin]
            };
            let command = |k: i32| {
                let u = phasor * Complex::cis(omega * h * f64::from(k));
                [u.re, -omega * u.im]
            };
            let mut long = discrete.at_rest::<S>(command(-2000)[0]);
            let mut short = discrete.in_orbit::<S>(phasor, omega, omega * h, wave(0));
            for k in -2000..0 {
                let ([u0, v0], [u1, v1]) = (command(k), command(k + 1));
                long.step([u0, v0, u1, v1]);
            }
            let mut worst: f64 = 0.0;
            for k in 0..900 {
                let (a, b) = (long.look(command(k)), short.look(wave(k)));
                worst = worst.max((a[0] - b[0]).abs()).max((a[1] - b[1]).abs());
                let ([u0, v0], [u1, v1]) = (command(k), command(k + 1));
                long.step([u0, v0, u1, v1]);
                short.step(wave(k));
            }
            worst
        }
        let machine = full();
        let no_mechanics = Machine {
            mechanics: [None; 3],
            ..full()
        };
        let no_filter = Machine {
            acc_dec: AccDec::None,
            ..full()
        };
        let ideal = Machine::default();
        let all = [
            departure::<4>(&machine),
            departure::<3>(&no_filter),
            departure::<2>(&no_mechanics),
            departure::<0>(&ideal),
        ];
        assert!(all.iter().all(|d| *d < 1e-13), "{all:?}");
    }
}
