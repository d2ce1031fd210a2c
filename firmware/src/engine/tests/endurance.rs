//! Random valid programs with random stops, bypass and overruns, for as long as one likes. Each tick is looked at: nothing
//! jumps, no bound is passed, no fault has come without its cause, and each program that was not stopped ends where it was
//! planned to, to the nanometre.
//!
//! `cargo test --release -p giotto-firmware -- --ignored endurance --nocapture` makes 1e9 ticks (`GIOTTO_TICKS` and
//! `GIOTTO_SEED` change that).
use super::std;
use crate::engine::{CircleRun, Config, Engine, Fault, Output, Segment, flag};
use core::f64::consts::{PI, TAU};
use giotto_shared::model::Cumulants;
use giotto_shared::table::{Limits, Table, Travel, Zone};
use giotto_shared::term::Term;
use giotto_shared::{Direction, Plane};

/// SplitMix64.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(super) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// One in so many.
    fn once_in(&mut self, times: u64) -> bool {
        self.bits().is_multiple_of(times)
    }

    pub(super) fn point(&mut self) -> [f64; 3] {
        [0; 3].map(|_| self.within(-0.4, 0.4))
    }
}

fn table(random: &mut Random) -> Table {
    // Lag and average, or the source paper's robot.
    let (lag, average) = (random.within(0.0, 0.015), random.within(0.0, 0.04));
    let chain = [
        lag * lag + average * average / 12.0,
        6.0 * lag.powi(4) - average.powi(4) / 120.0,
    ];
    let [k2, k4] = if random.once_in(2) {
        chain
    } else {
        [46.58e-6, -5.5265e-6]
    };
    let mut terms = heapless::Vec::new();
    let plane = Plane::ALL[(random.bits() % 3) as usize];
    let [actuator, across] = plane.axes();
    let all = [
        Term::ScaleMismatch {
            plane,
            relative: 100e-6,
        },
        Term::Squareness {
            plane,
            shear_rad: -80e-6,
        },
        Term::ServoMismatch {
            plane,
            delta_tau_s: 100e-6,
        },
        Term::Backlash {
            actuator,
            step_m: 12e-6,
        },
        Term::LateralPlay {
            actuator: across,
            across: actuator,
            shift_m: 7e-6,
        },
        Term::ReversalSpike {
            actuator,
            peak_m: 8e-6,
            decay_s: 0.05,
        },
        Term::Cyclic {
            actuator: across,
            amplitude_m: 3e-6,
            pitch_m: 0.01,
            phase_rad: 0.5,
        },
        Term::Straightness {
            actuator,
            across,
            curvature_per_m: 1e-4,
        },
    ];
    for term in all {
        if random.once_in(2) {
            terms.push(term).unwrap();
        }
    }
    let zone = Zone {
        place_m: None,
        radius_m: [0.001, 2.0],
        feed_m_s: [0.001, 5.0],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: k2 as f32,
            kappa4_s4: k4 as f32,
        },
        terms,
    };
    Table {
        machine: heapless::String::new(),
        zones: [zone].into_iter().collect(),
        limits: Limits {
            offset_m: 0.02,
            slew_m_s: 0.2,
        },
        arm: None,
    }
}

pub(super) fn segment(random: &mut Random, from_m: [f64; 3]) -> Segment {
    let feed_m_s = random.within(0.01, 0.9);
    match random.bits() % 4 {
        0 => Segment::Line {
            to_m: random.point(),
            feed_m_s,
        },
        1 => Segment::Dwell {
            time_s: random.within(0.001, 0.2),
        },
        _ => {
            let radius = random.within(0.01, 0.2);
            let angle = random.within(0.0, TAU);
            let centre_m = [
                from_m[0] + radius * angle.cos(),
                from_m[1] + radius * angle.sin(),
                from_m[2],
            ];
            let tilt = if random.once_in(2) {
                random.within(-0.5, 0.5)
            } else {
                0.0
            };
            // Across the arm, so that the radius stays what it was meant to be.
            let normal = [-tilt * angle.sin(), tilt * angle.cos(), 1.0];
            let rise_m = if random.once_in(3) {
                random.within(-0.05, 0.05)
            } else {
                0.0
            };
            Segment::Arc {
                centre_m,
                normal,
                sweep_rad: random.within(-2.0 * TAU, 2.0 * TAU),
                rise_m,
                feed_m_s,
            }
        }
    }
}

#[derive(Default, Debug)]
struct Tally {
    ticks: u64,
    programs: u64,
    refused: u64,
    exact: u64,
    stopped: u64,
    overruns: u64,
    cuts: u64,
}

