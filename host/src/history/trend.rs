//! A series of campaigns: does it drift, did it step, does a value stand out?
//!
//! Two laws compete with "nothing happens": a straight line, and one step between two campaigns. The statistic is the
//! larger share of the variance that one of them explains, and its significance is that of the order of the values: how
//! often a shuffled series does as well. No law of the scatter is assumed, so a series with values that are 0 because the
//! cause was not found is as good as any other. A value stands out if it lies further from the others than Student's t
//! allows.
use crate::fit::critical_t;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Fewest campaigns whose order can say anything at the levels used here.
pub const FEWEST: usize = 8;
/// Most shuffles.
const SHUFFLES: u32 = 400_000;
/// So many shuffles that do as well settle that there is nothing.
const ENOUGH: u32 = 20;
/// One history of an unchanged machine in so many says that something happened, over all its series.
pub const RARELY: f64 = 1000.0;

/// What happened to a series.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Change {
    /// It grows or falls steadily.
    Drift {
        /// Change a month.
        per_month: f64,
        /// Its 95 % interval.
        ci95: [f64; 2],
    },
    /// It changed between two campaigns.
    Step {
        /// Index of the first campaign after it.
        at: usize,
        /// Mean after less mean before.
        size: f64,
        /// Its 95 % interval.
        ci95: [f64; 2],
    },
}

/// What is known of a series.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trend {
    /// What happened, if anything did.
    pub change: Option<Change>,
    /// How often an unchanged series looks like this.
    pub p: f64,
    /// Centre, lower and upper control limit at each campaign.
    pub limits: Vec<[f64; 3]>,
    /// Campaigns that lie outside.
    pub outside: Vec<usize>,
}

