//! The machine of the hidden-effect tests against the closed forms: sign, size, parity of every effect.
//! `diagnose` relies on these conventions, so they are checked on a machine that knows none of them.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::campaign::Direction;
use giotto_tests::machine::run::simulate;
use giotto_tests::machine::{
    AxisChain, Cyclic, Friction, Machine, Plane, Test, Thermal, Vibration,
};
use std::f64::consts::PI;

const UM: f64 = 1e-6;
const N: usize = 1000;

fn test(radius_m: f64, feed_m_s: f64, direction: Direction) -> Test {
    Test {
        radius_m,
        feed_m_s,
        direction,
        start_angle_rad: 0.0,
        started_s: 0.0,
        samples: N,
        plane: Plane::XY,
        centre_m: [0.0; 3],
        from_rest: false,
    }
}

/// Radial deviation, m, sample by sample; the angles of a CCW run grow, those of a CW run fall.
fn profile(machine: &Machine, test: &Test) -> Vec<f64> {
    simulate(machine, test, 1000.0, 0.0)
        .position_m
        .iter()
        .map(|p| test.plane.radius(*p) - test.radius_m)
        .collect()
}

/// Amplitudes of cos kθ and sin kθ; the mean for order 0.
fn harmonic(r: &[f64], test: &Test, order: f64) -> [f64; 2] {
    let n = r.len() as f64;
    let scale = if order == 0.0 { 1.0 / n } else { 2.0 / n };
    let mut sum = [0.0; 2];
    for (k, x) in r.iter().enumerate() {
        let (s, c) = (order * test.sign() * 2.0 * PI * k as f64 / n).sin_cos();
        sum[0] += scale * x * c;
        sum[1] += scale * x * s;
    }
    sum
}

fn both(check: impl Fn(Direction, f64)) {
    check(Direction::Ccw, 1.0);
    check(Direction::Cw, -1.0);
}

fn near(got: f64, want: f64, within: f64, what: &str) {
    assert!(
        (got - want).abs() <= within,
        "{what}: {got:e}, expected {want:e} ± {within:e}"
    );
}

fn chain(change: impl Fn(&mut AxisChain)) -> Machine {
    let mut m = Machine::default();
    m.axes.iter_mut().for_each(change);
    m
}

#[test]
fn linear_chains_shrink_the_circle_by_their_gain() {
    let w: f64 = 7.0;
    let (x, zeta): (f64, f64) = (w / 38.0, 0.72);
    let gains = [
        (chain(|a| a.lag_s = 0.01), 1.0 / (w * 0.01).hypot(1.0)),
        (
            chain(|a| a.exponential_s = 0.02),
            1.0 / (w * 0.02).hypot(1.0),
        ),
        (
            chain(|a| a.average_s = 0.0413),
            (w * 0.0413 / 2.0).sin() / (w * 0.0413 / 2.0),
        ),
        (
            chain(|a| a.mechanics = Some([38.0, zeta])),
            1.0 / (1.0 - x * x).hypot(2.0 * zeta * x),
        ),
        (chain(|a| a.dead_time_s = 0.01), 1.0),
        (
            chain(|a| (a.lag_s, a.average_s) = (0.01, 0.02)),
            1.0 / (w * 0.01).hypot(1.0) * (w * 0.01).sin() / (w * 0.01),
        ),
    ];
    for (machine, gain) in gains {
        both(|direction, _| {
            let t = test(0.1, 0.7, direction);
            let want = 0.1 * (gain - 1.0);
            // Steady to two nanometres: the start has died away.
            for x in profile(&machine, &t) {
                near(x, want, 2e-9, "radius");
            }
        });
    }
}

#[test]
fn cumulants_give_the_radius_law() {
    let m = chain(|a| {
        (a.lag_s, a.average_s, a.mechanics, a.exponential_s) =
            (0.004, 0.01, Some([90.0, 0.6]), 0.003);
    });
    let [k2, k4] = m.axes[0].cumulants();
    let t = test(0.1, 0.4, Direction::Ccw);
    let w2: f64 = 16.0;
    let got = (harmonic(&profile(&m, &t), &t, 0.0)[0] / 0.1).ln_1p();
    // κ4 is a tenth of a percent of κ2 here; the bound is a tenth of κ4's own share.
    near(
        got,
        -k2 * w2 / 2.0 + k4 * w2 * w2 / 24.0,
        0.1 * (k4 * w2 * w2 / 24.0).abs(),
        "ln(Rm/R)",
    );
}

