//! The inverse of a machine's chain, as weights of some set-points.
//!
//! Cumulants of even order say how a chain shrinks circles, and a circle at constant rate shows no others. Where the
//! curvature changes, at each joint of a line and an arc, the odd ones count as well: the operator of κ2 and κ4 alone
//! leaves a quarter of the error there, whatever its window. So a chain that can be one of a lag τ and a moving average (most
//! are, or nearly) is undone as that: (1 + τ·d/dt) for the lag, the operator for what is symmetric in time.
//!
//! The lag's delay stays: it is the machine's own and the same on all slides. The points therefore lie about a place τ
//! before the one that goes out, and the offset has no part along the velocity.
//!
//! Five points are enough for circles. Nine leave the same of them, and where the acceleration jumps they are chosen for the
//! least error and no harder a pull than need be ([`crate::settle`]).
use crate::settle::{self, Bend, Chain, TAPS};
use giotto_shared::law::Operator;
use giotto_shared::model::Cumulants;

/// 1 + c1·s + … + c4·s⁴, s for d/dt.
type Series = [f64; 5];

/// What undoes a chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inverse {
    /// τ, s; 0: the chain is undone by even derivatives alone.
    pub(crate) lag_s: f64,
    /// Undoes what is not the lag.
    rest: Operator<f64>,
    /// Undoes all, where the history is too short for the lag.
    whole: Operator<f64>,
    /// What the chain may be.
    chains: [Chain; 2],
}

impl Inverse {
    pub(crate) fn new(cumulants: &Cumulants<f64>) -> Self {
        let lag_s = libm::cbrt(0.5 * cumulants.third_of_lag_and_average());
        let square = lag_s * lag_s;
        let rest_s2 = cumulants.kappa2_s2 - square;
        Self {
            lag_s,
            chains: Chain::both(cumulants, lag_s),
            rest: Operator::new(&Cumulants {
                kappa2_s2: rest_s2,
                kappa4_s4: cumulants.kappa4_s4 - 6.0 * square * square,
            }),
            whole: Operator::new(cumulants),
        }
    }

    /// By even derivatives alone.
    pub(crate) const fn without_lag(&self) -> Self {
        Self {
            lag_s: 0.0,
            rest: self.whole,
            whole: self.whole,
            chains: self.chains,
        }
    }
}

/// Set-points as far from each other, and what each counts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stencil {
    /// Ticks from the newest set-point of all to the newest that counts.
    pub(crate) newest: usize,
    /// Ticks between two.
    pub(crate) spacing: usize,
    /// Of the newest first.
    pub(crate) weights: [f64; TAPS],
}

impl Stencil {
    /// For set-points that go out two strides late; `reach` is how many ticks back the oldest one may lie.
    pub(crate) fn new(inverse: &Inverse, stride: usize, tick_s: f64, reach: usize) -> Self {
        let latency = stride.saturating_mul(2);
        // Not negative; a cast saturates.
        let late = (inverse.lag_s / tick_s + 0.5) as usize;
        let centre = latency.saturating_add(late);
        // What rounding to ticks leaves of the delay.
        let rest_s = inverse.lag_s - late as f64 * tick_s;
        let lag = [1.0, inverse.lag_s, 0.0, 0.0, 0.0];
        let undone = product(&product(&lag, &even(&inverse.rest)), &delay(rest_s));
        let five = |centre: usize, series: &Series| Self {
            newest: centre.saturating_sub(latency),
            spacing: stride,
            weights: settle::spread(weights(series, stride as f64 * tick_s), 1),
        };
        let spacing = (centre / SIDE).min(reach.saturating_sub(centre) / SIDE);
        if late == 0 || spacing == 0 {
            let whole = late == 0 && centre.saturating_add(latency) <= reach;
            return if whole {
                five(centre, &undone)
            } else {
                five(latency, &even(&inverse.whole))
            };
        }
        let spacing_s = spacing as f64 * tick_s;
        let bend = Bend {
            chains: inverse.chains,
            spacing_s,
            before_s: SIDE as f64 * spacing_s - late as f64 * tick_s,
        };
        let wide = weights(&undone, 2.0 * spacing_s);
        Self {
            newest: centre.saturating_sub(SIDE.saturating_mul(spacing)),
            spacing,
            weights: bend.settle(settle::spread(wide, 2)),
        }
    }
}

/// Points on either side of the middle one.
const SIDE: usize = TAPS / 2;

const fn even(operator: &Operator<f64>) -> Series {
    [1.0, 0.0, operator.second_s2, 0.0, operator.fourth_s4]
}

