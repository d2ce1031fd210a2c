//! The proof: the extended *simulation* against runs that it has not seen.
//!
//! Each radius is left out once, then each speed. The causes stated are fitted again on the runs that are left; the
//! shapes (pitch, time constants) are those found on all runs. The machine with the causes
//! built in runs the circles left out, in the time domain, and what is measured there is compared.
use super::arm::beyond_slides_m;
use super::baseline::{Size, fit_lag};
use super::duration::Clamp;
use super::explained::Explained;
use super::hypothesis::Kind;
use super::linear::solve;
use super::low_orders::Basis;
use super::survey::Response;
use super::vector::dot;
use super::veto;
use crate::campaign::{Campaign, Run};
use crate::causes::Effect;
use crate::kinematics::Kinematics;
use crate::model_file::{ModelFile, Servo};
use crate::simulation::machine::Machine;
use crate::simulation::{Arm, CircleTest, SAMPLES_PER_TURN, circle};
use giotto_shared::model::{Element, RadiusModel};
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::TAU;

/// Root mean squares over runs left out, centre free, sample by sample.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Extended simulation, µm.
    pub extended_rms_um: f64,
    /// Simulation as it stood, µm.
    pub baseline_rms_um: f64,
    /// The paper's β1, β2 fit, µm.
    pub beta_rms_um: f64,
    /// No model at all, µm.
    pub no_model_rms_um: f64,
    /// What noise and scatter between runs leave to a perfect model, µm.
    pub floor_rms_um: f64,
    /// 100·(1 − extended/baseline).
    pub percent: f64,
    /// 95 % bootstrap interval of `percent` over runs.
    pub ci95_percent: [f64; 2],
    /// Gain in mean square as a share of what a perfect model would gain, %.
    pub of_perfect_percent: f64,
    /// Folds by radius and by speed.
    pub folds: [usize; 2],
}

/// Resamples of the bootstrap.
const RESAMPLES: usize = 1000;

/// Response and effects as a machine.
pub fn machine(
    response: &Response,
    effects: &[Effect],
    lag_s: Option<f64>,
    kinematics: Option<Kinematics>,
) -> Machine {
    let mut machine = Machine::default();
    if response.a_s2 > 0.0 {
        let lag = Response {
            b_s4: 0.0,
            ..*response
        };
        if let Some(element) = lag.element() {
            machine.set_servo(element);
        }
        if response.b_s4 != 0.0 {
            machine.add_beta2(-0.5 * response.b_s4);
        }
    } else if let Ok(other) = Machine::from_servo(&beta(response)) {
        machine = other;
    }
    if let Some(lag_s) = lag_s {
        machine.set_delay(lag_s);
    }
    machine.arm = kinematics.map(Arm::sound);
    for effect in effects {
        // Already in the response.
        if !effect.cause().model().is_response() {
            effect.cause().model().apply(effect, &mut machine);
        }
    }
    machine
}

/// Eq. 15 with the same κ2 and κ4.
pub fn beta(response: &Response) -> Servo {
    let RadiusModel { beta1_s2, beta2_s4 } = RadiusModel::from(*response);
    Servo::Beta {
        beta1_s2,
        beta2_s4,
        half_width95: [0.0; 2],
    }
}

/// Response and effects that a set gives when it is fitted on some runs only.
fn fitted(found: &Explained, weights: &[f64], set: &[usize]) -> Option<(Response, Vec<Effect>)> {
    // The stated set, as far as these runs determine it.
    let (set, columns) = veto::determined(found, weights, set);
    let solution = solve(&found.gram.white(weights), &columns)?;
    let value = |column: usize| {
        columns
            .iter()
            .position(|&c| c == column)
            .map_or(0.0, |at| solution.coefficients[at])
    };
    let mut response = found.response;
    response.a_s2 += value(found.nuisance[0]);
    if let Some(&fourth) = found.nuisance.get(1) {
        response.b_s4 -= 2.0 * value(fourth);
    } else {
        response.b_s4 = 0.0;
    }
    // A servo is claimed only where the circles show one: beside f⁴/R³ it is what that needs.
    let alone = found.nuisance.len() == 1 && !set.iter().any(|&item| is_fourth_order(found, item));
    let own = columns
        .iter()
        .position(|column| *column == found.nuisance[0]);
    if let (true, Some(own)) = (alone, own)
        && response.a_s2.abs() < CLEAR * solution.covariance[(own, own)].sqrt()
    {
        response.a_s2 = 0.0;
    }
    let mut effects = Vec::new();
    for &item in &set {
        let Kind::Cause { cause, .. } = &found.items[item].kind else {
            continue;
        };
        // What has two names is fitted, so that it bends nothing else, but belongs to no machine.
        if found.tied.contains(&item) {
            continue;
        }
        let values: Vec<f64> = found.items[item]
            .columns
            .iter()
            .map(|&c| value(c))
            .collect();
        if cause.model().is_response() {
            response.b_s4 = -2.0 * values[0];
        }
        let size = if values.len() == 2 {
            values[0].hypot(values[1])
        } else {
            values[0]
        };
        effects.extend(super::verdict::effect_with(
            found, item, &values, size, [size; 2],
        ));
    }
    effects.extend(found.teeth.iter().filter_map(super::verdict::teeth_effect));
    let fastest = found
        .runs
        .iter()
        .map(|run| run.view.omega_rad_s)
        .fold(0.0, f64::max);
    let (w2, a, b) = (fastest * fastest, response.a_s2, response.b_s4);
    // A response that would blow up within the measured range is no response.
    if 1.0 + a * w2 + b * w2 * w2 < 0.1 {
        response = found.response;
    }
    Some((response, effects))
}

