//! How long a turn takes at the rate of its steady part: start, stop and pauses make no feed slower.
use std::f64::consts::TAU;

/// Pieces of a turn whose durations are compared.
const PIECES: usize = 72;
/// A turn that lasts longer by more than this share has a start, a stop or a pause in it.
const LONGER: f64 = 0.01;

/// Duration of a turn, s, from angles (rad) and times (s) in order of travel: the whole span by the angle that it covers, or the
/// usual piece of it where some pieces take much longer. `None` for points that do not move.
pub(super) fn turn_s(points: &[(f64, f64)]) -> Option<f64> {
    let (first, last) = (points.first()?, points.last()?);
    let extent = (last.0 - first.0).abs();
    let whole = (last.1 - first.1) * TAU / extent;
    if !(extent > 0.0 && whole.is_finite() && whole > 0.0) {
        return None;
    }
    let sign = (last.0 - first.0).signum();
    let pieces = PIECES.min(points.len() / 4).max(1);
    let piece = extent / pieces as f64;
    let mut passed = vec![first.1];
    for pair in points.windows(2) {
        let [from, to] = [pair[0], pair[1]].map(|(a, t)| (sign * (a - first.0), t));
        while passed.len() <= pieces && to.0 >= passed.len() as f64 * piece * (1.0 - 1e-12) {
            let line = passed.len() as f64 * piece;
            let share = ((line - from.0) / (to.0 - from.0)).clamp(0.0, 1.0);
            passed.push(from.1 + (to.1 - from.1) * share);
        }
    }
    let mut durations: Vec<f64> = passed.windows(2).map(|w| w[1] - w[0]).collect();
    if durations.is_empty() {
        return Some(whole);
    }
    durations.sort_unstable_by(f64::total_cmp);
    let usual = durations[durations.len() / 2] * TAU / piece;
    // The mean of the usual pieces is finer than one of them.
    let steady: Vec<f64> = durations
        .iter()
        .copied()
        .filter(|d| (d * TAU / piece / usual - 1.0).abs() < 0.03)
        .collect();
    let steady = steady.iter().sum::<f64>() / steady.len().max(1) as f64 * TAU / piece;
    let slowed = whole > steady * (1.0 + LONGER) && steady > 0.0;
    Some(if slowed { steady } else { whole })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_and_a_pause_make_no_turn_slower() {
        let steady = |k: usize| (TAU * k as f64 / 400.0, 0.01 * k as f64);
        let even: Vec<_> = (0..400).map(steady).collect();
        assert!((turn_s(&even).unwrap() / 4.0 - 1.0).abs() < 1e-9);
        // A pause of 3 s behind a third of the turn, clockwise.
        let pause = |k: usize| {
            let (a, t) = steady(k);
            (-a, t + if k > 133 { 3.0 } else { 0.0 })
        };
        let paused: Vec<_> = (0..400).map(pause).collect();
        assert!((turn_s(&paused).unwrap() / 4.0 - 1.0).abs() < 2e-3);
        // From rest to rest: the rate grows over the first and falls over the last tenth of the time.
        let rest = |k: usize| {
            let t = k as f64 / 1000.0;
            let edge = |t: f64| if t < 0.1 { t * t / 0.2 } else { t - 0.05 };
            let way = if t < 0.5 {
                edge(t)
            } else {
                0.9 - edge(1.0 - t)
            };
            (TAU * way / 0.9, t)
        };
        let rest: Vec<_> = (0..=1000).map(rest).collect();
        assert!((turn_s(&rest).unwrap() / 0.9 - 1.0).abs() < 2e-3);
        assert_eq!(turn_s(&[(1.0, 0.0), (1.0, 2.0)]), None);
        assert_eq!(turn_s(&[]), None);
    }
}
