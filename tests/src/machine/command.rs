//! The commanded circle: a start with limited jerk, a run-in, then the lap that is measured.

/// Position of the commanded point over time; the measured lap begins at `t = 0`.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    radius_m: f64,
    rate_rad_s: f64,
    start_rad: f64,
    ramp_s: f64,
    settle_s: f64,
    stop_s: f64,
}

impl Command {
    /// A circle of `radius_m` at the signed angular rate `rate_rad_s`, passing the polar angle
    /// `start_rad` at `t = 0`, after a ramp of `ramp_s` and `settle_s` at full feed.
    pub fn new(radius_m: f64, rate_rad_s: f64, start_rad: f64, ramp_s: f64, settle_s: f64) -> Self {
        Self {
            radius_m,
            rate_rad_s,
            start_rad,
            ramp_s,
            settle_s,
            stop_s: f64::INFINITY,
        }
    }

    /// The same, coming to rest by the mirror of its start, from `stop_s` on.
    pub fn stopping(mut self, stop_s: f64) -> Self {
        self.stop_s = stop_s;
        self
    }

    /// Time at which it rests again, s.
    pub fn end_s(&self) -> f64 {
        self.stop_s + self.ramp_s
    }

    /// Time at which the machine leaves its rest, s (negative).
    pub fn begin_s(&self) -> f64 {
        -self.settle_s - self.ramp_s
    }

    /// Polar angle at `t`, rad. During the ramp the acceleration is `1 − cos`, so the jerk is bounded.
    pub fn angle_rad(&self, t: f64) -> f64 {
        let turn = 2.0 * std::f64::consts::PI;
        // Way of the start at its share u, in ramps at full feed.
        let ramp = |u: f64| u * u / 2.0 + ((turn * u).cos() - 1.0) / (turn * turn);
        let travelled_s = if t > self.stop_s {
            let u = ((t - self.stop_s) / self.ramp_s).min(1.0);
            self.stop_s + self.ramp_s * (u - ramp(u))
        } else if t >= -self.settle_s {
            t
        } else {
            let u = ((t - self.begin_s()) / self.ramp_s).max(0.0);
            -self.settle_s - self.ramp_s / 2.0 + self.ramp_s * ramp(u)
        };
        self.start_rad + self.rate_rad_s * travelled_s
    }

    /// Commanded position at `t`, m.
    pub fn position_m(&self, t: f64) -> [f64; 2] {
        let (sin, cos) = self.angle_rad(t).sin_cos();
        [self.radius_m * cos, self.radius_m * sin]
    }
}

/// Issues set-points every `period_s` and joins them by straight lines.
#[derive(Clone, Debug)]
pub struct Interpolator {
    command: Command,
    period_s: f64,
    index: i64,
    from: [f64; 2],
    to: [f64; 2],
}

impl Interpolator {
    /// Starts at the command's first rest position. The clock of the interpolator is not that of the
    /// lap, so the set-points fall anywhere on the circle.
    pub fn new(command: Command, period_s: f64) -> Self {
        let from = command.position_m(command.begin_s());
        Self {
            command,
            period_s,
            index: i64::MIN,
            from,
            to: from,
        }
    }

    /// Interpolated position at `t`, m; `t` must not fall by more than one period between calls.
    pub fn position_m(&mut self, t: f64) -> [f64; 2] {
        let count = (t - self.command.begin_s()) / self.period_s;
        let index = count.floor();
        if index as i64 != self.index {
            let at = |k: f64| {
                self.command
                    .position_m(self.command.begin_s() + k * self.period_s)
            };
            self.from = if index as i64 == self.index + 1 {
                self.to
            } else {
                at(index)
            };
            self.to = at(index + 1.0);
            self.index = index as i64;
        }
        let share = count - index;
        [0, 1].map(|i| self.from[i] + share * (self.to[i] - self.from[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_is_smooth_and_meets_the_lap() {
        let c = Command::new(0.1, 3.0, 0.3, 0.2, 0.5);
        let h = 1e-4;
        let rate = |t: f64| (c.angle_rad(t + h) - c.angle_rad(t - h)) / (2.0 * h);
        assert!(rate(-0.7 + 2.0 * h).abs() < 1e-3, "rest at the beginning");
        assert!((rate(-0.5) - 3.0).abs() < 1e-3, "full feed after the ramp");
        assert!(
            (c.angle_rad(-0.5 - 1e-9) - c.angle_rad(-0.5)).abs() < 1e-7,
            "no jump"
        );
        assert!(
            (c.angle_rad(0.0) - 0.3).abs() < 1e-12,
            "lap begins at the start angle"
        );
    }

    #[test]
    fn the_stop_mirrors_the_start() {
        let c = Command::new(0.1, 3.0, 0.3, 0.2, 0.5).stopping(2.0);
        let way = |from: f64, to: f64| c.angle_rad(to) - c.angle_rad(from);
        assert!((way(2.0, c.end_s()) - way(c.begin_s(), -0.5)).abs() < 1e-12);
        assert!(way(c.end_s(), 9.0).abs() < 1e-12, "it rests");
        assert!(
            (way(2.0, 2.0 + 1e-4) - 3e-4).abs() < 1e-8,
            "no jump of the feed"
        );
    }

    #[test]
    fn chords_sag_by_the_sagitta() {
        let c = Command::new(0.1, 7.0, 0.0, 0.1, 0.2);
        let mut i = Interpolator::new(c, 0.01);
        let mut least = f64::MAX;
        for k in 0..20_000 {
            let p = i.position_m(f64::from(k) * 1e-5);
            least = least.min(p[0].hypot(p[1]));
        }
        let sagitta = 0.1 * (1.0 - (7.0_f64 * 0.005).cos());
        assert!((0.1 - least - sagitta).abs() < 0.01 * sagitta);
    }
}