/// Standard errors above which κ2 of a servo is claimed.
const CLEAR: f64 = 3.0;

fn is_fourth_order(found: &Explained, item: usize) -> bool {
    matches!(&found.items[item].kind, Kind::Cause { cause, .. } if cause.model().is_response())
}

/// Measures the gain. `start` is the baseline if a model was given; else kv is fitted in each fold.
pub fn measure(
    campaign: &Campaign,
    found: &Explained,
    given: Option<&Machine>,
    clamp: Option<Clamp>,
    seed: u64,
) -> Gain {
    let circles: Vec<[f64; 3]> = campaign
        .runs
        .iter()
        .map(|run| [run.radius_m, run.feed_m_s, run.sign()])
        .collect();
    let [radii, feeds] = veto::folds(&circles);
    let count = [radii.len(), feeds.len()];
    let folds = [radii, feeds].concat();
    let errors: Vec<Errors> = folds
        .par_iter()
        .flat_map(|out| fold(campaign, found, given, clamp, out))
        .collect();
    let mean = |pick: &dyn Fn(&Errors) -> f64| -> f64 {
        errors.iter().map(pick).sum::<f64>() / errors.len().max(1) as f64
    };
    let (extended, baseline) = (mean(&|e| e.extended), mean(&|e| e.baseline));
    let floor = mean(&|e| e.floor);
    let percent = |extended: f64, baseline: f64| {
        if baseline > 0.0 && extended != baseline {
            100.0 * (1.0 - (extended / baseline).sqrt())
        } else {
            0.0
        }
    };
    // Runs, not samples, are drawn again: both folds of a run go together.
    let runs = campaign.runs.len();
    let mut sums = vec![[0.0; 2]; runs];
    for e in &errors {
        sums[e.run][0] += e.extended;
        sums[e.run][1] += e.baseline;
    }
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut draws: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let mut total = [0.0; 2];
            for _ in 0..runs {
                let pick = sums[rng.random_range(0..runs)];
                total = [total[0] + pick[0], total[1] + pick[1]];
            }
            percent(total[0], total[1])
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    let possible = baseline - floor;
    Gain {
        extended_rms_um: extended.sqrt() * 1e6,
        baseline_rms_um: baseline.sqrt() * 1e6,
        beta_rms_um: mean(&|e| e.beta).sqrt() * 1e6,
        no_model_rms_um: mean(&|e| e.none).sqrt() * 1e6,
        floor_rms_um: floor.sqrt() * 1e6,
        percent: percent(extended, baseline),
        ci95_percent: [draws[RESAMPLES / 40], draws[RESAMPLES - 1 - RESAMPLES / 40]],
        // Nothing to gain is all there is to gain.
        of_perfect_percent: if possible > 0.3 * floor {
            100.0 * (baseline - extended) / possible
        } else {
            100.0
        },
        folds: count,
    }
}

/// Mean squares of one run left out, m².
#[derive(Clone, Copy, Debug)]
struct Errors {
    run: usize,
    extended: f64,
    baseline: f64,
    beta: f64,
    none: f64,
    floor: f64,
}

