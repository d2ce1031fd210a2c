//! Everything that is left must be noise, or it is called unexplained: a test of all that the search leaves, whatever its
//! law.
//!
//! For each order 2 to 40 and each parity, what is left of the runs is held against a size that goes as f^a·R^b,
//! a = 0…4, b = −2…2, turned with the machine or with the clock. Orders that scatter between runs are judged by that
//! scatter, which may itself grow with feed and radius; the higher ones by the level of the orders beside them, which
//! holds for noise that is correlated along the turn as well. The mean size is held against the order of the runs, and
//! against the radius. Each family of tests shares out one chance of a false alarm.
use super::explained::{Explained, energies, residual};
use super::finding::Signature;
use super::hypothesis::Kind;
use super::low_orders::Low;
use super::residual_waves::{self, Waves, median};
use super::survey::Prepared;
use super::veto;
use crate::causes::ORDERS;
use std::f64::consts::LN_2;

/// Chance of a false alarm of each family of tests (low orders, high orders, order of the runs, radius) in a campaign.
pub const FALSE_ALARM: f64 = 0.003;

/// Something that is left and is no noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Leftover {
    /// What it looks like.
    pub signature: Signature,
    /// Its root mean square over all samples, µm.
    pub rms_um: f64,
    /// Chance of so much by noise, all tests counted.
    pub chance: f64,
}

/// Fewest whole turns whose waves are compared.
const FEWEST_RUNS: usize = 6;
/// Feed exponents, radius exponents.
const EXPONENTS: ([i32; 5], [i32; 5]) = ([0, 1, 2, 3, 4], [-2, -1, 0, 1, 2]);
/// The 25 laws are far from independent: over usual grids they count as so many.
const LAWS: f64 = 6.0;
/// Smallest rms, in the loudest sixth of the runs, that is of interest: share of the noise of a sample …
const OF_NOISE: f64 = 0.4;
/// … and of what is explained there by causes with a form: below, it may be the error of their closed forms.
const OF_FORM: f64 = 0.12;

/// What is left of one run, ready to be tested.
struct Left {
    sign: f64,
    feed: f64,
    radius: f64,
    lag_rad: f64,
    samples: f64,
    waves: Waves,
    /// Mean square of what causes with a form explain, m².
    form_m2: f64,
}

/// Everything that is left and cannot be noise, the least likely first.
pub fn test(found: &Explained) -> Vec<Leftover> {
    let left = residual(found);
    let samples = left.all_samples(&found.runs);
    let forms = forms_m2(found);
    let all: Vec<Left> = found
        .runs
        .iter()
        .zip(residual_waves::waves(&found.runs, &samples))
        .zip(forms)
        .map(|((run, waves), form_m2)| Left {
            sign: run.view.sign,
            feed: run.view.feed_m_s / 0.3,
            radius: run.view.radius_m / 0.15,
            lag_rad: run.view.sign * run.turned_rad,
            samples: run.deviation_m.len() as f64,
            waves,
            form_m2,
        })
        .collect();
    let mut out = Vec::new();
    let whole: Vec<&Left> = all
        .iter()
        .filter(|run| !run.waves.of_order.is_empty())
        .collect();
    if whole.len() >= FEWEST_RUNS {
        out.extend(by_order(found, &whole));
    }
    // The coordinate along the mean: of an arc, too, it is free of the centre.
    let size = |(low, run): (&Low, &Prepared)| low[0] / (run.visible().max(1) as f64).sqrt();
    let sizes: Vec<f64> = left.low().iter().zip(found.runs.iter()).map(size).collect();
    out.extend(super::run_order::test(found, &sizes));
    out.sort_by(|a, b| a.chance.total_cmp(&b.chance));
    out
}

/// Against what is left of all orders, rms: below, a cause may be a piece of it. One with shape parameters fits more.
const LARGER_THAN_LEFT: [f64; 2] = [0.6, 1.0];

