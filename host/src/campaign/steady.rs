//! How long a turn takes at the rate of its steady part: start, stop and pauses make no feed slower.
use super::Samples;
use nalgebra::{SMatrix, SVector};
use std::f64::consts::TAU;
use std::ops::Range;

/// Pieces of a turn whose durations are compared.
const PIECES: usize = 72;
/// A turn that lasts longer by more than this share has a start, a stop or a pause in it.
const LONGER: f64 = 0.01;
/// A piece at the rate of the steady part lasts as long as the usual one within this share.
const ALIKE: f64 = 0.03;
/// What has to be passed of the circle until the machine has settled at the full rate, in ways of its ramp: behind a smooth ramp a
/// third of its time more, in which a servo that follows within it has come to rest.
const SETTLED: f64 = 1.7;
/// The same before the ramp of a stop: the servo lags behind the command, so that nothing is seen early.
const BEFORE_STOP: f64 = 1.3;

/// How long each of some equal pieces of the way took.
struct Pieces {
    /// Angle of the first point, rad, and the sense of travel.
    first_rad: f64,
    sign: f64,
    /// Angle of a piece, rad.
    piece_rad: f64,
    /// Duration of each, s.
    durations: Vec<f64>,
    /// The usual duration, s.
    usual_s: f64,
}

impl Pieces {
    /// Of angles (rad) and times (s) in order of travel; `None` for points that do not move.
    fn of(points: &[(f64, f64)]) -> Option<Self> {
        let (first, last) = (points.first()?, points.last()?);
        let extent = (last.0 - first.0).abs();
        if !(extent > 0.0 && extent.is_finite()) {
            return None;
        }
        let sign = (last.0 - first.0).signum();
        let pieces = PIECES.min(points.len() / 4).max(1);
        let piece_rad = extent / pieces as f64;
        let mut passed = vec![first.1];
        for pair in points.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|(a, t)| (sign * (a - first.0), t));
            while passed.len() <= pieces && to.0 >= passed.len() as f64 * piece_rad * (1.0 - 1e-12)
            {
                let line = passed.len() as f64 * piece_rad;
                let share = ((line - from.0) / (to.0 - from.0)).clamp(0.0, 1.0);
                passed.push(from.1 + (to.1 - from.1) * share);
            }
        }
        let durations: Vec<f64> = passed.windows(2).map(|w| w[1] - w[0]).collect();
        let mut sorted = durations.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let usual_s = sorted.get(sorted.len() / 2).copied()?;
        Some(Self {
            first_rad: first.0,
            sign,
            piece_rad,
            durations,
            usual_s,
        })
    }

    fn is_usual(&self, duration: f64) -> bool {
        (duration / self.usual_s - 1.0).abs() < ALIKE
    }
}

/// Duration of a turn, s, from angles (rad) and times (s) in order of travel: the whole span by the angle that it covers, or the
/// usual piece of it where some pieces take much longer. `None` for points that do not move.
pub(super) fn turn_s(points: &[(f64, f64)]) -> Option<f64> {
    let (first, last) = (points.first()?, points.last()?);
    let extent = (last.0 - first.0).abs();
    let whole = (last.1 - first.1) * TAU / extent;
    if !(extent > 0.0 && whole.is_finite() && whole > 0.0) {
        return None;
    }
    let Some(pieces) = Pieces::of(points) else {
        return Some(whole);
    };
    // The mean of the usual pieces is finer than one of them.
    let steady: Vec<f64> = pieces
        .durations
        .iter()
        .copied()
        .filter(|d| pieces.is_usual(*d))
        .collect();
    let steady = steady.iter().sum::<f64>() / steady.len().max(1) as f64 * TAU / pieces.piece_rad;
    let slowed = whole > steady * (1.0 + LONGER) && steady > 0.0;
    Some(if slowed { steady } else { whole })
}