fn fold(
    campaign: &Campaign,
    found: &Explained,
    given: Option<&Machine>,
    clamp: Option<Clamp>,
    out: &[usize],
) -> Vec<Errors> {
    let runs = &campaign.runs;
    let weights: Vec<f64> = (0..runs.len())
        .map(|i| if out.contains(&i) { 0.0 } else { 1.0 })
        .collect();
    // A pattern without a name has no place in the simulation, but it must not bend the causes.
    let set = &found.chosen;
    let training: Vec<usize> = (0..runs.len()).filter(|&i| weights[i] > 0.0).collect();
    let programmed: Vec<Size> = training
        .iter()
        .map(|&i| sized(found, i, &runs[i]))
        .collect();
    let lag_only = fit_lag(&programmed);
    let baseline = given.cloned().unwrap_or_else(|| {
        // Of an arm the simulation has a pattern of its own, and the delay turns it.
        let delay = campaign.kinematics.map(|_| found.lag.tau_s);
        machine(&lag_only, &[], delay, campaign.kinematics)
    });
    let nothing_new = clamp.is_none() && found.teeth.is_empty() && !found.stated().any(|_| true);
    let extended =
        fitted(found, &weights, set)
            .filter(|_| !nothing_new)
            .map(|(response, effects)| {
                let delay = Some(found.lag.tau_s);
                let mut machine = machine(&response, &effects, delay, campaign.kinematics);
                if let Some(clamp) = clamp {
                    machine.centripetal_limit_m_s2 = Some(clamp.limit_m_s2);
                }
                machine
            });
    let beta = beta_of(&programmed);
    let started = runs
        .iter()
        .filter_map(|run| run.started_s)
        .fold(f64::INFINITY, f64::min);
    out.par_iter()
        .map(|&i| {
            let run = &runs[i];
            let mut test = CircleTest::of(run);
            match run.started_s {
                Some(started_s) => test.started_s = started_s - started,
                None => test.started_s = found.runs[i].view.elapsed * found.runs[i].view.campaign_s,
            }
            let left = |prediction: &[f64]| left_of(run, &found.bases[i], prediction);
            let samples = run.samples.deviation_m.len() as f64;
            let simulated = |machine: &Machine| left(&at_samples(machine, &test, run));
            let base = simulated(&baseline);
            let x = run.feed_m_s.powi(2) / run.radius_m;
            let size = beta[0] * x + beta[1] * x * x / run.radius_m;
            let flat = |value: f64| left(&vec![value; run.samples.deviation_m.len()]);
            // The phase of a tone is new in each run: no model could foretell it.
            let tone = found
                .tones
                .iter()
                .map(|tone| tone.energy_m2[i].max(0.0))
                .sum::<f64>()
                / samples;
            let scatter =
                tone + found.spread.order_m2[0] + found.spread.order_m2[2..].iter().sum::<f64>();
            Errors {
                run: i,
                extended: extended.as_ref().map_or(base, &simulated),
                baseline: base,
                beta: flat(size),
                none: flat(0.0),
                floor: found.spread.noise_m2 + scatter,
            }
        })
        .collect()
}

/// Size of a run; of an arm without what its kinematics add to it, as far as the common response tells.
fn sized(found: &Explained, index: usize, run: &Run) -> Size {
    let size = Size::of(run, run.feed_m_s);
    let arm = found.runs.get(index).and_then(|run| run.view.arm.as_ref());
    let extra_m = arm.map_or(0.0, |arm| beyond_slides_m(arm, &found.response, &size));
    Size {
        error_m: size.error_m - extra_m,
        ..size
    }
}

/// Mean square of what a prediction leaves of a run, m². The centre is the operator's, and what the search hid from itself is
/// measured all the same.
fn left_of(run: &Run, basis: &Basis, prediction: &[f64]) -> f64 {
    let deviation = &run.samples.deviation_m;
    let rest: Vec<f64> = deviation
        .iter()
        .zip(prediction)
        .map(|(y, p)| y - p)
        .collect();
    let [cos, sin] = basis.centre(&rest);
    (dot(&rest, &rest) - cos * cos - sin * sin).max(0.0) / deviation.len() as f64
}

