//! Certified numbers of NIST's StRD and of the textbook on stepwise regression.
use super::*;

fn assert_close(got: f64, want: f64, tolerance: f64) {
    assert!(
        (got - want).abs() <= tolerance * want.abs(),
        "{got} is not {want} to {tolerance}"
    );
}

fn powers(x: &[f64], k: i32) -> Vec<f64> {
    x.iter().map(|x| x.powi(k)).collect()
}

#[test]
fn noint1_is_uncentred() {
    let x: Vec<f64> = (60..=70).map(f64::from).collect();
    let y: Vec<f64> = (130..=140).map(f64::from).collect();
    let fit = Triangle::new(&[("x", &x)], &y, false)
        .unwrap()
        .solve(&[0])
        .unwrap();
    assert_close(fit.coefficients[0], 2.07438016528926, 1e-13);
    assert_close(fit.standard_error(0), 0.0165289256198347, 1e-13);
    assert_close(fit.rss, 127.272727272727, 1e-12);
    assert_close(fit.deviation(), 3.56753034006338, 1e-12);
    assert_close(fit.r_squared(), 0.999365492298663, 1e-13);
}

#[test]
fn norris_is_centred() {
    let yx = [
        (0.1, 0.2),
        (338.8, 337.4),
        (118.1, 118.2),
        (888.0, 884.6),
        (9.2, 10.1),
        (228.1, 226.5),
        (668.5, 666.3),
        (998.5, 996.3),
        (449.1, 448.6),
        (778.9, 777.0),
        (559.2, 558.2),
        (0.3, 0.4),
        (0.1, 0.6),
        (778.1, 775.5),
        (668.8, 666.9),
        (339.3, 338.0),
        (448.9, 447.5),
        (10.8, 11.6),
        (557.7, 556.0),
        (228.3, 228.1),
        (998.0, 995.8),
        (888.8, 887.6),
        (119.6, 120.2),
        (0.3, 0.3),
        (0.6, 0.3),
        (557.6, 556.8),
        (339.3, 339.1),
        (888.0, 887.2),
        (998.5, 999.0),
        (778.9, 779.0),
        (10.2, 11.1),
        (117.6, 118.3),
        (228.9, 229.2),
        (668.4, 669.1),
        (449.2, 448.9),
        (0.2, 0.5),
    ];
    let (y, x): (Vec<f64>, Vec<f64>) = yx.iter().copied().unzip();
    let fit = Triangle::new(&[("x", &x)], &y, true)
        .unwrap()
        .solve(&[0])
        .unwrap();
    assert_close(fit.coefficients[0], -0.262323073774029, 1e-10);
    assert_close(fit.coefficients[1], 1.00211681802045, 1e-13);
    assert_close(fit.standard_error(0), 0.232818234301152, 1e-11);
    assert_close(fit.standard_error(1), 0.429796848199937e-3, 1e-11);
    assert_close(fit.rss, 26.6173985294224, 1e-11);
    assert_eq!(fit.dof, 34);
}

