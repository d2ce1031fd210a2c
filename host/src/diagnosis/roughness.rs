//! Stick–slip: teeth where an axis is slow, whatever the radius and the feed, and nowhere else.
//!
//! Teeth have no fixed place, so power is looked at: second differences of neighbouring samples, over bins of
//! the speed of one axis. The first quarter second after a reversal is left out, since a friction spike is
//! steep there too. A step at a fixed place is one edge a stroke, teeth are many. Where teeth are found, the other explanations
//! do not look.
use super::spread::Spread;
use super::survey::Prepared;
use giotto_shared::Actuator;
use rayon::prelude::*;

/// Teeth on one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teeth {
    /// Axis that sticks.
    pub axis: Actuator,
    /// Speed of the axis below which it does, m/s.
    pub below_m_s: f64,
    /// Height of a tooth, m: √3 times its root mean square (a ramp from nothing to the height).
    pub height_m: f64,
    /// Standard error of the height between runs, m.
    pub se_m: f64,
    /// Standard errors by which the roughness exceeds the noise.
    pub significance: f64,
}

/// Bins of axis speed: edges 0.25 mm/s · 2^(k/2).
const BINS: usize = 18;
const FIRST_EDGE_M_S: f64 = 2.5e-4;
/// Left out after a reversal, s.
const SPIKE_S: f64 = 0.25;
/// Left out on both sides of a reversal, rad.
const BESIDE_RAD: f64 = 0.07;
/// Variance ratio above which a bin is rough, and the significance it needs.
const ROUGH: f64 = 1.6;
const SIGNIFICANT: f64 = 8.0;
/// Variance ratio below which a bin is smooth, and above which it is rough in part.
const SMOOTH: f64 = 1.3;
const PARTLY: f64 = 1.15;
/// Variance ratio of the slow parts of runs that have fast parts too.
const CONTRAST: f64 = 1.25;

/// Share of the roughness that other edges than the steepest of each stroke hold at least: of two teeth a stroke one is left,
/// of a step at a place nothing.
const MANY_EDGES: f64 = 0.15;

/// Looks for teeth on every axis that moves.
pub fn find(runs: &[Prepared], residual: &[Vec<f64>], spread: &Spread) -> Vec<Teeth> {
    let mut rest: Vec<Actuator> = Actuator::SLIDES
        .into_iter()
        .filter(|axis| runs.iter().any(|run| run.view.moves(*axis)))
        .collect();
    let mut found: Vec<Teeth> = Vec::new();
    // One axis's teeth lie where the other is fast: hide them before the other is believed.
    while !rest.is_empty() {
        let teeth = rest
            .iter()
            .filter_map(|&axis| find_on(axis, runs, residual, spread, &found))
            .max_by(|a, b| a.significance.total_cmp(&b.significance));
        let Some(teeth) = teeth else { break };
        rest.retain(|axis| *axis != teeth.axis);
        found.push(teeth);
    }
    found
}

/// Speed of the axis at a sample, m/s; infinite for one that stands still, which cannot stick.
fn axis_speed(run: &Prepared, axis: Actuator, sample: usize) -> f64 {
    if !run.view.moves(axis) {
        return f64::INFINITY;
    }
    let swing = run.view.swing(axis);
    let facing = run.view.direction[sample][axis.index()];
    run.view.feed_m_s * (swing * swing - facing * facing).max(0.0).sqrt()
}

fn bin_of(speed: f64) -> Option<usize> {
    let bin = (2.0 * (speed / FIRST_EDGE_M_S).log2()).floor().max(0.0) as usize;
    (bin < BINS).then_some(bin)
}

fn find_on(
    axis: Actuator,
    runs: &[Prepared],
    residual: &[Vec<f64>],
    spread: &Spread,
    known: &[Teeth],
) -> Option<Teeth> {
    let power = powers(axis, runs, residual, spread, known);
    let (reached, significance) = rough_up_to(&power)?;
    if !power.has_many_edges_below(reached) {
        return None;
    }
    let below_m_s = FIRST_EDGE_M_S * 2f64.powf(0.5 * reached as f64);
    if !contrast(axis, below_m_s, runs, residual, spread.noise_m2) {
        return None;
    }
    let (height_m, se_m) = height(axis, below_m_s, runs, residual, spread.noise_m2)?;
    Some(Teeth {
        axis,
        below_m_s,
        height_m,
        se_m,
        significance,
    })
}

/// Squared second differences by the speed of an axis.
struct Powers {
    /// Sum in each bin as a multiple of the noise.
    ratios: [f64; BINS],
    /// Of it, what the steepest edge of each stroke holds.
    steepest: [f64; BINS],
    /// Samples in each bin.
    counts: [f64; BINS],
}

