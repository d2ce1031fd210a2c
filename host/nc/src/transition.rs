//! The shape of the step that brings a correction in behind a joint.
//!
//! Lengths in units of σf, σ = √κ2. From κ2 and κ4 alone the machine is taken to be a lag T behind a moving
//! average M with these cumulants (T² + M²/12 = 1, 6T⁴ − M⁴/120 = κ4/κ2², Eq. 12 and physics of averages): a
//! curvature that sets in at a joint, n = s²/2, is answered by h∗n, late by κ1 = T + M/2 and offset by ½. The
//! offset g that the command is given instead should leave h∗(n − g) = n(s − κ1). It may not begin before the
//! joint, where the block of a line stands untouched, nor have a corner, and so this is met as well as a cubic
//! with one free node can: least squares, reweighted towards the least largest error. What remains at the joint,
//! as a share of the offset, grows with the average's part ([`Transition::remaining`]; the tests hold the numbers):
//!
//! | machine | κ4/κ2² | smooth step | this one |
//! |---|---|---|---|
//! | a lag | 6 | 4 % | 0.4 % |
//! | a lag of 20 ms, an average of 40 ms | 3.3 | 8 % | 3.5 % |
//! | an average alone | −1.2 | 20 % | 12.3 % |
//!
//! An average alone answers before the joint, on the line that may not be touched, and what is left of that is no matter of
//! shape: with eight free nodes over three averages 5 % would remain, over one 12 %. The summary of `giotto compensate`
//! names the arcs whose joints keep more than 5 %.
use giotto_shared::model::Cumulants;

/// A step from 0 to 1 over a length, flat at both ends, through one node in the middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transition {
    /// Value in the middle.
    middle: f64,
    /// Slope there, per length.
    slope: f64,
    /// Largest error at the joint that it leaves, as a share of the step.
    remaining: f64,
}

/// The machine in units of σ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Response {
    lag: f64,
    average: f64,
}

/// Step of time, σ.
const STEP: f64 = 0.02;
/// How far the response is followed, σ.
const REACH: f64 = 9.0;
/// Rounds of reweighting; the largest error has settled to a tenth of a percent.
const ROUNDS: usize = 8;

impl Response {
    /// The lag and the average that have these cumulants; the nearest there are if none have.
    pub(super) fn of(cumulants: &Cumulants<f64>) -> Self {
        let ratio = cumulants.ratio().clamp(-1.2, 6.0);
        // x = T²: 6x² − 1.2(1 − x)² = ratio.
        let x = ((2.4_f64.powi(2) + 4.0 * 4.8 * (1.2 + ratio)).sqrt() - 2.4) / (2.0 * 4.8);
        let x = if x.is_finite() {
            x.clamp(0.0, 1.0)
        } else {
            1.0
        };
        Self {
            lag: x.sqrt(),
            average: (12.0 * (1.0 - x)).sqrt(),
        }
    }

    /// Length over which a step with one free node answers best, σf.
    pub(super) fn length(self) -> f64 {
        1.6 * self.lag + 1.1 * self.average
    }

    fn apply(self, x: &[f64]) -> Vec<f64> {
        // The average as a difference of the integral, then the lag, exact for straight pieces.
        let mut integral = vec![0.0; x.len()];
        for k in 1..x.len() {
            integral[k] = integral[k - 1] + 0.5 * STEP * (x[k - 1] + x[k]);
        }
        let back = self.average / STEP;
        let averaged: Vec<f64> = (0..x.len())
            .map(|k| {
                if back < 0.5 {
                    return x[k];
                }
                let at = k as f64 - back;
                let low = at.floor();
                let i = low as usize;
                let before = if at <= 0.0 {
                    0.0
                } else {
                    integral[i] + (at - low) * (integral[i + 1] - integral[i])
                };
                (integral[k] - before) / self.average
            })
            .collect();
        if self.lag < STEP {
            return averaged;
        }
        let decay = (-STEP / self.lag).exp();
        let part = (1.0 - decay) * self.lag / STEP;
        let mut y = vec![averaged[0]; x.len()];
        for k in 1..x.len() {
            y[k] = decay * y[k - 1] + (part - decay) * averaged[k - 1] + (1.0 - part) * averaged[k];
        }
        y
    }

