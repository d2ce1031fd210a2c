//! A machine and a planner of our own around the corrector.
#![allow(
    clippy::needless_range_loop,
    reason = "a joint is a number into several arrays at once"
)]
mod arm;
mod circles;
mod contours;
mod lead;
mod sessions;
mod through;
mod transitions;

use crate::{Corrector, Input, JOINTS, Output, Settings};
use giotto_shared::model::{Cumulants, Element};
use giotto_shared::table::{Limits, MAX_IMAGE_BYTES, Table, Travel, Zone, image};
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Plane};
use std::boxed::Box;
use std::collections::VecDeque;
use std::vec::Vec;

/// Lag of every joint, and the window of its average, s.
const LAG_S: f64 = 0.020;
const AVERAGE_S: f64 = 0.040;

/// Cumulants of the machine below.
fn cumulants() -> Cumulants<f32> {
    let lag = Element::Lag {
        kv_per_s: 1.0 / LAG_S,
    }
    .cumulants();
    let average = Element::MovingAverage {
        window_s: AVERAGE_S,
    }
    .cumulants();
    Cumulants {
        kappa2_s2: (lag.kappa2_s2 + average.kappa2_s2) as f32,
        kappa4_s4: (lag.kappa4_s4 + average.kappa4_s4) as f32,
    }
}

fn table(
    cumulants: Cumulants<f32>,
    terms: &[Term<f32>],
    place_m: Option<[[f32; 3]; 2]>,
) -> Vec<u8> {
    let zone = Zone {
        place_m,
        radius_m: [0.02, 0.2],
        feed_m_s: [0.02, 0.4],
        travel: Travel::Both,
        cumulants,
        terms: terms.iter().copied().collect(),
    };
    let table = Table {
        machine: "test".try_into().unwrap(),
        zones: [zone].into_iter().collect(),
        limits: Limits {
            offset_m: 0.005,
            slew_m_s: 0.1,
        },
        arm: None,
    };
    let mut bytes = std::vec![0; MAX_IMAGE_BYTES];
    let length = image::encode(&table, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

/// Eight terms, one of nearly each kind.
fn eight() -> Vec<Term<f32>> {
    let (plane, x, y) = (Plane::Xy, Actuator::X, Actuator::Y);
    std::vec![
        Term::Backlash {
            actuator: x,
            step_m: 20e-6
        },
        Term::Backlash {
            actuator: y,
            step_m: 12e-6
        },
        Term::ScaleMismatch {
            plane,
            relative: 1e-4
        },
        Term::Squareness {
            plane,
            shear_rad: 5e-5
        },
        Term::ServoMismatch {
            plane,
            delta_tau_s: 2e-4
        },
        Term::ReversalSpike {
            actuator: y,
            peak_m: 8e-6,
            decay_s: 0.02
        },
        Term::Cyclic {
            actuator: x,
            amplitude_m: 3e-6,
            pitch_m: 0.01,
            phase_rad: 1.0
        },
        Term::RadiusOffset { offset_m: 5e-6 },
    ]
}

fn corrector(joints: usize, units_per_mm: f64) -> Box<Corrector> {
    Box::new(Corrector::new(
        Settings::new(joints, "XYZABCUVW", units_per_mm).unwrap(),
    ))
}

fn input(command: [f64; JOINTS], feedback: [f64; JOINTS]) -> Input {
    Input {
        command,
        feedback,
        motor_offset: [0.0; JOINTS],
        soft: [[-1e99, 1e99]; JOINTS],
        enable: false,
        coordinated: true,
        machine_on: true,
    }
}

/// One joint: play, an average, a lag, and play behind them.
#[derive(Clone, Debug)]
struct Joint {
    driven: f64,
    last: VecDeque<f64>,
    sum: f64,
    lagged: f64,
    place: f64,
    /// Before and behind the servo.
    play: [f64; 2],
}

impl Joint {
    fn new(at: f64, tick_s: f64, play: [f64; 2]) -> Self {
        let count = (AVERAGE_S / tick_s).round() as usize;
        Self {
            last: std::iter::repeat_n(at, count).collect(),
            driven: at,
            sum: at * count as f64,
            lagged: at,
            place: at,
            play,
        }
    }

    fn tick(&mut self, command: f64, tick_s: f64) -> f64 {
        let [before, behind] = self.play.map(|play| 0.5 * play);
        self.driven = self.driven.clamp(command - before, command + before);
        let command = self.driven;
        self.last.push_back(command);
        self.sum += command - self.last.pop_front().unwrap();
        let average = self.sum / self.last.len() as f64;
        self.lagged += (average - self.lagged) * (1.0 - (-tick_s / LAG_S).exp());
        self.place = self.place.clamp(self.lagged - behind, self.lagged + behind);
        self.place
    }
}

/// A path about the origin with a feed that rises and falls within an acceleration: where it is at a time.
fn circle(radius: f64, omega: f64, turns: f64, acceleration: f64, t: f64) -> [f64; 3] {
    let feed = radius * omega;
    let (length, rise) = (std::f64::consts::TAU * radius * turns, feed / acceleration);
    let whole = length / feed + rise;
    let way = if t <= 0.0 {
        0.0
    } else if t < rise {
        0.5 * acceleration * t * t
    } else if t < whole - rise {
        feed * (t - 0.5 * rise)
    } else if t < whole {
        length - 0.5 * acceleration * (whole - t) * (whole - t)
    } else {
        length
    };
    let (sin, cos) = (way / radius).sin_cos();
    [radius * (cos - 1.0), radius * sin, 0.0]
}

/// One tick of planner's set-points through corrector and machine.
struct Loop {
    corrector: Box<Corrector>,
    joints: Vec<Joint>,
    feedback: [f64; JOINTS],
    tick_s: f64,
}

impl Loop {
    fn new(corrector: Box<Corrector>, count: usize, tick_s: f64, play: [f64; 2]) -> Self {
        Self {
            corrector,
            joints: (0..count).map(|_| Joint::new(0.0, tick_s, play)).collect(),
            feedback: [0.0; JOINTS],
            tick_s,
        }
    }

    fn tick(&mut self, input: &Input) -> Output {
        let out = self.corrector.tick(input, self.tick_s);
        for ((joint, command), measured) in self
            .joints
            .iter_mut()
            .zip(out.command)
            .zip(&mut self.feedback)
        {
            *measured = joint.tick(command, self.tick_s);
        }
        out
    }
}
