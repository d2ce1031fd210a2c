//! The ticks whose instructions `giotto-hil ticks` counts, ready to be called one by one.
//!
//! Counted is the call alone, inputs prepared before it. All arcs lie in a tilted plane ("in space"); the
//! first tick with [`flag::MOVING`](super::flag::MOVING) begins what counts, ticks without it (rest, settling) do not.
use super::planner::Planner;
use super::{Config, Executor, Output, Planned, Stream, StreamSample};
use giotto_shared::kinematics::{IRB1600, Kinematics, PAPER_CENTRE_M};
use giotto_shared::model::Cumulants;
use giotto_shared::path::{Segment, smoothstep};
use giotto_shared::table::{Arm, Limits, Table, Travel, Zone};
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Plane};

const TICK_S: f64 = 1e-3;
/// As on the images.
const PLACES: usize = crate::control::STREAM_PLACES;
const CENTRE_M: [f64; 3] = [0.1, -0.2, 0.3];
const RADIUS_M: f64 = 0.1;
const FEED_M_S: f64 = 0.5;
/// The source paper's robot.
const CUMULANTS: Cumulants<f32> = Cumulants {
    kappa2_s2: 46.58e-6,
    kappa4_s4: -5.5265e-6,
};

/// Eight profile terms such as a diagnosis finds: all that is linear, play and reversal pulses of two slides, a periodic error.
pub const TERMS: [Term<f32>; 8] = [
    Term::Squareness {
        plane: Plane::Zx,
        shear_rad: 80e-6,
    },
    Term::ServoMismatch {
        plane: Plane::Xy,
        delta_tau_s: 100e-6,
    },
    Term::BandwidthMismatch {
        plane: Plane::Yz,
        delta_kappa2_s2: 5e-6,
    },
    Term::Backlash {
        actuator: Actuator::X,
        step_m: 10e-6,
    },
    Term::Backlash {
        actuator: Actuator::Z,
        step_m: 12e-6,
    },
    spike(Actuator::X, 8e-6),
    spike(Actuator::Z, 6e-6),
    cyclic(Actuator::Z, 2e-6),
];

/// The dearest eight for a tick: periodic errors and pulses of all slides, a bow, and one that goes with the rate.
pub const DEAREST: [Term<f32>; 8] = [
    Term::ServoMismatch {
        plane: Plane::Zx,
        delta_tau_s: 100e-6,
    },
    Term::Straightness {
        actuator: Actuator::X,
        across: Actuator::Z,
        curvature_per_m: 1e-4,
    },
    spike(Actuator::X, 8e-6),
    spike(Actuator::Y, 6e-6),
    spike(Actuator::Z, 4e-6),
    cyclic(Actuator::X, 2e-6),
    cyclic(Actuator::Y, 1e-6),
    cyclic(Actuator::Z, 1e-6),
];

const fn spike(actuator: Actuator, peak_m: f32) -> Term<f32> {
    Term::ReversalSpike {
        actuator,
        peak_m,
        decay_s: 0.05,
    }
}

const fn cyclic(actuator: Actuator, amplitude_m: f32) -> Term<f32> {
    Term::Cyclic {
        actuator,
        amplitude_m,
        pitch_m: 0.01,
        phase_rad: 0.5,
    }
}

fn table(terms: &[Term<f32>]) -> Table {
    let terms = terms.iter().copied().collect();
    let zone = Zone {
        place_m: None,
        radius_m: [0.001, 1.0],
        feed_m_s: [0.001, 2.0],
        travel: Travel::Both,
        cumulants: CUMULANTS,
        terms,
    };
    let limits = Limits {
        offset_m: 0.02,
        slew_m_s: 0.2,
    };
    Table {
        machine: heapless::String::new(),
        zones: [zone].into_iter().collect(),
        limits,
        arm: None,
    }
}

/// Terms of an arm, dear ones: two lags, play and pulses that turn at once, gears, a length.
pub const OF_JOINTS: [Term<f32>; 8] = [
    Term::JointLag {
        actuator: Actuator::Joint2,
        delta_tau_s: 1e-3,
        delta_kappa2_s2: 1e-5,
    },
    Term::JointBacklash {
        actuator: Actuator::Joint1,
        play_rad: 2e-5,
        loop_s: 0.007,
    },
    Term::JointReversal {
        actuator: Actuator::Joint1,
        peak_rad: 1e-5,
        decay_s: 0.05,
        rise_s: 0.002,
        presliding_rad: 1e-5,
    },
    Term::JointBacklash {
        actuator: Actuator::Joint3,
        play_rad: 2e-5,
        loop_s: 0.007,
    },
    gear(Actuator::Joint1),
    gear(Actuator::Joint2),
    gear(Actuator::Joint3),
    Term::LinkLength {
        actuator: Actuator::Joint2,
        longer_m: 1e-4,
    },
];

