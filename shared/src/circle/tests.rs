//! Circles against published numbers, exact constructions and each other.
#![allow(
    clippy::excessive_precision,
    reason = "reference numbers are quoted as published"
)]
use super::*;
use core::f64::consts::{PI, TAU};
use std::vec::Vec;

/// Points, Kåsa's centre and radius, the geometric centre, radius and sum of squares; computed with 50 digits.
struct Reference {
    points: &'static [[f64; 2]],
    kasa: [f64; 3],
    geometric: [f64; 4],
}

const REFERENCES: [Reference; 5] = [
    // Gander, Golub, Strebel, BIT 34 (1994)
    Reference {
        points: &[[1., 7.], [2., 6.], [5., 8.], [7., 7.], [9., 5.], [3., 7.]],
        kasa: [4.742331288343558, 3.835122699386503, 4.108761522345449],
        geometric: [
            4.73978241090607403,
            2.98353269929247516,
            4.71422603779210975,
            1.22759907818365635,
        ],
    },
    // SciPy cookbook
    Reference {
        points: &[
            [9., 34.],
            [35., 10.],
            [-13., 6.],
            [10., -14.],
            [23., 27.],
            [0., -10.],
        ],
        kasa: [10.55231285578565, 9.705900055995934, 23.36241056178362],
        geometric: [
            10.500086213944377,
            9.65994950583643048,
            23.3335276461828767,
            7.7118522388199628,
        ],
    },
    // SciPy cookbook, arc
    Reference {
        points: &[
            [36., 14.],
            [36., 10.],
            [19., 28.],
            [18., 31.],
            [33., 18.],
            [26., 26.],
        ],
        kasa: [15.05503486956201, 8.836149957566141, 20.85072309131152],
        geometric: [
            9.88756656747738748,
            3.68749730978412046,
            27.3504431681337441,
            4.04252189831859094,
        ],
    },
    // Apache commons-math
    Reference {
        points: &[[30., 68.], [50., -6.], [110., -20.], [35., 15.], [45., 97.]],
        kasa: [96.00573345901923, 48.10393940404276, 69.91471921082821],
        geometric: [
            96.0759020960109499,
            48.1351678947139973,
            69.9601617535997453,
            3.126752705904914,
        ],
    },
    Reference {
        points: &[
            [0.7, 4.],
            [3.3, 4.7],
            [5.6, 4.],
            [7.5, 1.3],
            [6.4, -1.1],
            [4.4, -3.],
            [0.3, -2.5],
            [-1.1, 1.3],
        ],
        kasa: [3.06030356572735, 0.7436073210423231, 4.10913703607478],
        geometric: [
            3.04323825158254216,
            0.745678313458604047,
            4.10585583795433105,
            0.295948437998298817,
        ],
    },
];

fn assert_relative(got: f64, want: f64, tolerance: f64) {
    assert!(
        (got - want).abs() <= tolerance * want.abs(),
        "{got} is not {want} to {tolerance}"
    );
}

