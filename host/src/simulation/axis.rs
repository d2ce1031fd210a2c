//! One axis in time: the linear chain, then what remembers the last reversal (backlash, friction).
use super::chain::{Chain, Stepper};
use super::command::{Command, hermite};
use super::machine::{AccDec, Friction, Machine};

/// Travel back from the extreme after which a reversal counts, m: below it rounding and a decaying
/// oscillation at standstill would be taken for reversals.
const REVERSAL_TRAVEL_M: f64 = 1e-8;

/// Pieces of a step in which friction turns its sign.
const PIECES: u32 = 8;

/// Steps of one length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub(super) start_s: f64,
    pub(super) step_s: f64,
    pub(super) steps: usize,
}

/// An axis at the time of a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AxisPoint {
    /// Where the drive is, m.
    pub(super) drive_m: f64,
    /// Velocity of the drive, m/s.
    pub(super) velocity_m_s: f64,
    /// What backlash and friction add, m.
    pub(super) error_m: f64,
    /// Sign of the travel.
    pub(super) sign: f64,
}

/// Moves one axis along the grid and looks at it at the given times (rising; before the grid the axis rests
/// at the command's first value). Dead time is a shift of these times.
pub(super) fn motion(
    machine: &Machine,
    axis: usize,
    command: &Command,
    grid: Grid,
    times: impl Iterator<Item = f64>,
) -> Vec<AxisPoint> {
    let window = match machine.acc_dec {
        AccDec::MovingAverage(t) => Some(t),
        AccDec::None | AccDec::Exponential(_) => None,
    };
    let dead_time_s = machine.dead_time_s[axis];
    let mut times = times.map(|t| t - dead_time_s).peekable();
    let input = |t: f64, inside: f64| match window {
        None => command.at(t, inside),
        Some(w) => command.mean_at(t, w),
    };

    let h = grid.step_s;
    let chain = Chain::new(machine, axis);
    let start = input(grid.start_s, grid.start_s + 0.5 * h);
    let mut stepper = (!chain.is_ideal()).then(|| Stepper::new(&chain, h, start[0]));
    let mut memory = Memory::new(machine, axis, start);
    let mut points = Vec::with_capacity(times.size_hint().0);
    let mut end = start;
    for k in 0..grid.steps {
        let t0 = grid.start_s + h * k as f64;
        let inside = t0 + 0.5 * h;
        // Chords meet in a corner: the velocity at the start of a step is not that at the end of the last.
        let begin = if matches!(command, Command::Knots(_)) { input(t0, inside) } else { end };
        end = input(t0 + h, inside);
        let u = [begin[0], begin[1], end[0], end[1]];
        let y = stepper.as_mut().map_or(u, |stepper| stepper.step(u));

        let mut turn = memory.as_ref().and_then(|_| turning_point(y, h));
        let mut behind = 0.0;
        let last = k + 1 == grid.steps;
        while let Some(t) = times.next_if(|t| *t < t0 + h || last) {
            let s = ((t - t0) / h).clamp(0.0, 1.0);
            let [drive_m, velocity] = hermite(y, h, s);
            let mut point = AxisPoint { drive_m, velocity_m_s: velocity, error_m: 0.0, sign: 0.0 };
            if let Some(memory) = &mut memory {
                memory.follow(t0, h, y, [behind, s], &mut turn);
                behind = s;
                point.error_m = memory.error_m(drive_m, velocity);
                point.sign = memory.sign;
            }
            points.push(point);
        }
        if let Some(memory) = &mut memory {
            memory.follow(t0, h, y, [behind, 1.0], &mut turn);
        }
    }
    points
}

/// Share of the step at which the velocity is zero, if it changes sign within.
fn turning_point([p0, v0, p1, v1]: [f64; 4], h: f64) -> Option<f64> {
    if v0 * v1 >= 0.0 {
        return None;
    }
    // Velocity·h = c + 2a·s + 3b·s², of which one root lies within; the other form avoids cancellation.
    let (m0, m1) = (v0 * h, v1 * h);
    let (a, b) = (3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1);
    let root = (a * a - 3.0 * b * m0).max(0.0).sqrt();
    let q = -(a + root.copysign(a));
    [m0 / q, q / (3.0 * b)].into_iter().find(|s| (0.0..=1.0).contains(s))
}

/// What an axis remembers of its way.
#[derive(Clone, Copy, Debug)]
struct Memory {
    half_backlash_m: f64,
    friction: Option<Friction>,
    sign: f64,
    /// Extreme of the present stroke and its time.
    extreme: [f64; 2],
    /// Place and time of the last reversal.
    reversal: Option<[f64; 2]>,
    /// Where the play has left the load.
    load_m: f64,
    /// Last place and time.
    last: [f64; 2],
    /// Friction, −1…1, and the answers of the loop to its changes.
    slide: f64,
    answers: [f64; 2],
}

impl Memory {
    /// `None` for an axis on which nothing depends on the way.
    fn new(machine: &Machine, axis: usize, [position, velocity]: [f64; 2]) -> Option<Self> {
        let half_backlash_m = 0.5 * machine.backlash_m[axis];
        let friction = machine.friction[axis];
        let needed = half_backlash_m != 0.0 || friction.is_some() || machine.lateral_play_m[axis] != 0.0;
        let sign = if velocity == 0.0 { 0.0 } else { velocity.signum() };
        needed.then(|| Self {
            half_backlash_m,
            friction,
            sign,
            extreme: [position, f64::NEG_INFINITY],
            reversal: None,
            load_m: position - sign * half_backlash_m.abs(),
            last: [position, f64::NEG_INFINITY],
            slide: sign,
            answers: [0.0; 2],
        })
    }

