//! The time domain against the closed forms of the field: Eq. 12 and 13, cumulants, and the profile of every
//! element by sign, size and parity.
use super::machine::{AccDec, Cyclic, Friction, PositionLoop, SecondOrder, Vibration};
use super::{CircleTest, Machine, Trace, circle};
use giotto_shared::Direction::{self, Ccw, Cw};
use std::f64::consts::{PI, TAU};

const TENTH_UM: f64 = 1e-7;

fn run(machine: &Machine, radius: f64, feed: f64, direction: Direction) -> Trace {
    circle(machine, &CircleTest::new(radius, feed, direction))
}

fn loops(kv_per_s: f64, feed_forward: f64) -> Machine {
    Machine {
        servo: [PositionLoop {
            kv_per_s,
            feed_forward,
        }; 3],
        ..Machine::default()
    }
}

fn grid() -> impl Iterator<Item = (f64, f64)> {
    let feeds = [0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.7];
    [0.1, 0.15, 0.3]
        .into_iter()
        .flat_map(move |r| feeds.into_iter().map(move |f| (r, f)))
}

/// Largest departure of every sample of every circle from `law(R, f)`.
fn worst(machine: &Machine, law: impl Fn(f64, f64) -> f64) -> f64 {
    let mut worst: f64 = 0.0;
    for (r, f) in grid() {
        for d in [Ccw, Cw] {
            for deviation in run(machine, r, f, d).deviation_m {
                worst = worst.max((deviation - law(r, f)).abs());
            }
        }
    }
    worst
}

/// |G| of the chain at ω from its transfer function: the oracle for linear elements.
fn gain(machine: &Machine, omega: f64) -> f64 {
    let mut squared = match machine.acc_dec {
        AccDec::None => 1.0,
        AccDec::Exponential(t) => 1.0 / (1.0 + (omega * t).powi(2)),
        AccDec::MovingAverage(t) => ((omega * t / 2.0).sin() / (omega * t / 2.0)).powi(2),
    };
    let servo = machine.servo[0];
    let x = (omega / servo.kv_per_s).powi(2);
    squared *= (1.0 + servo.feed_forward.powi(2) * x) / (1.0 + x);
    if let Some(m) = machine.mechanics[0] {
        let u = omega / m.omega_n_rad_s;
        squared /= (1.0 - u * u).powi(2) + (2.0 * m.zeta * u).powi(2);
    }
    squared.sqrt()
}

#[test]
fn linear_chain_is_its_transfer_function() {
    let m = Machine {
        acc_dec: AccDec::MovingAverage(0.04),
        mechanics: [Some(SecondOrder {
            omega_n_rad_s: 38.0,
            zeta: 0.72,
        }); 3],
        dead_time_s: [0.012; 3],
        ..loops(50.0, 0.4)
    };
    let error = worst(&m, |r, f| r * (gain(&m, f / r) - 1.0));
    assert!(error < 1e-9, "{error:e}");
    let m = Machine {
        acc_dec: AccDec::Exponential(0.03),
        ..loops(50.0, 0.0)
    };
    let error = worst(&m, |r, f| r * (gain(&m, f / r) - 1.0));
    assert!(error < 1e-9, "{error:e}");
}

/// Eq. 12 and 13 are first terms in ω²; kv and T are such that the next one stays below 0.1 µm at ω = 7 rad/s.
#[test]
fn eq_12_and_13() {
    let (kv, t) = (300.0, 0.004);
    let both = Machine {
        acc_dec: AccDec::Exponential(t),
        ..loops(kv, 0.0)
    };
    let error = worst(&both, |r, f| -0.5 * (t * t + 1.0 / (kv * kv)) * f * f / r);
    assert!(error < TENTH_UM, "{error:e}");
    let cumulants = worst(&both, |r, f| {
        let (k2, k4) = (t * t + kv.powi(-2), 6.0 * (t.powi(4) + kv.powi(-4)));
        r * ((-k2 / 2.0 * (f / r).powi(2) + k4 / 24.0 * (f / r).powi(4)).exp() - 1.0)
    });
    assert!(cumulants < TENTH_UM, "{cumulants:e}");
    for a in [0.0, 0.5, 0.9] {
        let error = worst(&loops(kv, a), |r, f| {
            -0.5 * (1.0 - a * a) / (kv * kv) * f * f / r
        });
        assert!(error < TENTH_UM, "{a}: {error:e}");
    }
}