#[test]
fn longley_keeps_eight_digits() {
    let rows: [[f64; 7]; 16] = [
        [60323., 83.0, 234289., 2356., 1590., 107608., 1947.],
        [61122., 88.5, 259426., 2325., 1456., 108632., 1948.],
        [60171., 88.2, 258054., 3682., 1616., 109773., 1949.],
        [61187., 89.5, 284599., 3351., 1650., 110929., 1950.],
        [63221., 96.2, 328975., 2099., 3099., 112075., 1951.],
        [63639., 98.1, 346999., 1932., 3594., 113270., 1952.],
        [64989., 99.0, 365385., 1870., 3547., 115094., 1953.],
        [63761., 100.0, 363112., 3578., 3350., 116219., 1954.],
        [66019., 101.2, 397469., 2904., 3048., 117388., 1955.],
        [67857., 104.6, 419180., 2822., 2857., 118734., 1956.],
        [68169., 108.4, 442769., 2936., 2798., 120445., 1957.],
        [66513., 110.8, 444546., 4681., 2637., 121950., 1958.],
        [68655., 112.6, 482704., 3813., 2552., 123366., 1959.],
        [69564., 114.2, 502601., 3931., 2514., 125368., 1960.],
        [69331., 115.7, 518173., 4806., 2572., 127852., 1961.],
        [70551., 116.9, 554894., 4007., 2827., 130081., 1962.],
    ];
    let column = |k: usize| rows.iter().map(|r| r[k]).collect::<Vec<f64>>();
    let columns: Vec<Vec<f64>> = (1..7).map(column).collect();
    let named: Vec<(&str, &[f64])> = columns.iter().map(|c| ("x", c.as_slice())).collect();
    let fit = Triangle::new(&named, &column(0), true)
        .unwrap()
        .solve(&[0, 1, 2, 3, 4, 5])
        .unwrap();
    let certified = [
        -3482258.63459582,
        15.0618722713733,
        -0.0358191792925910,
        -2.02022980381683,
        -1.03322686717359,
        -0.0511041056535807,
        1829.15146461355,
    ];
    for (got, want) in fit.coefficients.iter().zip(certified) {
        assert_close(*got, want, 1e-10);
    }
    assert_close(fit.standard_error(0), 890420.383607373, 1e-9);
    assert_close(fit.rss, 836424.055505915, 1e-10);
}

#[test]
fn wampler_polynomials_keep_seven_digits() {
    let x: Vec<f64> = (0..=20).map(f64::from).collect();
    let columns: Vec<Vec<f64>> = (1..=5).map(|k| powers(&x, k)).collect();
    let named: Vec<(&str, &[f64])> = columns.iter().map(|c| ("x^k", c.as_slice())).collect();
    let solve = |y: &[f64]| {
        Triangle::new(&named, y, true)
            .unwrap()
            .solve(&[0, 1, 2, 3, 4])
            .unwrap()
    };
    let sum = |base: f64| {
        x.iter()
            .map(|x| (0..=5).map(|k| (base * x).powi(k)).sum())
            .collect::<Vec<f64>>()
    };
    let mut one = sum(1.0);
    for coefficient in solve(&one).coefficients {
        assert_close(coefficient, 1.0, 1e-8);
    }
    for (k, coefficient) in (0..).zip(solve(&sum(0.1)).coefficients) {
        assert_close(coefficient, 0.1f64.powi(k), 1e-10);
    }
    let deviations = [
        759., -2048., 2048., -2048., 2523., -2048., 2048., -2048., 1838., -2048., 2048., -2048.,
        1838., -2048., 2048., -2048., 2523., -2048., 2048., -2048., 759.,
    ];
    one.iter_mut().zip(deviations).for_each(|(y, d)| *y += d);
    let third = solve(&one);
    for coefficient in &third.coefficients {
        assert_close(*coefficient, 1.0, 1e-8);
    }
    assert_close(third.rss, 83554268.0, 1e-12);
    assert_close(third.standard_error(0), 2152.32624678170, 1e-10);
}

fn hald() -> (Vec<Vec<f64>>, Vec<f64>) {
    let columns = vec![
        vec![7., 1., 11., 11., 7., 11., 3., 1., 2., 21., 1., 11., 10.],
        vec![
            26., 29., 56., 31., 52., 55., 71., 31., 54., 47., 40., 66., 68.,
        ],
        vec![6., 15., 8., 8., 6., 9., 17., 22., 18., 4., 23., 9., 8.],
        vec![
            60., 52., 20., 47., 33., 22., 6., 44., 22., 26., 34., 12., 12.,
        ],
    ];
    let y = vec![
        78.5, 74.3, 104.3, 87.6, 95.9, 109.2, 102.7, 72.5, 93.1, 115.9, 83.8, 113.3, 109.4,
    ];
    (columns, y)
}

fn hald_triangle() -> Triangle {
    let (columns, y) = hald();
    let names = ["x1", "x2", "x3", "x4"];
    let named: Vec<(&str, &[f64])> = names
        .into_iter()
        .zip(columns.iter().map(Vec::as_slice))
        .collect();
    Triangle::new(&named, &y, true).unwrap()
}

