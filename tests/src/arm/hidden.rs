//! Campaigns of an arm: where it draws its circles, what is hidden in it, how it is looked at.
use super::effects::ALIKE;
use super::{Arm, Kinematics, arm_effect, simulate};
use crate::effects::{Hidden, Truth, left_um};
use crate::machine::plan::Grid;
use crate::machine::run::Lap;
use crate::machine::{AxisChain, Instrument, Plan, Plane, Shape, Spread};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What is asked of [`hidden`].
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Six joints at the paper's place, or else two links.
    pub six: bool,
    /// Effects by name; none: a sound arm.
    pub effects: Vec<String>,
    /// Misfit of each in units of all noise (that of a sample and the scatter between runs).
    pub strength: f64,
    /// Places of the circles' centre: 1 to 4.
    pub places: usize,
    /// Scatter between runs as robots have it (10–40 µm) instead of 1–3 µm.
    pub robot: bool,
    /// Whether the campaign gives its kinematics.
    pub given: bool,
}

/// Centres of the six-joint arm, m: that of the paper first.
const SIX: [[f64; 3]; 4] = [
    [-0.290, 0.987, 0.615],
    [0.750, 0.250, 0.450],
    [0.350, -0.850, 0.800],
    [0.900, -0.350, 0.700],
];
/// Centres of the two-link arm, m.
const TWO: [[f64; 3]; 4] = [
    [0.42, 0.12, 0.0],
    [0.10, 0.48, 0.0],
    [-0.30, 0.30, 0.0],
    [0.30, -0.38, 0.0],
];

/// Draws an arm and its laboratory under `seed`, hides the effects, measures. `None` if an effect has no such name
/// or an arm does not reach.
pub fn hidden(setting: &Setting, seed: u64) -> Option<Hidden> {
    hidden_arm(setting, seed).map(|(hidden, _)| hidden)
}

/// As [`hidden`], with the arm that was measured: what its circles become is to be tried on it.
pub fn hidden_arm(setting: &Setting, seed: u64) -> Option<(Hidden, Arm)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6a6f_696e);
    let kinematics = if setting.six {
        Kinematics::irb1600()
    } else {
        Kinematics::Scara {
            l1_m: rng.random_range(0.36..0.44),
            l2_m: rng.random_range(0.32..0.40),
            positive: rng.random_bool(0.5),
        }
    };
    let chain = AxisChain {
        lag_s: rng.random_range(0.004..0.010),
        dead_time_s: rng.random_range(0.0..0.004),
        ..AxisChain::default()
    };
    let instrument = instrument(setting.robot, &mut rng);
    let plan = plan(setting, seed);
    let sound = Arm::sound(kinematics, chain);
    let total_m = instrument.noise_m.hypot(instrument.spread.radius_m);
    let mut arm = sound.clone();
    let mut truth = Vec::new();
    for (name, index) in setting.effects.iter().zip(1_u64..) {
        let effect = arm_effect(name, seed.wrapping_mul(37) + index, &sound.believed)?;
        let wanted_m = setting.strength * total_m;
        let (size, misfit_m) = sized(&sound, &plan, wanted_m, &effect.apply, effect.first)?;
        (effect.apply)(&mut arm, size);
        let mut alone = sound.clone();
        (effect.apply)(&mut alone, size);
        let alike = ALIKE.contains(&effect.name) && setting.places < 4;
        truth.push(Truth {
            effect: effect.name.to_owned(),
            accept: if alike {
                ALIKE.map(str::to_owned).to_vec()
            } else {
                vec![effect.name.to_owned()]
            },
            seat: effect.seat,
            // Of a class the number belongs to the member that was hidden.
            value: if alike {
                f64::NAN
            } else {
                (effect.value)(&alone, &plan)
            },
            by_pair: None,
            unit: effect.unit.to_owned(),
            misfit_m,
        });
    }
    let measured_with = seed ^ 0x6172_6d73;
    let campaign = measured(&instrument, &arm, &plan, measured_with)?;
    let silent = Instrument {
        offset_m: instrument.offset_m,
        sees_angle: instrument.sees_angle,
        ..Instrument::perfect()
    };
    let clean = measured(&silent, &arm, &plan, measured_with)?;
    let hidden = Hidden {
        name: name(setting),
        seed,
        strength: setting.strength,
        noise_m: instrument.noise_m,
        scatter_m: instrument.spread.radius_m,
        truth,
        perfect_um: Some(left_um(&campaign, &clean)),
        campaign,
        model: None,
        kinematics: setting.given.then(|| sound.believed.block()),
        spoilt: None,
    };
    Some((hidden, arm))
}

/// Its name in a list.
pub fn name(setting: &Setting) -> String {
    let what = if setting.effects.is_empty() {
        "sound".to_owned()
    } else {
        setting.effects.join("+")
    };
    let arm = if setting.six { "arm6" } else { "arm2" };
    let places = if setting.places > 1 {
        format!("_{}places", setting.places)
    } else {
        String::new()
    };
    let given = if setting.given { "" } else { "_as_slides" };
    let robot = if setting.robot { "_robot" } else { "" };
    format!("{arm}_{what}{places}{robot}{given}")
}