/// Every row of the table of cumulants, to 0.1 µm over R 100–300 mm and f 20–700 mm/s.
#[test]
fn cumulants_of_every_element() {
    let (t, kv, a): (f64, f64, f64) = (0.04, 60.0, 0.5);
    let (wn, z): (f64, f64) = (70.0, 0.6);
    let rows = [
        (loops(kv, 0.0), kv.powi(-2), 6.0 * kv.powi(-4)),
        (
            Machine {
                acc_dec: AccDec::Exponential(1.0 / kv),
                ..Machine::default()
            },
            kv.powi(-2),
            6.0 * kv.powi(-4),
        ),
        (
            loops(kv, a),
            (1.0 - a * a) * kv.powi(-2),
            6.0 * (1.0 - a.powi(4)) * kv.powi(-4),
        ),
        (
            Machine {
                acc_dec: AccDec::MovingAverage(t),
                ..Machine::default()
            },
            t * t / 12.0,
            -t.powi(4) / 120.0,
        ),
        (
            Machine {
                mechanics: [Some(SecondOrder {
                    omega_n_rad_s: wn,
                    zeta: z,
                }); 3],
                ..Machine::default()
            },
            -2.0 * (1.0 - 2.0 * z * z) / (wn * wn),
            12.0 * (8.0 * z.powi(4) - 8.0 * z * z + 1.0) / wn.powi(4),
        ),
        (
            Machine {
                dead_time_s: [0.05; 3],
                ..Machine::default()
            },
            0.0,
            0.0,
        ),
    ];
    for (machine, k2, k4) in rows {
        let error = worst(&machine, |r, f| {
            let w2 = (f / r).powi(2);
            r * ((-k2 * w2 / 2.0 + k4 * w2 * w2 / 24.0).exp() - 1.0)
        });
        assert!(error < TENTH_UM, "{machine:?}: {error:e}");
    }
}

/// Chords: scallops between 0 and −f²Δt²/(8R), mean −f²Δt²/(12R), so κ2 = Δt²/6.
#[test]
fn chords_lie_inside() {
    let dt = 0.012;
    let machine = Machine {
        interpolation_s: Some(dt),
        ..Machine::default()
    };
    for (r, f) in grid().filter(|(_, f)| *f >= 0.1) {
        let trace = run(&machine, r, f, Ccw);
        let step = (f * dt).powi(2) / r;
        let deepest = trace.deviation_m.iter().copied().fold(0.0, f64::min);
        assert!((trace.mean_deviation_m() + step / 12.0).abs() < 0.01 * step / 12.0 + 1e-9);
        assert!(
            deepest >= -step / 8.0 * 1.001 && deepest < -step / 8.0 * 0.98,
            "{deepest:e} {step:e}"
        );
        assert!(trace.deviation_m.iter().all(|d| *d < 1e-12));
    }
    // A loop behind the interpolator smooths the scallops and keeps their mean.
    let smooth = Machine {
        interpolation_s: Some(dt),
        ..loops(60.0, 0.0)
    };
    let (with, without) = (
        run(&smooth, 0.1, 0.7, Ccw),
        run(&loops(60.0, 0.0), 0.1, 0.7, Ccw),
    );
    let mean = with.mean_deviation_m() - without.mean_deviation_m();
    let inside = (0.7 * dt).powi(2) / 1.2 * gain(&loops(60.0, 0.0), 7.0);
    assert!((mean + inside).abs() < TENTH_UM, "{mean:e} {inside:e}");
}

#[test]
fn feed_clamp_saturates_the_radius_and_stretches_the_turn() {
    let (kv, limit) = (60.0_f64, 1.0);
    let machine = Machine {
        centripetal_limit_m_s2: Some(limit),
        ..loops(kv, 0.0)
    };
    let trace = run(&machine, 0.1, 0.7, Ccw);
    let omega = (limit / 0.1_f64).sqrt();
    assert!((trace.turn_s - TAU / omega).abs() < 1e-12);
    assert!((trace.mean_deviation_m() + 0.5 * limit / (kv * kv)).abs() < TENTH_UM * 5.0);
    assert!((run(&machine, 0.3, 0.5, Ccw).turn_s - TAU * 0.3 / 0.5).abs() < 1e-12);
}