#[test]
fn hald_goes_in_and_out_as_in_the_textbook() {
    // Draper and Smith: α = 0.10 to enter and to stay.
    let rules = StepwiseOptions {
        enter: 0.10,
        remove: 0.10,
        partial_f: PartialF::Textbook,
    };
    let selection = stepwise(&hald_triangle(), &[], &[0, 1, 2, 3], rules).unwrap();
    let want = [
        (Action::Enter, 3, 22.7985202014, (1, 11)),
        (Action::Enter, 0, 108.223909331, (1, 10)),
        (Action::Enter, 1, 5.02586464895, (1, 9)),
        (Action::Remove, 3, 1.86326242219, (1, 9)),
    ];
    for (step, (action, column, f, dof)) in selection.steps.iter().zip(want) {
        assert_eq!((step.action, step.column, step.dof), (action, column, dof));
        assert_close(step.partial_f, f, 1e-10);
    }
    assert_eq!(selection.steps[4].action, Action::Reject);
    assert_eq!(selection.columns, [0, 1]);
    assert_close(selection.fit.rss, 57.9044831761, 1e-10);
    assert_close(selection.fit.r_squared(), 0.9786783745, 1e-9);
    for (got, want) in
        selection
            .fit
            .coefficients
            .iter()
            .zip([52.5773488821, 1.46830574222, 0.662250491275])
    {
        assert_close(*got, want, 1e-10);
    }
}

#[test]
fn the_papers_partial_f_divides_by_all_parameters() {
    let rule = |partial_f| StepwiseOptions {
        enter: 0.10,
        remove: 0.10,
        partial_f,
    };
    let textbook = stepwise(&hald_triangle(), &[], &[3], rule(PartialF::Textbook))
        .unwrap()
        .steps[0];
    let paper = stepwise(&hald_triangle(), &[], &[3], rule(PartialF::Paper))
        .unwrap()
        .steps[0];
    assert_close(paper.partial_f, textbook.partial_f / 2.0, 1e-14);
    assert_eq!((textbook.dof, paper.dof), ((1, 11), (2, 11)));
    assert!(paper.critical_f < textbook.critical_f);
}

#[test]
fn what_cannot_be_solved_is_an_error() {
    let (x, twice, y) = ([1., 2., 3., 4.], [2., 4., 6., 8.], [1., 3., 2., 5.]);
    let triangle = Triangle::new(&[("x", &x), ("2x", &twice), ("0", &[0.0; 4])], &y, true).unwrap();
    assert_eq!(
        triangle.solve(&[0, 1]).unwrap_err(),
        FitError::Collinear {
            column: "2x".into()
        }
    );
    assert_eq!(
        triangle.solve(&[2]).unwrap_err(),
        FitError::Collinear { column: "0".into() }
    );
    assert!(matches!(
        triangle.solve(&[0, 1, 2, 0]).unwrap_err(),
        FitError::TooFew { parameters: 5, .. }
    ));
    let bad = Triangle::new(&[("x", &[1., f64::NAN, 3., 4.])], &y, true).unwrap_err();
    assert_eq!(
        bad,
        FitError::NonFinite {
            column: "x".into(),
            index: 1
        }
    );
    assert!(matches!(
        Triangle::new(&[("x", &[1.])], &y, true).unwrap_err(),
        FitError::Length { found: 1, .. }
    ));
    // The dependent twin is passed over, not fatal.
    let selection = stepwise(
        &triangle,
        &[],
        &[0, 1, 2],
        StepwiseOptions {
            enter: 0.5,
            ..Default::default()
        },
    )
    .unwrap();
    assert_eq!(selection.columns.len(), 1);
}

/// The paper's circles: 13 feeds from 20 to 700 mm/s, both directions.
fn campaign(
    model: giotto_shared::model::RadiusModel<f64>,
    noise: impl Fn(usize) -> f64,
) -> Vec<Observation> {
    let mut runs = Vec::new();
    for (radius_m, offset_m) in [(0.1, 1.96e-6), (0.15, -12e-6), (0.3, 40e-6)] {
        for i in 0..26 {
            let feed_m_s = 0.02 + 0.68 * f64::from(i / 2) / 12.0;
            let radius_error_m =
                offset_m + model.radius_error_m(radius_m, feed_m_s) + noise(runs.len());
            runs.push(Observation {
                radius_m,
                feed_m_s,
                radius_error_m,
                out_of_roundness_m: None,
            });
        }
    }
    runs
}