/// A tracker, as robots are measured; with a robot's scatter or a good one's.
fn instrument(robot: bool, rng: &mut ChaCha8Rng) -> Instrument {
    let radius_m = if robot {
        rng.random_range(10e-6..40e-6)
    } else {
        rng.random_range(1e-6..3e-6)
    };
    Instrument {
        noise_m: rng.random_range(1e-6..3e-6),
        spread: Spread {
            radius_m,
            oval_m: 0.3 * radius_m,
            lobes_m: 0.1 * radius_m,
            high_m: 0.05 * radius_m,
            grows: [0.0; 2],
            shape: Shape::Normal,
        },
        offset_m: [rng.random_range(-4e-5..4e-5), rng.random_range(-4e-5..4e-5)],
        sees_angle: true,
        tick_s: 1e-3,
        ..Instrument::perfect()
    }
}

fn plan(setting: &Setting, seed: u64) -> Plan {
    let grid = Grid {
        radii_m: if setting.six {
            vec![0.1, 0.15, 0.3]
        } else {
            vec![0.05, 0.08, 0.12]
        },
        feeds_m_s: if setting.six {
            vec![0.02, 0.1, 0.3, 0.5, 0.7]
        } else {
            vec![0.02, 0.08, 0.2, 0.35, 0.5]
        },
        samples: 360,
        ..Grid::paper()
    };
    let centres = if setting.six { SIX } else { TWO };
    let mut all = Vec::new();
    for (centre, k) in centres.iter().zip(0..setting.places as u64) {
        let mut plan = grid.plan(seed ^ 0x706c_6163 ^ k);
        let begun_s = all
            .last()
            .map_or(0.0, |t: &crate::machine::Test| t.started_s + 120.0);
        for test in &mut plan.tests {
            test.centre_m = *centre;
            test.plane = Plane::XY;
            test.started_s += begun_s;
        }
        all.append(&mut plan.tests);
    }
    let length_s = all.last().map_or(0.0, |t| t.started_s + 60.0);
    Plan {
        tests: all,
        length_s,
    }
}

fn measured(
    instrument: &Instrument,
    arm: &Arm,
    plan: &Plan,
    seed: u64,
) -> Option<giotto::campaign::Campaign> {
    let laps: Option<Vec<Lap>> = plan.tests.iter().map(|test| simulate(arm, test)).collect();
    let laps = laps?;
    let lap_of = |test: &crate::machine::Test| {
        let index = plan.tests.iter().position(|t| t == test).unwrap_or(0);
        laps[index].clone()
    };
    Some(instrument.watch(plan, seed, |test, _| lap_of(test)))
}

/// Root mean square, m, of what the effect adds to the circles, each run's centre and one common servo lag (∝ f²/R)
/// taken off; on every fourth test.
fn misfit_m(sound: &[Vec<f64>], arm: &Arm, tests: &[&crate::machine::Test]) -> Option<f64> {
    let (mut within, mut count) = (0.0, 0.0);
    let mut means = Vec::new();
    for (test, sound) in tests.iter().zip(sound) {
        let profile = radii(arm, test)?;
        let n = profile.len() as f64;
        let added: Vec<f64> = profile.iter().zip(sound).map(|(a, b)| a - b).collect();
        let mean = added.iter().sum::<f64>() / n;
        let wave = |k: usize| (2.0 * std::f64::consts::PI * k as f64 / n).sin_cos();
        let (mut cos, mut sin) = (0.0, 0.0);
        for (k, x) in added.iter().enumerate() {
            let (s, c) = wave(k);
            cos += 2.0 * x * c / n;
            sin += 2.0 * x * s / n;
        }
        within += added
            .iter()
            .enumerate()
            .map(|(k, x)| {
                let (s, c) = wave(k);
                (x - mean - cos * c - sin * s).powi(2)
            })
            .sum::<f64>();
        means.push((n, test.feed_m_s * test.feed_m_s / test.radius_m, mean));
        count += n;
    }
    let top: f64 = means.iter().map(|(n, a, m)| n * a * m).sum();
    let below: f64 = means.iter().map(|(n, a, _)| n * a * a).sum();
    let lag = top / below;
    let between: f64 = means
        .iter()
        .map(|(n, a, m)| n * (m - lag * a).powi(2))
        .sum();
    Some(((within + between) / count).sqrt())
}

fn radii(arm: &Arm, test: &crate::machine::Test) -> Option<Vec<f64>> {
    let lap = simulate(arm, test)?;
    Some(
        lap.position_m
            .iter()
            .map(|p| test.plane.radius(*p) - test.radius_m)
            .collect(),
    )
}

/// The size at which the effect has the wanted misfit, and the misfit reached, m.
fn sized(
    sound: &Arm,
    plan: &Plan,
    wanted_m: f64,
    apply: &(dyn Fn(&mut Arm, f64) + Send + Sync),
    first: f64,
) -> Option<(f64, f64)> {
    let mut tests: Vec<&crate::machine::Test> = plan.tests.iter().collect();
    tests.sort_by(|a, b| {
        (a.radius_m, a.feed_m_s, a.sign())
            .partial_cmp(&(b.radius_m, b.feed_m_s, b.sign()))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let tests: Vec<_> = tests.into_iter().step_by(3).collect();
    let before: Option<Vec<Vec<f64>>> = tests.iter().map(|t| radii(sound, t)).collect();
    let before = before?;
    let (mut size, mut best) = (first, (first, f64::MAX));
    for _ in 0..8 {
        let mut arm = sound.clone();
        apply(&mut arm, size);
        let reached = misfit_m(&before, &arm, &tests)?;
        let off = (reached / wanted_m).ln().abs();
        if off < (best.1 / wanted_m).ln().abs() {
            best = (size, reached);
        }
        if off < 0.03 {
            break;
        }
        // All of these grow about in proportion.
        size *= (wanted_m / reached).clamp(0.05, 20.0);
    }
    Some(best)
}
