//! Against closed forms and against sums done another way.
use super::*;
use crate::campaign::{Campaign, Direction, Manifest, Run, Samples, write};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::{PI, TAU};

const R: f64 = 0.15;

/// Deviations `deviation(θ)` of a machine, seen by an instrument `e` off centre. Exact geometry.
fn run(
    file: &str,
    direction: Direction,
    n: usize,
    e: [f64; 2],
    deviation: impl Fn(f64) -> f64,
) -> Run {
    let d = f64::from(direction.sign());
    let mut samples = Samples {
        angle_rad: vec![],
        deviation_m: vec![],
        time_s: None,
        angle_inferred: false,
    };
    for k in 0..n {
        let a = d * TAU * k as f64 / n as f64;
        let r = R + deviation(a);
        let (x, y) = (r * a.cos() + e[0], r * a.sin() + e[1]);
        // The pole sees the point at a slightly other angle; keep it continuous.
        samples
            .angle_rad
            .push(a + (y.atan2(x) - a + PI).rem_euclid(TAU) - PI);
        samples.deviation_m.push(x.hypot(y) - R);
    }
    Run {
        file: file.into(),
        radius_m: R,
        feed_m_s: 0.3,
        direction,
        start_angle_rad: 0.0,
        started_s: None,
        temperature_c: None,
        centre_m: None,
        frame: crate::campaign::Frame::default(),
        setup: None,
        samples,
    }
}

fn with_time(mut run: Run, turn_s: f64) -> Run {
    let n = run.samples.angle_rad.len();
    run.samples.angle_inferred = true;
    run.samples.time_s = Some((0..n).map(|k| turn_s * k as f64 / n as f64).collect());
    run
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} against {expected}"
    );
}

/// White normal noise of standard deviation 1, the same for the same seed.
fn noise(seed: u64, n: usize) -> Vec<f64> {
    let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    rng.sample_iter(StandardNormal).take(n).collect()
}

#[test]
fn a_known_form_is_found_again() {
    let (size, oval, lobes) = (-37e-6, 8e-6, 3e-6);
    let run = run("a", Direction::Cw, 720, [45e-6, -20e-6], |a| {
        size + oval * (2.0 * a).sin() + lobes * (5.0 * a).cos()
    });
    let found = of_run(&with_time(run, 3.2), None).unwrap();
    near(found.centre_m[0], 45e-6, 2e-9);
    near(found.centre_m[1], -20e-6, 2e-9);
    // The mean distance of an oval differs from its mean radius by (amplitude)²/R.
    near(found.radius_error_m, size, 1e-9);
    let of = |order: usize| found.harmonics.iter().find(|h| h.order == order).unwrap();
    assert_eq!(found.harmonics.first().unwrap().order, 2);
    assert_eq!(found.harmonics.last().unwrap().order, HIGHEST_ORDER);
    // The angle is taken about the nominal centre: amplitude × eccentricity/R leaks into the neighbours.
    let leak = 1.5 * 8e-6 * 50e-6 / R;
    near(of(2).sin_m, oval, leak);
    near(of(2).cos_m, 0.0, leak);
    near(of(5).cos_m, lobes, leak);
    near(of(3).cos_m, 0.0, leak);
    let profile = |a: f64| oval * (2.0 * a).sin() + lobes * (5.0 * a).cos();
    let grid = || (0..100_000).map(|k| profile(TAU * k as f64 / 1e5));
    let range = grid().fold(f64::MIN, f64::max) - grid().fold(f64::MAX, f64::min);
    // Between samples the profile bends by up to k²A·Δθ²/8 at either end.
    near(
        found.out_of_roundness_m,
        range,
        2.0 * (4.0 * oval + 25.0 * lobes) * (TAU / 720.0).powi(2) / 8.0,
    );
    near(found.measured_feed_m_s.unwrap(), TAU * R / 3.2, 1e-12);
}

