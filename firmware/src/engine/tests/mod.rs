//! Set-points against an independent `f64` statement of the law.
extern crate std;
mod arm;
mod contour;
mod endurance;
mod motion;
mod stop;
mod terms;

use super::*;
use giotto_shared::Direction;
use giotto_shared::model::Cumulants;
use giotto_shared::table::{Limits, Travel, Zone};
use std::vec::Vec;

/// A table with one zone that holds everywhere.
pub(crate) fn table(kappa2_s2: f32, kappa4_s4: f32) -> Table {
    let zone = Zone {
        place_m: None,
        radius_m: [0.001, 2.0],
        feed_m_s: [0.001, 5.0],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2,
            kappa4_s4,
        },
        terms: heapless::Vec::new(),
    };
    Table {
        machine: heapless::String::new(),
        zones: [zone].into_iter().collect(),
        limits: Limits {
            offset_m: 0.05,
            slew_m_s: 1.0,
        },
        arm: None,
    }
}

pub(crate) fn run_out(engine: &mut Engine) -> Vec<Output> {
    let mut out = Vec::new();
    while !engine.idle() {
        out.push(engine.tick());
        assert!(out.len() < 10_000_000);
    }
    out
}

/// Largest distance of nominal and corrected set-points from the law, µm. The oracle knows only the programmed
/// circle, the ramp's definition by its third derivative of q and Taylor arithmetic on e^{iθ}: it shares no formula
/// with the engine.
fn deviation_from_law(
    radius_m: f64,
    feed_m_s: f64,
    direction: Direction,
    kappa: [f32; 2],
) -> (f64, f64, usize) {
    let mut config = Config::robot(1000);
    (config.offset_m, config.slew_m_s) = (0.05, [1.0; 3]);
    let mut engine = Engine::new(config).unwrap();
    engine.load(Some(&table(kappa[0], kappa[1]))).unwrap();
    let run = CircleRun {
        centre_m: [0.01, -0.02, 0.5],
        radius_m,
        feed_m_s,
        plane: giotto_shared::Plane::Xy,
        direction,
        laps: 2,
        start_rad: 0.3,
    };
    engine.run_circle(&run).unwrap();
    let out = run_out(&mut engine);
    // The circle is what follows the last settling.
    let first = out
        .iter()
        .rposition(|o| o.flags & flag::SETTLING != 0)
        .unwrap()
        + 1;
    let ticks = &out[first..];
    let cruise = ticks.iter().filter(|o| o.flags & flag::CRUISE != 0).count();
    let ramp = ticks
        .iter()
        .position(|o| o.flags & flag::CRUISE != 0)
        .unwrap();
    let dt = 1e-3;
    let (t_ramp, t_cruise) = (ramp as f64 * dt, cruise as f64 * dt);
    let d = f64::from(direction.sign());
    let rate = d * 2.0 * core::f64::consts::TAU / t_cruise;
    let (k2, k4) = (f64::from(kappa[0]), f64::from(kappa[1]));
    let (mut worst_nominal, mut worst_corrected) = (0.0f64, 0.0f64);
    for (n, o) in ticks.iter().enumerate() {
        let t = (n + 1) as f64 * dt;
        // θ(t) and Taylor coefficients of θ′ from polynomials of u.
        let (theta, taylor) = if t <= t_ramp {
            let (i, s) = ramp_taylor(t / t_ramp, t_ramp);
            (rate * (t_ramp * i - t_ramp / 2.0), s.map(|s| s * rate))
        } else if t <= t_ramp + t_cruise {
            (rate * (t - t_ramp), [rate, 0.0, 0.0, 0.0])
        } else {
            let left = 2.0 * t_ramp + t_cruise - t;
            let (i, s) = ramp_taylor(left / t_ramp, t_ramp);
            let mirrored = [s[0], -s[1], s[2], -s[3]];
            (
                rate * (t_cruise + t_ramp / 2.0 - t_ramp * i),
                mirrored.map(|s| s * rate),
            )
        };
        let theta = theta + 0.3;
        let mut q = [(theta.cos(), theta.sin()); 5];
        for n in 0..4 {
            let mut sum = (0.0, 0.0);
            for k in 0..=n {
                sum.0 -= taylor[k] * q[n - k].1;
                sum.1 += taylor[k] * q[n - k].0;
            }
            q[n + 1] = (sum.0 / (n + 1) as f64, sum.1 / (n + 1) as f64);
        }
        // κ3 of lag and average, as far as it points outward; none where there is no such chain.
        let third = if k4 > 0.0 {
            2.0 * 0.02f64.powi(3) / 6.0
        } else {
            0.0
        };
        let radial = third * 6.0 * (q[3].0 * q[0].0 + q[3].1 * q[0].1);
        let law = |p: f64, p2: f64, p4: f64| p - k2 / 2.0 * p2 + (k2 * k2 / 8.0 - k4 / 24.0) * p4;
        let expected = [
            (law(q[0].0, 2.0 * q[2].0, 24.0 * q[4].0) + radial * q[0].0) * radius_m + 0.01,
            (law(q[0].1, 2.0 * q[2].1, 24.0 * q[4].1) + radial * q[0].1) * radius_m - 0.02,
        ];
        let nominal = [q[0].0 * radius_m + 0.01, q[0].1 * radius_m - 0.02];
        for axis in 0..2 {
            let um = |nm: i32, m: f64| (f64::from(nm) * 1e-3 - m * 1e6).abs();
            worst_nominal = worst_nominal.max(um(o.nominal_nm[axis], nominal[axis]));
            worst_corrected = worst_corrected.max(um(o.corrected_nm[axis], expected[axis]));
        }
        assert_eq!(o.corrected_nm[2], 500_000_000);
    }
    assert_eq!(
        engine.counters().offset_cuts + engine.counters().slew_cuts,
        0
    );
    (worst_nominal, worst_corrected, ticks.len())
}