/// Takes out the causes that may be pieces of something unlisted: those that explain less than what is left in spite of them.
pub fn take_out_pieces(found: &mut Explained) {
    let squares: f64 = test(found)
        .iter()
        .filter(|left| left.signature.harmonic.is_some())
        .map(|left| left.rms_um.powi(2))
        .sum();
    let samples: usize = found.runs.iter().map(|run| run.deviation_m.len()).sum();
    let left_m2 = squares * 1e-12 * samples as f64;
    let (each, _) = energies(found, &found.all());
    let is_piece = |item: usize, energy_m2: f64| match &found.items[item].kind {
        Kind::Cause { cause, .. } => {
            let flexible = usize::from(cause.model().flexible());
            energy_m2 < LARGER_THAN_LEFT[flexible].powi(2) * left_m2
        }
        Kind::Pattern(_) => false,
    };
    let pieces: Vec<usize> = found
        .chosen
        .iter()
        .zip(each)
        .filter(|(item, energy_m2)| is_piece(**item, *energy_m2))
        .map(|(item, _)| *item)
        .collect();
    for item in pieces {
        veto::take_out(found, item);
    }
}

/// Mean square of what the chosen explanations with a form, that is more than a size, do in each run, m².
fn forms_m2(found: &Explained) -> Vec<f64> {
    let columns = super::search::columns_of(&found.nuisance, &found.items, &found.chosen);
    let mut fitted = super::design_column::Column::zero(found.runs.len());
    for (&column, &amount) in columns.iter().zip(&found.solution.coefficients) {
        fitted.add(amount, found.gram.column(column));
    }
    found
        .runs
        .iter()
        .enumerate()
        .map(|(index, run)| {
            let low = &fitted.low()[index];
            let outside = fitted.outside(run);
            let energy = low[3..].iter().chain(outside).map(|x| x * x).sum::<f64>();
            let apart = found.apart_m2 / found.runs.len() as f64;
            (energy + apart) / run.deviation_m.len().max(1) as f64
        })
        .collect()
}

/// Growth of the scatter of the low orders with feed and radius: ln of the variance of each run less that of the usual
/// run, by a regression over all low orders but `own`.
fn growth(whole: &[&Left], own: usize) -> Vec<f64> {
    let orders: Vec<usize> = (2..=ORDERS).filter(|order| *order != own).collect();
    let mut levels = vec![0.0; whole.len()];
    for &order in &orders {
        let logs: Vec<f64> = whole
            .iter()
            .map(|run| square(run.waves.of_order.get(order)).max(1e-30).ln())
            .collect();
        let middle = median(&mut logs.clone());
        levels
            .iter_mut()
            .zip(&logs)
            .for_each(|(level, log)| *level += (log - middle) / orders.len() as f64);
    }
    let columns: [Vec<f64>; 3] = [
        vec![1.0; whole.len()],
        whole.iter().map(|run| run.feed.ln()).collect(),
        whole.iter().map(|run| run.radius.ln()).collect(),
    ];
    let fitted = super::linear::fitted_values(&columns, &levels);
    let mean = fitted.iter().sum::<f64>() / fitted.len() as f64;
    fitted.iter().map(|value| value - mean).collect()
}

fn square(wave: Option<&[f64; 2]>) -> f64 {
    wave.map_or(0.0, |[a, b]| a * a + b * b)
}

/// Orders on either side by which the level at an order is judged.
const BESIDE: usize = 6;

/// Variance |z|² of each run at an order, by the orders beside it, and no less than the noise of a sample gives.
fn level_beside(run: &Left, order: usize, noise_m2: f64) -> f64 {
    let mut beside: Vec<f64> = (order.saturating_sub(BESIDE)..=order + BESIDE)
        .filter(|other| *other != order && *other > ORDERS)
        .filter_map(|other| run.waves.of_order.get(other))
        .map(|wave| square(Some(wave)))
        .collect();
    let white = 4.0 * noise_m2 / run.samples;
    (median(&mut beside) / LN_2).max(white)
}

