//! One axis on a circle at a constant rate. Its linear part is in the steady state from the first step on; what remembers
//! reversals is led through one first.
use super::axis::AxisPoint;
use super::chain::{Discrete, Stepper};
use super::circle::{MAX_STEPS, ONE_REVERSAL_TURNS, RUN_IN_TIME_CONSTANTS};
use super::hysteresis::{Hysteresis, turning_point};
use super::machine::Machine;
use super::wave::{Turns, phasor};

/// Steps for which waves are worked out at a time: they stay in the L1 cache.
pub(super) const PIECE: usize = 512;

/// The circle that the axes are on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round<'a> {
    pub(super) machine: &'a Machine,
    pub(super) turns: &'a Turns,
    pub(super) radius_m: f64,
    pub(super) omega_rad_s: f64,
    pub(super) step_s: f64,
}

/// An axis in motion.
pub(super) trait Orbit {
    /// Goes one step a wave and looks at the axis before every `every`th of them.
    fn follow(&mut self, waves: &[[f64; 2]], every: usize, points: &mut Vec<AxisPoint>);
}

/// The axis, ready to step from step 0 of the waves.
pub(super) fn axis(
    round: Round<'_>,
    axis: usize,
    shares: [f64; 2],
    chain: &Discrete,
) -> Box<dyn Orbit> {
    match chain.chain().states() {
        0 => Box::new(Axis::<0>::new(round, axis, shares, chain)),
        1 => Box::new(Axis::<1>::new(round, axis, shares, chain)),
        2 => Box::new(Axis::<2>::new(round, axis, shares, chain)),
        3 => Box::new(Axis::<3>::new(round, axis, shares, chain)),
        _ => Box::new(Axis::<4>::new(round, axis, shares, chain)),
    }
}

struct Axis<const S: usize> {
    chain: Stepper<S, 2>,
    track: Option<Track>,
}

/// Where an axis with hysteresis is.
struct Track {
    hysteresis: Hysteresis,
    step_s: f64,
    last: [f64; 2],
}

impl<const S: usize> Axis<S> {
    fn new(round: Round<'_>, axis: usize, shares: [f64; 2], chain: &Discrete) -> Self {
        let Round {
            machine,
            turns,
            omega_rad_s,
            step_s,
            ..
        } = round;
        let before = run_in_s(round, axis).map_or(0.0, |s| (s / step_s).min(MAX_STEPS).ceil());
        let phasor = phasor(
            machine,
            axis,
            shares.map(|share| round.radius_m * share),
            omega_rad_s,
        );
        let start = turns.at(-before);
        let chain = chain.in_orbit(phasor, omega_rad_s, turns.step_rad(), start);
        let last = chain.look(start);
        let track = Hysteresis::new(machine, axis, last, step_s).map(|hysteresis| Track {
            hysteresis,
            step_s,
            last,
        });
        let mut axis = Self { chain, track };
        let mut waves = [[0.0; 2]; PIECE];
        let (mut k, mut unseen) = (before, Vec::with_capacity(1));
        while k > 0.0 {
            let waves = &mut waves[..k.min(PIECE as f64) as usize];
            turns.fill(-k, waves);
            axis.follow(waves, PIECE, &mut unseen);
            unseen.clear();
            k -= waves.len() as f64;
        }
        axis
    }
}

/// How long an axis has to move before what it remembers is that of the lap, s; none for one that remembers nothing.
fn run_in_s(round: Round<'_>, axis: usize) -> Option<f64> {
    let machine = round.machine;
    Hysteresis::needed(machine, axis).then(|| {
        let turn_s = std::f64::consts::TAU / round.omega_rad_s.abs();
        let friction_s = machine.friction[axis].map_or(0.0, |_| machine.settling_s(axis));
        ONE_REVERSAL_TURNS * turn_s + RUN_IN_TIME_CONSTANTS * friction_s
    })
}

impl<const S: usize> Orbit for Axis<S> {
    fn follow(&mut self, waves: &[[f64; 2]], every: usize, points: &mut Vec<AxisPoint>) {
        for waves in waves.chunks(every) {
            for (k, wave) in waves.iter().enumerate() {
                if k == 0 || self.track.is_some() {
                    let now = self.chain.look(*wave);
                    if let Some(track) = &mut self.track {
                        track.go(now);
                    }
                    if k == 0 {
                        points.push(AxisPoint::new(
                            now,
                            self.track.as_ref().map(|t| &t.hysteresis),
                        ));
                    }
                }
                self.chain.step(*wave);
            }
        }
    }
}

impl Track {
    /// On to where the axis is now.
    fn go(&mut self, now: [f64; 2]) {
        let ([p0, v0], [p1, v1]) = (self.last, now);
        let y = [p0, v0, p1, v1];
        let mut turn = turning_point(y, self.step_s);
        self.hysteresis.follow(y, [0.0, 1.0], &mut turn);
        self.last = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::chain::Chain;
    use crate::simulation::machine::{Friction, PositionLoop};

    /// What comes after the run-in is what comes a turn and two turns later: nothing of the start is left.
    #[test]
    fn the_first_lap_is_that_of_all() {
        let sharp = Friction {
            peak_m: 8e-6,
            decay_s: 0.03,
            ..Friction::default()
        };
        let soft = Friction {
            rise_s: 0.004,
            presliding_m: 2e-5,
            ..sharp
        };
        let lagging = || Machine {
            servo: [PositionLoop {
                kv_per_s: 30.0,
                feed_forward: 0.0,
            }; 3],
            ..Machine::default()
        };
        let machines = [
            Machine {
                backlash_m: [2e-5; 3],
                ..lagging()
            },
            Machine {
                friction: [Some(sharp); 3],
                ..lagging()
            },
            Machine {
                friction: [Some(soft); 3],
                backlash_m: [1e-5; 3],
                ..lagging()
            },
        ];
        const STEPS: usize = 720;
        for machine in &machines {
            for (omega_rad_s, start_rad) in [(2.0, 0.3), (-7.0, -1.9)] {
                let step_rad = std::f64::consts::TAU.copysign(omega_rad_s) / STEPS as f64;
                let (turns, step_s) = (Turns::new(start_rad, step_rad), step_rad / omega_rad_s);
                let round = Round {
                    machine,
                    turns: &turns,
                    radius_m: 0.1,
                    omega_rad_s,
                    step_s,
                };
                let chain = Discrete::new(Chain::new(machine, 0), step_s);
                let mut axis = axis(round, 0, [1.0, 0.0], &chain);
                let mut waves = [[0.0; 2]; STEPS];
                let mut lap = |first: usize| {
                    let mut points = Vec::new();
                    turns.fill((first * STEPS) as f64, &mut waves);
                    axis.follow(&waves, 1, &mut points);
                    points
                        .iter()
                        .map(|p| p.drive_m + p.error_m)
                        .collect::<Vec<_>>()
                };
                let (one, two, three) = (lap(0), lap(1), lap(2));
                let apart = |a: &[f64], b: &[f64]| {
                    a.iter()
                        .zip(b)
                        .map(|(a, b)| (a - b).abs())
                        .fold(0.0, f64::max)
                };
                let worst = apart(&one, &three).max(apart(&two, &three));
                assert!(
                    worst < 1e-10,
                    "{worst} m at {omega_rad_s} rad/s: {machine:?}"
                );
            }
        }
    }
}