#[test]
fn servo_mismatch_is_odd_and_follows_the_feed() {
    let tau = 1e-4;
    for dead in [false, true] {
        let mut m = Machine::default();
        if dead {
            m.axes[0].dead_time_s = tau;
        } else {
            (m.axes[0].lag_s, m.axes[1].lag_s) = (0.001 + tau, 0.001);
        }
        for (radius, feed) in [(0.1, 0.2), (0.3, 0.2), (0.1, 0.05)] {
            both(|direction, d| {
                let t = test(radius, feed, direction);
                let want = d * 0.5 * feed * tau;
                near(
                    harmonic(&profile(&m, &t), &t, 2.0)[1],
                    want,
                    0.005 * want.abs(),
                    "d·½fΔτ·sin2θ",
                );
            });
        }
    }
}

#[test]
fn bandwidth_mismatch_is_even_and_along_the_axes() {
    let window: f64 = 0.008;
    let mut m = Machine::default();
    m.axes[0].average_s = window;
    m.axes[1].dead_time_s = window / 2.0;
    both(|direction, _| {
        let t = test(0.1, 0.5, direction);
        let want = -(window * window / 12.0) / 4.0 * 0.25 / 0.1;
        let [cos, sin] = harmonic(&profile(&m, &t), &t, 2.0);
        // The common delay of half a window turns the oval by 2·ω·T/2 = 0.04 rad.
        near(cos, want, 0.003 * want.abs(), "−(Δκ2/4)(f²/R)·cos2θ");
        near(sin, 0.0, 0.045 * want.abs(), "no sin2θ but from the delay");
    });
}

#[test]
fn geometry_has_its_ovals_lobes_and_chirp() {
    let mut m = Machine::default();
    m.geometry.scale = [50e-6, 20e-6, 0.0];
    m.geometry.squareness_rad[0] = 40e-6;
    m.geometry.bow_per_m[0][1] = 3e-4;
    both(|direction, _| {
        let t = test(0.3, 0.1, direction);
        let r = profile(&m, &t);
        near(
            harmonic(&r, &t, 0.0)[0],
            0.5 * 0.3 * 70e-6,
            4e-9,
            "½R(sx+sy)",
        );
        near(
            harmonic(&r, &t, 2.0)[0],
            0.5 * 0.3 * 30e-6,
            4e-9,
            "½R(sx−sy)·cos2θ",
        );
        near(
            harmonic(&r, &t, 2.0)[1],
            0.5 * 0.3 * 40e-6,
            4e-9,
            "½εR·sin2θ",
        );
        let bow = 3e-4 * 0.09;
        near(harmonic(&r, &t, 1.0)[1], bow / 4.0, 4e-9, "S/4·sinθ");
        near(harmonic(&r, &t, 3.0)[1], bow / 4.0, 4e-9, "S/4·sin3θ");
    });
    let (amplitude_m, pitch_m, phase_rad) = (4.0 * UM, 0.02, 0.6);
    let mut m = Machine::default();
    m.geometry.cyclic[0] = Some(Cyclic {
        amplitude_m,
        pitch_m,
        phase_rad,
    });
    both(|direction, d| {
        let t = test(0.1, 0.1, direction);
        for (k, x) in profile(&m, &t).into_iter().enumerate() {
            let theta = d * 2.0 * PI * k as f64 / N as f64;
            let want = amplitude_m
                * theta.cos()
                * (2.0 * PI * 0.1 * theta.cos() / pitch_m + phase_rad).sin();
            near(x, want, 1e-9, "A·cosθ·sin(2πR cosθ/P + φ)");
        }
    });
}

#[test]
fn backlash_steps_outward_on_both_axes_both_ways() {
    let b = 6.0 * UM;
    for axis in 0..2 {
        for sign in [1.0, -1.0] {
            let mut m = Machine::default();
            m.axes[axis].backlash_m = sign * b;
            both(|direction, d| {
                let t = test(0.1, 0.1, direction);
                for (k, x) in profile(&m, &t).into_iter().enumerate() {
                    let theta = d * 2.0 * PI * k as f64 / N as f64;
                    let (s, c) = theta.sin_cos();
                    let (speed, want) = if axis == 0 {
                        (s, d * s.signum() * c)
                    } else {
                        (c, -d * c.signum() * s)
                    };
                    // The gap is taken up within √(2B/R) = 0.011 rad.
                    if speed.abs() > 0.02 {
                        near(x, sign * 0.5 * b * want, 1e-9, "d(B/2)sgn(sinθ)cosθ");
                    }
                }
            });
        }
    }
}

#[test]
fn lateral_play_moves_the_mean_against_the_direction() {
    for axis in 0..2 {
        let mut m = Machine::default();
        m.lateral_play_m[axis][1 - axis] = 5.0 * UM;
        both(|direction, d| {
            let t = test(0.15, 0.1, direction);
            let r = profile(&m, &t);
            near(
                harmonic(&r, &t, 0.0)[0],
                -d * 5.0 * UM / PI,
                0.01 * UM,
                "−dL/π",
            );
            for (k, x) in r.into_iter().enumerate() {
                let (s, c) = (2.0 * PI * k as f64 / N as f64).sin_cos();
                let lever = if axis == 0 { s.abs() } else { c.abs() };
                if lever > 0.05 {
                    near(x, -d * 2.5 * UM * lever, 1e-9, "−d(L/2)|sinθ|");
                }
            }
        });
    }
}