    /// Goes along a step `y` from share to share, by way of its turning point and, while friction is turning
    /// its sign, in pieces.
    fn follow(&mut self, t0: f64, h: f64, y: [f64; 4], [from, to]: [f64; 2], turn: &mut Option<f64>) {
        let mut from = from;
        let mut turning = self.is_turning();
        if let Some(s) = turn.take_if(|s| *s <= to) {
            self.visit(t0 + h * s, hermite(y, h, s)[0]);
            from = s;
            turning = self.friction.is_some();
        }
        let pieces = if turning { PIECES } else { 1 };
        for k in 1..=pieces {
            let s = from + (to - from) * f64::from(k) / f64::from(pieces);
            self.visit(t0 + h * s, hermite(y, h, s)[0]);
        }
    }

    /// Whether friction is between its two signs.
    fn is_turning(&self) -> bool {
        self.friction.is_some_and(|f| f.presliding_m > 0.0) && self.slide.abs() < 0.999
    }

    /// Takes notice of the drive's position; every extreme has to be visited.
    fn visit(&mut self, t: f64, x: f64) {
        let gap = self.half_backlash_m.abs();
        // Not clamp(): it panics where x is NaN.
        self.load_m = self.load_m.max(x - gap).min(x + gap);
        self.rub(t, x);
        let ahead = x - self.extreme[0];
        if self.sign == 0.0 {
            if ahead.abs() > REVERSAL_TRAVEL_M {
                self.sign = ahead.signum();
                self.extreme = [x, t];
            }
        } else if ahead * self.sign >= 0.0 {
            self.extreme = [x, t];
        } else if ahead.abs() > REVERSAL_TRAVEL_M {
            self.reversal = Some(self.extreme);
            self.sign = -self.sign;
            self.extreme = [x, t];
        }
    }

    /// Friction follows the travel, the loop follows the friction.
    fn rub(&mut self, t: f64, x: f64) {
        let Some(friction) = self.friction else { return };
        let [last_x, last_t] = self.last;
        self.last = [x, t];
        let way = x - last_x;
        let turned = if way == 0.0 { self.slide } else { way.signum() };
        let stay = if friction.presliding_m > 0.0 { (-way.abs() / friction.presliding_m).exp() } else { 0.0 };
        let before = self.slide;
        self.slide = turned + (before - turned) * stay;
        let step_s = t - last_t;
        for (answer, tau) in self.answers.iter_mut().zip([friction.decay_s, friction.rise_s]) {
            let ratio = step_s / tau;
            // A change spread evenly over the step, or with it all at its beginning; a rise of zero answers nothing.
            let [keep, take] = match ratio.is_finite() {
                true if stay == 0.0 => [(-ratio).exp(); 2],
                true if ratio > 1e-9 => [(-ratio).exp(), (1.0 - (-ratio).exp()) / ratio],
                true => [1.0, 1.0],
                false => [0.0, 0.0],
            };
            *answer = keep * *answer + take * (self.slide - before);
        }
    }

    /// Offset of the load from the drive.
    fn error_m(&self, x: f64, velocity: f64) -> f64 {
        // A negative step is an overcompensated play: the mirror image.
        let play = (self.load_m - x) * if self.half_backlash_m < 0.0 { -1.0 } else { 1.0 };
        let Some((friction, [turn_m, _])) = self.friction.zip(self.reversal) else { return play };
        let pulse = 0.5 * friction.peak_m * (self.answers[0] - self.answers[1]) / friction.highest();
        let slow = (-(velocity / friction.stick_speed_m_s).powi(2)).exp();
        let tooth = friction.stick_slip_m * slow * ((x - turn_m).abs() / friction.stick_travel_m).fract();
        play - pulse - self.sign * tooth
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_point_is_where_the_velocity_is_zero() {
        for y in
            [[0.0, 1.0, 0.1, -2.0], [0.0, -1e-9, 0.1, 3.0], [1.0, 2.0, 1.0, -2.0], [0.0, 1.0, 0.4, -1e-7]]
        {
            let s = turning_point(y, 0.3).unwrap();
            assert!((hermite(y, 0.3, s)[1]).abs() < 1e-12, "{y:?}: {s}");
        }
        assert_eq!(turning_point([0.0, 1.0, 1.0, 1.0], 1.0), None);
        assert_eq!(turning_point([0.0, f64::NAN, 1.0, 1.0], 1.0), None);
    }

    #[test]
    fn play_lags_on_both_sides() {
        let machine = Machine { backlash_m: [2e-5, 0.0], ..Machine::default() };
        let mut memory = Memory::new(&machine, 0, [0.0, 1.0]).unwrap();
        memory.visit(1.0, 1e-3);
        assert!((memory.error_m(1e-3, 1.0) + 1e-5).abs() < 1e-15);
        memory.visit(2.0, 1e-3 - 5e-6);
        assert!((memory.error_m(1e-3 - 5e-6, -1.0) + 5e-6).abs() < 1e-15, "inside the gap the load stands");
        memory.visit(3.0, 0.0);
        assert!((memory.error_m(0.0, -1.0) - 1e-5).abs() < 1e-15);
    }
}