fn endure(ticks: u64, seed: u64) -> Tally {
    let mut random = Random(seed);
    let mut tally = Tally::default();
    while tally.ticks < ticks {
        let config = Config::robot([250, 1000, 4000, 8000][(random.bits() % 4) as usize]);
        let mut engine = Engine::new(config).unwrap();
        for _ in 0..200 {
            if tally.ticks >= ticks {
                break;
            }
            if random.once_in(10) {
                engine.load(Some(&table(&mut random))).unwrap();
            }
            program(&mut random, &mut engine, &config, &mut tally);
        }
    }
    tally
}

/// One program from rest to rest.
fn program(random: &mut Random, engine: &mut Engine, config: &Config, tally: &mut Tally) {
    let from_m = engine.executor.rest_nm().map(|nm| f64::from(nm) * 1e-9);
    let accepted = if random.once_in(3) {
        let direction = if random.once_in(2) {
            Direction::Ccw
        } else {
            Direction::Cw
        };
        let radius_m = random.within(0.02, 0.3);
        // Within what the acceleration allows, so that the check below holds.
        let feed_m_s = random.within(0.01, 0.9f64.min((3.0 * radius_m).sqrt()));
        let (laps, start_rad) = (1 + (random.bits() % 2) as u32, random.within(-PI, PI));
        engine.run_circle(&CircleRun {
            centre_m: random.point(),
            radius_m,
            feed_m_s,
            plane: Plane::ALL[(random.bits() % 3) as usize],
            direction,
            laps,
            start_rad,
        })
    } else {
        let first = engine.push(&segment(random, from_m));
        if first.is_ok() && random.once_in(2) {
            let _ = engine.push(&Segment::Line {
                to_m: random.point(),
                feed_m_s: random.within(0.05, 0.9),
            });
        }
        first
    };
    tally.programs += 1;
    tally.refused += u64::from(accepted.is_err());
    let planned_nm = engine.planner.position_nm();
    let (mut disturbed, mut overrun) = (false, false);
    let cuts_before = engine.counters().offset_cuts + engine.counters().slew_cuts;
    let (bypass_at, stop_at) = (random.bits() % 4000, random.bits() % 4000);
    let disturb = random.once_in(3);
    let mut before: Option<Output> = None;
    let most_nm = 1.25 * config.tick_s() * 1e9 + 100.0;
    let mut n = 0;
    while !engine.idle() {
        if disturb && n == stop_at {
            (disturbed, overrun) = (true, random.once_in(2));
            if overrun {
                engine.overrun()
            } else {
                engine.stop()
            }
        }
        if disturb && n == bypass_at {
            engine.set_bypass(!engine.bypass());
        }
        let out = engine.tick();
        for axis in 0..3 {
            let offset = i64::from(out.corrected_nm[axis]) - i64::from(out.nominal_nm[axis]);
            assert!(offset.abs() <= 20_000_000, "{out:?}");
            if let Some(before) = &before {
                let step = f64::from(out.corrected_nm[axis] - before.corrected_nm[axis]);
                assert!(step.abs() <= most_nm, "{step} nm: {before:?} {out:?}");
            }
        }
        let cause = overrun.then_some(Fault::Overrun);
        assert_eq!(
            engine.fault(),
            cause,
            "a fault without its cause at tick {}",
            tally.ticks
        );
        before = Some(out);
        n += 1;
        tally.ticks += 1;
    }
    tally.cuts +=
        u64::from(engine.counters().offset_cuts + engine.counters().slew_cuts - cuts_before);
    if disturbed {
        tally.stopped += u64::from(!overrun);
        tally.overruns += u64::from(overrun);
        assert!(engine.clear_fault());
    } else {
        assert_eq!(
            engine.executor.rest_nm(),
            planned_nm,
            "the phase at the end is that of the plan"
        );
        tally.exact += 1;
    }
    assert!(before.is_none_or(|o| o.flags & flag::CRUISE == 0));
}

fn wanted(name: &str, otherwise: u64) -> u64 {
    std::env::var(name)
        .ok()
        .and_then(|value| value.parse().ok())
        .unwrap_or(otherwise)
}

#[test]
fn endurance_in_short() {
    let tally = endure(1_000_000, 1);
    std::println!("seed 1: {tally:?}");
    assert!(
        tally.exact > 100 && tally.stopped > 10 && tally.overruns > 10,
        "{tally:?}"
    );
}

#[test]
#[ignore = "minutes"]
fn endurance() {
    let (ticks, seed) = (
        wanted("GIOTTO_TICKS", 1_000_000_000),
        wanted("GIOTTO_SEED", 1),
    );
    let tally = endure(ticks, seed);
    std::println!("seed {seed}: {tally:?}");
    assert!(tally.ticks >= ticks && tally.exact > 0);
}
