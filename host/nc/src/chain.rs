//! The chain that a model's radius law stands for, as it answers in time.
//!
//! A second-order model says what it is. Of κ2 and κ4 alone (β1, β2) the simplest chain that has them is taken:
//!
//! | κ2 | κ4/κ2² | chain |
//! |---|---|---|
//! | > 0 | −1.2 … 6 | a lag behind a moving average: T² + M²/12 = κ2, 6T⁴ − M⁴/120 = κ4 |
//! | > 0 | below −1.2 | second order, ζ > 0.707: κ4/κ2² = 6 − 3/(1 − 2ζ²)² |
//! | > 0 | above 6 | a lag with velocity feed-forward a: 6(1 + a²)/(1 − a²) |
//! | < 0 | up to 3 | second order, ζ < 0.707, swinging out |
//! | < 0 | above 3 | none that is simple: the error at a joint is not known |
use giotto::model_file::Servo;
use giotto_shared::model::Cumulants;

/// A chain in units of its own time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Chain {
    /// Lag and moving average, in units of σ = √κ2.
    LagAverage { lag: f64, average: f64 },
    /// In units of 1/ωn.
    SecondOrder { zeta: f64 },
    /// In units of the lag.
    FeedForward { share: f64 },
}

/// A chain and its unit of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Response {
    pub(super) chain: Chain,
    /// Seconds in a unit.
    pub(super) unit_s: f64,
}

/// Step of time in units.
pub(super) const STEP: f64 = 0.02;

impl Response {
    /// The chain of a model; `None` where it does nothing or none is known.
    pub(super) fn of(servo: &Servo) -> Option<Self> {
        if let Servo::SecondOrder {
            omega_n_rad_s,
            zeta,
        } = *servo
        {
            return Some(Self {
                chain: Chain::SecondOrder { zeta },
                unit_s: omega_n_rad_s.recip(),
            });
        }
        Self::of_cumulants(&servo.cumulants())
    }

    pub(super) fn of_cumulants(cumulants: &Cumulants<f64>) -> Option<Self> {
        let (k2, k4) = (cumulants.kappa2_s2, cumulants.kappa4_s4);
        // κ2² without a digit left beside κ4 is no ratio: damping of 0.707 then.
        let ratio = (k4 / (k2 * k2)).clamp(-1e9, 1e9);
        if (k2 == 0.0 && k4 == 0.0) || ratio.is_nan() {
            return None;
        }
        let second_order = |square: f64| {
            let zeta = square.sqrt();
            let rate4 = 12.0 * (8.0 * square * square - 8.0 * square + 1.0) / k4;
            Self {
                chain: Chain::SecondOrder { zeta },
                unit_s: rate4.powf(-0.25),
            }
        };
        let part = (3.0 / (6.0 - ratio)).sqrt();
        let found = match ratio {
            r if k2 > 0.0 && (-1.2..=6.0).contains(&r) => Self::lag_and_average(k2, r),
            r if k2 > 0.0 && r > 6.0 => {
                let square = (r - 6.0) / (r + 6.0);
                Self {
                    chain: Chain::FeedForward {
                        share: square.sqrt(),
                    },
                    unit_s: (k2 / (1.0 - square)).sqrt(),
                }
            }
            r if k2 >= 0.0 && r < -1.2 => second_order(0.5 * (1.0 + part)),
            r if k2 < 0.0 && r < 3.0 => {
                let square = 0.5 * (1.0 - part);
                let mut found = second_order(square);
                // κ4 may be zero where κ2 is not.
                found.unit_s = (-k2 / (2.0 * part)).sqrt();
                found
            }
            _ => return None,
        };
        (found.unit_s.is_finite() && found.unit_s > 0.0).then_some(found)
    }

    fn lag_and_average(k2: f64, ratio: f64) -> Self {
        // x = T²: 6x² − 1.2(1 − x)² = ratio.
        let x = ((2.4_f64.powi(2) + 4.0 * 4.8 * (1.2 + ratio)).sqrt() - 2.4) / (2.0 * 4.8);
        let x = x.clamp(0.0, 1.0);
        Self {
            chain: Chain::LagAverage {
                lag: x.sqrt(),
                average: (12.0 * (1.0 - x)).sqrt(),
            },
            unit_s: k2.sqrt(),
        }
    }
}

impl Chain {
    /// κ1 in units: how late the machine is.
    pub(super) fn delay(self) -> f64 {
        match self {
            Self::LagAverage { lag, average } => lag + 0.5 * average,
            Self::SecondOrder { zeta } => 2.0 * zeta,
            Self::FeedForward { share } => 1.0 - share,
        }
    }

    /// After so many units nothing is left of what was.
    pub(super) fn settling(self) -> f64 {
        match self {
            Self::LagAverage { .. } | Self::FeedForward { .. } => 9.0,
            Self::SecondOrder { zeta } => {
                let slowest = if zeta > 1.0 {
                    zeta - (zeta * zeta - 1.0).sqrt()
                } else {
                    zeta.max(0.05)
                };
                (9.0 / slowest).min(90.0)
            }
        }
    }

