//! Fitting what bends a signature: pitch, time constants, play.
//!
//! A coarse scan on a stratified part of the runs, then along tangents to the nearest best, or by a simplex where there is no
//! slope; each trial costs one column, not one refit of everything.
use super::design_column::Column;
use super::explained::{Explained, residual};
use super::gear;
use super::gram::kept;
use super::hypothesis::Kind;
use super::linear::{Factor, solve};
use super::low_orders::{COLUMNS, Low};
use super::pitch;
use super::products::Products;
use super::search::columns_of;
use super::simplex::simplex;
use super::survey::Prepared;
use super::vector::dot;
use crate::causes::{Bend, Cause, RunView, Site};
use rayon::prelude::*;
use std::sync::Arc;

/// Runs of the coarse scan.
const SCAN_RUNS: usize = 16;
/// Most moves along tangents, the longest of them in steps, and the χ² for which one is worth while.
const CLIMBS: usize = 6;
const LONGEST: f64 = 8.0;
const WORTH: f64 = 0.3;
/// Standard deviation of a shape about where it is, in steps: what the runs cannot tell stays near.
const PRIOR: f64 = 20.0;
/// A scan is worth refining above this share of its price.
const PROMISING: f64 = 0.6;

/// Number of starting shapes of an explanation: the more, the higher its price.
pub fn count(kind: &Kind, views: &[RunView]) -> usize {
    match kind {
        Kind::Cause { cause, .. } => cause.model().shapes(views).len(),
        Kind::Pattern(_) => 1,
    }
}

/// The motion of every run.
pub fn views(runs: &[Prepared]) -> Vec<RunView> {
    runs.iter().map(|run| run.view.clone()).collect()
}

/// Gives every shaped cause its best shape beside the other chosen explanations: those that are chosen one after the other,
/// each beside what those before it have become, then all others at once.
pub fn improve(found: &mut Explained) {
    let (chosen, others): (Vec<usize>, Vec<usize>) =
        (0..found.items.len()).partition(|item| found.chosen.contains(item));
    for item in chosen {
        let Some(task) = Task::of(found, item) else {
            continue;
        };
        let shape = Fit::new(found).best(&task);
        settle(found, [(&task, shape)]);
    }
    let tasks: Vec<Task> = others
        .into_iter()
        .filter_map(|item| Task::of(found, item))
        .collect();
    if tasks.is_empty() {
        return;
    }
    let fit = Fit::new(found);
    let shapes: Vec<Vec<f64>> = tasks.par_iter().map(|task| fit.best(task)).collect();
    settle(found, tasks.iter().zip(shapes));
}

/// Takes over the shapes that have changed.
fn settle<'a>(found: &mut Explained, shapes: impl IntoIterator<Item = (&'a Task, Vec<f64>)>) {
    let mut changed = Vec::new();
    for (task, shape) in shapes {
        if shape != task.shape {
            found.items[task.item].kind = task.kind(&shape);
            changed.push(task.item);
        }
    }
    found.relay(&changed);
}

/// A shape to be fitted.
struct Task {
    item: usize,
    cause: Cause,
    site: Site,
    shape: Vec<f64>,
    chosen: bool,
    price: f64,
    /// Columns that are fitted along.
    with: Vec<usize>,
}

impl Task {
    /// `None`: it has no shape, or none that is to be fitted here and now.
    fn of(found: &mut Explained, item: usize) -> Option<Self> {
        let Kind::Cause { cause, site, shape } = found.items[item].kind.clone() else {
            return None;
        };
        let model = cause.model();
        if model.shape_names().is_empty() {
            return None;
        }
        let chosen = found.chosen.contains(&item);
        // What is chosen and has a slope is climbed beside all others (see `tangent`).
        let slope = |which: usize| matches!(model.bend(which, shape[which], 1.0), Bend::Amount(_));
        if chosen && (0..shape.len()).all(slope) {
            return None;
        }
        let others: Vec<usize> = found
            .chosen
            .iter()
            .copied()
            .filter(|&i| i != item)
            .collect();
        let with = columns_of(&found.nuisance, &found.items, &others);
        if found.items[item].fitted_beside.as_ref() == Some(&with) {
            return None;
        }
        found.items[item].fitted_beside = Some(with.clone());
        Some(Self {
            item,
            cause,
            site,
            shape,
            chosen,
            price: found.items[item].price,
            with,
        })
    }