impl Powers {
    /// Power as a multiple of the noise, and how many standard errors it is above 1. Second differences are
    /// correlated: about a third of the samples count.
    fn excess(&self, bin: usize) -> (f64, f64) {
        let ratio = self.ratios[bin];
        (ratio, (ratio - 1.0) * (self.counts[bin] / 6.0).sqrt())
    }

    /// Whether there is more to the bins below one than the steepest edge of each stroke: a machine that sticks jumps many
    /// times, a step at a place once a stroke.
    fn has_many_edges_below(&self, reached: usize) -> bool {
        let slow = || 0..reached.min(BINS);
        let excess = |bin: usize| (self.ratios[bin] - 1.0) * self.counts[bin];
        let beside = |bin: usize| (self.ratios[bin] - self.steepest[bin] - 1.0) * self.counts[bin];
        slow().map(beside).sum::<f64>() > MANY_EDGES * slow().map(excess).sum::<f64>()
    }
}

/// Roughness of what is left by the speed of an axis, away from its reversals.
fn powers(
    axis: Actuator,
    runs: &[Prepared],
    residual: &[Vec<f64>],
    spread: &Spread,
    known: &[Teeth],
) -> Powers {
    let sums = runs
        .par_iter()
        .zip(residual)
        .map(|(run, left)| {
            let mut sums = Sums::default();
            let strokes = run.view.strokes_of(axis);
            let mut edges = Edges::default();
            for i in 1..left.len().min(strokes.len()).saturating_sub(1) {
                let share = strokes[i].share;
                if share < strokes[i - 1].share {
                    edges.close(&mut sums);
                }
                let facing = run.view.direction[i][axis.index()].abs();
                // A step at the reversal itself shows beside it, if the lag is off.
                let beside = share.min(1.0 - share) * std::f64::consts::PI < BESIDE_RAD;
                if share * run.view.half_turn_s() < SPIKE_S
                    || beside
                    || facing < 0.3
                    || known.iter().any(|known| known.covers(run, i))
                {
                    continue;
                }
                if let Some(bin) = bin_of(axis_speed(run, axis, i)) {
                    // Clipped: a few wild samples are not roughness.
                    let square = ((left[i - 1] - 2.0 * left[i] + left[i + 1]).powi(2) / 6.0)
                        .min(400.0 * spread.noise_m2);
                    edges.of_stroke.push((i, bin, square));
                }
            }
            edges.close(&mut sums);
            sums
        })
        .reduce(Sums::default, |a, b| Sums {
            all: std::array::from_fn(|k| a.all[k] + b.all[k]),
            count: std::array::from_fn(|k| a.count[k] + b.count[k]),
            steepest: std::array::from_fn(|k| a.steepest[k] + b.steepest[k]),
        });
    let noise = |bin: usize| (sums.count[bin] * spread.noise_m2).max(f64::MIN_POSITIVE);
    Powers {
        ratios: std::array::from_fn(|bin| sums.all[bin] / noise(bin)),
        steepest: std::array::from_fn(|bin| sums.steepest[bin] / noise(bin)),
        counts: sums.count,
    }
}

/// What is summed over the strokes of all runs, by bin.
#[derive(Default)]
struct Sums {
    all: [f64; BINS],
    count: [f64; BINS],
    /// Of `all`, what the steepest edge of each stroke holds.
    steepest: [f64; BINS],
}

/// Squared second differences of one stroke, with their samples and bins.
#[derive(Default)]
struct Edges {
    of_stroke: Vec<(usize, usize, f64)>,
}

impl Edges {
    /// Counts a stroke.
    fn close(&mut self, sums: &mut Sums) {
        let steepest = self.of_stroke.iter().max_by(|a, b| a.2.total_cmp(&b.2));
        let steepest = steepest.map(|edge| edge.0);
        for (sample, bin, square) in self.of_stroke.drain(..) {
            sums.all[bin] += square;
            sums.count[bin] += 1.0;
            if steepest.is_some_and(|at| at.abs_diff(sample) <= 1) {
                sums.steepest[bin] += square;
            }
        }
    }
}