/// Sum of squares about the mean.
fn about_mean(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Share of the variance that a line explains, slope, and mean of the times.
fn line(times: &[f64], values: &[f64]) -> (f64, f64, f64) {
    let (t0, v0) = (mean(times), mean(values));
    let (mut tt, mut tv, mut vv) = (0.0, 0.0, 0.0);
    for (t, v) in times.iter().zip(values) {
        tt += (t - t0).powi(2);
        tv += (t - t0) * (v - v0);
        vv += (v - v0).powi(2);
    }
    if tt <= 0.0 || vv <= 0.0 {
        return (0.0, 0.0, t0);
    }
    (tv * tv / (tt * vv), tv / tt, t0)
}

/// Share of the variance that the best step explains, and where it is. At least three values stand on either side:
/// fewer are values that stand out.
fn step(values: &[f64]) -> (f64, usize) {
    let n = values.len();
    let total: f64 = values.iter().sum();
    let whole = about_mean(values);
    if whole <= 0.0 {
        return (0.0, n);
    }
    let (mut before, mut best) = (0.0, (0.0, n));
    for (k, value) in values.iter().enumerate() {
        if k >= 3 && n - k >= 3 {
            let (a, b) = (k as f64, (n - k) as f64);
            let gap = before / a - (total - before) / b;
            let share = a * b / n as f64 * gap * gap / whole;
            if share > best.0 {
                best = (share, k);
            }
        }
        before += value;
    }
    best
}

fn statistic(times: &[f64], values: &[f64]) -> f64 {
    line(times, values).0.max(step(values).0)
}

/// How often a shuffled series does as well. Stops as soon as it is clear that it is not rare.
fn significance(times: &[f64], values: &[f64], seed: u64) -> f64 {
    let seen = statistic(times, values);
    let mut shuffled = values.to_vec();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut as_good = 0;
    for round in 1..=SHUFFLES {
        shuffled.shuffle(&mut random);
        if statistic(times, &shuffled) >= seen * (1.0 - 1e-12) {
            as_good += 1;
            if as_good == ENOUGH {
                return f64::from(as_good) / f64::from(round);
            }
        }
    }
    f64::from(as_good + 1) / f64::from(SHUFFLES + 1)
}

/// Looks at one of `many` series: values at times in months, in order.
pub fn look(months: &[f64], values: &[f64], many: usize, seed: u64) -> Trend {
    let n = values.len();
    let level = 1.0 / (RARELY * 2.0 * many.max(1) as f64);
    let p = if n < FEWEST || about_mean(values) <= 0.0 {
        1.0
    } else {
        significance(months, values, seed)
    };
    let change = (p <= level).then(|| law(months, values)).flatten();
    let expected: Vec<f64> = match change {
        Some(Change::Drift { per_month, .. }) => {
            let (t0, v0) = (mean(months), mean(values));
            months.iter().map(|t| v0 + per_month * (t - t0)).collect()
        }
        Some(Change::Step { at, .. }) => {
            let (a, b) = (mean(&values[..at]), mean(&values[at..]));
            (0..n).map(|k| if k < at { a } else { b }).collect()
        }
        None => vec![mean(values); n],
    };
    let (limits, outside) = limits(values, &expected, change.is_some(), level);
    Trend {
        change,
        p,
        limits,
        outside,
    }
}

/// Line or step, whichever leaves less, a step paying for its place.
fn law(months: &[f64], values: &[f64]) -> Option<Change> {
    let n = values.len() as f64;
    let ((line, slope, t0), (share, at)) = (line(months, values), step(values));
    let whole = about_mean(values);
    let cost = |share: f64, parameters: f64| {
        n * ((1.0 - share).max(1e-12) * whole).ln() + parameters * n.ln()
    };
    if cost(line, 2.0) <= cost(share, 3.0) {
        let free = values.len().checked_sub(2)?;
        let spread: f64 = months.iter().map(|t| (t - t0).powi(2)).sum();
        let standard = ((1.0 - line).max(0.0) * whole / free as f64 / spread).sqrt();
        let half = critical_t(0.05, free).ok()? * standard;
        return Some(Change::Drift {
            per_month: slope,
            ci95: [slope - half, slope + half],
        });
    }
    let (before, after) = values.split_at(at);
    let free = values.len().checked_sub(2)?;
    let variance = (about_mean(before) + about_mean(after)) / free as f64;
    let each = 1.0 / before.len() as f64 + 1.0 / after.len() as f64;
    let half = critical_t(0.05, free).ok()? * (variance * each).sqrt();
    let size = mean(after) - mean(before);
    Some(Change::Step {
        at,
        size,
        ci95: [size - half, size + half],
    })
}

/// Limits about what is expected; each value is held against the scatter of the others.
fn limits(
    values: &[f64],
    expected: &[f64],
    changed: bool,
    level: f64,
) -> (Vec<[f64; 3]>, Vec<usize>) {
    let n = values.len();
    let spent = if changed { 3 } else { 2 };
    let left: Vec<f64> = values.iter().zip(expected).map(|(v, e)| v - e).collect();
    let squares: f64 = left.iter().map(|v| v * v).sum();
    let Some(free) = n.checked_sub(spent + 1).filter(|f| *f >= 4) else {
        let open = |e: &f64| [*e, f64::NEG_INFINITY, f64::INFINITY];
        return (expected.iter().map(open).collect(), Vec::new());
    };
    let t = critical_t(level / n as f64, free).unwrap_or(f64::INFINITY);
    let scale = n as f64 / (n as f64 - 1.0);
    let mut outside = Vec::new();
    let mut limits = Vec::with_capacity(n);
    for (k, (&e, &r)) in expected.iter().zip(&left).enumerate() {
        // Without this value; its own share in the mean makes it stand out by n/(n−1) more.
        let others = (squares - r * r * scale).max(0.0) / free as f64;
        let half = t * (others * scale).sqrt();
        limits.push([e, e - half, e + half]);
        if (r * scale).abs() > half && r != 0.0 {
            outside.push(k);
        }
    }
    (limits, outside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, Normal, StudentT};

    fn months() -> Vec<f64> {
        (0..24).map(f64::from).collect()
    }

    /// 200 histories of 22 series each in which nothing happens, Gaussian and with heavier tails.
    #[test]
    fn two_hundred_unchanged_histories_raise_at_most_one_alarm() {
        let months = months();
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let (normal, heavy) = (Normal::new(5.0, 0.4).unwrap(), StudentT::new(6.0).unwrap());
        let mut alarms = 0;
        for history in 0..200_u64 {
            let mut raised = false;
            for series in 0..22 {
                let values: Vec<f64> = months
                    .iter()
                    .map(|_| match series % 2 {
                        0 => normal.sample(&mut random),
                        _ => 0.2 * heavy.sample(&mut random),
                    })
                    .collect();
                let trend = look(&months, &values, 22, history);
                raised |= trend.change.is_some();
                // Outliers of heavy tails are outliers: only Gaussian series promise none.
                raised |= series % 2 == 0 && !trend.outside.is_empty();
            }
            alarms += u32::from(raised);
        }
        assert!(alarms <= 1, "{alarms} of 200 unchanged histories");
    }

    #[test]
    fn a_slow_drift_and_a_step_are_told_apart_and_sized() {
        let months = months();
        let mut random = ChaCha8Rng::seed_from_u64(12);
        let noise = Normal::new(0.0, 0.5).unwrap();
        for seed in 0..20 {
            let drift: Vec<f64> = months
                .iter()
                .map(|t| 2.0 + 0.25 * t + noise.sample(&mut random))
                .collect();
            match look(&months, &drift, 24, seed).change {
                Some(Change::Drift { per_month, ci95 }) => {
                    assert!((per_month - 0.25).abs() < 0.07, "{per_month}");
                    assert!(ci95[0] < per_month && per_month < ci95[1]);
                }
                other => panic!("a drift: {other:?}"),
            }
            let at = 5 + seed as usize % 14;
            let step: Vec<f64> = (0..24)
                .map(|k| if k < at { 6.0 } else { 3.0 } + noise.sample(&mut random))
                .collect();
            match look(&months, &step, 24, seed).change {
                Some(Change::Step {
                    at: found, size, ..
                }) => {
                    assert!(found.abs_diff(at) <= 1, "{found} {at}");
                    assert!((size + 3.0).abs() < 0.8, "{size}");
                }
                other => panic!("a step: {other:?}"),
            }
        }
    }

    #[test]
    fn one_value_that_stands_out_is_named_and_few_values_say_nothing() {
        let months = months();
        let mut values: Vec<f64> = months.iter().map(|t| 5.0 + 0.1 * (7.3 * t).sin()).collect();
        values[9] = 9.0;
        let trend = look(&months, &values, 10, 1);
        assert_eq!(trend.outside, [9]);
        assert_eq!(trend.change, None);
        let few = look(&[0.0, 1.0, 2.0], &[1.0, 2.0, 3.0], 1, 1);
        assert_eq!((few.change, few.outside.len()), (None, 0));
        let flat = look(&months, &[4.0; 24], 1, 1);
        assert_eq!((flat.change, flat.outside.len()), (None, 0));
    }
}