    /// The answer to a curve given every [`STEP`], from rest at 0.
    pub(super) fn apply(self, x: &[f64]) -> Vec<f64> {
        match self {
            Self::LagAverage { lag, average } => lagged(&averaged(x, average), lag),
            Self::SecondOrder { zeta } => second_order(x, zeta),
            Self::FeedForward { share } => lagged(x, 1.0)
                .iter()
                .zip(x)
                .map(|(y, x)| share * x + (1.0 - share) * y)
                .collect(),
        }
    }
}

/// The average as a difference of the integral, exact for straight pieces.
fn averaged(x: &[f64], average: f64) -> Vec<f64> {
    let back = average / STEP;
    if back < 0.5 {
        return x.to_vec();
    }
    let mut integral = vec![0.0; x.len()];
    for k in 1..x.len() {
        integral[k] = integral[k - 1] + 0.5 * STEP * (x[k - 1] + x[k]);
    }
    let mean = |k: usize| {
        let at = k as f64 - back;
        let low = at.floor();
        let i = low as usize;
        let before = if at <= 0.0 {
            0.0
        } else {
            integral[i] + (at - low) * (integral[i + 1] - integral[i])
        };
        (integral[k] - before) / average
    };
    (0..x.len()).map(mean).collect()
}

/// One lag, exact for straight pieces.
fn lagged(x: &[f64], lag: f64) -> Vec<f64> {
    if lag < STEP {
        return x.to_vec();
    }
    let decay = (-STEP / lag).exp();
    let part = (1.0 - decay) * lag / STEP;
    let mut y = vec![x.first().copied().unwrap_or(0.0); x.len()];
    for k in 1..x.len() {
        y[k] = decay * y[k - 1] + (part - decay) * x[k - 1] + (1.0 - part) * x[k];
    }
    y
}

/// y″ + 2ζy′ + y = x by the trapezoidal rule; a step of 0.02 leaves it true to 3e-5.
fn second_order(x: &[f64], zeta: f64) -> Vec<f64> {
    let h = 0.5 * STEP;
    // (1 − hA)s′ = (1 + hA)s + h·b(x + x′), A = [0 1; −1 −2ζ].
    let det = 1.0 + 2.0 * zeta * h + h * h;
    let (mut y, mut v) = (0.0, 0.0);
    let mut out = vec![0.0; x.len()];
    for k in 1..x.len() {
        let push = h * (x[k - 1] + x[k]);
        let (a, b) = (y + h * v, v - h * y - 2.0 * zeta * h * v + push);
        y = ((1.0 + 2.0 * zeta * h) * a + h * b) / det;
        v = (b - h * a) / det;
        out[k] = y;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_shared::model::Element;

    fn sum(elements: &[Element<f64>]) -> Cumulants<f64> {
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
            let cumulants = sum(&[
                Element::Lag { kv_per_s },
                Element::MovingAverage { window_s },
            ]);
            let found = Response::of_cumulants(&cumulants).unwrap();
            let Chain::LagAverage { lag, average } = found.chain else {
                panic!("{found:?}")
            };
            assert!(
                (lag * found.unit_s * kv_per_s - 1.0).abs() < 1e-6,
                "{found:?}"
            );
            assert!(
                (average * found.unit_s - window_s).abs() < 1e-5,
                "{found:?}"
            );
        }
    }

    #[test]
    fn second_order_is_found_from_its_cumulants() {
        for zeta in [0.72, 0.75, 0.5, 0.3, 0.9e-1] {
            let cumulants = sum(&[Element::SecondOrder {
                omega_n_rad_s: 38.0,
                zeta,
            }]);
            let found = Response::of_cumulants(&cumulants).unwrap();
            let Chain::SecondOrder { zeta: back } = found.chain else {
                panic!("{zeta}: {found:?}")
            };
            assert!((back / zeta - 1.0).abs() < 1e-6, "{zeta}: {found:?}");
            assert!((found.unit_s * 38.0 - 1.0).abs() < 1e-6, "{found:?}");
        }
    }

    /// A parabola is answered late by κ1 and off by κ2/2, whatever the chain.
    #[test]
    fn a_parabola_shows_the_cumulants() {
        let chains = [
            (
                Chain::LagAverage {
                    lag: 1.0,
                    average: 0.0,
                },
                1.0,
            ),
            (
                Chain::LagAverage {
                    lag: 0.6,
                    average: 2.0,
                },
                0.36 + 4.0 / 12.0,
            ),
            (
                Chain::SecondOrder { zeta: 0.95 },
                -2.0 * (1.0 - 2.0 * 0.95 * 0.95),
            ),
            (Chain::SecondOrder { zeta: 0.5 }, -1.0),
            (Chain::FeedForward { share: 0.5 }, 0.75),
        ];
        for (chain, kappa2) in chains {
            let n = (chain.settling() / STEP) as usize * 2;
            let curve: Vec<f64> = (0..n).map(|k| 0.5 * (k as f64 * STEP).powi(2)).collect();
            let t = (n - 1) as f64 * STEP;
            let got = chain.apply(&curve)[n - 1] - 0.5 * (t - chain.delay()).powi(2);
            assert!((got - 0.5 * kappa2).abs() < 2e-3, "{chain:?}: {got}");
        }
    }
}
