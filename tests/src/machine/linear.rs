//! Linear elements in exact discrete form: the input is taken as straight between steps.
//!
//! Joining samples of a circle by lines shrinks it by sinc²(ωh/2); [`line_loss`] is that factor, and
//! [`crate::machine::run`] divides it out once an element, so that radii are exact at any step.

/// Factor by which a circle of angular rate `rate_rad_s` shrinks when its samples every `step_s` are joined by lines.
pub fn line_loss(rate_rad_s: f64, step_s: f64) -> f64 {
    let half = rate_rad_s * step_s / 2.0;
    if half.abs() < 1e-9 {
        1.0
    } else {
        (half.sin() / half).powi(2)
    }
}

/// First-order lag with feed-forward: (1 + a·sτ)/(1 + sτ), Eq. 13 with τ = 1/kv.
#[derive(Clone, Copy, Debug)]
pub struct Lag {
    keep: f64,
    ramp: f64,
    ahead: f64,
    state: f64,
    input: f64,
}

impl Lag {
    /// At rest at `position`.
    pub fn new(tau_s: f64, feed_forward: f64, step_s: f64, position: f64) -> Self {
        let keep = (-step_s / tau_s).exp();
        Self {
            keep,
            ramp: 1.0 - (1.0 - keep) * tau_s / step_s,
            ahead: feed_forward,
            state: position,
            input: position,
        }
    }

    /// Advances by one step to the input `u`.
    pub fn step(&mut self, u: f64) -> f64 {
        self.state =
            self.keep * self.state + (1.0 - self.keep) * self.input + self.ramp * (u - self.input);
        self.input = u;
        self.ahead * u + (1.0 - self.ahead) * self.state
    }
}

/// ωn²/(s² + 2ζωn s + ωn²).
#[derive(Clone, Copy, Debug)]
pub struct SecondOrder {
    transition: [[f64; 4]; 4],
    state: [f64; 2],
    input: f64,
}

impl SecondOrder {
    /// At rest at `position`.
    pub fn new(omega_n_rad_s: f64, zeta: f64, step_s: f64, position: f64) -> Self {
        let (h, w) = (step_s, omega_n_rad_s);
        // States: position, velocity, input, rise of the input over the step.
        let transition = expm([
            [0.0, h, 0.0, 0.0],
            [-w * w * h, -2.0 * zeta * w * h, w * w * h, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0; 4],
        ]);
        Self {
            transition,
            state: [position, 0.0],
            input: position,
        }
    }

    /// Advances by one step to the input `u`.
    pub fn step(&mut self, u: f64) -> f64 {
        let v = [self.state[0], self.state[1], self.input, u - self.input];
        self.state = [0, 1].map(|i| (0..4).map(|k| self.transition[i][k] * v[k]).sum());
        self.input = u;
        self.state[0]
    }
}

/// Moving average over a time that need not be a multiple of the step.
#[derive(Clone, Debug)]
pub struct Average {
    /// Running integral of the input at the last steps, oldest overwritten.
    integral: Vec<f64>,
    values: Vec<f64>,
    at: usize,
    window_s: f64,
    step_s: f64,
}

impl Average {
    /// At rest at `position`.
    pub fn new(window_s: f64, step_s: f64, position: f64) -> Self {
        let n = (window_s / step_s).ceil() as usize + 2;
        let integral = (0..n)
            .map(|k| position * step_s * (k as f64 - (n - 1) as f64))
            .collect();
        Self {
            integral,
            values: vec![position; n],
            at: n - 1,
            window_s,
            step_s,
        }
    }

    /// Advances by one step to the input `u`.
    pub fn step(&mut self, u: f64) -> f64 {
        let n = self.values.len();
        let area = self.integral[self.at] + 0.5 * self.step_s * (self.values[self.at] + u);
        self.at = (self.at + 1) % n;
        self.integral[self.at] = area;
        self.values[self.at] = u;
        // Integral at the window's far end: exact for the straight piece it falls on.
        let back = self.window_s / self.step_s;
        let whole = back.floor() as usize;
        let share = back - whole as f64;
        let near = (self.at + n - whole) % n;
        let far = (near + n - 1) % n;
        let end = self.values[near] + share * (self.values[far] - self.values[near]);
        let piece = 0.5 * share * self.step_s * (self.values[near] + end);
        (area - (self.integral[near] - piece)) / self.window_s
    }
}

/// Matrix exponential by scaling and a Taylor series; the step matrices here have norms below 10.
fn expm(a: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let product = |a: &[[f64; 4]; 4], b: &[[f64; 4]; 4]| {
        let mut c = [[0.0; 4]; 4];
        for (i, row) in c.iter_mut().enumerate() {
            for (j, cell) in row.iter_mut().enumerate() {
                *cell = (0..4).map(|k| a[i][k] * b[k][j]).sum();
            }
        }
        c
    };
    const HALVINGS: i32 = 16;
    let small = a.map(|row| row.map(|x| x / f64::from(2_i32.pow(HALVINGS as u32))));
    let mut sum = [[0.0; 4]; 4];
    let mut power = [[0.0; 4]; 4];
    for i in 0..4 {
        sum[i][i] = 1.0;
        power[i][i] = 1.0;
    }
    for k in 1..8 {
        power = product(&power, &small).map(|row| row.map(|x| x / f64::from(k)));
        for i in 0..4 {
            for j in 0..4 {
                sum[i][j] += power[i][j];
            }
        }
    }
    (0..HALVINGS).fold(sum, |m, _| product(&m, &m))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steady gain of an element on a sine of rate `w`, from its peak over the last periods.
    fn gain(mut step: impl FnMut(f64) -> f64, w: f64, h: f64) -> f64 {
        let n = (60.0 / (w * h)) as usize;
        let (mut s, mut c) = (0.0, 0.0);
        let period = (2.0 * std::f64::consts::PI / (w * h)).round() as usize;
        for k in 0..n + period {
            let phase = w * h * k as f64;
            let y = step(phase.sin());
            if k >= n {
                s += y * phase.sin();
                c += y * phase.cos();
            }
        }
        s.hypot(c) * 2.0 / period as f64
    }

    #[test]
    fn elements_have_their_textbook_gains() {
        let w = 7.0;
        let h = 2.0 * std::f64::consts::PI / w / 1800.0;
        let loss = line_loss(w, h);
        let mut lag = Lag::new(0.02, 0.3, h, 0.0);
        let want = (0.3_f64 * 0.14).hypot(1.0) / (0.14_f64).hypot(1.0);
        let got = gain(|u| lag.step(u), w, h);
        // The feed-forward share sees the sine itself, not its chords: a loss of at most a·(ωh)²/12.
        assert!((got / loss - want).abs() < 1e-6, "{got} {want}");
        let mut second = SecondOrder::new(38.0, 0.72, h, 0.0);
        let x: f64 = w / 38.0;
        let want = 1.0 / (1.0 - x * x).hypot(2.0 * 0.72 * x);
        assert!((gain(|u| second.step(u), w, h) / loss - want).abs() < 1e-9);
        let mut average = Average::new(0.0437, h, 0.0);
        let half = w * 0.0437 / 2.0;
        assert!((gain(|u| average.step(u), w, h) / loss - half.sin() / half).abs() < 1e-8);
    }
}
