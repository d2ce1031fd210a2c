//! Set-points of an arm against joints in the time domain: each lags, plays and waves by itself and knows nothing of the engine.
use super::*;
use core::f64::consts::TAU;
use giotto_shared::circle;
use giotto_shared::kinematics::{IRB1600, Kinematics, PAPER_CENTRE_M as CENTRE};
use giotto_shared::table::Arm;
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Plane};

const KV: f64 = 50.0;

fn irb1600() -> Kinematics<f64> {
    Kinematics::Opw(IRB1600)
}

/// What is wrong with the simulated arm.
#[derive(Clone, Copy, Default)]
struct Wrong {
    lag_s: [f64; 6],
    zero_rad: [f64; 6],
    /// Amplitude and waves.
    gear: [[f64; 2]; 6],
    longer_m: [f64; 6],
}

/// Places of the tool for commanded places.
fn tool(wrong: &Wrong, commands: &[[f64; 3]], tick_s: f64) -> Vec<[f64; 3]> {
    let (arm, actual) = (irb1600(), irb1600().with_links(&wrong.longer_m));
    let mut followers: Option<[f64; 6]> = None;
    let follow = |command: &[f64; 3]| {
        let q = arm.angles(*command).unwrap();
        let state = followers.get_or_insert(q);
        let mut out = [0.0; 6];
        for joint in 0..6 {
            let way = q[joint] - state[joint];
            // The drive goes on where the closed form begins a new turn.
            let way = way - TAU * (way / TAU).round();
            let tau = 1.0 / KV + wrong.lag_s[joint];
            state[joint] += way * (1.0 - (-tick_s / tau).exp());
            let [amplitude, waves] = wrong.gear[joint];
            out[joint] =
                state[joint] + wrong.zero_rad[joint] + amplitude * (waves * state[joint]).sin();
        }
        actual.place(&out)
    };
    commands.iter().map(follow).collect()
}

fn arm_table(terms: &[Term<f32>]) -> Table {
    // κ2 and κ4 of a lag.
    let tau = 1.0 / KV;
    let mut table = table((tau * tau) as f32, (6.0 * tau.powi(4)) as f32);
    table.zones[0].terms = terms.iter().copied().collect();
    table.arm = Some(Arm {
        kinematics: irb1600().map(|v| v as f32),
        home_m: Some(CENTRE.map(|v| v as f32)),
    });
    table
}

fn engine(rate_hz: u32, table: Option<&Table>) -> Engine {
    let mut config = Config::robot(rate_hz);
    config.motion.acceleration_m_s2 = 8.0;
    (config.offset_m, config.slew_m_s) = (0.05, [1.0; 3]);
    let mut engine = Engine::new(config).unwrap();
    engine.load(table).unwrap();
    engine
        .set_position(CENTRE.map(|m| (m * 1e9) as i32))
        .unwrap();
    engine
}

/// A lap takes so many seconds.
fn run(radius_m: f64, lap_s: f64, plane: Plane, direction: Direction) -> CircleRun {
    CircleRun {
        centre_m: CENTRE,
        radius_m,
        feed_m_s: TAU * radius_m / lap_s,
        plane,
        direction,
        laps: 2,
        start_rad: 0.0,
    }
}

/// Out-of-roundness and radius error of the last whole lap, m.
fn measured(wrong: &Wrong, out: &[Output], run: &CircleRun, tick_s: f64) -> [f64; 2] {
    let commands: Vec<_> = out
        .iter()
        .map(|o| o.corrected_nm.map(|nm| f64::from(nm) * 1e-9))
        .collect();
    let places = tool(wrong, &commands, tick_s);
    let last = out
        .iter()
        .rposition(|o| o.flags & flag::CRUISE != 0)
        .unwrap();
    let lap = (TAU * run.radius_m / run.feed_m_s / tick_s).round() as usize;
    let [first, second] = run.plane.axes().map(Actuator::index);
    let lap: Vec<[f64; 2]> = places[last - lap..last]
        .iter()
        .map(|p| [p[first], p[second]])
        .collect();
    let fit = circle::fit(lap.as_slice()).unwrap().circle;
    let [cx, cy] = fit.centre;
    let radii = lap.iter().map(|p| (p[0] - cx).hypot(p[1] - cy));
    let (low, high) = radii.fold((f64::MAX, f64::MIN), |(low, high), r| {
        (r.min(low), r.max(high))
    });
    [0.5 * (high - low), fit.radius - run.radius_m]
}