/// Largest departure of the trace from r(θ, d), with θ the angle of the command.
fn departure(machine: &Machine, radius: f64, feed: f64, law: impl Fn(f64, f64) -> f64) -> f64 {
    let mut worst: f64 = 0.0;
    for direction in [Ccw, Cw] {
        let d = f64::from(direction.sign());
        let trace = run(machine, radius, feed, direction);
        for (theta, deviation) in trace.angle_rad.iter().zip(&trace.deviation_m) {
            worst = worst.max((deviation - law(*theta, d)).abs());
        }
    }
    worst
}

#[test]
fn geometry_has_its_profiles() {
    let r = 0.15;
    let square = Machine {
        squareness_rad: [80e-6, 0.0, 0.0],
        ..Machine::default()
    };
    assert!(departure(&square, r, 0.1, |th, _| 0.5 * 80e-6 * r * (2.0 * th).sin()) < 1e-9);
    let scale = Machine {
        scale: [60e-6, -40e-6, 0.0],
        ..Machine::default()
    };
    let law = |th: f64, _: f64| 0.5 * r * 20e-6 + 0.5 * r * 100e-6 * (2.0 * th).cos();
    assert!(departure(&scale, r, 0.1, law) < 1e-9);
    let bow = Machine {
        straightness_per_m: [[0.0, 1e-3, 0.0], [0.0; 3], [0.0; 3]],
        ..Machine::default()
    };
    let law = |th: f64, _: f64| 1e-3 * r * r / 4.0 * (th.sin() + (3.0 * th).sin());
    assert!(departure(&bow, r, 0.1, law) < 5e-9);
    let offset = Machine {
        radius_offset_m: -12e-6,
        ..Machine::default()
    };
    assert!(departure(&offset, r, 0.1, |_, _| -12e-6) < 1e-12);
    let cyclic = Cyclic {
        amplitude_m: 3e-6,
        pitch_m: 0.02,
        phase_rad: 0.7,
    };
    let cyclic = Machine {
        cyclic: [None, Some(cyclic), None],
        ..Machine::default()
    };
    let law = |th: f64, _: f64| 3e-6 * th.sin() * (TAU * r * th.sin() / 0.02 + 0.7).sin();
    assert!(departure(&cyclic, r, 0.1, law) < 1e-9);
}

#[test]
fn unequal_axes_have_their_profiles() {
    let (r, f) = (0.1, 0.2);
    // Feed-forward errors of first order only: τ = (1 − a)/kv per axis with κ2 nearly equal is not needed,
    // the second order is 0.4 % of the first here.
    let (kx, ky) = (500.0, 1000.0);
    let servo = [kx, ky, ky].map(|kv_per_s| PositionLoop {
        kv_per_s,
        feed_forward: 0.0,
    });
    let lag = Machine {
        servo,
        ..Machine::default()
    };
    let delta = 1.0 / kx - 1.0 / ky;
    let law = |th: f64, d: f64| d * 0.5 * f * delta * (2.0 * th).sin();
    let error = departure(&lag, r, f, law);
    assert!(error < 2.0 * f * f / r / (kx * kx), "{error:e}");
    // The same with dead time instead: no κ2, so the profile is closer still.
    let dead = Machine {
        dead_time_s: [0.0010, 0.0, 0.0],
        ..Machine::default()
    };
    let law = |th: f64, d: f64| d * 0.5 * f * 0.0010 * (2.0 * th).sin();
    assert!(departure(&dead, r, f, law) < f * f / r * 0.001 * 0.001);
    // Equal delay, unequal κ2: second-order elements of equal 2ζ/ωn.
    let lag_s = 0.02;
    let mechanics = [60.0, 90.0, 90.0].map(|wn| {
        Some(SecondOrder {
            omega_n_rad_s: wn,
            zeta: 0.5 * lag_s * wn,
        })
    });
    let unequal = Machine {
        mechanics,
        ..Machine::default()
    };
    let k2 = |wn: f64| -2.0 / (wn * wn) + lag_s * lag_s;
    let (delta, mean) = (k2(60.0) - k2(90.0), 0.5 * (k2(60.0) + k2(90.0)));
    let shift = lag_s * f / r;
    let law = |th: f64, d: f64| {
        let at = th - d * shift;
        -f * f / r * (0.5 * mean + 0.25 * delta * (2.0 * at).cos())
    };
    let error = departure(&unequal, r, f, law);
    assert!(error < 0.03 * f * f / r * delta.abs(), "{error:e}");
}