#[test]
fn friction_spikes_come_after_the_reversal_and_point_outward() {
    let (peak_m, decay_s) = (10.0 * UM, 0.03);
    let mut m = Machine::default();
    m.axes[0].friction = Some(Friction {
        peak_m,
        decay_s,
        rise_s: 0.0005,
        presliding_m: 0.1 * UM,
    });
    both(|direction, _| {
        let t = test(0.1, 0.5, direction);
        let r = profile(&m, &t);
        // X reverses at the first sample and half a turn later; samples are in the order of travel.
        for start in [0, N / 2] {
            for later in [20, 60, 120] {
                let turned = later as f64 / N as f64 * 2.0 * PI;
                let decayed = (-turned / 5.0 / decay_s).exp();
                near(
                    r[start + later],
                    peak_m * decayed * turned.cos(),
                    0.1 * peak_m * decayed,
                    "A·exp(−t/τi)",
                );
            }
            assert!(
                r[(start + N - 30) % N].abs() < 0.1 * peak_m,
                "quiet before the reversal"
            );
        }
        // Two spikes a turn, each of area A·ωτi (before the lever of cosθ).
        let area = peak_m * 5.0 * decay_s / PI;
        near(harmonic(&r, &t, 0.0)[0], area, 0.06 * area, "mean");
    });
}

#[test]
fn chords_cut_the_circle() {
    let dt: f64 = 0.01;
    let m = Machine {
        interpolation_s: dt,
        ..Machine::default()
    };
    let t = test(0.1, 0.5, Direction::Ccw);
    let r = profile(&m, &t);
    near(
        harmonic(&r, &t, 0.0)[0],
        -0.25 * dt * dt / (12.0 * 0.1),
        0.3 * UM,
        "mean −f²Δt²/(12R)",
    );
    let least = r.iter().copied().fold(f64::MAX, f64::min);
    near(
        least,
        -0.25 * dt * dt / (8.0 * 0.1),
        0.5 * UM,
        "peak −f²Δt²/(8R)",
    );
}

#[test]
fn the_clamp_saturates_the_error_and_lengthens_the_turn() {
    let mut m = chain(|a| a.lag_s = 0.008);
    m.centripetal_limit_m_s2 = 1.0;
    let t = test(0.1, 0.7, Direction::Cw);
    let feed = 0.1_f64.sqrt();
    near(
        simulate(&m, &t, 1.0, 0.0).turn_s,
        2.0 * PI * 0.1 / feed,
        1e-9,
        "duration",
    );
    near(
        harmonic(&profile(&m, &t), &t, 0.0)[0],
        -0.008_f64.powi(2) / 2.0,
        0.1 * UM,
        "−κ2·a_max/2",
    );
    let slow = test(0.1, 0.2, Direction::Cw);
    near(
        simulate(&m, &slow, 1.0, 0.0).turn_s,
        PI,
        1e-9,
        "runs below the limit keep their feed",
    );
}

#[test]
fn heat_and_vibration_belong_to_time() {
    let m = Machine {
        thermal: Some(Thermal {
            total: 100e-6,
            curvature: 0.0,
            hook: 0.0,
        }),
        ..Machine::default()
    };
    let mut t = test(0.2, 0.5, Direction::Ccw);
    t.started_s = 500.0;
    let half_lap = 0.5 * 2.0 * PI * 0.2 / 0.5 / 1000.0;
    near(
        harmonic(&profile(&m, &t), &t, 0.0)[0],
        0.2 * 100e-6 * (0.5 + half_lap),
        0.01 * UM,
        "R·α·ΔT(t)",
    );
    let warm = Thermal {
        total: 100e-6,
        curvature: 2.0,
        hook: 0.0,
    };
    near(
        warm.growth(1.0),
        100e-6,
        1e-15,
        "the total is reached at the end",
    );
    assert!(warm.growth(0.5) > 60e-6, "a warm-up is fast at first");

    let vibration = Some(Vibration {
        frequency_hz: 12.0,
        amplitude_m: 3.0 * UM,
        axis: None,
    });
    let m = Machine {
        vibration,
        ..Machine::default()
    };
    // One turn lasts 1.25 s: the vibration makes 15 waves of it.
    let t = test(0.1, 2.0 * PI * 0.1 / 1.25, Direction::Ccw);
    let [c, s] = harmonic(&profile(&m, &t), &t, 15.0);
    near(c.hypot(s), 3.0 * UM, 0.01 * UM, "order 2πR·f0/f");
}