fn delay(t: f64) -> Series {
    let square = t * t;
    [
        1.0,
        -t,
        square / 2.0,
        -square * t / 6.0,
        square * square / 24.0,
    ]
}

fn product(a: &Series, b: &Series) -> Series {
    let mut out = [0.0; 5];
    for (i, a) in a.iter().enumerate() {
        for (out, b) in out.iter_mut().skip(i).zip(b) {
            *out += a * b;
        }
    }
    out
}

/// Differences of fourth order for the first two derivatives, of second order for the others.
fn weights(&[_, first, second, third, fourth]: &Series, h: f64) -> [f64; 5] {
    let (first, second) = (first / (12.0 * h), second / (12.0 * h * h));
    let (third, fourth) = (third / (2.0 * h * h * h), fourth / (h * h * h * h));
    let outer = [
        -first - second + third + fourth,
        first - second - third + fourth,
    ];
    let inner = [
        8.0 * first + 16.0 * second - 2.0 * third - 4.0 * fourth,
        -8.0 * first + 16.0 * second + 2.0 * third - 4.0 * fourth,
    ];
    let [[newest, oldest], [newer, older]] = [outer, inner];
    let middle = 1.0 - (newest + oldest + newer + older);
    [newest, newer, middle, older, oldest]
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_shared::model::Element;

    const TICK_S: f64 = 1e-3;

    /// What goes out for a polynomial in time, at time 0 of the place that goes out.
    fn applied(stencil: &Stencil, latency: usize, at: impl Fn(f64) -> f64) -> f64 {
        stencil
            .weights
            .iter()
            .enumerate()
            .map(|(k, weight)| {
                let ticks = (stencil.newest + k * stencil.spacing) as f64 - latency as f64;
                weight * at(-ticks * TICK_S)
            })
            .sum()
    }

    /// A lag between two ticks and an average: of polynomials up to the third degree the inverse with its delay is exact, and
    /// nothing of a constant velocity is left.
    #[test]
    fn a_lag_between_ticks_is_undone_without_a_lead() {
        let (lag_s, window_s) = (0.0203, 0.04);
        let lag = Element::Lag {
            kv_per_s: 1.0 / lag_s,
        };
        let cumulants = lag.cumulants() + Element::MovingAverage { window_s }.cumulants();
        let inverse = Inverse::new(&cumulants);
        assert!((inverse.lag_s - lag_s).abs() < 1e-9, "{}", inverse.lag_s);
        let stencil = Stencil::new(&inverse, 15, TICK_S, 1000);
        assert_eq!((stencil.newest, stencil.spacing), (2, 12));
        assert!(applied(&stencil, 30, |t| t).abs() < 1e-15);
        // (1 + τs)e^{−τs} = 1 − τ²s²/2 + τ³s³/3 …; the average: 1 − T²s²/24.
        let square = lag_s * lag_s + window_s * window_s / 12.0;
        assert!((applied(&stencil, 30, |t| t * t) + square).abs() < 1e-12);
        let third = 2.0 * lag_s.powi(3);
        assert!((applied(&stencil, 30, |t| t.powi(3)) - third).abs() < 1e-12);
    }

    #[test]
    fn a_chain_that_is_no_lag_and_average_has_its_operator() {
        for (kappa2_s2, kappa4_s4) in [(46.58e-6, -5.5e-6), (-1e-4, 1e-9), (4e-4, 12.0 * 16e-8)] {
            let cumulants = Cumulants {
                kappa2_s2,
                kappa4_s4,
            };
            let inverse = Inverse::new(&cumulants);
            assert_eq!(inverse.lag_s, 0.0);
            let stencil = Stencil::new(&inverse, 15, TICK_S, 1000);
            let fourth = Operator::new(&cumulants).offset(0.0, 24.0);
            assert_eq!((stencil.newest, stencil.spacing), (0, 15));
            assert!((applied(&stencil, 30, |t| t * t) + kappa2_s2).abs() < 1e-15);
            assert!((applied(&stencil, 30, |t| t.powi(4)) - fourth).abs() < 1e-12);
            assert!(applied(&stencil, 30, |t| t.powi(3)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_lag_longer_than_the_history_is_left_to_the_operator() {
        let inverse = Inverse::new(&Element::Lag { kv_per_s: 2.0 }.cumulants());
        let stencil = Stencil::new(&inverse, 15, TICK_S, 500);
        assert_eq!((stencil.newest, stencil.spacing), (0, 15));
        assert!((applied(&stencil, 30, |t| t * t) + 0.25).abs() < 1e-12);
    }
}