const fn gear(actuator: Actuator) -> Term<f32> {
    Term::JointCyclic {
        actuator,
        amplitude_rad: 1e-5,
        waves: 50.0,
        phase_rad: 0.5,
    }
}

/// Where the arc of [`Arc`] starts, and its plan.
pub(crate) fn planned(terms: &[Term<f32>], rise_m: f64) -> ([i32; 3], Option<Planned>) {
    plan(CENTRE_M, &table(terms), rise_m)
}

fn plan(centre_m: [f64; 3], table: &Table, rise_m: f64) -> ([i32; 3], Option<Planned>) {
    let config = Config::robot(1000);
    let normal = [0.0, 0.5, 1.0];
    // cos and sin of −0.3 rad along two vectors of the plane: X, and the normal crossed with it.
    let (cos, sin, length) = (0.955_336_5, -0.295_520_2, 1.118_034);
    let arm = [cos, sin * normal[2] / length, -sin * normal[1] / length];
    let mut start = [0; 3];
    for ((nm, centre), arm) in start.iter_mut().zip(centre_m).zip(arm) {
        *nm = ((centre + RADIUS_M * arm) * 1e9) as i32;
    }
    let mut planner = Planner::new(&config, start);
    let arc = Segment::Arc {
        centre_m,
        normal,
        sweep_rad: 3.0 * core::f64::consts::PI,
        rise_m,
        feed_m_s: FEED_M_S,
    };
    let mut planned = Planned::default();
    let done = planner.set_table(Some(table)).is_ok()
        && arc
            .exact(start)
            .is_ok_and(|exact| planner.segment(&exact, &mut planned).is_ok());
    (start, done.then_some(planned))
}

/// A planned arc and the executor that runs it (first, where one load reaches two of its words).
#[repr(C)]
pub struct Arc {
    executor: Executor,
    queue: heapless::spsc::Queue<Planned, 2>,
}

impl Arc {
    /// One and a half turns with the β model and these terms. Each axis reverses at constant feed, and X
    /// in the rising ramp too. With a rise (m) it is a helix.
    pub fn new(terms: &[Term<f32>], rise_m: f64) -> Self {
        Self::of(planned(terms, rise_m))
    }

    /// The same on a six-joint arm with errors of its joints.
    pub fn of_arm() -> Self {
        let mut table = table(&OF_JOINTS);
        table.arm = Some(Arm {
            kinematics: Kinematics::Opw(IRB1600).map(|value| value as f32),
            home_m: Some(PAPER_CENTRE_M.map(|m| m as f32)),
        });
        Self::of(plan(PAPER_CENTRE_M, &table, 0.0))
    }

    fn of((start, planned): ([i32; 3], Option<Planned>)) -> Self {
        let mut queue = heapless::spsc::Queue::new();
        // Whether there is one is looked at in `sound`; the queue is empty.
        if let Some(planned) = planned {
            let _ = queue.enqueue(planned);
        }
        Self {
            executor: Executor::new(start, Config::robot(1000).engage_ticks(), false),
            queue,
        }
    }

    /// What is counted.
    #[inline(never)]
    pub fn tick(&mut self) -> Output {
        self.executor.tick(&mut self.queue)
    }

    /// Nothing is left to count.
    pub fn done(&self) -> bool {
        self.executor.idle() && self.queue.is_empty()
    }

    /// The arc was planned and every tick stayed within its bounds.
    pub fn sound(&self) -> bool {
        let c = self.executor.counters();
        c.segments == 1 && c.uncorrected == 0 && c.offset_cuts == 0 && c.slew_cuts == 0
    }
}

/// A streamed circle.
pub struct Streamed {
    stream: Stream<PLACES>,
    sequence: u16,
}

impl Streamed {
    /// At rest at the start; `None` if the configuration were wrong.
    pub fn new() -> Option<Self> {
        let mut planner = Planner::new(&Config::robot(1000), position(0));
        planner.set_table(Some(&table(&[]))).ok()?;
        let plan = planner.stream(1.0, PLACES).ok()?;
        Some(Self {
            stream: Stream::new(&plan, position(0), 0, false),
            sequence: 0,
        })
    }