#[test]
fn uneven_spacing_does_not_bend_the_form() {
    // Twice as dense on one half: a plain Fourier sum would be off by a large part.
    let mut even = run("a", Direction::Ccw, 900, [0.0, 0.0], |a| {
        7e-6 * (2.0 * a).cos() - 4e-6 * (3.0 * a).sin()
    });
    let keep = |k: usize| k < 450 || k.is_multiple_of(2);
    let thin = |v: &Vec<f64>| {
        v.iter()
            .enumerate()
            .filter(|(k, _)| keep(*k))
            .map(|(_, v)| *v)
            .collect::<Vec<_>>()
    };
    even.samples.angle_rad = thin(&even.samples.angle_rad);
    even.samples.deviation_m = thin(&even.samples.deviation_m);
    let found = of_run(&even, None).unwrap();
    // About the least-squares centre of these points the profile keeps its orders ≥ 2 to second order.
    near(found.harmonics[0].cos_m, 7e-6, 1e-9);
    near(found.harmonics[1].sin_m, -4e-6, 1e-9);
    near(found.harmonics[2].cos_m, 0.0, 1e-9);
}

#[test]
fn noise_is_measured_under_form_and_spikes() {
    let sd = 0.8e-6;
    let spike = |a: f64| 20e-6 * (-((a - 1.6) * 30.0).max(0.0)).exp() * f64::from(a > 1.6);
    for n in [1000, 20_000] {
        let mut noisy = run("a", Direction::Ccw, n, [45e-6, 0.0], |a| {
            9e-6 * (2.0 * a).cos() + spike(a)
        });
        noisy
            .samples
            .deviation_m
            .iter_mut()
            .zip(noise(1, n))
            .for_each(|(v, e)| *v += sd * e);
        let found = of_run(&noisy, None).unwrap();
        near(found.noise_m / sd, 1.0, 0.08);
        // The spike is left over: never less than the noise alone would give.
        assert!(found.radius_error_se_m > 0.9 * sd / (n as f64).sqrt());
    }
}

#[test]
fn a_large_form_seen_nearly_evenly_does_not_pass_for_size() {
    // A turn as a robot's log holds it: 187 rows, a wider step at the seam; an oval of 224 µm under noise of 10 µm.
    let (sd, n) = (10e-6, 187);
    let (mut inside, mut sum) = (0, 0.0);
    for seed in 0..100 {
        let mut log = run("a", Direction::Ccw, n, [0.0, 0.0], |_| 0.0);
        for (k, a) in log.samples.angle_rad.iter_mut().enumerate() {
            *a = 357.6f64.to_radians() * k as f64 / (n as f64 - 1.0);
        }
        let oval = |a: f64| 200e-6 * (2.0 * a).cos() + 100e-6 * (2.0 * a).sin();
        log.samples.deviation_m = log
            .samples
            .angle_rad
            .iter()
            .zip(noise(seed, n))
            .map(|(a, e)| oval(*a) - 100e-6 + sd * e)
            .collect();
        let found = of_run(&log, None).unwrap();
        let off = found.radius_error_m + 100e-6;
        inside += usize::from(off.abs() < 1.96 * found.radius_error_se_m);
        sum += off / 100.0;
    }
    assert!(inside >= 90, "{inside} of 100");
    near(sum, 0.0, 0.25e-6);
}

#[test]
fn an_arc_gets_the_interval_it_deserves() {
    // 200 arcs of 200° with fresh noise: the radius must lie within ±1.96 standard errors in about 95 %.
    let (sd, n) = (2e-6, 300);
    let mut inside = 0;
    let mut whole_se = 0.0;
    let mut arc_se = 0.0;
    for seed in 0..200 {
        let make = |turn: f64| {
            let mut arc = run("a", Direction::Ccw, n, [0.0, 0.0], |_| 0.0);
            for (k, a) in arc.samples.angle_rad.iter_mut().enumerate() {
                *a = turn * k as f64 / n as f64;
            }
            arc.samples.deviation_m = noise(seed, n).iter().map(|e| 30e-6 + sd * e).collect();
            arc
        };
        let found = of_run(&make(200f64.to_radians()), None).unwrap();
        assert!(found.harmonics.is_empty());
        near(found.arc_rad.unwrap().to_degrees(), 200.0, 0.01);
        inside +=
            usize::from((found.radius_error_m - 30e-6).abs() < 1.96 * found.radius_error_se_m);
        arc_se += found.radius_error_se_m;
        whole_se += of_run(&make(TAU), None).unwrap().radius_error_se_m;
    }
    assert!(inside >= 184, "{inside} of 200");
    // Root of the last diagonal of (AᵀA)⁻¹ for columns cos, sin, 1 over 200° and over 360°, by numpy: never less than without any
    // form, and form that the noise could hide makes it at most a few times that.
    let plain = 0.106469 / 0.057735;
    let ratio = arc_se / whole_se / plain;
    assert!((1.0..4.0).contains(&ratio), "{ratio}");
}