/// Angles (rad) between which the machine ran at its steady rate, in order of travel, where it got up to speed or slowed down within
/// the recording: a slower piece is a circle of another feed. `None` where it did neither, or was steady over less than half.
pub(super) fn window_rad(points: &[(f64, f64)]) -> Option<[f64; 2]> {
    let pieces = Pieces::of(points)?;
    let n = pieces.durations.len();
    let slow = |d: &&f64| **d > pieces.usual_s * (1.0 + ALIKE);
    let way = |slow: usize, factor: f64| (slow as f64 * factor).ceil();
    let start = way(pieces.durations.iter().take_while(slow).count(), SETTLED);
    let stop = way(
        pieces.durations.iter().rev().take_while(slow).count(),
        BEFORE_STOP,
    );
    let left = n as f64 - start - stop;
    if start + stop == 0.0 || left < 0.5 * n as f64 {
        return None;
    }
    Some([start, n as f64 - stop].map(|k| pieces.first_rad + pieces.sign * k * pieces.piece_rad))
}

/// Standard errors by which rows outside the steady part are off what the steady part foretells of them before they show.
const SHOWN: f64 = 3.0;
/// Mean, set-up and oval.
const UNKNOWNS: usize = 5;

/// Whether the rows outside `steady` lie elsewhere than the circle and the oval of the others: at another feed another size.
pub(super) fn shows(samples: &Samples, steady: Range<usize>) -> bool {
    let basis = |a: f64| {
        SVector::<f64, UNKNOWNS>::new(1.0, a.cos(), a.sin(), (2.0 * a).cos(), (2.0 * a).sin())
    };
    let rows = || {
        samples
            .angle_rad
            .iter()
            .map(|&a| basis(a))
            .zip(&samples.deviation_m)
            .enumerate()
    };
    let inside = || {
        rows()
            .filter(|(k, _)| steady.contains(k))
            .map(|(_, row)| row)
    };
    let outside = || {
        rows()
            .filter(|(k, _)| !steady.contains(k))
            .map(|(_, row)| row)
    };
    let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
    let mut right = SVector::<f64, UNKNOWNS>::zeros();
    for (x, y) in inside() {
        normal += x * x.transpose();
        right += x * *y;
    }
    let Some(factor) = normal.cholesky() else {
        return false;
    };
    let model = factor.solve(&right);
    let squares: f64 = inside().map(|(x, y)| (y - model.dot(&x)).powi(2)).sum();
    let free = (steady.len() as f64 - UNKNOWNS as f64).max(1.0);
    let n = samples.angle_rad.len().saturating_sub(steady.len()).max(1) as f64;
    let (off, mean) = outside().fold((0.0, SVector::zeros()), |(off, mean), (x, y)| {
        (off + (y - model.dot(&x)) / n, mean + x / n)
    });
    let variance = squares / free * (1.0 / n + mean.dot(&factor.solve(&mean)));
    off.abs() > SHOWN * variance.sqrt()
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
        // What is steady of it begins behind the ramp, with some way to settle, and ends before the other.
        let [from, to] = window_rad(&rest).unwrap();
        let at = |a: f64| rest.iter().find(|p| p.0 >= a).unwrap().1;
        assert!((0.11..0.16).contains(&at(from)), "{}", at(from));
        assert!((0.85..0.91).contains(&at(to)), "{}", at(to));
        assert_eq!(window_rad(&even), None);
        assert_eq!(window_rad(&paused), None);
        assert_eq!(turn_s(&[(1.0, 0.0), (1.0, 2.0)]), None);
        assert_eq!(turn_s(&[]), None);
    }

    #[test]
    fn slower_rows_show_where_they_are_of_another_size() {
        let angle_rad: Vec<f64> = (0..360).map(|k| TAU * f64::from(k) / 360.0).collect();
        let of = |slower_m: f64| {
            let deviation = |(k, a): (usize, &f64)| {
                let noise = if k % 2 == 0 { 1e-6 } else { -1e-6 };
                let ramp = if (30..330).contains(&k) {
                    0.0
                } else {
                    slower_m
                };
                20e-6 * (2.0 * a).cos() + 5e-6 * a.sin() - 50e-6 + noise + ramp
            };
            Samples {
                deviation_m: angle_rad.iter().enumerate().map(deviation).collect(),
                angle_rad: angle_rad.clone(),
                time_s: None,
                angle_inferred: false,
            }
        };
        assert!(!shows(&of(0.0), 30..330));
        assert!(shows(&of(2e-6), 30..330));
    }
}