const PAPER: giotto_shared::model::RadiusModel<f64> = giotto_shared::model::RadiusModel {
    beta1_s2: -23.29e-6,
    beta2_s4: -0.23e-6,
};

#[test]
fn without_noise_the_model_comes_back_whole() {
    let runs = campaign(PAPER, |_| 0.0);
    for train_radius_m in [None, Some(0.1)] {
        let fit = RadiusFit::new(
            &runs,
            Options {
                train_radius_m,
                ..Options::default()
            },
        )
        .unwrap();
        assert_close(fit.model.beta1_s2, PAPER.beta1_s2, 1e-9);
        assert_close(fit.model.beta2_s4, PAPER.beta2_s4, 1e-9);
        assert_eq!(
            fit.steps.iter().map(|s| s.action).collect::<Vec<_>>(),
            [Action::Enter, Action::Enter]
        );
        for ((radius_m, offset_m), want) in
            fit.offsets_m
                .iter()
                .zip([(0.1, 1.96e-6), (0.15, -12e-6), (0.3, 40e-6)])
        {
            assert_eq!(*radius_m, want.0);
            assert!((offset_m - want.1).abs() < 1e-12);
        }
        let heldout = fit.heldout.unwrap();
        assert!(
            heldout.explained_percent > 99.999999 && heldout.max_m < 1e-12,
            "{heldout:?}"
        );
        assert_eq!(heldout.runs, if train_radius_m.is_some() { 52 } else { 78 });
        assert_eq!(fit.classes.to_string(), "second_order");
    }
}

#[test]
fn the_papers_subtraction_loses_the_servo_error_of_the_lowest_speed() {
    let runs = campaign(PAPER, |_| 0.0);
    let fit = RadiusFit::new(
        &runs,
        Options {
            offset: Offset::LowestSpeed,
            ..Options::default()
        },
    )
    .unwrap();
    // The two reference runs of each radius are not scored.
    assert_eq!(fit.heldout.unwrap().runs, 72);
    // 20 mm/s at R = 100 mm: β1·4e-3 m/s² = −0.093 µm, left in every run of that radius.
    let lost = 1.96e-6 - fit.offsets_m[0].1;
    assert!((lost - 0.0932e-6).abs() < 2e-10, "{lost}");
}

#[test]
fn pure_noise_leaves_the_model_empty_and_the_class_open() {
    // A Weyl sequence, in no step with feed or direction.
    let runs = campaign(Default::default(), |i| {
        1e-6 * ((i as f64 * 0.754877666).fract() - 0.5)
    });
    let fit = RadiusFit::new(&runs, Options::default()).unwrap();
    assert_eq!(fit.steps.len(), 1);
    assert_eq!(fit.steps[0].action, Action::Reject);
    assert_eq!(fit.model, Default::default());
    assert!(fit.ci95.iter().all(|ci| ci[0] < 0.0 && ci[1] > 0.0));
    assert!(fit.classes.is_any());
}

#[test]
fn a_radius_that_is_not_there_is_named() {
    let error = RadiusFit::new(
        &campaign(PAPER, |_| 0.0),
        Options {
            train_radius_m: Some(0.2),
            ..Options::default()
        },
    );
    let words = error.unwrap_err().to_string();
    assert_eq!(
        words,
        "no run has a radius of 200 mm; the campaign has 100, 150, 300 mm"
    );
    assert!(matches!(
        RadiusFit::new(&[], Options::default()).unwrap_err(),
        FitError::TooFew { .. }
    ));
    let few = campaign(PAPER, |_| 0.0)[..3].to_vec();
    assert!(matches!(
        RadiusFit::new(&few, Options::default()).unwrap_err(),
        FitError::TooFew { .. }
    ));
}