/// Test of one order, parity, sense of turning and law.
struct Hit {
    order: usize,
    odd: bool,
    machine: bool,
    law: (i32, i32),
    chance: f64,
    rms_m: f64,
}

fn by_order(found: &Explained, whole: &[&Left]) -> Vec<Leftover> {
    let noise_m2 = found.spread.noise_m2;
    let highest = whole
        .iter()
        .map(|run| run.waves.of_order.len())
        .min()
        .unwrap_or(0);
    let turns = whole.iter().any(|run| run.lag_rad != 0.0);
    let senses: &[bool] = if turns { &[true, false] } else { &[true] };
    let ways: &[bool] = if whole.iter().any(|run| run.sign != whole[0].sign) {
        &[false, true]
    } else {
        &[false]
    };
    let mut hits: Vec<Hit> = Vec::new();
    for order in 2..highest {
        let low = order <= ORDERS;
        let grown = if low {
            growth(whole, order)
        } else {
            Vec::new()
        };
        let levels: Vec<f64> = whole
            .iter()
            .enumerate()
            .map(|(i, run)| {
                if low {
                    grown[i].exp()
                } else {
                    level_beside(run, order, noise_m2)
                }
            })
            .collect();
        let orders = if low {
            ORDERS - 1
        } else {
            highest.saturating_sub(ORDERS + 1).max(1)
        };
        let tests = orders as f64 * senses.len() as f64 * ways.len() as f64 * LAWS;
        for &machine in senses {
            for &odd in ways {
                for a in EXPONENTS.0 {
                    for b in EXPONENTS.1 {
                        let hit = one(whole, &levels, order, odd, machine, (a, b));
                        let hit = Hit {
                            chance: hit.chance * tests,
                            ..hit
                        };
                        if hit.chance < FALSE_ALARM && is_material(found, whole, &hit) {
                            hits.push(hit);
                        }
                    }
                }
            }
        }
    }
    hits.sort_by(|a, b| a.chance.total_cmp(&b.chance));
    let mut seen: Vec<usize> = Vec::new();
    hits.retain(|hit| {
        !seen.contains(&hit.order) && {
            seen.push(hit.order);
            true
        }
    });
    hits.iter().map(leftover).collect()
}

fn size(run: &Left, (a, b): (i32, i32), odd: bool) -> f64 {
    run.feed.powi(a) * run.radius.powi(b) * if odd { run.sign } else { 1.0 }
}

/// Explained part of an order under one law, against the levels; those of low orders are relative, and what is left of
/// the order itself gives their scale.
fn one(
    whole: &[&Left],
    levels: &[f64],
    order: usize,
    odd: bool,
    machine: bool,
    law: (i32, i32),
) -> Hit {
    let (mut pull, mut own, mut total) = ([0.0; 2], 0.0, 0.0);
    for (run, level) in whole.iter().zip(levels) {
        let [re, im] = run.waves.of_order[order];
        let turn = if machine {
            order as f64 * run.sign * run.lag_rad
        } else {
            0.0
        };
        let (sin, cos) = turn.sin_cos();
        let s = size(run, law, odd);
        pull[0] += s * (re * cos - im * sin) / level;
        pull[1] += s * (re * sin + im * cos) / level;
        own += s * s / level;
        total += (re * re + im * im) / level;
    }
    let explained = (pull[0] * pull[0] + pull[1] * pull[1]) / own.max(f64::MIN_POSITIVE);
    let dof = whole.len() as f64 - 1.0;
    // Both parts of z: F(2, 2·dof), whose tail is in closed form.
    let ratio = explained
        / (total - explained)
            .max(1e-12 * total)
            .max(f64::MIN_POSITIVE);
    let against_rest = (1.0 + ratio).powf(-dof);
    let chance = if order <= ORDERS {
        against_rest
    } else {
        // The levels are medians of few and scatter themselves.
        (-explained / LEVELS_SCATTER)
            .exp()
            .max(against_rest.powf(SHARED))
    };
    let amount = pull[0].hypot(pull[1]) / own.max(f64::MIN_POSITIVE);
    let (mut energy, mut samples) = (0.0, 0.0);
    for run in whole {
        energy += 0.5 * run.samples * (amount * size(run, law, odd)).powi(2);
        samples += run.samples;
    }
    Hit {
        order,
        odd,
        machine,
        law,
        chance,
        rms_m: (energy / samples).sqrt(),
    }
}