#[test]
fn backlash_steps_outward_both_ways() {
    let (r, f) = (0.1, 0.1);
    for axis in 0..2 {
        let mut machine = Machine::default();
        machine.backlash_m[axis] = 20e-6;
        for direction in [Ccw, Cw] {
            let d = f64::from(direction.sign());
            let trace = run(&machine, r, f, direction);
            for (theta, deviation) in trace.angle_rad.iter().zip(&trace.deviation_m) {
                let (sin, cos) = theta.sin_cos();
                let (law, since) = match axis {
                    0 => (d * 10e-6 * sin.signum() * cos, sin.abs()),
                    _ => (-d * 10e-6 * cos.signum() * sin, cos.abs()),
                };
                // The load stands while the drive crosses the gap: R(1 − cosΔθ) = B.
                if since > (2.0 * 20e-6_f64 / r).sqrt() + 1e-3 {
                    assert!(
                        (deviation - law).abs() < 1e-9,
                        "axis {axis} {direction:?} {theta}"
                    );
                }
            }
            let mean = trace.mean_deviation_m();
            assert!(mean.abs() < 0.2e-6, "{mean:e}");
        }
    }
    // Overcompensated: the mirror image.
    let step = |b| {
        run(
            &Machine {
                backlash_m: [b, 0.0, 0.0],
                ..Machine::default()
            },
            r,
            f,
            Ccw,
        )
        .deviation_m
    };
    for (plus, minus) in step(20e-6).iter().zip(step(-20e-6)) {
        assert!((plus + minus).abs() < 1e-8);
    }
}

#[test]
fn lateral_play_moves_the_mean() {
    let l = 10e-6;
    let first = Machine {
        lateral_play_m: [[0.0, l, 0.0], [0.0; 3], [0.0; 3]],
        ..Machine::default()
    };
    let second = Machine {
        lateral_play_m: [[0.0; 3], [l, 0.0, 0.0], [0.0; 3]],
        ..Machine::default()
    };
    assert!(departure(&first, 0.1, 0.1, |th, d| -d * l / 2.0 * th.sin().abs()) < 0.02 * l);
    assert!(departure(&second, 0.1, 0.1, |th, d| -d * l / 2.0 * th.cos().abs()) < 0.02 * l);
    let mean = run(&first, 0.1, 0.1, Cw).mean_deviation_m();
    assert!((mean - l / PI).abs() < 0.01 * l, "{mean:e}");
}

/// Spikes stand outward just after the reversals, die away in time, and turn with the lag.
#[test]
fn friction_leaves_a_decaying_spike() {
    let (r, f, peak, decay) = (0.15, 0.15, 10e-6, 0.05);
    let friction = Friction {
        peak_m: peak,
        decay_s: decay,
        ..Friction::default()
    };
    for axis in 0..2 {
        let mut machine = Machine::default();
        machine.friction[axis] = Some(friction);
        let quarter = PI / 2.0;
        let law = |th: f64, d: f64| {
            let reversal = if axis == 0 { 0.0 } else { quarter };
            let since = (d * (th - reversal)).rem_euclid(PI);
            let across = if axis == 0 {
                th.cos().abs()
            } else {
                th.sin().abs()
            };
            peak * (-since * r / f / decay).exp() * across
        };
        for direction in [Ccw, Cw] {
            let d = f64::from(direction.sign());
            let trace = run(&machine, r, f, direction);
            let spike = trace.deviation_m.iter().copied().fold(0.0, f64::max);
            assert!((spike - peak).abs() < 0.15 * peak, "{spike:e}");
            for (theta, deviation) in trace.angle_rad.iter().zip(&trace.deviation_m) {
                let phase = (d * (theta - if axis == 0 { 0.0 } else { quarter })).rem_euclid(PI);
                if phase > 0.01 && phase < 0.45 * PI {
                    assert!(
                        (deviation - law(*theta, d)).abs() < 2e-9,
                        "axis {axis} {direction:?} {theta}"
                    );
                }
            }
        }
    }
    // Behind a lag of τ the reversal comes ωτ later.
    let mut late = loops(20.0, 0.0);
    late.friction[1] = Some(friction);
    let trace = run(&late, r, 0.45, Ccw);
    let mean = trace.mean_deviation_m();
    let at = trace
        .deviation_m
        .iter()
        .position(|d| *d > mean + 0.5 * peak)
        .unwrap();
    let expected = PI / 2.0 + (3.0_f64 / 20.0).atan();
    assert!(
        (trace.angle_rad[at] - expected).abs() < 0.02,
        "{} {expected}",
        trace.angle_rad[at]
    );
}