/// ∫₀ᵘ S and the Taylor coefficients in time of S at u, from S = Σ c u^k (k = 5…9).
fn ramp_taylor(u: f64, t_ramp: f64) -> (f64, [f64; 4]) {
    let c = [126.0, -420.0, 540.0, -315.0, 70.0];
    let mut integral = 0.0;
    let mut s = [0.0; 4];
    for (i, c) in c.iter().enumerate() {
        let k = (i + 5) as f64;
        integral += c * u.powf(k + 1.0) / (k + 1.0);
        let mut binomial = 1.0;
        for (j, s) in s.iter_mut().enumerate() {
            *s += c * binomial * u.powf(k - j as f64) / t_ramp.powi(j as i32);
            binomial *= (k - j as f64) / (j as f64 + 1.0);
        }
    }
    (integral, s)
}

#[test]
fn set_points_are_the_law_to_a_tenth_of_a_micrometre() {
    use Direction::{Ccw, Cw};
    let lag_and_filter = [4e-4 + 1.6e-3 / 12.0, 6.0 * 1.6e-7 - 2.56e-6 / 120.0];
    // The source paper's robot: β1 = −23.29e-6, β2 = −0.23e-6.
    let robot = [46.58e-6, -5.5265e-6];
    let mut worst = 0.0f64;
    for kappa in [lag_and_filter, robot] {
        for (radius, feed) in [(1.0, 0.9), (0.3, 0.7), (0.1, 0.02), (0.1, 0.7), (0.05, 0.3)] {
            for direction in [Ccw, Cw] {
                let (nominal, corrected, n) = deviation_from_law(radius, feed, direction, kappa);
                std::println!(
                    "R {radius} f {feed} {direction:?}: nominal {nominal:.4} µm, corrected {corrected:.4} µm, {n} ticks"
                );
                worst = worst.max(nominal).max(corrected);
            }
        }
    }
    assert!(worst <= 0.1, "{worst} µm");
}

/// No axis of a set-point moves further in one tick than this, m.
fn no_jump(out: &[Output], most_m: f64) {
    for pair in out.windows(2) {
        for axis in 0..3 {
            let jump =
                f64::from(pair[1].corrected_nm[axis] - pair[0].corrected_nm[axis]).abs() * 1e-9;
            assert!(jump <= most_m, "{jump} m in one tick: {pair:?}");
        }
    }
}