#[test]
fn form_on_an_arc_is_covered_by_the_interval_of_size() {
    // Ovals, a trefoil, half a rectified sine and noise that is alike for neighbours, each where a seed puts it.
    let count = 300;
    let (mut inside, mut wide) = (0, 0);
    for seed in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = |low: f64, high: f64| random.random_range(low..high);
        let (turn, from) = (uniform(190.0, 345.0).to_radians(), uniform(0.0, TAU));
        let oval = [0.0, 2e-6, 5e-6, 20e-6, 40e-6][(seed % 5) as usize];
        let (phase, third, rectified) = (uniform(0.0, TAU), uniform(0.0, TAU), uniform(0.0, TAU));
        let form = |a: f64| {
            let more = match seed % 3 {
                0 => 0.0,
                1 => 3e-6 * (3.0 * a + third).cos(),
                _ => 4e-6 * ((a + rectified).cos().abs() - std::f64::consts::FRAC_2_PI),
            };
            oval * (2.0 * a + phase).cos() + more
        };
        let n = 400;
        let mut arc = run("a", Direction::Ccw, n, [0.0, 0.0], |_| 0.0);
        for (k, a) in arc.samples.angle_rad.iter_mut().enumerate() {
            *a = from + turn * k as f64 / n as f64;
        }
        let alike = [0.0, 0.0, 0.8][(seed / 15 % 3) as usize];
        let mut error = 0.0;
        arc.samples.deviation_m = noise(1000 + seed, n)
            .iter()
            .zip(&arc.samples.angle_rad)
            .map(|(e, a)| {
                error = alike * error + f64::sqrt(1.0 - alike * alike) * e;
                -50e-6 + form(*a) + 0.5e-6 * error
            })
            .collect();
        let found = of_run(&arc, None).unwrap();
        inside += u64::from((found.radius_error_m + 50e-6).abs() < 1.96 * found.radius_error_se_m);
        wide += u64::from(found.radius_error_se_m > 10e-6);
    }
    assert!(inside * 100 >= count * 93, "{inside} of {count}");
    assert!(
        wide * 100 <= count * 5,
        "{wide} of {count} say next to nothing"
    );
}

#[test]
fn iso_figures_of_a_pair() {
    // Odd 2θ of 10 µm: each direction has G = 20 µm, both together as well; D is the mean size.
    let e = [30e-6, 0.0];
    let cw = run("cw", Direction::Cw, 1440, e, |a| {
        -20e-6 - 10e-6 * (2.0 * a).sin()
    });
    let ccw = run("ccw", Direction::Ccw, 1440, e, |a| {
        -10e-6 + 10e-6 * (2.0 * a).sin()
    });
    let raw = [&cw.samples.deviation_m, &ccw.samples.deviation_m];
    let raw_max = raw
        .iter()
        .flat_map(|v| v.iter())
        .copied()
        .fold(f64::MIN, f64::max);
    let lone = run("lone", Direction::Cw, 360, e, |_| 5e-6);
    let campaign = Campaign {
        name: "c".into(),
        machine: "m".into(),
        repeatability_m: None,
        table: None,
        kinematics: None,
        runs: vec![cw, lone, ccw],
    };
    let report = of_campaign(&campaign).unwrap();
    assert_eq!(report.iso230_4.len(), 2);
    let iso = report.iso230_4[0];
    near(iso.g_cw_m.unwrap(), 20e-6, 5e-9);
    near(iso.g_ccw_m.unwrap(), 20e-6, 5e-9);
    near(iso.g_b_m.unwrap(), 30e-6, 5e-9);
    near(iso.d_m.unwrap(), -15e-6, 5e-9);
    assert_eq!(iso.f_max_m, raw_max);
    let lone = report.iso230_4[1];
    assert_eq!((lone.g_ccw_m, lone.g_b_m, lone.d_m), (None, None, None));
    assert!(lone.g_cw_m.is_some());
}