/// By how much a sum of squares over levels that are medians of a dozen waves exceeds one over true levels.
const LEVELS_SCATTER: f64 = 1.6;
/// The rest of the order itself must agree, by the root of its chance: a pattern of few loud runs leaves little of it.
const SHARED: f64 = 0.5;

/// Whether it is of interest in the runs where it is loudest.
fn is_material(found: &Explained, whole: &[&Left], hit: &Hit) -> bool {
    let mut sizes: Vec<(f64, f64)> = whole
        .iter()
        .map(|run| (size(run, hit.law, hit.odd).powi(2), run.form_m2))
        .collect();
    let mean = sizes.iter().map(|s| s.0).sum::<f64>() / sizes.len() as f64;
    sizes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let loudest = &sizes[..(sizes.len() / 6).max(1)];
    let count = loudest.len() as f64;
    let loud_m2 = hit.rms_m.powi(2) * loudest.iter().map(|s| s.0).sum::<f64>()
        / count
        / mean.max(f64::MIN_POSITIVE);
    let form_m2 = loudest.iter().map(|s| s.1).sum::<f64>() / count;
    loud_m2 > OF_NOISE.powi(2) * found.spread.sample_m2 && loud_m2 > OF_FORM.powi(2) * form_m2
}

/// How rare a thing is, for a person.
fn chance_words(chance: f64) -> String {
    if chance < 1e-6 {
        "less than once in a million".to_owned()
    } else {
        format!("once in {:.0}", 1.0 / chance.max(f64::MIN_POSITIVE))
    }
}

fn leftover(hit: &Hit) -> Leftover {
    let (a, b) = hit.law;
    let ways = if hit.odd {
        "flips with the direction"
    } else {
        "the same both ways"
    };
    let rms_um = hit.rms_m * 1e6;
    let turning = if hit.machine {
        ""
    } else {
        ", by the clock rather than the machine's place"
    };
    Leftover {
        signature: Signature {
            harmonic: Some(hit.order),
            direction_parity: Some(if hit.odd { "odd" } else { "even" }),
            feed_exponent: Some(f64::from(a)),
            radius_exponent: Some(f64::from(b)),
            words: vec![format!(
                "{} waves a turn, {ways}, about {}{turning} ({rms_um:.2} µm rms): {} by noise alone",
                hit.order,
                super::unexplained::law_words(f64::from(a), f64::from(b)),
                chance_words(hit.chance)
            )],
            ..Signature::default()
        },
        rms_um,
        chance: hit.chance,
    }
}

/// Adds what the test has found to what the patterns say.
pub fn report(unexplained: &mut super::finding::Unexplained, leftovers: &[Leftover]) {
    const MOST: usize = 4;
    let Some(first) = leftovers.first() else {
        return;
    };
    if !unexplained.present {
        unexplained.signature = Signature {
            words: Vec::new(),
            ..first.signature.clone()
        };
    }
    unexplained.present = true;
    let words = leftovers
        .iter()
        .take(MOST)
        .flat_map(|left| left.signature.words.clone());
    unexplained.signature.words.extend(words);
    let squares: f64 = leftovers.iter().map(|left| left.rms_um.powi(2)).sum();
    unexplained.rms_um = unexplained.rms_um.hypot(squares.sqrt());
}