    /// The best step over `length` σf.
    pub(super) fn transition(self, length: f64) -> Transition {
        let samples = ((REACH.max(length + 6.0)) / STEP) as usize;
        let time = |k: usize| k as f64 * STEP;
        let delay = self.lag + 0.5 * self.average;
        let curve: Vec<f64> = (0..samples).map(|k| 0.5 * time(k).powi(2)).collect();
        let wanted = |k: usize| 0.5 * (time(k) - delay).max(0.0).powi(2);
        // In units of the final offset, ½.
        let shape =
            |t: Transition| -> Vec<f64> { (0..samples).map(|k| t.at(time(k) / length)).collect() };
        let parts = [
            Transition {
                middle: 0.0,
                slope: 0.0,
                remaining: 0.0,
            },
            Transition {
                middle: 1.0,
                slope: 0.0,
                remaining: 0.0,
            },
            Transition {
                middle: 0.0,
                slope: 1.0,
                remaining: 0.0,
            },
        ]
        .map(|t| self.apply(&shape(t)));
        let answer = self.apply(&curve);
        let target: Vec<f64> = (0..samples)
            .map(|k| 2.0 * (answer[k] - wanted(k)) - parts[0][k])
            .collect();
        // A part contains the end of the step as well, which is parts[0].
        let part = |i: usize, k: usize| parts[i][k] - parts[0][k];
        let mut weights = vec![1.0; samples];
        let mut best = Transition {
            middle: 0.5,
            slope: 1.5,
            remaining: f64::INFINITY,
        };
        for _ in 0..ROUNDS {
            let (mut a, mut b) = ([[0.0; 2]; 2], [0.0; 2]);
            for k in 0..samples {
                let row = [part(1, k), part(2, k)];
                for i in 0..2 {
                    b[i] += weights[k] * row[i] * target[k];
                    (0..2).for_each(|j| a[i][j] += weights[k] * row[i] * row[j]);
                }
            }
            let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
            let middle = (b[0] * a[1][1] - b[1] * a[0][1]) / det;
            let slope = (b[1] * a[0][0] - b[0] * a[1][0]) / det;
            let left: Vec<f64> = (0..samples)
                .map(|k| (target[k] - middle * part(1, k) - slope * part(2, k)).abs())
                .collect();
            let remaining = left.iter().copied().fold(0.0, f64::max);
            if remaining < best.remaining {
                best = Transition {
                    middle,
                    slope,
                    remaining,
                };
            }
            let scale = remaining.max(f64::MIN_POSITIVE);
            weights
                .iter_mut()
                .zip(&left)
                .for_each(|(w, e)| *w *= e / scale + 1e-3);
            let sum: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|w| *w /= sum);
        }
        best
    }
}

impl Transition {
    /// The smooth step 3u² − 2u³.
    pub(super) const SMOOTH: Self = Self {
        middle: 0.5,
        slope: 1.5,
        remaining: f64::INFINITY,
    };

    /// The nodes behind the start: place, value and slope per length.
    pub(super) const fn nodes(self) -> [(f64, f64, f64); 2] {
        [(0.5, self.middle, self.slope), (1.0, 1.0, 0.0)]
    }

    /// Largest |g″|·L²: what it adds to the curvature, in Δ/L².
    pub(super) fn curvature(self) -> f64 {
        let (m, s) = (self.middle, 0.5 * self.slope);
        let halves = [
            [6.0 * m - 2.0 * s, -6.0 * m + 4.0 * s],
            [6.0 * (1.0 - m) - 4.0 * s, -6.0 * (1.0 - m) + 2.0 * s],
        ];
        4.0 * halves
            .iter()
            .flatten()
            .fold(0.0, |most, c| f64::max(most, c.abs()))
    }

