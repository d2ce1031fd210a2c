//! From a campaign to the set of explanations: prepare, search, refine, and again about the better model.
use super::explained::{Explained, chosen_kinds, refit, residual};
use super::item::{Item, Kind};
use super::ledger::{Ledger, Samples};
use super::linear::Solution;
use super::material::{is_material, prune};
use super::pattern::Pattern;
use super::propose::propose_patterns;
use super::roughness::{self, Teeth};
use super::search::{columns_of, select};
use super::shape;
use super::spread;
use super::survey::{self, Prepared, Response};
use super::tangent;
use super::tone::{self, Tone};
use crate::campaign::Campaign;
use crate::causes::{ALL, Cause, Evidence};

/// What stands before the search.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Response of the baseline.
    pub response: Response,
    /// Whether the baseline has a fourth-order coefficient of its own (then `higher_order_dynamics` is in it).
    pub own_fourth_order: bool,
}

const PASSES: usize = 6;
/// Change of the response that does not matter: what it leaves is taken up to first order. Shares of κ2 and b.
const SETTLED: [f64; 2] = [1e-3, 1e-2];
/// Change of the lag that does not matter, s.
const SETTLED_LAG_S: f64 = 2e-4;

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
pub fn explain(campaign: &Campaign, start: &Start) -> Explained {
    let (mut response, mut more_lag_s) = (start.response, 0.0);
    let mut seen = Seen::default();
    let (mut found, mut longer_s) = pass(campaign, start, (response, more_lag_s), &mut seen, &[], None);
    // Scatter is measured well only beside a model, so there are two passes at least.
    let mut known = None;
    for _ in 1..PASSES {
        let tones = seen.tones.len();
        let left = residual(&found);
        if tones < TONES {
            let tone = tone::find(&found.runs, &left, &found.spread);
            seen.tones.extend(tone.filter(|tone| is_material(&found, tone) && tone.is_new(&seen.tones)));
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
        response = refined;
        more_lag_s += longer_s;
        (found, longer_s) = pass(campaign, start, (response, more_lag_s), &mut seen, &kinds, Some(&left));
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
        let Kind::Cause { cause: Cause::HigherOrderDynamics, .. } = found.items[item].kind else { continue };
        if let Some(at) = columns.iter().position(|&c| c == found.items[item].columns[0]) {
            refined.b_s4 = -2.0 * found.solution.coefficients[at];
        }
    }
    let fastest = found.runs.iter().map(|run| run.view.omega_rad_s).fold(0.0, f64::max);
    let w2 = fastest * fastest;
    // A response that would blow up within the measured range is no response.
    if 1.0 + refined.a_s2 * w2 + refined.b_s4 * w2 * w2 > 0.1 { refined } else { response }
}

fn pass(
    campaign: &Campaign,
    start: &Start,
    (response, more_lag_s): (Response, f64),
    seen: &mut Seen,
    kinds: &[Kind],
    left: Option<&Samples>,
) -> (Explained, f64) {
    let (mut runs, lag) = survey::prepare(campaign, &response, more_lag_s);
    for tone in &seen.tones {
        tone.remove(&mut runs);
    }
    let data = |runs: &[Prepared]| -> Samples {
        runs.iter()
            .map(|run| {
                let shrink = run.view.radius_m * (run.view.gain - 1.0);
                let mut out: Vec<f64> = run.deviation_m.iter().map(|deviation| deviation - shrink).collect();
                run.mask(&mut out);
                out
            })
            .collect()
    };
    let (mut kinds, mut left) = (kinds, left);
    if seen.looked_beside != Some(seen.tones.len()) {
        // Before anything is believed: teeth look like everything.
        let whole = data(&runs);
        let teeth = roughness::find(&runs, &whole, &spread::measure(&runs, &whole));
        // What was found with a tone or teeth in sight is not to be trusted.
        if seen.looked_beside.is_some() {
            (kinds, left) = (&[], None);
        }
        seen.teeth = teeth;
        seen.looked_beside = Some(seen.tones.len());
    }
    if !seen.teeth.is_empty() {
        for run in &mut runs {
            let hidden =
                (0..run.deviation_m.len()).map(|i| seen.teeth.iter().any(|t| t.covers(run, i))).collect();
            run.hide(hidden);
        }
    }
    let data = data(&runs);
    // Once there is a model, what it leaves shows the scatter better than the data do.
    let spread = spread::measure(&runs, left.unwrap_or(&data));
    let mut ledger = Ledger::open(&runs, &spread, data);
    // ∂ΔR/∂a about the response.
    let own: Samples = runs
        .iter()
        .map(|run| {
            let (w, g) = (run.view.omega_rad_s, run.view.gain);
            let mut out = vec![-0.5 * run.view.radius_m * w * w * g.powi(3); run.deviation_m.len()];
            run.mask(&mut out);
            out
        })
        .collect();
    let mut nuisance = vec![ledger.push(&runs, own)];
    let mut items: Vec<Item> = Vec::new();
    let add = |ledger: &mut Ledger, items: &mut Vec<Item>, kind: Kind, shapes: usize| -> usize {
        let columns = (0..kind.columns()).map(|i| ledger.push(&runs, kind.samples(i, &runs))).collect();
        items.push(Item { price: kind.price(shapes), columns, kind, fitted_beside: None });
        items.len() - 1
    };
    let mut chosen = Vec::new();
    for kind in kinds {
        chosen.push(add(&mut ledger, &mut items, kind.clone(), shape::count(kind, &runs)));
    }
    // The data no longer hold what the response has taken in; its column still does.
    if start.own_fourth_order {
        let fourth = Kind::Cause { cause: Cause::HigherOrderDynamics, axis: None, shape: Vec::new() };
        nuisance.push(ledger.push(&runs, fourth.samples(0, &runs)));
    } else if response.b_s4 != 0.0 {
        restore_fourth_order(&runs, &mut ledger, &response);
    }
    for model in ALL {
        if model.evidence() != Evidence::Signature
            || (start.own_fourth_order && model.cause() == Cause::HigherOrderDynamics)
        {
            continue;
        }
        let views: Vec<_> = runs.iter().map(|run| run.view.clone()).collect();
        let shapes = model.shapes(&views);
        for &axis in model.axes() {
            let known = kinds.iter().any(
                |kind| matches!(kind, Kind::Cause { cause, axis: at, .. } if *cause == model.cause() && *at == axis),
            );
            if let (false, Some(first)) = (known, shapes.first()) {
                let kind = Kind::Cause { cause: model.cause(), axis, shape: first.clone() };
                add(&mut ledger, &mut items, kind, shapes.len());
            }
        }
    }
    for pattern in Pattern::sizes() {
        let kind = Kind::Pattern(pattern);
        if !kinds.contains(&kind) {
            add(&mut ledger, &mut items, kind, 1);
        }
    }
    let all = vec![1.0; runs.len()];
    let apart_m2 = seen.tones.iter().flat_map(|tone| &tone.energy_m2).sum::<f64>()
        + seen.teeth.iter().map(|teeth| roughness::energy_m2(teeth, &runs)).sum::<f64>();
    let mut found = Explained {
        apart_m2,
        solution: Solution {
            coefficients: Vec::new(),
            covariance: nalgebra::DMatrix::zeros(0, 0),
            gain: 0.0,
        },
        runs: Vec::new(),
        response,
        lag,
        spread,
        ledger,
        nuisance,
        items,
        chosen,
        tones: Vec::new(),
        tangents: None,
        more_lag_s,
        teeth: seen.teeth.clone(),
    };
    let mut barred: Vec<usize> = Vec::new();
    let mut polished: Vec<Kind> = Vec::new();
    for _ in 0..6 {
        let before: Vec<Kind> = chosen_kinds(&found);
        refit(&mut found, &all);
        shape::improve(&mut found, &runs);
        refit(&mut found, &all);
        if before != polished {
            tangent::polish(&mut found, &runs, &all);
            polished = chosen_kinds(&found);
        }
        propose_patterns(&mut found, &runs);
        let products = found.ledger.white(&all);
        found.chosen = select(&products, &found.nuisance, &found.items, &found.chosen, &barred);
        found.chosen = prune(&found, &all, found.chosen.clone(), &mut barred);
        if chosen_kinds(&found) == before {
            break;
        }
    }
    refit(&mut found, &all);
    if chosen_kinds(&found) != polished {
        tangent::polish(&mut found, &runs, &all);
    }
    let longer_s = tangent::finish(&mut found, &runs, &all);
    found.runs = runs;
    (found, longer_s)
}

/// The response holds a fourth-order part that the search may still reject: give it back to the data, to first
/// order exactly as its column would take it.
fn restore_fourth_order(runs: &[Prepared], ledger: &mut Ledger, response: &Response) {
    let mut data = ledger.samples(0).clone();
    for (run, data) in runs.iter().zip(&mut data) {
        let shift =
            -0.5 * response.b_s4 * run.view.radius_m * run.view.omega_rad_s.powi(4) * run.view.gain.powi(3);
        data.iter_mut().for_each(|y| *y += shift);
        run.mask(data);
    }
    ledger.replace(runs, 0, data);
}
