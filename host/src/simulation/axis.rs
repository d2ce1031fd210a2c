//! One axis in time: the linear chain, then what remembers the last reversal (backlash, friction).
use super::chain::{Chain, Discrete};
use super::command::{Knots, hermite};
use super::hysteresis::{Hysteresis, turning_point};
use super::machine::{AccDec, Machine};

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

impl AxisPoint {
    pub(super) fn new([drive_m, velocity_m_s]: [f64; 2], hysteresis: Option<&Hysteresis>) -> Self {
        let error_m = hysteresis.map_or(0.0, |m| m.error_m(drive_m, velocity_m_s));
        Self {
            drive_m,
            velocity_m_s,
            error_m,
            sign: hysteresis.map_or(0.0, |m| m.sign),
        }
    }
}

/// Moves one axis under `knots` along the grid and looks at it at the given times (rising; before the grid the axis
/// rests at the command's first value). Dead time is a shift of these times.
pub(super) fn motion(
    machine: &Machine,
    axis: usize,
    knots: &Knots,
    grid: Grid,
    times: impl Iterator<Item = f64>,
) -> Vec<AxisPoint> {
    let chain = Discrete::new(Chain::new(machine, axis), grid.step_s);
    match chain.chain().states() {
        0 => motion_of::<0>(machine, axis, &chain, knots, grid, times),
        1 => motion_of::<1>(machine, axis, &chain, knots, grid, times),
        2 => motion_of::<2>(machine, axis, &chain, knots, grid, times),
        3 => motion_of::<3>(machine, axis, &chain, knots, grid, times),
        _ => motion_of::<4>(machine, axis, &chain, knots, grid, times),
    }
}

fn motion_of<const S: usize>(
    machine: &Machine,
    axis: usize,
    chain: &Discrete,
    knots: &Knots,
    grid: Grid,
    times: impl Iterator<Item = f64>,
) -> Vec<AxisPoint> {
    let dead_time_s = machine.dead_time_s[axis];
    let mut times = times.map(|t| t - dead_time_s).peekable();
    let input = |t: f64, inside: f64| match machine.acc_dec {
        AccDec::MovingAverage(window_s) => knots.mean_at(t, window_s),
        AccDec::None | AccDec::Exponential(_) => knots.at(t, inside),
    };

    let h = grid.step_s;
    let start = input(grid.start_s, grid.start_s + 0.5 * h);
    let mut stepper = chain.at_rest::<S>(start[0]);
    let mut hysteresis = Hysteresis::new(machine, axis, start, h);
    let mut points = Vec::with_capacity(times.size_hint().0);
    for k in 0..grid.steps {
        let t0 = grid.start_s + h * k as f64;
        let inside = t0 + 0.5 * h;
        // Chords meet in a corner: the velocity at the start of a step is not that at the end of the last.
        let [begin, end] = [input(t0, inside), input(t0 + h, inside)];
        let [p0, v0] = stepper.look(begin);
        stepper.step([begin[0], begin[1], end[0], end[1]]);
        let [p1, v1] = stepper.look(end);
        let y = [p0, v0, p1, v1];

        let mut turn = hysteresis.as_ref().and_then(|_| turning_point(y, h));
        let mut behind = 0.0;
        let last = k + 1 == grid.steps;
        while let Some(t) = times.next_if(|t| *t < t0 + h || last) {
            let s = ((t - t0) / h).clamp(0.0, 1.0);
            if let Some(hysteresis) = &mut hysteresis {
                hysteresis.follow(y, [behind, s], &mut turn);
                behind = s;
            }
            points.push(AxisPoint::new(hermite(y, h, s), hysteresis.as_ref()));
        }
        if let Some(hysteresis) = &mut hysteresis {
            hysteresis.follow(y, [behind, 1.0], &mut turn);
        }
    }
    points
}