/// The scatter comes of the reduction; the points of the runs themselves.
#[test]
fn scatter_is_that_of_the_points() {
    let noise = |k: usize| ((k * 7919) % 41) as f64 * 1e-7;
    let runs = campaign(PAPER, noise);
    for train_radius_m in [None, Some(0.15)] {
        for offset in [Offset::Joint, Offset::LowestSpeed] {
            let fit = RadiusFit::new(
                &runs,
                Options {
                    train_radius_m,
                    offset,
                    ..Options::default()
                },
            )
            .unwrap();
            let points = fit.points(&runs);
            assert_eq!(points.len(), runs.len());
            let squares: Vec<f64> = points
                .iter()
                .filter(|p| p.part == Part::Train)
                .map(|p| p.residual_m().powi(2))
                .collect();
            let rms_m = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
            assert_eq!(squares.len(), fit.train.0);
            assert_close(fit.train.1, rms_m, 1e-9);
            let (is, wanted): (Vec<_>, _) = (
                points.iter().filter(|p| p.part == Part::Heldout).collect(),
                fit.heldout,
            );
            if train_radius_m.is_some() {
                let pairs = is.iter().map(|p| (p.measured_m(), p.predicted_m));
                assert_eq!(Heldout::of(pairs).unwrap().runs, wanted.unwrap().runs);
            }
        }
    }
}

#[test]
fn a_radius_left_out_is_predicted_by_the_fit_on_the_others() {
    let runs = campaign(PAPER, |i| 1e-6 * ((i as f64 * 0.754877666).fract() - 0.5));
    for offset in [Offset::Joint, Offset::LowestSpeed] {
        let options = Options {
            offset,
            ..Options::default()
        };
        let whole = RadiusFit::new(&runs, options).unwrap();
        for (radius_m, heldout) in &whole.heldout_by_radius {
            let others: Vec<Observation> = runs
                .iter()
                .copied()
                .filter(|o| o.radius_m != *radius_m)
                .collect();
            let model = RadiusFit::new(&others, options).unwrap().model;
            let own = || runs.iter().filter(|o| o.radius_m == *radius_m);
            let servo = |o: &Observation| model.radius_error_m(o.radius_m, o.feed_m_s);
            let (taken, skipped): (Vec<f64>, usize) = match offset {
                Offset::Joint => (own().map(|o| o.radius_error_m - servo(o)).collect(), 0),
                Offset::LowestSpeed => (own().take(2).map(|o| o.radius_error_m).collect(), 2),
            };
            let offset_m = taken.iter().sum::<f64>() / taken.len() as f64;
            let pairs = own()
                .skip(skipped)
                .map(|o| (o.radius_error_m - offset_m, servo(o)));
            let want = Heldout::of(pairs).unwrap();
            assert_eq!(heldout.runs, want.runs);
            assert_close(heldout.rms_m, want.rms_m, 1e-11);
            assert_close(heldout.explained_percent, want.explained_percent, 1e-11);
        }
        assert_eq!(whole.heldout_by_radius.len(), 3);
    }
}

#[test]
fn numbers_that_are_none_are_named_with_their_run() {
    let good = campaign(PAPER, |_| 0.0);
    let spoilt = |change: fn(&mut Observation)| {
        let mut runs = good.clone();
        change(&mut runs[40]);
        RadiusFit::new(&runs, Options::default()).unwrap_err()
    };
    let named = |column: &str| FitError::NonFinite {
        column: column.to_owned(),
        index: 40,
    };
    assert_eq!(
        spoilt(|o| o.radius_error_m = f64::NAN),
        named("the observations")
    );
    assert_eq!(
        spoilt(|o| o.radius_error_m = f64::NEG_INFINITY),
        named("the observations")
    );
    assert_eq!(spoilt(|o| o.feed_m_s = f64::INFINITY), named("f2_r"));
    assert_eq!(spoilt(|o| o.radius_m = f64::NAN), named("f2_r"));
    assert_eq!(spoilt(|o| o.feed_m_s = 1e90), named("f4_r3"));
    // Those of a radius that is not fitted have no part in it.
    let mut runs = good.clone();
    runs[40].radius_error_m = f64::NAN;
    assert!(
        RadiusFit::new(
            &runs,
            Options {
                train_radius_m: Some(0.1),
                ..Options::default()
            }
        )
        .is_ok()
    );
}