/// Machines with the table that knows what is wrong with them.
fn machines() -> [(&'static str, Wrong, Vec<Term<f32>>); 5] {
    let [_, shoulder, elbow, ..] = Actuator::JOINTS;
    let by = |joint: Actuator, value: f64| {
        let mut all = [0.0; 6];
        all[joint.index()] = value;
        all
    };
    let good = Wrong::default();
    let mut gear = good;
    gear.gear[1] = [1e-4, 100.0];
    [
        ("none", good, [].to_vec()),
        (
            "lag",
            Wrong {
                lag_s: by(shoulder, 2e-3),
                ..good
            },
            [Term::JointLag {
                actuator: shoulder,
                delta_tau_s: 2e-3,
                delta_kappa2_s2: 8e-5,
            }]
            .to_vec(),
        ),
        (
            "zero",
            Wrong {
                zero_rad: by(elbow, 1e-3),
                ..good
            },
            [Term::JointZero {
                actuator: elbow,
                offset_rad: 1e-3,
            }]
            .to_vec(),
        ),
        (
            "length",
            Wrong {
                longer_m: by(shoulder, 1e-3),
                ..good
            },
            [Term::LinkLength {
                actuator: shoulder,
                longer_m: 1e-3,
            }]
            .to_vec(),
        ),
        (
            "gear",
            gear,
            [Term::JointCyclic {
                actuator: shoulder,
                amplitude_rad: 1e-4,
                waves: 100.0,
                phase_rad: 0.0,
            }]
            .to_vec(),
        ),
    ]
}

#[test]
fn circles_of_an_arm_become_round() {
    for rate_hz in [1000, 4000] {
        for (name, wrong, terms) in machines() {
            for (plane, direction, lap_s) in [
                (Plane::Xy, Direction::Ccw, 1.5),
                (Plane::Zx, Direction::Cw, 3.0),
            ] {
                let run = run(0.1, lap_s, plane, direction);
                let tick_s = 1.0 / f64::from(rate_hz);
                let of = |table: Option<&Table>| {
                    let mut engine = engine(rate_hz, table);
                    engine.run_circle(&run).unwrap();
                    let out = run_out(&mut engine);
                    assert_eq!(
                        engine.counters().slew_cuts + engine.counters().offset_cuts,
                        0
                    );
                    measured(&wrong, &out, &run, tick_s)
                };
                let ([round, size], [round_after, size_after]) =
                    (of(None), of(Some(&arm_table(&terms))));
                std::println!(
                    "{rate_hz} Hz {name} {plane} {lap_s} s: {:.1} {:.1} -> {:.2} {:.2} um",
                    round * 1e6,
                    size * 1e6,
                    round_after * 1e6,
                    size_after * 1e6
                );
                assert!(round_after < 0.12 * round + 1e-6, "{name} {plane}");
                assert!(
                    size_after.abs() < 0.02 * size.abs() + 1e-6,
                    "{name} {plane}"
                );
            }
        }
    }
}

/// Another table, none, one without an arm: the offset goes from one law to the other.
#[test]
fn laws_are_exchanged_without_a_step() {
    let (_, _, terms) = machines()[2].clone();
    let mut engine = engine(1000, Some(&arm_table(&terms)));
    let mut out = Vec::new();
    let play = Term::JointBacklash {
        actuator: Actuator::Joint1,
        play_rad: 5e-5,
        loop_s: 0.0,
    };
    let tables = [
        Some(arm_table(&[play])),
        None,
        Some(table(4e-4, 0.0)),
        Some(arm_table(&terms)),
    ];
    for table in tables {
        engine
            .run_circle(&run(0.05, 3.0, Plane::Xy, Direction::Ccw))
            .unwrap();
        out.extend(run_out(&mut engine));
        for _ in 0..50 {
            out.push(engine.tick());
        }
        engine.load(table.as_ref()).unwrap();
    }
    let offsets: Vec<_> = out
        .iter()
        .map(|o| [0, 1, 2].map(|k| o.corrected_nm[k] - o.nominal_nm[k]))
        .collect();
    // Play of 50 um taken up in 8 ms and ramps of the feed bend it by a few micrometres from tick to tick; a law that came or went at
    // once would by the tens that zeros and play hold at rest.
    let bends = offsets
        .windows(3)
        .flat_map(|w| [0, 1, 2].map(|k| (w[0][k] + w[2][k] - 2 * w[1][k]).abs()));
    let most = bends.max();
    assert!(most.is_some_and(|nm| nm < 9_000), "{most:?}");
    assert!(offsets.iter().any(|o| o[0].abs() > 20_000));
}

/// A circle that the arm cannot follow is not corrected, and said so.
#[test]
fn a_place_out_of_reach_is_not_corrected() {
    let mut engine = engine(1000, Some(&arm_table(&[])));
    let far = CircleRun {
        centre_m: [1.5, 0.0, 0.6],
        ..run(0.1, 6.0, Plane::Xy, Direction::Ccw)
    };
    engine.run_circle(&far).unwrap();
    let out = run_out(&mut engine);
    assert!(engine.counters().uncorrected > 0);
    assert!(out.iter().all(|o| o.corrected_nm == o.nominal_nm));
}

/// A circle's programmed set-points, and the stream of an arm after all of them.
fn streamed(terms: &[Term<f32>], run: &CircleRun) -> (Vec<Output>, Stream<PLACES>, Vec<Output>) {
    let mut plain = engine(1000, None);
    plain.run_circle(run).unwrap();
    let programmed = run_out(&mut plain);
    let start_nm = programmed[0].nominal_nm;
    let mut planner = Planner::new(&Config::robot(1000), start_nm);
    let mut table = arm_table(terms);
    (table.limits.offset_m, table.limits.slew_m_s) = (4e-3, 0.09);
    planner.set_table(Some(&table)).unwrap();
    let plan = planner.stream(0.5, PLACES).unwrap();
    let mut stream = Stream::new(&plan, start_nm, 0, false);
    let late = plan.latency() as usize;
    let out = (0..programmed.len()).map(|sequence| {
        let mut got = stream.tick(Some(StreamSample {
            sequence: sequence as u16,
            position_nm: programmed[sequence].nominal_nm,
        }));
        let then = sequence.checked_sub(late);
        got.flags = then.map_or(0, |then| programmed[then].flags);
        got
    });
    let out = out.collect();
    (programmed, stream, out)
}

/// Set-points of a stream go the same way.
#[test]
fn a_stream_of_an_arm_becomes_round() {
    let (_, wrong, terms) = machines()[1].clone();
    let run = run(0.1, 1.5, Plane::Xy, Direction::Ccw);
    let (programmed, _, out) = streamed(&terms, &run);
    let [round, _] = measured(&wrong, &programmed, &run, 1e-3);
    let [round_after, size] = measured(&wrong, &out, &run, 1e-3);
    std::println!("stream {round:e} -> {round_after:e} {size:e}");
    assert!(
        round_after < 0.1 * round && size.abs() < 2e-6,
        "{round_after} {size}"
    );
}

/// Zeros and play hold an offset at rest. What comes after a stream knows nothing of it: it goes before the stream is over, whether its
/// sender ends it or falls silent, and not at once.
#[test]
fn where_a_stream_of_an_arm_ends_nothing_is_left_of_it() {
    let play = Term::JointBacklash {
        actuator: Actuator::Joint1,
        play_rad: 5e-5,
        loop_s: 0.0,
    };
    let zero = Term::JointZero {
        actuator: Actuator::Joint3,
        offset_rad: 1e-3,
    };
    let run = run(0.1, 1.5, Plane::Xy, Direction::Ccw);
    for silent in [false, true] {
        let (programmed, mut stream, mut out) = streamed(&[play, zero], &run);
        // At rest for as long as the filter needs.
        for tick in 0..100 {
            out.push(stream.tick(Some(StreamSample {
                sequence: (programmed.len() + tick) as u16,
                position_nm: programmed[programmed.len() - 1].nominal_nm,
            })));
        }
        let offset = |o: &Output| [0, 1, 2].map(|k| o.corrected_nm[k] - o.nominal_nm[k]);
        let held = out.last().map(offset).unwrap();
        assert!(held.iter().any(|nm| nm.abs() > 20_000), "{held:?}");
        if !silent {
            stream.finish();
        }
        let first = out.len() - 1;
        while !stream.over() {
            out.push(stream.tick(None));
        }
        let offsets: Vec<_> = out[first..].iter().map(offset).collect();
        assert_eq!(offsets.last(), Some(&[0; 3]), "silent: {silent}");
        let steps = offsets
            .windows(2)
            .flat_map(|w| [0, 1, 2].map(|k| w[1][k] - w[0][k]));
        let most = steps.map(i32::abs).max().unwrap();
        assert!(most < 2_000, "{most} nm in a tick, silent: {silent}");
    }
}
