//! From a campaign to the set of explanations: prepare, search, refine, and again about the better model.
use super::design_column::Column;
use super::explained::{Explained, chosen_kinds, refit, residual};
use super::gram::Gram;
use super::hypothesis::Kind;
use super::linear::Solution;
use super::material::{is_material, prune};
use super::pattern::Pattern;
use super::propose::propose_patterns;
use super::roughness::{self, Teeth};
use super::search::{columns_of, select};
use super::shape;
use super::spread;
use super::survey::{Lag, Prepared, Response, Survey, misfit};
use super::tangent;
use super::tone::{self, Tone};
use crate::causes::{ALL, Evidence, Harmonics, RunView, Site, of_response};
use rayon::prelude::*;
use std::sync::Arc;

/// What stands before the search.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Response of the baseline.
    pub response: Response,
    /// Whether the baseline has a fourth-order coefficient of its own (then `higher_order_dynamics` is in it).
    pub own_fourth_order: bool,
    /// Scatter of the size between runs that is taken at least, m.
    pub repeatability_m: f64,
    /// By how much the delay is taken as longer than the response says, s, where the set-up offset does not show it.
    pub more_lag_s: f64,
}

const PASSES: usize = 6;
/// Change of the response that does not matter: what it leaves is taken up to first order. Shares of κ2 and b.
const SETTLED: [f64; 2] = [1e-3, 1e-2];
/// Change of the lag that does not matter, s.
const SETTLED_LAG_S: f64 = 2e-4;

/// Change of a response's own lag that makes it another one, s: the longest move of a pass.
const OTHER_LAG_S: f64 = 5e-3;

/// Most tones of one machine.
const TONES: usize = 2;

/// What is taken out of the samples before the search.
#[derive(Clone, Debug, Default)]
struct Seen {
    tones: Vec<Tone>,
    teeth: Vec<Teeth>,
    /// For how many tones teeth were looked for: a tone may cover them, and pose as them.
    looked_beside: Option<usize>,
}

/// Searches the explanations of a campaign.
pub fn explain(survey: &Survey, start: &Start) -> Explained {
    let (mut response, mut more_lag_s) = (start.response, start.more_lag_s);
    let mut seen = Seen::default();
    let (mut found, mut longer_s) =
        pass(survey, start, (response, more_lag_s), &mut seen, &[], None);
    // Scatter is measured well only beside a model, so there are two passes at least.
    let mut known = None;
    for _ in 1..PASSES {
        let tones = seen.tones.len();
        let left = residual(&found);
        if tones < TONES {
            let tone = tone::find(&found.runs, &left, &found.spread);
            seen.tones
                .extend(tone.filter(|tone| is_material(&found, tone) && tone.is_new(&seen.tones)));
        }
        let refined = refined_response(&found, response);
        let settled = (refined.a_s2 - response.a_s2).abs() <= SETTLED[0] * response.a_s2.abs()
            && (refined.b_s4 - response.b_s4).abs() <= SETTLED[1] * refined.b_s4.abs()
            && longer_s.abs() < SETTLED_LAG_S;
        let kinds = chosen_kinds(&found);
        if settled && tones == seen.tones.len() && known == Some(kinds.len()) {
            break;
        }
        known = Some(kinds.len());
        let [new, old] = [&refined, &response].map(|response| survey.lag(response));
        more_lag_s = if !new.measured && !old.measured {
            // The delay is a parameter of its own: another response does not change what is known of it.
            more_lag_s + longer_s + old.tau_s - new.tau_s
        } else if (new.tau_s - old.tau_s).abs() > OTHER_LAG_S {
            // A response of another kind has a lag of its own: what the old one lacked says nothing of it.
            0.0
        } else {
            more_lag_s + longer_s
        };
        response = refined;
        let left = left.all_samples(&found.runs);
        (found, longer_s) = pass(
            survey,
            start,
            (response, more_lag_s),
            &mut seen,
            &kinds,
            Some(&left),
        );
    }
    found.tones = seen.tones;
    found
}

/// Response with the fitted corrections of its own coefficients and of the fourth order.
fn refined_response(found: &Explained, response: Response) -> Response {
    let mut refined = response;
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    for (&column, &amount) in columns.iter().zip(&found.solution.coefficients) {
        if column == found.nuisance[0] {
            refined.a_s2 += amount;
        } else if found.nuisance.get(1) == Some(&column) {
            refined.b_s4 -= 2.0 * amount;
        }
    }
    for &item in &found.chosen {
        match &found.items[item].kind {
            Kind::Cause { cause, .. } if cause.model().is_response() => {}
            _ => continue,
        }
        if let Some(at) = columns
            .iter()
            .position(|&c| c == found.items[item].columns[0])
        {
            refined.b_s4 = -2.0 * found.solution.coefficients[at];
        }
    }
    let fastest = found
        .runs
        .iter()
        .map(|run| run.view.omega_rad_s)
        .fold(0.0, f64::max);
    let w2 = fastest * fastest;
    // A response that would blow up within the measured range is no response.
    if 1.0 + refined.a_s2 * w2 + refined.b_s4 * w2 * w2 > 0.1 {
        refined
    } else {
        response
    }
}