/// Deviations of a simulated circle where a run has its samples, m. A whole turn by the clock is sampled as the run is;
/// an arc is a part of the turn, and where the angle was measured it is that of the tool, not of the command.
fn at_samples(machine: &Machine, test: &CircleTest, run: &Run) -> Vec<f64> {
    let samples = &run.samples;
    if samples.angle_inferred && samples.arc_rad().is_none() {
        return circle(machine, test).deviation_m;
    }
    let turn = circle(
        machine,
        &CircleTest {
            start_angle_rad: 0.0,
            samples: Some(SAMPLES_PER_TURN),
            ..*test
        },
    );
    let angle = |index: usize| {
        let [x, y] = turn.position_m[index];
        if samples.angle_inferred {
            turn.angle_rad[index]
        } else {
            y.atan2(x)
        }
    };
    let mut places: Vec<[f64; 2]> = (0..turn.deviation_m.len())
        .map(|index| [angle(index).rem_euclid(TAU), turn.deviation_m[index]])
        .collect();
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let between = |theta: f64| {
        let at = theta.rem_euclid(TAU);
        let next = places.partition_point(|place| place[0] <= at);
        let count = places.len();
        let ([before, from], [after, to]) =
            (places[(next + count - 1) % count], places[next % count]);
        let span = (after - before).rem_euclid(TAU);
        let share = if span > 0.0 {
            (at - before).rem_euclid(TAU) / span
        } else {
            0.0
        };
        from + share.min(1.0) * (to - from)
    };
    samples
        .angle_rad
        .iter()
        .map(|theta| between(*theta))
        .collect()
}

/// β1, β2 by least squares on the sizes, β0 of each radius free where it was run at two speeds or more.
fn beta_of(sizes: &[Size]) -> [f64; 2] {
    let row = |s: &Size| {
        let w2 = s.omega_rad_s.powi(2);
        [w2 * s.radius_m, w2 * w2 * s.radius_m, s.error_m]
    };
    let mut radii: Vec<f64> = sizes.iter().map(|s| s.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * *b);
    let (mut xx, mut xy, mut yy, mut xe, mut ye) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for radius_m in radii {
        let own: Vec<[f64; 3]> = sizes
            .iter()
            .filter(|s| (s.radius_m - radius_m).abs() < 1e-9 * radius_m)
            .map(row)
            .collect();
        let mean: [f64; 3] =
            std::array::from_fn(|k| own.iter().map(|row| row[k]).sum::<f64>() / own.len() as f64);
        for row in own {
            let [x, y, e]: [f64; 3] = std::array::from_fn(|k| row[k] - mean[k]);
            xx += x * x;
            xy += x * y;
            yy += y * y;
            xe += x * e;
            ye += y * e;
        }
    }
    let determinant = xx * yy - xy * xy;
    if determinant.abs() > 1e-9 * xx * yy {
        [
            (xe * yy - ye * xy) / determinant,
            (ye * xx - xe * xy) / determinant,
        ]
    } else {
        [if xx > 0.0 { xe / xx } else { 0.0 }, 0.0]
    }
}

/// The model file of what was found on all runs.
pub fn extended_model(
    campaign: &Campaign,
    found: &Explained,
    effects: Vec<Effect>,
    delay_s: Option<f64>,
) -> ModelFile {
    let weights = found.all();
    let response =
        fitted(found, &weights, &found.chosen).map_or(found.response, |(response, _)| response);
    let servo = match response.element() {
        Some(Element::SecondOrder {
            omega_n_rad_s,
            zeta,
        }) => Servo::SecondOrder {
            omega_n_rad_s,
            zeta,
        },
        Some(Element::Lag { kv_per_s }) => Servo::Lag { kv_per_s },
        _ => beta(&response),
    };
    let range = |value: &dyn Fn(&crate::campaign::Run) -> f64| {
        campaign
            .runs
            .iter()
            .map(value)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| {
                [lo.min(v * 1e3), hi.max(v * 1e3)]
            })
    };
    ModelFile {
        format: crate::model_file::FORMAT,
        campaign: campaign.name.clone(),
        machine: campaign.machine.clone(),
        servo,
        valid: crate::model_file::Valid {
            radius_mm: range(&|r| r.radius_m),
            feed_mm_s: range(&|r| r.feed_m_s),
            centre_mm: campaign.kinematics.and_then(|_| middle_mm(campaign)),
        },
        kinematics: campaign.kinematics,
        effects: effects
            .into_iter()
            .filter(|e| !e.cause().model().is_response())
            .collect(),
        delay_s,
    }
}

/// Middle of the centres of all circles, mm to the micrometre, if all are known.
fn middle_mm(campaign: &Campaign) -> Option<[f64; 3]> {
    let centres: Option<Vec<[f64; 3]>> = campaign.runs.iter().map(|run| run.centre_m).collect();
    let centres = centres.filter(|centres| !centres.is_empty())?;
    let mean = |k: usize| centres.iter().map(|c| c[k]).sum::<f64>() / centres.len() as f64;
    Some([0, 1, 2].map(|k| (mean(k) * 1e6).round() / 1e3))
}