/// The bin above those that are rough, and the largest significance among them. Rough up to a speed, which lies within
/// the bin above the last rough one, and smooth beyond it; else it is something else.
fn rough_up_to(power: &Powers) -> Option<(usize, f64)> {
    let counts = &power.counts;
    let rough: Vec<usize> = (0..BINS)
        .filter(|&bin| counts[bin] >= 20.0)
        .filter(|&bin| {
            let (ratio, sigmas) = power.excess(bin);
            ratio > ROUGH && sigmas > SIGNIFICANT
        })
        .collect();
    let (&highest, &lowest) = (rough.last()?, rough.first()?);
    let above: Vec<usize> = (highest + 2..BINS)
        .filter(|&bin| counts[bin] >= 50.0)
        .collect();
    if above.is_empty()
        || highest - lowest + 1 > rough.len() + 2
        || above.iter().any(|&bin| power.excess(bin).0 > SMOOTH)
    {
        return None;
    }
    let significance = rough
        .iter()
        .map(|&bin| power.excess(bin).1)
        .fold(0.0, f64::max);
    let partly = counts[highest + 1] >= 20.0 && power.excess(highest + 1).0 > PARTLY;
    Some((highest + 1 + usize::from(partly), significance))
}

/// Height of the teeth and its standard error, m, from each run with enough samples below a speed.
fn height(
    axis: Actuator,
    below_m_s: f64,
    runs: &[Prepared],
    residual: &[Vec<f64>],
    noise_m2: f64,
) -> Option<(f64, f64)> {
    let heights: Vec<(f64, f64)> = runs
        .iter()
        .zip(residual)
        .filter_map(|(run, left)| {
            let mut clean = left.clone();
            let mut low = run.basis.coordinates(left).map(|c| -c);
            low[3..].fill(0.0);
            run.basis.add(&low, &mut clean);
            let zone: Vec<f64> = (0..left.len())
                .filter(|&i| {
                    axis_speed(run, axis, i) < 0.6 * below_m_s
                        && run.view.direction[i][axis.index()].abs() > 0.3
                })
                .map(|i| (clean[i] / run.view.direction[i][axis.index()]).powi(2))
                .collect();
            (zone.len() >= 30).then(|| {
                let mean = zone.iter().sum::<f64>() / zone.len() as f64 - noise_m2;
                ((3.0 * mean.max(0.0)).sqrt(), zone.len() as f64)
            })
        })
        .collect();
    let weight: f64 = heights.iter().map(|h| h.1).sum();
    if heights.len() < 2 || weight <= 0.0 {
        return None;
    }
    let height_m = heights.iter().map(|h| h.0 * h.1).sum::<f64>() / weight;
    let variance = heights
        .iter()
        .map(|h| h.1 * (h.0 - height_m).powi(2))
        .sum::<f64>()
        / weight;
    let se_m = (variance / (heights.len() - 1) as f64)
        .sqrt()
        .max(0.07 * height_m);
    Some((height_m, se_m))
}

/// Runs in which the axis is both slow and fast have to be rough where it is slow and smooth where it is fast: a
/// tone seen by a slow sampling is rough all around its run, and slow runs are those in which the axis is slow.
fn contrast(
    axis: Actuator,
    below_m_s: f64,
    runs: &[Prepared],
    residual: &[Vec<f64>],
    noise_m2: f64,
) -> bool {
    let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
    for (run, left) in runs.iter().zip(residual) {
        let (mut own, mut count) = ([0.0; 2], [0.0; 2]);
        for i in 1..left.len().saturating_sub(1) {
            let speed = axis_speed(run, axis, i);
            if (0.6 * below_m_s..1.5 * below_m_s).contains(&speed) {
                continue;
            }
            let at = usize::from(speed > below_m_s);
            own[at] +=
                ((left[i - 1] - 2.0 * left[i] + left[i + 1]).powi(2) / 6.0).min(400.0 * noise_m2);
            count[at] += 1.0;
        }
        if count.iter().all(|n| *n >= 20.0) {
            for at in 0..2 {
                sums[at] += own[at];
                counts[at] += count[at];
            }
        }
    }
    let ratio = |at: usize| sums[at] / (counts[at] * noise_m2).max(f64::MIN_POSITIVE);
    counts[0] >= 50.0 && ratio(0) > CONTRAST && ratio(0) - 1.0 > 2.0 * (ratio(1) - 1.0).max(0.0)
}

/// Energy of the teeth on the samples that are hidden for them, m².
pub fn energy_m2(teeth: &Teeth, runs: &[Prepared]) -> f64 {
    let hidden: usize = runs
        .iter()
        .map(|run| {
            (0..run.hidden.len())
                .filter(|&i| teeth.covers(run, i))
                .count()
        })
        .sum();
    // A ramp from nothing to the height, seen along the radius.
    hidden as f64 * teeth.height_m.powi(2) / 3.0 * 0.5
}

impl Teeth {
    /// Samples of a run in which the axis may stick: a little more than the zone itself.
    pub fn covers(&self, run: &Prepared, sample: usize) -> bool {
        axis_speed(run, self.axis, sample) < 1.2 * self.below_m_s
    }
}
