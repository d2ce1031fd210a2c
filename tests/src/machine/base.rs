//! Machines, laboratories and instruments to hide effects in, drawn under a seed.
use super::plan::Grid;
use super::{AxisChain, Instrument, Machine, Shape, Spread};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A machine, a grid and an instrument before anything is hidden.
#[derive(Clone, Debug)]
pub struct Lab {
    /// The machine.
    pub machine: Machine,
    /// What is run.
    pub grid: Grid,
    /// What looks.
    pub instrument: Instrument,
}

/// How far a lab may stray from the usual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variety {
    /// The paper's grid, a ballbar, normal spread.
    Usual,
    /// As usual, but half the feeds and 500 samples a turn: for tests that have little time.
    Small,
    /// Other grids, sample counts, start angles, spread shapes, trackers, missing start times.
    Broad,
    /// As broad, and noise correlated along the turn, jitter of the clock, spread that grows with the speed.
    Laws,
}

impl Lab {
    /// Draws a lab: one servo lag the same on both axes, a dead time, a set-up offset, noise and spread.
    pub fn drawn(seed: u64, variety: Variety) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let broad = matches!(variety, Variety::Broad | Variety::Laws);
        let lag_s = if broad {
            rng.random_range(0.003..0.016)
        } else {
            rng.random_range(0.005..0.012)
        };
        let dead_time_s = if rng.random_bool(0.5) {
            rng.random_range(0.0..0.004)
        } else {
            0.0
        };
        let axis = AxisChain {
            lag_s,
            dead_time_s,
            ..AxisChain::default()
        };
        let machine = Machine {
            axes: [axis.clone(), axis.clone(), axis],
            ..Machine::default()
        };
        let noise_m = if broad {
            rng.random_range(0.4e-6..2.5e-6)
        } else {
            rng.random_range(0.7e-6..1.2e-6)
        };
        let radius_m = if broad {
            rng.random_range(0.1e-6..2.0e-6)
        } else {
            rng.random_range(0.4e-6..0.8e-6)
        };
        let around: f64 = rng.random_range(-3.2..3.2);
        let off = rng.random_range(5e-6..60e-6);
        let shape = if broad {
            [Shape::Normal, Shape::Heavy, Shape::Flat][rng.random_range(0..3)]
        } else {
            Shape::Normal
        };
        let instrument = Instrument {
            noise_m,
            resolution_m: 0.1e-6,
            spread: Spread {
                radius_m,
                oval_m: radius_m
                    * if broad {
                        rng.random_range(0.0..0.4)
                    } else {
                        0.2
                    },
                lobes_m: if broad {
                    radius_m * rng.random_range(0.0..0.1)
                } else {
                    0.0
                },
                shape,
                ..Instrument::perfect().spread
            },
            offset_m: [off * around.cos(), off * around.sin()],
            height_m: if broad {
                rng.random_range(0.0..0.2e-3)
            } else {
                0.0
            },
            drift_m: if broad && rng.random_bool(0.3) {
                rng.random_range(0.0..0.3e-6)
            } else {
                0.0
            },
            tick_s: 0.25e-3,
            sees_angle: broad && rng.random_bool(0.25),
            knows_start: !(broad && rng.random_bool(0.2)),
            ..Instrument::perfect()
        };
        let grid = match variety {
            Variety::Usual => Grid::paper(),
            Variety::Small => Grid {
                feeds_m_s: [20., 50., 100., 200., 300., 450., 700.]
                    .map(|f: f64| f / 1e3)
                    .to_vec(),
                samples: 500,
                ..Grid::paper()
            },
            Variety::Broad | Variety::Laws => Grid::drawn(&mut rng),
        };
        let mut instrument = instrument;
        if variety == Variety::Laws {
            instrument.memory_rad = rng.random_range(0.02..0.3);
            instrument.jitter_s = rng.random_range(0.0..3e-4);
            instrument.spread.grows = [rng.random_range(0.0..1.0), 0.0];
            instrument.spread.high_m = 0.1 * instrument.spread.radius_m;
        }
        Self {
            machine,
            grid,
            instrument,
        }
    }
}