/// A repeatable sequence in (−1, 1): Weyl's, whitened by a mixing step.
fn noise(i: usize) -> f64 {
    let mut z = (i as u64)
        .wrapping_add(1)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

#[test]
fn kasa_gives_the_reference_numbers() {
    for reference in &REFERENCES {
        let circle = kasa(&Moments::of(reference.points)).unwrap();
        for (got, want) in [circle.centre[0], circle.centre[1], circle.radius]
            .iter()
            .zip(reference.kasa)
        {
            assert_relative(*got, want, 1e-13);
        }
    }
}

#[test]
fn geometric_fit_gives_the_reference_numbers() {
    for reference in &REFERENCES {
        let fit = fit(reference.points).unwrap();
        let got = [
            fit.circle.centre[0],
            fit.circle.centre[1],
            fit.circle.radius,
            fit.rss,
        ];
        for (got, want) in got.iter().zip(reference.geometric) {
            assert_relative(*got, want, 2e-13);
        }
        assert_eq!(fit.stopped, Stop::Converged);
        assert!(fit.passes <= 8, "{} passes", fit.passes);
    }
}

#[test]
fn a_start_half_a_radius_off_is_good_enough() {
    for reference in &REFERENCES {
        let moments = Moments::of(reference.points);
        let [x, y, radius, rss] = reference.geometric;
        for i in 0..12 {
            let (sin, cos) = (TAU * f64::from(i) / 12.0).sin_cos();
            let centre = [x + 0.5 * radius * cos, y + 0.5 * radius * sin];
            let fit = refine(
                reference.points,
                &moments,
                Circle {
                    centre,
                    radius: 0.3 * radius,
                },
            )
            .unwrap();
            assert_relative(fit.rss, rss, 1e-12);
            assert!(fit.passes <= 15, "{} passes", fit.passes);
        }
    }
}

#[test]
fn a_circle_100_m_away_loses_nothing() {
    // Coordinates in steps of 2⁻⁴⁶ m, the last digit at 100 m, so both sets hold exactly the same shape.
    let digit = 46f64.exp2();
    let at = |i: usize| {
        let (angle, radius) = (TAU * i as f64 / 1000.0, 0.1 + 1e-6 * noise(i));
        [radius * angle.cos(), radius * angle.sin()].map(|v| (v * digit).round() / digit)
    };
    let near = fit(&Sampled::new(1000, at)).unwrap();
    let far = fit(&Sampled::new(1000, |i| [at(i)[0] + 100.0, at(i)[1] - 70.0])).unwrap();
    assert!(
        (near.circle.radius - far.circle.radius).abs() < 3e-17,
        "{}",
        near.circle.radius - far.circle.radius
    );
    assert_relative(far.rss, near.rss, 1e-9);
    // The centre itself can only be written to 1.4e-14 m there.
    assert!((far.circle.centre[0] - 100.0 - near.circle.centre[0]).abs() < 2e-14);
    assert!((far.circle.centre[1] + 70.0 - near.circle.centre[1]).abs() < 2e-14);
}

#[test]
fn any_scale_gives_the_same_circle() {
    let at = |i: usize| {
        [
            3.0 + 2.0 * (i as f64).sin() + 0.1 * noise(i),
            2.0 * (i as f64).cos(),
        ]
    };
    let one = fit(&Sampled::new(200, at)).unwrap();
    for scale in [1e-60, 1e-6, 1e6, 1e60] {
        let fit = fit(&Sampled::new(200, |i| at(i).map(|v| v * scale))).unwrap();
        assert_relative(fit.circle.radius, one.circle.radius * scale, 1e-14);
        assert_relative(fit.rms, one.rms * scale, 1e-12);
    }
}

#[test]
fn starting_from_a_few_of_many_points_ends_at_the_same_circle() {
    let n = MANY + 75_000;
    let (mut x, y): (Vec<f64>, Vec<f64>) = (0..n)
        .map(|i| {
            let (sin, cos) = (TAU * i as f64 / n as f64).sin_cos();
            let radius = 0.1 + 1e-6 * noise(i) + 1e-5 * sin * cos;
            (2.0 + radius * cos, radius * sin - 7.0)
        })
        .unzip();
    let few = fit(&Xy::new(&x, &y).unwrap()).unwrap();
    let all = fit_all(&Xy::new(&x, &y).unwrap()).unwrap();
    assert!((few.circle.radius - all.circle.radius).abs() < 1e-14);
    assert!((0..2).all(|k| (few.circle.centre[k] - all.circle.centre[k]).abs() < 1e-14));
    assert_relative(few.rss, all.rss, 1e-11);
    assert_eq!(few.passes, 1);
    // Of many points on a line, or with a bad one that is not among the few, the few say nothing.
    x[333_333] = f64::NAN;
    assert_eq!(
        fit(&Xy::new(&x, &y).unwrap()).unwrap_err(),
        CircleError::NonFinite
    );
    x.iter_mut().zip(&y).for_each(|(x, y)| *x = 2.0 * y);
    assert_eq!(
        fit(&Xy::new(&x, &y).unwrap()).unwrap_err(),
        CircleError::Collinear
    );
}

#[test]
fn three_points_are_met_exactly_and_have_no_covariance() {
    let fit = fit([[0.0, 1.0], [1.0, 0.0], [0.0, -1.0]].as_slice()).unwrap();
    assert!((fit.circle.radius - 1.0).abs() < 1e-15 && fit.rms < 1e-15);
    assert_eq!(fit.covariance, None);
}

#[test]
fn hyper_does_not_shrink_arcs_as_kasa_does() {
    // 60° of a unit circle with 2 % radial noise, 400 sets of 200 points.
    let (mut of_hyper, mut of_kasa, mut of_fit) = (0.0, 0.0, 0.0);
    let sets = 400;
    for set in 0..sets {
        let points = Sampled::new(200, |i| {
            let radius = 1.0 + 0.02 * 3f64.sqrt() * noise(set * 200 + i);
            let angle = PI / 3.0 * i as f64 / 199.0;
            [radius * angle.cos(), radius * angle.sin()]
        });
        let moments = Moments::of(&points);
        of_kasa += kasa(&moments).unwrap().radius / sets as f64 - 1.0 / sets as f64;
        of_hyper += hyper(&moments).unwrap().radius / sets as f64 - 1.0 / sets as f64;
        of_fit += fit(&points).unwrap().circle.radius / sets as f64 - 1.0 / sets as f64;
    }
    assert!(of_kasa < -0.08, "Kåsa's bias {of_kasa}");
    assert!(of_hyper.abs() < 0.01, "hyper's bias {of_hyper}");
    assert!(of_fit.abs() < 0.01, "bias of the geometric fit {of_fit}");
}

#[test]
fn covariance_is_what_the_scatter_over_sets_shows() {
    // 90° arc, 1 % uniform radial noise.
    let sets = 3000;
    let deviation = 0.01;
    let mut scatter = [[0.0; 3]; 3];
    let mut stated = [[0.0; 3]; 3];
    for set in 0..sets {
        let fit = fit(&Sampled::new(60, |i| {
            let radius = 1.0 + deviation * 3f64.sqrt() * noise(set * 60 + i);
            let angle = PI / 2.0 * i as f64 / 59.0 + 0.3;
            [radius * angle.cos(), radius * angle.sin()]
        }))
        .unwrap();
        let error = [
            fit.circle.centre[0],
            fit.circle.centre[1],
            fit.circle.radius - 1.0,
        ];
        let covariance = fit.covariance.unwrap();
        for i in 0..3 {
            for j in 0..3 {
                scatter[i][j] += error[i] * error[j] / sets as f64;
                stated[i][j] += covariance[i][j] / sets as f64;
            }
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            let unit = (stated[i][i] * stated[j][j]).sqrt();
            assert!(
                (scatter[i][j] - stated[i][j]).abs() < 0.1 * unit,
                "{i}{j}: {scatter:?} {stated:?}"
            );
        }
    }
}

#[test]
fn degenerate_points_are_told_apart() {
    let ring = |i: usize| [(i as f64).cos(), (i as f64).sin()];
    assert_eq!(
        fit(&Sampled::new(2, ring)).unwrap_err(),
        CircleError::TooFew { points: 2 }
    );
    assert_eq!(
        fit([].as_slice()).unwrap_err(),
        CircleError::TooFew { points: 0 }
    );
    assert_eq!(
        fit(&Sampled::new(9, |_| [100.0, 0.1])).unwrap_err(),
        CircleError::Coincident
    );
    assert_eq!(
        fit(&Sampled::new(9, |_| [0.0, 0.0])).unwrap_err(),
        CircleError::Coincident
    );
    for slope in [0.0, 0.3, 1.0, 1e9] {
        let line = Sampled::new(50, |i| [i as f64 * 0.1 + 7.0, slope * i as f64 * 0.1]);
        assert_eq!(
            fit(&line).unwrap_err(),
            CircleError::Collinear,
            "slope {slope}"
        );
    }
    for bad in [f64::NAN, f64::INFINITY, 1e90] {
        let points = Sampled::new(30, |i| if i == 17 { [bad, 0.0] } else { ring(i) });
        assert_eq!(fit(&points).unwrap_err(), CircleError::NonFinite, "{bad}");
    }
    assert_eq!(
        Xy::new(&[0.0], &[]).unwrap_err(),
        CircleError::Lengths { x: 1, y: 0 }
    );
}

#[test]
fn a_point_on_the_centre_is_only_a_bad_point() {
    let fit = fit(&Sampled::new(101, |i| {
        let angle = TAU * i as f64 / 100.0;
        if i == 100 {
            [0.0, 0.0]
        } else {
            [angle.cos(), angle.sin()]
        }
    }))
    .unwrap();
    assert!(fit.circle.radius.is_finite() && (fit.circle.radius - 1.0).abs() < 0.02);
}

#[test]
fn a_tilted_circle_in_space_is_found_in_its_plane() {
    let (tilt, radius, height) = (0.02_f64, 0.1, 0.615);
    let points: Vec<[f64; 3]> = (0..720)
        .map(|i| {
            let angle = TAU * i as f64 / 720.0;
            let (x, y) = (radius * angle.cos(), radius * angle.sin());
            let off = 1e-6 * (3.0 * angle).cos();
            let (sin, cos) = tilt.sin_cos();
            // Tilted about y, the departure along the normal.
            [
                -0.29 + x * cos + off * sin,
                0.987 + y,
                height - x * sin + off * cos,
            ]
        })
        .collect();
    let plane = Plane::fit(points.iter().copied()).unwrap();
    assert!((plane.tilt_rad - tilt).abs() < 1e-9, "{}", plane.tilt_rad);
    assert!((plane.flatness - 2e-6).abs() < 1e-11);
    assert!((plane.rms - 1e-6 / 2f64.sqrt()).abs() < 1e-11);
    let flat: Vec<[f64; 2]> = points.iter().map(|p| plane.project(*p)).collect();
    let fit = fit(flat.as_slice()).unwrap();
    assert!((fit.circle.radius - radius).abs() < 1e-14);
    // Counter-clockwise from above stays so, starting along x.
    assert!(flat[0][0] > 0.0999 && flat[180][1] > 0.0999);
    for (got, want) in plane
        .lift(fit.circle.centre)
        .iter()
        .zip([-0.29, 0.987, height])
    {
        assert!((got - want).abs() < 1e-12);
    }
}

#[test]
fn degenerate_planes_are_told_apart() {
    let line = (0..9).map(|i| [f64::from(i), 2.0 * f64::from(i), 1.0]);
    assert_eq!(Plane::fit(line).unwrap_err(), CircleError::Collinear);
    assert_eq!(
        Plane::fit((0..9).map(|_| [1.0, 2.0, 3.0])).unwrap_err(),
        CircleError::Coincident
    );
    assert_eq!(
        Plane::fit((0..2).map(|_| [1.0, 2.0, 3.0])).unwrap_err(),
        CircleError::TooFew { points: 2 }
    );
    let bad = (0..9).map(|i| [f64::from(i * i), f64::from(i), f64::NAN]);
    assert_eq!(Plane::fit(bad).unwrap_err(), CircleError::NonFinite);
}

#[test]
fn a_walk_sums_the_first_points_of_each_part() {
    let at = |i: usize| [(i * 37 % 1009) as f64, (i * 91 % 1013) as f64];
    let (x, y): (Vec<f64>, Vec<f64>) = (0..5003).map(|i| (at(i)[0], at(i)[1])).unzip();
    let walk = Walk::some(7, 100);
    let some: Vec<[f64; 2]> = (0..5003).filter(|i| i % 100 < 7).map(at).collect();
    let of_some = Moments::of(some.as_slice());
    let walked = Moments::of_walk(walk, &Xy::new(&x, &y).unwrap());
    assert_eq!(walked.count, some.len());
    assert_relative(walked.xx, of_some.xx, 1e-12);
    assert_relative(walked.zz, of_some.zz, 1e-12);
    assert_eq!(Moments::of_walk(walk, &Sampled::new(5003, at)), walked);
}