/// What the runs leave of the baseline, and what is seen of it.
struct Prepare {
    runs: Vec<Prepared>,
    lag: Lag,
    data: Column,
}

/// Makes the runs ready: tones taken out, teeth hidden. `true`: what was found before is not to be trusted.
fn prepare(
    survey: &Survey,
    (response, more_lag_s): (Response, f64),
    seen: &mut Seen,
) -> (Prepare, bool) {
    let (mut runs, lag) = survey.prepare(&response, more_lag_s);
    for tone in &seen.tones {
        tone.remove(&mut runs);
    }
    let mut afresh = false;
    if seen.looked_beside != Some(seen.tones.len()) {
        // Before anything is believed: teeth look like everything.
        let whole = misfit(&runs).all_samples(&runs);
        seen.teeth = roughness::find(&runs, &whole, &spread::measure(&runs, &whole, false));
        // What was found with a tone or teeth in sight is not to be trusted.
        afresh = seen.looked_beside.is_some();
        seen.looked_beside = Some(seen.tones.len());
    }
    if !seen.teeth.is_empty() {
        runs.par_iter_mut().for_each(|run| {
            let covered = |i: usize| seen.teeth.iter().any(|teeth| teeth.covers(run, i));
            let hidden = (0..run.deviation_m.len()).map(covered).collect();
            run.hide(hidden);
        });
    }
    let data = misfit(&runs);
    (Prepare { runs, lag, data }, afresh)
}

/// `kinds` and `left`: what the pass before has chosen, and what that left.
fn pass(
    survey: &Survey,
    start: &Start,
    (response, more_lag_s): (Response, f64),
    seen: &mut Seen,
    kinds: &[Kind],
    left: Option<&[Vec<f64>]>,
) -> (Explained, f64) {
    let (Prepare { runs, lag, data }, afresh) = prepare(survey, (response, more_lag_s), seen);
    let (kinds, left) = if afresh {
        (&[][..], None)
    } else {
        (kinds, left)
    };
    // Once there is a model, what it leaves shows the scatter better than the data do.
    let spread = match left {
        Some(left) => spread::measure(&runs, left, true),
        None => spread::measure(&runs, &data.all_samples(&runs), false),
    }
    .at_least(start.repeatability_m);
    let mut found = Explained {
        apart_m2: seen
            .tones
            .iter()
            .flat_map(|tone| &tone.energy_m2)
            .sum::<f64>()
            + seen
                .teeth
                .iter()
                .map(|teeth| roughness::energy_m2(teeth, &runs))
                .sum::<f64>(),
        solution: Solution::default(),
        gram: Gram::open(&runs, &spread, data),
        runs: runs.into(),
        bases: survey.bases(),
        response,
        lag,
        spread,
        nuisance: Vec::new(),
        items: Vec::new(),
        chosen: Vec::new(),
        tied: Vec::new(),
        tones: Vec::new(),
        tangents: None,
        more_lag_s,
        teeth: seen.teeth.clone(),
    };
    enter(&mut found, start, kinds);
    let all = found.all();
    search(&mut found, &all);
    let longer_s = tangent::finish(&mut found, &all);
    (found, longer_s)
}

/// Refits, improves, proposes and selects until the same explanations are chosen again.
fn search(found: &mut Explained, all: &[f64]) {
    let mut barred: Vec<usize> = Vec::new();
    let mut polished: Vec<Kind> = Vec::new();
    for _ in 0..6 {
        let before: Vec<Kind> = chosen_kinds(found);
        refit(found, all);
        shape::improve(found);
        refit(found, all);
        if before != polished {
            tangent::polish(found, all);
            polished = chosen_kinds(found);
        }
        propose_patterns(found);
        let products = found.gram.white(all);
        found.chosen = select(
            &products,
            &found.nuisance,
            &found.items,
            &found.chosen,
            &barred,
        );
        found.chosen = prune(found, all, found.chosen.clone(), &mut barred);
        bar_impossible(found, all, &mut barred);
        if chosen_kinds(found) == before {
            break;
        }
    }
    refit(found, all);
    if chosen_kinds(found) != polished {
        tangent::polish(found, all);
    }
}

