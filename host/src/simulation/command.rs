//! The command of one axis over time as knots, joined by cubics or chords. A circle that the controller does not cut
//! into chords is a [`super::wave`] instead.

/// Knots `dt_s` apart from `start_s` on, joined by cubics in Hermite form; before the first and after the last the
/// command stands still, so that filters have no start-up of their own.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    start_s: f64,
    dt_s: f64,
    position_m: Vec<f64>,
    /// Velocity at both ends of each piece.
    velocity_m_s: Vec<[f64; 2]>,
    /// Antiderivative at each knot.
    integral: Vec<f64>,
}

impl Knots {
    /// Joined by straight chords.
    pub(super) fn chords(start_s: f64, dt_s: f64, position_m: Vec<f64>) -> Self {
        let velocity = position_m
            .windows(2)
            .map(|p| [(p[1] - p[0]) / dt_s; 2])
            .collect();
        Self::new(start_s, dt_s, position_m, velocity)
    }

    /// Joined by cubics whose velocity at a knot is the five-point difference (three-point and one-sided
    /// at the ends): on a circle the position is then right to (ω·dt)⁴·R/64.
    pub(super) fn smooth(start_s: f64, dt_s: f64, position_m: Vec<f64>) -> Self {
        let last = position_m.len().saturating_sub(1);
        let p = |k: usize| position_m[k];
        let slope = |k: usize| match k {
            0 => (p(last.min(1)) - p(0)) / dt_s,
            k if k == last => (p(k) - p(k - 1)) / dt_s,
            k if k == 1 || k + 1 == last => (p(k + 1) - p(k - 1)) / (2.0 * dt_s),
            k => (8.0 * (p(k + 1) - p(k - 1)) - (p(k + 2) - p(k - 2))) / (12.0 * dt_s),
        };
        let velocity = (0..last).map(|k| [slope(k), slope(k + 1)]).collect();
        Self::new(start_s, dt_s, position_m, velocity)
    }

    fn new(start_s: f64, dt_s: f64, position_m: Vec<f64>, velocity_m_s: Vec<[f64; 2]>) -> Self {
        let mut sum = 0.0;
        let mut integral = Vec::with_capacity(position_m.len());
        integral.push(0.0);
        for (p, v) in position_m.windows(2).zip(&velocity_m_s) {
            sum += dt_s * (0.5 * (p[0] + p[1]) + dt_s / 12.0 * (v[0] - v[1]));
            integral.push(sum);
        }
        Self {
            start_s,
            dt_s,
            position_m,
            velocity_m_s,
            integral,
        }
    }

    /// Piece that holds `inside`, or the end beyond which it lies.
    fn piece(&self, inside: f64) -> Result<usize, usize> {
        let last = self.position_m.len() - 1;
        let s = (inside - self.start_s) / self.dt_s;
        match s {
            s if s < 0.0 || s.is_nan() => Err(0),
            s if s >= last as f64 => Err(last),
            s => Ok(s as usize),
        }
    }

    /// Position and velocity at `t`; where the velocity jumps, it is that of the piece in which `inside` lies.
    pub(super) fn at(&self, t: f64, inside: f64) -> [f64; 2] {
        match self.piece(inside) {
            Err(end) => [self.position_m[end], 0.0],
            Ok(k) => {
                let s = (t - self.start_s) / self.dt_s - k as f64;
                let [v0, v1] = self.velocity_m_s[k];
                hermite(
                    [self.position_m[k], v0, self.position_m[k + 1], v1],
                    self.dt_s,
                    s,
                )
            }
        }
    }

    /// Position and velocity of the mean over the last `window_s`.
    pub(super) fn mean_at(&self, t: f64, window_s: f64) -> [f64; 2] {
        let (now, then) = (self.at(t, t)[0], self.at(t - window_s, t - window_s)[0]);
        [
            (self.integral(t) - self.integral(t - window_s)) / window_s,
            (now - then) / window_s,
        ]
    }

    /// Antiderivative of the position at `t`, up to a constant.
    fn integral(&self, t: f64) -> f64 {
        match self.piece(t) {
            Err(0) => self.position_m[0] * (t - self.start_s),
            Err(end) => {
                self.integral[end]
                    + self.position_m[end] * (t - self.start_s - self.dt_s * end as f64)
            }
            Ok(k) => {
                let s = (t - self.start_s) / self.dt_s - k as f64;
                let (p0, p1) = (self.position_m[k], self.position_m[k + 1]);
                let [m0, m1] = self.velocity_m_s[k].map(|v| v * self.dt_s);
                let (a, b) = (3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1);
                let within = s * (p0 + s * (m0 / 2.0 + s * (a / 3.0 + s * b / 4.0)));
                self.integral[k] + self.dt_s * within
            }
        }
    }
}

/// Position and velocity of a cubic `[p0, v0, p1, v1]` of length `h` at share `s` of the way.
pub(super) fn hermite([p0, v0, p1, v1]: [f64; 4], h: f64, s: f64) -> [f64; 2] {
    let (m0, m1) = (v0 * h, v1 * h);
    let (a, b) = (3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1);
    [
        p0 + s * (m0 + s * (a + s * b)),
        (m0 + s * (2.0 * a + s * 3.0 * b)) / h,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(dt: f64) -> Vec<f64> {
        (0..2001)
            .map(|k| 0.1 * (7.0 * dt * k as f64).sin())
            .collect()
    }

    #[test]
    fn smooth_knots_follow_a_circle() {
        let (dt, omega) = (0.01_f64, 7.0);
        let knots = Knots::smooth(0.0, dt, sine(dt));
        let bound = (omega * dt).powi(4) * 0.1 / 64.0;
        let mut worst: f64 = 0.0;
        for k in 1000..9000 {
            let t = 0.05 + f64::from(k) * 1.9e-3;
            worst = worst.max((knots.at(t, t)[0] - 0.1 * (omega * t).sin()).abs());
        }
        assert!(
            worst <= bound && worst > bound / 20.0,
            "worst {worst:e}, stated {bound:e}"
        );
    }

    #[test]
    fn moving_average_of_knots_is_the_integral() {
        let dt = 0.01;
        for knots in [
            Knots::smooth(0.0, dt, sine(dt)),
            Knots::chords(0.0, dt, sine(dt)),
        ] {
            let (t, window, n) = (7.3123, 0.0417, 20_000);
            let step = window / f64::from(n);
            let sum: f64 = (0..n)
                .map(|i| t - window + (f64::from(i) + 0.5) * step)
                .map(|x| knots.at(x, x)[0])
                .sum();
            let [mean, slope] = knots.mean_at(t, window);
            assert!((mean - sum / f64::from(n)).abs() < 1e-11);
            let eps = 1e-6;
            let numeric = (knots.mean_at(t + eps, window)[0] - knots.mean_at(t - eps, window)[0])
                / (2.0 * eps);
            assert!((slope - numeric).abs() < 1e-7, "{slope} {numeric}");
        }
    }

    #[test]
    fn command_stands_still_outside_its_knots() {
        let knots = Knots::smooth(1.0, 0.5, vec![2.0, 3.0, 5.0]);
        assert_eq!(knots.at(-4.0, -4.0), [2.0, 0.0]);
        assert_eq!(knots.at(9.0, 9.0), [5.0, 0.0]);
        assert!((knots.mean_at(20.0, 1.0)[0] - 5.0).abs() < 1e-12);
        assert!((knots.mean_at(0.9, 1.0)[0] - 2.0).abs() < 1e-12);
    }
}