#[test]
fn stick_slip_shows_only_near_reversals() {
    let friction = Friction {
        stick_slip_m: 8e-6,
        stick_travel_m: 400e-6,
        stick_speed_m_s: 8e-3,
        ..Friction::default()
    };
    let machine = Machine {
        friction: [Some(friction), None, None],
        ..Machine::default()
    };
    let trace = run(&machine, 0.1, 0.02, Ccw);
    for (theta, deviation) in trace.angle_rad.iter().zip(&trace.deviation_m) {
        let envelope = 8e-6 * (-(0.02 * theta.sin() / 8e-3_f64).powi(2)).exp();
        assert!(deviation.abs() <= envelope + 1e-9);
    }
    assert!(trace.deviation_m.iter().copied().fold(0.0, f64::max) > 5e-6);
    let fast = run(&machine, 0.1, 0.7, Ccw);
    assert!(fast.deviation_m.iter().filter(|d| d.abs() > 1e-6).count() < 20);
}

#[test]
fn time_is_kept() {
    let vibration = Vibration {
        frequency_hz: 12.5,
        amplitude_m: 4e-6,
        phase_rad: 0.3,
    };
    let machine = Machine {
        vibration: Some(vibration),
        ..Machine::default()
    };
    let mut test = CircleTest::new(0.1, 0.3, Ccw);
    test.started_s = 777.3;
    let trace = circle(&machine, &test);
    let step = trace.turn_s / trace.deviation_m.len() as f64;
    for (i, deviation) in trace.deviation_m.iter().enumerate() {
        let t = 777.3 + step * i as f64;
        assert!((deviation - 4e-6 * (TAU * 12.5 * t + 0.3).sin()).abs() < 1e-9);
    }
    let growth = Machine {
        thermal_per_s: 1e-8,
        ..Machine::default()
    };
    let mean = circle(&growth, &test).mean_deviation_m();
    assert!(
        (mean - 0.1 * 1e-8 * (777.3 + trace.turn_s / 2.0)).abs() < 1e-10,
        "{mean:e}"
    );
}

/// The tool is behind the command by the lag: a machine seen from the start angle of the command.
#[test]
fn first_sample_is_when_the_command_passes() {
    let mut test = CircleTest::new(0.1, 0.5, Cw);
    test.start_angle_rad = 0.8;
    let trace = circle(&loops(25.0, 0.0), &test);
    let [x, y] = trace.position_m[0];
    let lag = (5.0_f64 / 25.0).atan();
    assert!(
        (y.atan2(x) - (0.8 + lag)).abs() < 1e-6,
        "clockwise: behind means a larger angle"
    );
    assert_eq!(trace.angle_rad[0], 0.8);
    assert!(trace.angle_rad[1] < 0.8);
}

#[test]
fn nonsense_comes_back_as_nan() {
    let trace = circle(&loops(f64::NAN, 0.0), &CircleTest::new(0.1, 0.5, Ccw));
    assert!(trace.deviation_m.iter().all(|d| d.is_nan()));
    for (radius, feed) in [
        (0.0, 0.1),
        (0.1, 0.0),
        (-0.1, 0.1),
        (f64::NAN, 0.1),
        (0.1, f64::INFINITY),
    ] {
        let trace = run(&Machine::default(), radius, feed, Ccw);
        assert!(
            trace.deviation_m.iter().all(|d| d.is_nan()),
            "{radius} {feed}"
        );
    }
}

/// A sample every 94 ms or every 3 ms: the pulse, of 30 ms, is the same where both look.
#[test]
fn friction_does_not_depend_on_the_steps() {
    for presliding_m in [0.0, 2e-6, 30e-6] {
        let friction = Friction {
            peak_m: 10e-6,
            decay_s: 0.03,
            rise_s: 0.002,
            presliding_m,
            ..Friction::default()
        };
        let machine = Machine {
            friction: [Some(friction); 3],
            ..loops(40.0, 0.0)
        };
        let lap = |samples| {
            let test = CircleTest {
                samples: Some(samples),
                ..CircleTest::new(0.3, 0.02, Ccw)
            };
            circle(&machine, &test).deviation_m
        };
        let (coarse, fine) = (lap(1000), lap(32_000));
        let off = coarse
            .iter()
            .zip(fine.iter().step_by(32))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(off < 0.05 * 10e-6, "{presliding_m}: {off:e}");
        assert!(
            fine.iter().copied().fold(0.0, f64::max) > 0.5e-6,
            "{presliding_m}: there is a pulse"
        );
    }
}