    /// As this cause with another shape, within what the cause can have.
    fn kind(&self, shape: &[f64]) -> Kind {
        let mut shape = shape.to_vec();
        self.cause.model().tidy(&mut shape);
        Kind::Cause {
            cause: self.cause,
            site: self.site,
            shape,
        }
    }
}

/// What every trial needs.
struct Fit<'a> {
    found: &'a Explained,
    runs: Arc<[Prepared]>,
    views: Vec<RunView>,
    sample: Vec<usize>,
    all: Vec<usize>,
    whitened: Column,
}

impl<'a> Fit<'a> {
    fn new(found: &'a Explained) -> Self {
        let runs = Arc::clone(&found.runs);
        Self {
            views: views(&runs),
            sample: stratified(&runs),
            all: (0..runs.len()).collect(),
            whitened: whitened_residual(found),
            runs,
            found,
        }
    }

    /// The best shape; the one it has if there is none that promises anything.
    fn best(&self, task: &Task) -> Vec<f64> {
        let model = task.cause.model();
        let score = |shape: &[f64], over: &[usize]| self.gain(&task.kind(shape), &task.with, over);
        let best_of = |candidates: Vec<Vec<f64>>, over: &[usize]| {
            candidates
                .into_par_iter()
                .map(|shape| (score(&shape, over), shape))
                .max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let start = if task.chosen {
            task.shape.clone()
        } else {
            // A scan of a part of the runs sees that part of the gain.
            let share = self.runs.len() as f64 / self.sample.len().max(1) as f64;
            let noise_m2 = self.found.spread.noise_m2;
            let best = match (model.finest_wave_per_m(&self.views), task.site) {
                (Some(finest), Site::One(axis)) if axis.is_slide() => {
                    pitch::scan(&self.runs, &self.whitened, noise_m2, axis, finest)
                        .map(|found| (found.gain / share, vec![found.pitch_m]))
                }
                (Some(_), Site::One(joint)) => model
                    .ratios(&self.views, joint.index())
                    .and_then(|ratios| {
                        gear::scan(&self.runs, ratios, &self.whitened, noise_m2, joint.index())
                    })
                    .map(|found| (found.gain / share, vec![found.ratio])),
                _ => best_of(model.shapes(&self.views), &self.sample),
            };
            match best {
                Some((coarse, start)) if coarse * share > PROMISING * task.price => start,
                _ => return task.shape.clone(),
            }
        };
        let choice = (0..start.len())
            .any(|which| matches!(model.bend(which, start[which], 1.0), Bend::Choice(_)));
        let mut polished = if choice {
            best_of(model.shapes(&self.views), &self.all).map_or(start, |(_, shape)| shape)
        } else if (0..start.len())
            .all(|which| matches!(model.bend(which, start[which], 1.0), Bend::Amount(_)))
        {
            self.climb(task, start)
        } else {
            let near = simplex(&start, 0.15, 40, |shape| score(shape, &self.sample));
            if task.chosen {
                simplex(&near, 0.03, 20, |shape| score(shape, &self.all))
            } else {
                near
            }
        };
        model.tidy(&mut polished);
        polished
    }

    /// Climbs from a shape to the nearest best one along its tangents, over the runs of the scan.
    fn climb(&self, task: &Task, start: Vec<f64>) -> Vec<f64> {
        let model = task.cause.model();
        let travel_m = 2.0
            * self
                .views
                .iter()
                .map(|view| view.radius_m)
                .fold(1e-3, f64::max);
        let mut shape = start;
        for _ in 0..CLIMBS {
            let steps: Vec<f64> = (0..shape.len())
                .map(|which| match model.bend(which, shape[which], travel_m) {
                    Bend::Amount(step) => step,
                    Bend::Choice(_) | Bend::Stiff => 0.0,
                })
                .collect();
            let Some(climb) = self.slope(task, &shape, &steps) else {
                break;
            };
            if climb.promised < WORTH {
                break;
            }
            let higher = [1.0, 0.4, 0.1].into_iter().find_map(|share| {
                let mut moved = shape.clone();
                for ((value, step), way) in moved.iter_mut().zip(&steps).zip(&climb.ways) {
                    *value += share * way.clamp(-LONGEST, LONGEST) * step;
                }
                model.tidy(&mut moved);
                (self.gain(&task.kind(&moved), &task.with, &self.sample) > climb.gain + 0.1 * WORTH)
                    .then_some(moved)
            });
            match higher {
                Some(moved) => shape = moved,
                None => break,
            }
        }
        shape
    }

    /// The gain of a shape and where its tangents lead; `None`: it is nothing beside the columns fitted along.
    fn slope(&self, task: &Task, shape: &[f64], steps: &[f64]) -> Option<Climb> {
        let here = task.kind(shape);
        let moved = steps.iter().enumerate().map(|(which, step)| {
            let mut moved = shape.to_vec();
            moved[which] += step;
            task.kind(&moved)
        });
        let kinds: Vec<Kind> = std::iter::once(here).chain(moved).collect();
        let (products, known) = self.products(&kinds, &task.with, &self.sample);
        let wide = (products.size() - known) / kinds.len();
        let plain: Vec<usize> = (1..known + wide).collect();
        let alone = solve(&products, &plain[..known - 1])?;
        let fitted = solve(&products, &plain)?;
        let amounts = &fitted.coefficients[known - 1..];
        // A tangent is what its moved columns do beyond those here, at the amounts fitted here.
        let size = known + wide + steps.len();
        let parts = |column: usize| -> Vec<(usize, f64)> {
            match column.checked_sub(known + wide) {
                None => vec![(column, 1.0)],
                Some(which) => (0..wide)
                    .flat_map(|k| {
                        [
                            (known + (which + 1) * wide + k, amounts[k]),
                            (known + k, -amounts[k]),
                        ]
                    })
                    .collect(),
            }
        };
        let parts: Vec<Vec<(usize, f64)>> = (0..size).map(parts).collect();
        let mut along = Products::from_fn(size, |i, j| {
            let pairs = parts[i]
                .iter()
                .flat_map(|a| parts[j].iter().map(move |b| (a, b)));
            pairs
                .map(|((a, x), (b, y))| x * y * products.at(*a, *b))
                .sum()
        });
        for tangent in known + wide..size {
            *along.at_mut(tangent, tangent) += PRIOR.powi(-2);
        }
        let all: Vec<usize> = (1..size).collect();
        let climbed = solve(&along, &all)?;
        Some(Climb {
            gain: fitted.gain - alone.gain,
            promised: climbed.gain - fitted.gain,
            ways: climbed.coefficients[known + wide - 1..].to_vec(),
        })
    }

    /// What the explanation takes off χ² beside the columns `with`, over some runs.
    fn gain(&self, kind: &Kind, with: &[usize], over: &[usize]) -> f64 {
        let (products, known) = self.products(std::slice::from_ref(kind), with, over);
        let (without, further): (Vec<usize>, Vec<usize>) =
            ((1..known).collect(), (known..products.size()).collect());
        let gain = |mut factor: Factor<'_>| Some(factor.gain_with(&further)? - factor.gain());
        Factor::new(&products, &without)
            .and_then(gain)
            .unwrap_or(0.0)
    }

    /// White products over some runs: of the data and the columns `with`, as many as the second number says, and of the
    /// columns of the trials behind them.
    fn products(&self, trials: &[Kind], with: &[usize], over: &[usize]) -> (Products, usize) {
        let base: Vec<usize> = std::iter::once(0).chain(with.iter().copied()).collect();
        let wide: usize = trials.iter().map(Kind::columns).sum();
        let of_run = |&run: &usize| {
            let mut products = Products::zeros(base.len() + wide);
            self.add_run(trials, &base, run, &mut products);
            products
        };
        let each: Vec<Products> = over.par_iter().map(of_run).collect();
        let mut products = Products::zeros(base.len() + wide);
        each.iter().for_each(|of_run| products.add(1.0, of_run));
        (products, base.len())
    }

    fn add_run(&self, trials: &[Kind], base: &[usize], run: usize, products: &mut Products) {
        let (gram, prepared) = (&self.found.gram, &self.runs[run]);
        let (white, discount) = (gram.white_of(run), gram.discounts(run));
        for (i, &a) in base.iter().enumerate() {
            for (j, &b) in base[..=i].iter().enumerate() {
                *products.at_mut(i, j) += white.at(a, b);
            }
        }
        let parts: Vec<Part> = trials
            .iter()
            .flat_map(|kind| Part::all(kind, prepared))
            .collect();
        for (index, part) in parts.iter().enumerate() {
            let at = base.len() + index;
            for (i, &other) in base.iter().enumerate() {
                let other = gram.column(other);
                // The samples still hold their low orders: what they are multiplied with here has none.
                let outside = dot(&part.samples, other.outside(prepared));
                let white = kept(&part.low, &other.low()[run], discount) + outside;
                *products.at_mut(at, i) += white / gram.noise_m2();
            }
            for (earlier, other) in parts[..=index].iter().enumerate() {
                *products.at_mut(at, base.len() + earlier) +=
                    part.white(other, discount) / gram.noise_m2();
            }
        }
    }
}

/// Where tangents lead.
struct Climb {
    gain: f64,
    /// What the move would add to it.
    promised: f64,
    /// The move, in steps.
    ways: Vec<f64>,
}

/// A trial in one run: coordinates in the low orders, and all its samples if it has more than these.
struct Part {
    low: Low,
    samples: Vec<f64>,
}

impl Part {
    fn all(kind: &Kind, run: &Prepared) -> Vec<Self> {
        let low: Option<Vec<Low>> = (0..kind.columns())
            .map(|index| kind.low(index, run))
            .collect();
        match low {
            Some(low) => low
                .into_iter()
                .map(|low| Self {
                    low,
                    samples: Vec::new(),
                })
                .collect(),
            None => {
                let mut all = vec![vec![0.0; run.deviation_m.len()]; kind.columns()];
                let mut out: Vec<&mut [f64]> = all.iter_mut().map(Vec::as_mut_slice).collect();
                kind.samples(run, &mut out);
                let part = |mut samples: Vec<f64>| {
                    run.mask(&mut samples);
                    Self {
                        low: run.basis.coordinates(&samples),
                        samples,
                    }
                };
                all.into_iter().map(part).collect()
            }
        }
    }

