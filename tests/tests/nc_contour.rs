//! What is left of contour errors, on a plant whose laws are not the host's: a lag, a lag behind an average, second order.
use giotto::model_file::{ModelFile, Servo};
use giotto_nc::{Fate, FreeSide, Leads, Led, Options};
use giotto_tests::nc::contour::{Plant, deviations, wall_um};
use giotto_tests::nc::model;

/// A shape, whether it begins or ends at a stop on its arc, and its moves.
const SHAPES: [(&str, bool, &str); 8] = [
    (
        "rounded contour",
        false,
        "G0 X0 Y0\nG1 X0 Y30\nG2 X8 Y38 I8 J0\nG1 X52\nG2 X60 Y30 I0 J-8\nG1 Y0\n",
    ),
    (
        "slot",
        false,
        "G0 X0 Y0\nG1 X20 Y0\nG3 X20 Y10 I0 J5\nG1 X0\nG3 X0 Y0 I0 J-5\nG1 X20\n",
    ),
    (
        "S chain",
        false,
        "G0 X0 Y0\nG1 X20\nG3 X30 Y10 I0 J10\nG2 X40 Y20 I10 J0\nG3 X55 Y35 I0 J15\nG1 Y60\n",
    ),
    (
        "hole with lead",
        false,
        "G0 X0 Y-8\nG1 X10\nG3 X18 Y0 I0 J8\nG3 X18 Y0 I-18 J0\nG3 X10 Y8 I-8 J0\nG1 X0\n",
    ),
    (
        "G18",
        false,
        "G18\nG0 X0 Z0\nG1 X0 Z20\nG3 X10 Z30 I10 K0\nG1 X40\n",
    ),
    (
        "G19",
        false,
        "G19\nG0 Y0 Z0\nG1 Y20\nG3 Y30 Z10 J0 K10\nG1 Z40\n",
    ),
    (
        "helix",
        false,
        "G0 X-30 Y-10 Z0\nG1 X0 Y-10\nG3 X0 Y-10 Z-2 I0 J10\nG3 X0 Y-10 Z-4 I0 J10\nG1 X30\n",
    ),
    (
        "circle from a stop",
        true,
        "G0 X0 Y0\nG1 X12\nG3 X12 Y0 I-12 J0\nG1 X0\n",
    ),
];

/// Plants with the model that a fit would find of each, and the share that may be left.
fn plants() -> [(&'static str, Plant, ModelFile, f64); 3] {
    let of = |servo| ModelFile { servo, ..model() };
    let beta = |k2: f64, k4: f64| Servo::Beta {
        beta1_s2: -k2 / 2.0,
        beta2_s4: k2 * k2 / 8.0 + k4 / 24.0,
        half_width95: [0.0; 2],
    };
    let (t, m) = (0.02_f64, 0.04_f64);
    let (k2, k4) = (t * t + m * m / 12.0, 6.0 * t.powi(4) - m.powi(4) / 120.0);
    [
        (
            "lag",
            Plant::Lag(0.025),
            of(Servo::Lag { kv_per_s: 40.0 }),
            2.0,
        ),
        (
            "lag and average",
            Plant::LagAverage(t, m),
            of(beta(k2, k4)),
            5.0,
        ),
        (
            "second order",
            Plant::SecondOrder(50.0, 0.95),
            of(Servo::SecondOrder {
                omega_n_rad_s: 50.0,
                zeta: 0.95,
            }),
            5.0,
        ),
    ]
}

/// The machine goes no deeper into the material than before, µm.
const DEEPER_UM: f64 = 1.0;

#[test]
fn contour_errors_are_within_their_bars() {
    let mut failed = Vec::new();
    for (plant_name, plant, model, bar) in plants() {
        for (name, stop, moves) in SHAPES {
            let program = format!("G21 G90 G17 G94 F1500\n{moves}");
            let options = Options {
                all_planes: true,
                acceleration_mm_s2: 5000.0,
                ..Options::default()
            };
            let result = giotto_nc::compensate(program.as_bytes(), &model, &options);
            let text = String::from_utf8(result.program).unwrap();
            assert!(
                result
                    .arcs
                    .iter()
                    .all(|a| matches!(a.fate, Fate::Corrected { .. })),
                "{name}: {:?}",
                result.arcs
            );
            let before = deviations(plant, &program, &program);
            let after = deviations(plant, &text, &program);
            let bar = if stop { 10.0 } else { bar };
            for (was, is) in before.iter().zip(&after) {
                if was.most_um() < 1.0 {
                    continue;
                }
                let share = 100.0 * is.most_um() / was.most_um();
                let said = result.arcs.iter().fold(0.0, |most, a| match a.fate {
                    Fate::Corrected { joint_share, .. } => f64::max(most, 100.0 * joint_share),
                    Fate::Left(_) => most,
                });
                println!(
                    "{plant_name}, {name}: {was:.2?} -> {is:.2?}: {share:.2} %, {said:.2} % said"
                );
                let deeper = (is.left_um - was.left_um).max(is.right_um - was.right_um);
                if share > bar {
                    failed.push(format!("{plant_name}, {name}: {share:.2} % of {bar} %"));
                }
                if deeper > DEEPER_UM {
                    failed.push(format!("{plant_name}, {name}: {deeper:.2} µm deeper"));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// With leads a hole and a boss that begin and end at a stop are round, as far as the plain part of a circle is.
#[test]
fn leads_make_the_wall_round() {
    for (plant_name, plant, model, bar) in plants() {
        for (side, code, radius) in [
            (FreeSide::Inside, "G3", 12.0),
            (FreeSide::Inside, "G2", 8.0),
            (FreeSide::Outside, "G2", 10.0),
            (FreeSide::Outside, "G3", 15.0),
        ] {
            let hole = side == FreeSide::Inside;
            let far = if hole { 0.0 } else { radius + 8.0 };
            let program = format!(
                "G21 G90 G17 G94 F1500\nG0 X{far} Y0\nG1 X{radius}\n{code} X{radius} Y0 I-{radius} J0\nG1 X{far}\n"
            );
            let options = Options {
                acceleration_mm_s2: 5000.0,
                leads: Leads::On(side),
                ..Options::default()
            };
            let result = giotto_nc::compensate(program.as_bytes(), &model, &options);
            let text = String::from_utf8(result.program).unwrap();
            assert!(
                matches!(
                    result.arcs[0].fate,
                    Fate::Corrected {
                        led: Led::Tangent,
                        ..
                    }
                ),
                "{:?}",
                result.arcs
            );
            let was = wall_um(plant, &program, [0.0; 2], radius, hole);
            let is = wall_um(plant, &text, [0.0; 2], radius, hole);
            let most = |[least, most]: [f64; 2]| f64::max(-least, most);
            let share = 100.0 * most(is) / most(was);
            println!("{plant_name}, {side:?} {radius}: {was:.2?} -> {is:.2?}: {share:.2} %");
            assert!(share <= bar, "{plant_name}, {side:?}: {share:.2} %\n{text}");
            // No deeper than before, or than the circle itself.
            let deeper = (-is[0]) - f64::max(-was[0], 0.0);
            assert!(
                deeper <= DEEPER_UM,
                "{plant_name}, {side:?}: {deeper:.2} µm deeper"
            );
        }
    }
}