/// Enters the columns of the model itself, of what was chosen before, and of everything that may compete.
fn enter(found: &mut Explained, start: &Start, kinds: &[Kind]) {
    let runs = Arc::clone(&found.runs);
    let views = shape::views(&runs);
    // ∂ΔR/∂a about the response.
    let own = |run: &Prepared| {
        if let Some(arm) = &run.view.arm {
            return run.low_of(&arm.per_kappa2);
        }
        let (w, g) = (run.view.omega_rad_s, run.view.gain);
        run.low_of(&Harmonics::mean(
            -0.5 * run.view.radius_m * w * w * g.powi(3),
        ))
    };
    found.nuisance.push(
        found
            .gram
            .push(Column::within(runs.iter().map(own).collect())),
    );
    let before = kinds
        .iter()
        .map(|kind| (kind.clone(), shape::count(kind, &views)))
        .collect();
    found.chosen = found.enter(before).collect();
    // The data no longer hold what the response has taken in; its column still does.
    if start.own_fourth_order {
        if let Some(model) = of_response() {
            let fourth = Kind::Cause {
                cause: model.cause(),
                site: Site::Machine,
                shape: Vec::new(),
            };
            let columns = fourth.columns_over(&runs);
            found.nuisance.extend(found.gram.push_all(columns));
        }
    } else if found.response.b_s4 != 0.0 {
        restore_fourth_order(found);
    }
    let mut further = Vec::new();
    let no_fourth = start.own_fourth_order || !shows_fourth_order(&views);
    for model in ALL {
        if model.evidence() != Evidence::Signature || (no_fourth && model.is_response()) {
            continue;
        }
        let shapes = model.shapes(&views);
        for site in model.sites(&views) {
            let known = kinds.iter().any(
                |kind| matches!(kind, Kind::Cause { cause, site: at, .. } if *cause == model.cause() && *at == site),
            );
            if let (false, Some(first)) = (known, shapes.first()) {
                let kind = Kind::Cause {
                    cause: model.cause(),
                    site,
                    shape: first.clone(),
                };
                further.push((kind, shapes.len()));
            }
        }
    }
    for pattern in Pattern::sizes() {
        let kind = Kind::Pattern(pattern);
        if !kinds.contains(&kind) {
            further.push((kind, 1));
        }
    }
    found.enter(further);
}

/// Whether the rates of turn can tell f⁴/R³ from f²/R and a static error of each radius: two more rates than radii.
fn shows_fourth_order(views: &[RunView]) -> bool {
    let mut circles: Vec<[f64; 2]> = views
        .iter()
        .map(|view| [view.radius_m, view.omega_rad_s])
        .collect();
    circles.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let same = |a: f64, b: f64| (a - b).abs() < 0.02 * b.abs();
    circles.dedup_by(|a, b| same(a[0], b[0]) && same(a[1], b[1]));
    let rates = circles.len();
    circles.dedup_by(|a, b| same(a[0], b[0]));
    rates >= circles.len() + 2
}

/// Takes out, and bars, what was fitted with a value that its cause cannot have.
fn bar_impossible(found: &mut Explained, weights: &[f64], barred: &mut Vec<usize>) {
    loop {
        refit(found, weights);
        let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
        let amount = |item: usize| {
            let at = columns
                .iter()
                .position(|column| *column == found.items[item].columns[0]);
            at.and_then(|at| found.solution.coefficients.get(at))
                .copied()
                .unwrap_or(0.0)
        };
        let impossible = found
            .chosen
            .iter()
            .copied()
            .find(|&item| match &found.items[item].kind {
                // A phase takes the sign of an amplitude.
                Kind::Cause { cause, site, .. } => {
                    cause.model().columns() == 1
                        && !cause
                            .model()
                            .allows_beside(amount(item), &found.causes_on(*site, item))
                }
                Kind::Pattern(_) => false,
            });
        let Some(item) = impossible else { break };
        found.chosen.retain(|&other| other != item);
        barred.push(item);
    }
}

/// The response holds a fourth-order part that the search may still reject: give it back to the data, to first
/// order exactly as its column would take it.
fn restore_fourth_order(found: &mut Explained) {
    let shift = |run: &Prepared| {
        if let Some(arm) = &run.view.arm {
            return run.low_of(&arm.per_beta2.times(-0.5 * found.response.b_s4));
        }
        let (w, g) = (run.view.omega_rad_s, run.view.gain);
        run.low_of(&Harmonics::mean(
            -0.5 * found.response.b_s4 * run.view.radius_m * w.powi(4) * g.powi(3),
        ))
    };
    let mut data = found.gram.column(0).clone();
    data.add(1.0, &Column::within(found.runs.iter().map(shift).collect()));
    found.gram.replace_all([(0, data)]);
}