    fn white(&self, other: &Self, discount: &Low) -> f64 {
        if self.samples.is_empty() || other.samples.is_empty() {
            return kept(&self.low, &other.low, discount);
        }
        let scatter: f64 = (0..COLUMNS)
            .map(|k| discount[k] * self.low[k] * other.low[k])
            .sum();
        dot(&self.samples, &other.samples) - scatter
    }
}

/// V⁻¹ times what the chosen explanations leave: its product with a column is that column's pull.
fn whitened_residual(found: &Explained) -> Column {
    let noise_m2 = found.spread.noise_m2;
    let left = residual(found);
    let mut whitened = Column::zero(found.runs.len());
    whitened.add(1.0 / noise_m2, &left);
    let kept = |run: usize| found.gram.discounts(run).map(|discount| 1.0 - discount);
    whitened.scale_low((0..found.runs.len()).map(kept));
    whitened
}

/// Every so many runs in the order of radius and feed.
fn stratified(runs: &[Prepared]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..runs.len()).collect();
    order.sort_by(|&a, &b| {
        let key = |i: usize| {
            (
                runs[i].view.radius_m,
                runs[i].view.feed_m_s,
                runs[i].view.sign,
            )
        };
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0)
            .then(a.1.total_cmp(&b.1))
            .then(a.2.total_cmp(&b.2))
    });
    let step = (runs.len() as f64 / SCAN_RUNS as f64).max(1.0);
    (0..SCAN_RUNS.min(runs.len()))
        .map(|i| order[((i as f64 + 0.5) * step) as usize % order.len()])
        .collect()
}