#[test]
fn even_and_odd_parts_add_up() {
    let even = |a: f64| 6e-6 * (2.0 * a).cos() - 1e-5;
    let odd = |a: f64| 9e-6 * (2.0 * a).sin();
    let cw = run("cw", Direction::Cw, 3600, [0.0, 0.0], |a| even(a) - odd(a));
    let ccw = run("ccw", Direction::Ccw, 3600, [0.0, 0.0], |a| {
        even(a) + odd(a)
    });
    let split = even_odd(&cw, &ccw, 360);
    for (k, a) in split.angle_rad.iter().enumerate() {
        near(split.even_m[k], even(*a), 2e-7);
        near(split.odd_m[k], odd(*a), 2e-7);
    }
    // More sectors than samples: lines between them.
    let sparse = run("s", Direction::Ccw, 36, [0.0, 0.0], |a| 1e-5 * a.cos());
    let dense = profile(&sparse, 360);
    (0..360).for_each(|k| near(dense[k], 1e-5 * (k as f64).to_radians().cos(), 1e-7));
}

#[test]
fn files_and_memory_give_the_same_figures() {
    let dir = tempfile::tempdir().unwrap();
    let n = 200_000; // long enough for sectors
    let make = |file, direction| {
        let mut r = run(file, direction, n, [40e-6, 10e-6], |a| {
            5e-6 * (2.0 * a).cos()
        });
        let seed = if direction == Direction::Cw { 2 } else { 3 };
        r.samples
            .deviation_m
            .iter_mut()
            .zip(noise(seed, n))
            .for_each(|(v, e)| *v += 1e-6 * e);
        for (k, a) in r.samples.angle_rad.iter_mut().enumerate() {
            *a = f64::from(direction.sign()) * TAU * k as f64 / n as f64;
        }
        r.samples.angle_inferred = true;
        with_time(r, PI)
    };
    let campaign = Campaign {
        name: "c".into(),
        machine: "m".into(),
        repeatability_m: None,
        table: None,
        kinematics: None,
        runs: vec![make("a.csv", Direction::Cw), make("b.csv", Direction::Ccw)],
    };
    write(&campaign, dir.path()).unwrap();
    let memory = of_campaign(&crate::campaign::read(dir.path()).unwrap()).unwrap();
    let files = of_files(&Manifest::open(dir.path()).unwrap(), || {}).unwrap();
    assert_eq!(memory.iso230_4, files.iso230_4);
    for (a, b) in memory.runs.iter().zip(&files.runs) {
        assert_eq!(
            (a.centre_m, a.radius_error_m, &a.harmonics),
            (b.centre_m, b.radius_error_m, &b.harmonics)
        );
        near(
            a.measured_feed_m_s.unwrap(),
            b.measured_feed_m_s.unwrap(),
            1e-15,
        );
    }
    // G(b) over sectors against all points about the centre of both.
    let iso = files.iso230_4[0];
    let runs = crate::campaign::read(dir.path()).unwrap().runs;
    let both: Vec<[f64; 2]> = runs
        .iter()
        .flat_map(|r| {
            r.samples
                .angle_rad
                .iter()
                .zip(&r.samples.deviation_m)
                .map(|(a, v)| [(R + v) * a.cos(), (R + v) * a.sin()])
        })
        .collect();
    // A long run by its sectors against all its samples.
    for (run, found) in runs.iter().zip(&files.runs) {
        let points = Polar::new(R, &run.samples.angle_rad, &run.samples.deviation_m);
        let all = giotto_shared::circle::fit(&points).unwrap();
        near(found.radius_error_m, all.circle.radius - R, 1e-11);
        // Without the oval, which is not noise, the standard error is 1 µm/√n.
        near(found.radius_error_se_m * (n as f64).sqrt(), 1e-6, 0.02e-6);
    }
    let fit = giotto_shared::circle::fit(both.as_slice()).unwrap();
    let distance = |p: &[f64; 2]| (p[0] - fit.circle.centre[0]).hypot(p[1] - fit.circle.centre[1]);
    let range = both.iter().map(distance).fold(f64::MIN, f64::max)
        - both.iter().map(distance).fold(f64::MAX, f64::min);
    near(iso.g_b_m.unwrap(), range, 1e-10);
    near(iso.d_m.unwrap(), fit.circle.radius - R, 1e-11);
}