    /// Largest error that it leaves at the joint, as a share of the step; not finite where that is not known.
    pub(super) const fn remaining(self) -> f64 {
        self.remaining
    }

    fn at(self, u: f64) -> f64 {
        if u >= 1.0 {
            return 1.0;
        }
        let ((y0, m0), (y1, m1), v) = if u < 0.5 {
            ((0.0, 0.0), (self.middle, 0.5 * self.slope), 2.0 * u)
        } else {
            ((self.middle, 0.5 * self.slope), (1.0, 0.0), 2.0 * u - 1.0)
        };
        let (v2, v3) = (v * v, v * v * v);
        (2.0 * v3 - 3.0 * v2 + 1.0) * y0
            + (v3 - 2.0 * v2 + v) * m0
            + (3.0 * v2 - 2.0 * v3) * y1
            + (v3 - v2) * m1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_shared::model::Element;

    fn chain(elements: &[Element<f64>]) -> Cumulants<f64> {
        elements
            .iter()
            .map(Element::cumulants)
            .fold(Cumulants::default(), |a, b| Cumulants {
                kappa2_s2: a.kappa2_s2 + b.kappa2_s2,
                kappa4_s4: a.kappa4_s4 + b.kappa4_s4,
            })
    }

    #[test]
    fn a_lag_and_an_average_are_found_from_their_cumulants() {
        for (kv_per_s, window_s) in [(50.0, 0.04), (43.3, 0.0), (200.0, 0.1)] {
            let sum = chain(&[
                Element::Lag { kv_per_s },
                Element::MovingAverage { window_s },
            ]);
            let (found, sigma) = (Response::of(&sum), sum.kappa2_s2.sqrt());
            assert!(
                (found.lag * sigma * kv_per_s - 1.0).abs() < 1e-6,
                "{found:?}"
            );
            assert!((found.average * sigma - window_s).abs() < 1e-5, "{found:?}");
        }
    }

    /// What the module's table says; the smooth step beside it by the same measure.
    #[test]
    fn errors_are_those_of_the_table() {
        let average = [Element::MovingAverage { window_s: 0.04 }];
        let lag = [Element::Lag { kv_per_s: 50.0 }];
        for (elements, most) in [
            (lag.to_vec(), 0.004),
            ([lag, average].concat(), 0.035),
            (average.to_vec(), 0.123),
        ] {
            let response = Response::of(&chain(&elements));
            let t = response.transition(response.length());
            assert!(
                t.remaining() <= most && t.remaining() > 0.5 * most,
                "{elements:?}: {t:?}"
            );
            // No more acceleration (curvature over length squared) than 40 over the length of a shorter step.
            let short = 1.6 * response.lag + 0.6 * response.average;
            assert!(
                t.curvature() / response.length().powi(2) < 40.0 / short.powi(2),
                "{t:?}"
            );
        }
    }

    /// The second derivative by differences, as an independent measure of the curvature.
    #[test]
    fn curvature_is_that_of_the_curve() {
        let t = Response::of(&chain(&[Element::Lag { kv_per_s: 50.0 }])).transition(1.6);
        let h = 1e-4;
        let most = (1..9999).filter(|k| *k != 5000).map(|k| {
            let u = f64::from(k) * 1e-4;
            ((t.at(u + h) - 2.0 * t.at(u) + t.at(u - h)) / (h * h)).abs()
        });
        let most = most.fold(0.0, f64::max);
        assert!(
            (most / t.curvature() - 1.0).abs() < 0.01,
            "{most} {}",
            t.curvature()
        );
        assert_eq!((t.at(0.0), t.at(1.0)), (0.0, 1.0));
    }
}