    /// The next set-point; not counted.
    pub fn sample(&mut self) -> StreamSample {
        let sample = StreamSample {
            sequence: self.sequence,
            position_nm: position(self.sequence),
        };
        self.sequence = self.sequence.wrapping_add(1);
        sample
    }

    /// What is counted.
    #[inline(never)]
    pub fn tick(&mut self, sample: Option<StreamSample>) -> Output {
        self.stream.tick(sample)
    }

    /// Every set-point was taken and every tick stayed within its bounds.
    pub fn sound(&self) -> bool {
        let c = self.stream.counters();
        c.missing == 0 && c.rejected == 0 && c.bounds.offset_cuts == 0 && c.bounds.slew_cuts == 0
    }
}

/// Set-point `n` of a circle that starts smoothly, nm.
fn position(n: u16) -> [i32; 3] {
    let (t, start) = (f64::from(n) * TICK_S, 0.3);
    let angle =
        FEED_M_S / RADIUS_M * (start * smoothstep(t / start).integral + (t - start).max(0.0));
    let (s, c) = libm::sincos(angle);
    [
        CENTRE_M[0] + RADIUS_M * c,
        CENTRE_M[1] + RADIUS_M * s,
        CENTRE_M[2],
    ]
    .map(|m| (m * 1e9) as i32)
}

/// How a plain tick turns.
pub trait Turning: Default {
    /// Goes on by an angle, rad.
    fn advance(&mut self, by_rad: f32);

    /// (1, 0) and (`re`, `im`) turned by the angle so far, in the plane.
    fn turned(&self, re: f32, im: f32) -> [[f32; 2]; 2];
}

/// Angle in `f32`, `libm::sincosf`.
#[derive(Default)]
pub struct Libm {
    theta: f32,
}

impl Turning for Libm {
    fn advance(&mut self, by_rad: f32) {
        self.theta += by_rad;
    }

    fn turned(&self, re: f32, im: f32) -> [[f32; 2]; 2] {
        let (sin, cos) = libm::sincosf(self.theta);
        [[cos, sin], [re * cos - im * sin, re * sin + im * cos]]
    }
}

/// The same arc tick as one would write it down: `f32`, formulas as they stand.
#[derive(Default)]
pub struct Plain<T> {
    tick: u32,
    turning: T,
}

impl<T: Turning> Plain<T> {
    /// What is counted, from the beginning of a ramp of 400 ticks on.
    #[inline(never)]
    pub fn tick(&mut self) -> Output {
        const RAMP_S: f32 = 0.4;
        let dt = TICK_S as f32;
        self.tick = self.tick.wrapping_add(1);
        let u = self.tick as f32 * dt / RAMP_S;
        let s = smoothstep(u);
        let full = (FEED_M_S / RADIUS_M) as f32;
        let (w, a) = (full * s.value, full * s.first / RAMP_S);
        let (j, n) = (
            full * s.second / (RAMP_S * RAMP_S),
            full * s.third / (RAMP_S * RAMP_S * RAMP_S),
        );
        self.turning.advance(w * dt);
        let (k2, k4) = (CUMULANTS.kappa2_s2, CUMULANTS.kappa4_s4);
        let fourth = k2 * k2 / 8.0 - k4 / 24.0;
        let re = 1.0 + 0.5 * k2 * w * w + fourth * (w * w * w * w - 4.0 * w * j - 3.0 * a * a);
        let im = -0.5 * k2 * a + fourth * (n - 6.0 * w * w * a);
        let r = RADIUS_M as f32;
        // A plane tilted as that of `Arc`.
        let (up, along) = (0.447_213_6_f32, 0.894_427_2_f32);
        let nm = |[c, s]: [f32; 2]| {
            let mut out = [0; 3];
            for ((o, p), centre) in out
                .iter_mut()
                .zip([r * c, r * s * along, -r * s * up])
                .zip(CENTRE_M)
            {
                *o = ((p + centre as f32) * 1e9) as i32;
            }
            out
        };
        let [nominal, corrected] = self.turning.turned(re, im);
        Output {
            nominal_nm: nm(nominal),
            corrected_nm: nm(corrected),
            flags: 0,
        }
    }
}
