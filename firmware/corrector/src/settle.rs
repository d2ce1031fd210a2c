//! Weights of nine set-points that undo a lag and an average, chosen for where the acceleration jumps.
//!
//! Planners without a bound on jerk, LinuxCNC's among them, let it jump at each joint of a line and an arc and on both sides of
//! a corner. Five weights are given by the first five derivatives; adding fifth differences changes none of them, so that
//! circles keep what they have. How much of each of the four is added is a question of least squares: the sum over time of what
//! the chain then is beside its own delay, after a jump of 1 m/s², and, less, of how much harder than the path the drive is
//! pulled meanwhile. The chain is known by κ2 and κ4 alone; so the two that are farthest from each other count the same.

use giotto_shared::model::Cumulants;

/// Set-points that count.
pub(crate) const TAPS: usize = 9;
/// Weights that the first five derivatives leave free.
const FREE: usize = TAPS - 5;
/// Fifth difference, and the sums of it from its begin: that of what it does to the acceleration.
const FIFTH: [f64; 6] = [1.0, -5.0, 10.0, -10.0, 5.0, -1.0];
const PULL: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Looks in the time between two set-points.
const LOOKS: usize = 4;
/// Most looks.
const MOST: usize = 256;
/// What a pull of the drive, in accelerations of the path, counts beside an error of the uncorrected chain's size. Smaller
/// leaves less at a jump and pulls harder.
const GENTLE: f64 = 0.01;

/// Five weights among nine, `every` apart.
pub(crate) fn spread(five: [f64; 5], every: usize) -> [f64; TAPS] {
    let mut taps = [0.0; TAPS];
    for (tap, weight) in taps.iter_mut().step_by(every.max(1)).zip(five) {
        *tap = weight;
    }
    taps
}

/// Two lags and an average.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chain {
    /// The longer one first; the second may be 0, the first not.
    pub(crate) lags_s: [f64; 2],
    pub(crate) window_s: f64,
}

impl Chain {
    /// The two chains farthest from each other that have these cumulants: a lag with an average, and two lags, with one only
    /// if they need it. A machine's own lies between them, nobody knows where. `lag_s` is the first one's.
    pub(crate) fn both(cumulants: &Cumulants<f64>, lag_s: f64) -> [Self; 2] {
        let Cumulants {
            kappa2_s2: k2,
            kappa4_s4: k4,
        } = *cumulants;
        let root = |square: f64| libm::sqrt(square.max(0.0));
        let single = Self {
            lags_s: [lag_s, 0.0],
            window_s: root(12.0 * (k2 - lag_s * lag_s)),
        };
        let half = 0.5 * k2;
        let apart = root(0.5 * (k4 / 6.0 - half * k2));
        let of_lags = (root(5.76 * k2 * k2 + 7.2 * (1.2 * k2 * k2 + k4)) - 2.4 * k2) / 3.6;
        let double = if apart > 0.0 {
            Self {
                lags_s: [root(half + apart), root(half - apart)],
                window_s: 0.0,
            }
        } else {
            Self {
                lags_s: [root(0.5 * of_lags); 2],
                window_s: root(12.0 * (k2 - of_lags)),
            }
        };
        [single, double]
    }

    fn delay_s(&self) -> f64 {
        self.lags_s.iter().sum::<f64>() + 0.5 * self.window_s
    }

    /// Where it is so long after its set-points have begun to accelerate by 1 m/s².
    fn place(&self, t: f64) -> f64 {
        let [longer, shorter] = self.lags_s;
        if shorter < 1e-3 * longer {
            return self.through_one(longer, t);
        }
        // Two that are all but equal are not told from two a little apart.
        let mean = 0.5 * (longer + shorter);
        let half = (0.5 * (longer - shorter)).max(0.005 * mean);
        let (longer, shorter) = (mean + half, mean - half);
        let [one, two] = [longer, shorter].map(|lag_s| lag_s * self.through_one(lag_s, t));
        (one - two) / (longer - shorter)
    }

    fn through_one(&self, lag: f64, t: f64) -> f64 {
        if self.window_s < 1e-3 * lag {
            let t = t.max(0.0);
            return 0.5 * t * t - lag * t + lag * lag * (1.0 - libm::exp(-t / lag));
        }
        let sum = |t: f64| {
            let t = t.max(0.0);
            t * t * t / 6.0 - 0.5 * lag * t * t
                + lag * lag * t
                + lag * lag * lag * (libm::exp(-t / lag) - 1.0)
        };
        (sum(t) - sum(t - self.window_s)) / self.window_s
    }
}

/// Set-points that begin to accelerate, with chains behind them. Times count from when the newest weighted set-point does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bend {
    pub(crate) chains: [Chain; 2],
    /// Between two set-points that count.
    pub(crate) spacing_s: f64,
    /// Until the set-points that go out should.
    pub(crate) before_s: f64,
}

impl Bend {
    /// The same weights with fifth differences added.
    pub(crate) fn settle(&self, taps: [f64; TAPS]) -> [f64; TAPS] {
        let mut normal = [[0.0; FREE + 1]; FREE];
        for chain in &self.chains {
            self.errors(chain, &taps, &mut normal);
        }
        self.pulls(&taps, &mut normal);
        let mut settled = taps;
        for (at, share) in solve(normal).into_iter().enumerate() {
            for (tap, weight) in settled.iter_mut().skip(at).zip(FIFTH) {
                *tap += share * weight;
            }
        }
        if settled.iter().all(|weight| weight.is_finite()) {
            settled
        } else {
            taps
        }
    }

    /// What the chain leaves, look by look.
    fn errors(&self, chain: &Chain, taps: &[f64; TAPS], normal: &mut [[f64; FREE + 1]; FREE]) {
        let step_s = self.spacing_s / LOOKS as f64;
        let long_s = TAPS as f64 * self.spacing_s + 6.0 * chain.delay_s();
        // Not negative; a cast saturates.
        let looks = ((long_s / step_s) as usize).min(MOST);
        let mut places = [0.0; MOST];
        for (look, place) in places.iter_mut().enumerate().take(looks) {
            *place = chain.place(look as f64 * step_s);
        }
        let at = |look: usize, taps_late: usize| {
            let then = look.checked_sub(taps_late.saturating_mul(LOOKS));
            then.and_then(|then| places.get(then))
                .copied()
                .unwrap_or(0.0)
        };
        let through = |weights: &[f64], look: usize, late: usize| -> f64 {
            let each = weights.iter().enumerate();
            each.map(|(k, weight)| weight * at(look, k.saturating_add(late)))
                .sum()
        };
        let late_s = self.before_s + chain.delay_s();
        for look in 0..looks {
            let t = (look as f64 * step_s - late_s).max(0.0);
            let left = through(taps, look, 0) - 0.5 * t * t;
            add(normal, |free| through(&FIFTH, look, free), left);
        }
    }

    /// How hard the drive is pulled, set-point by set-point.
    fn pulls(&self, taps: &[f64; TAPS], normal: &mut [[f64; FREE + 1]; FREE]) {
        let [single, _] = self.chains;
        let [lag, _] = single.lags_s;
        let bare = lag * lag + single.window_s * single.window_s / 12.0;
        // An error counts at every look, for either chain.
        let counts = GENTLE * bare * libm::sqrt((2 * LOOKS) as f64);
        let mut pull = 0.0;
        for (k, weight) in taps.iter().enumerate() {
            pull += weight;
            let path = if k as f64 * self.spacing_s >= self.before_s {
                1.0
            } else {
                0.0
            };
            let by = |free: usize| k.checked_sub(free).and_then(|at| PULL.get(at)).copied();
            add(
                normal,
                |free| counts * by(free).unwrap_or(0.0),
                counts * (pull - path),
            );
        }
    }
}

/// One more equation for the normal ones: Σ share·of(k) = −left.
fn add(normal: &mut [[f64; FREE + 1]; FREE], of: impl Fn(usize) -> f64, left: f64) {
    let mut line = [-left; FREE + 1];
    for (k, value) in line.iter_mut().take(FREE).enumerate() {
        *value = of(k);
    }
    for (row, own) in normal.iter_mut().zip(line) {
        for (sum, value) in row.iter_mut().zip(line) {
            *sum += own * value;
        }
    }
}

/// Solves the normal equations. They are positive definite: no pivot is looked for.
fn solve(mut rows: [[f64; FREE + 1]; FREE]) -> [f64; FREE] {
    for pivot in 0..FREE {
        let Some(row) = rows.get(pivot).copied() else {
            break;
        };
        let by = row.get(pivot).copied().unwrap_or(0.0);
        for (k, other) in rows.iter_mut().enumerate() {
            let share = other.get(pivot).copied().unwrap_or(0.0) / by;
            if k == pivot {
                *other = row.map(|value| value / by);
            } else {
                for (value, own) in other.iter_mut().zip(row) {
                    *value -= share * own;
                }
            }
        }
    }
    rows.map(|row| row.last().copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_equations_are_solved() {
        let mut normal = [[0.0; FREE + 1]; FREE];
        // Five equations for 3, −1, 2, 0.5 that agree.
        for line in [
            [1.0, 0.0, 0.0, 0.0],
            [2.0, 1.0, 0.0, 4.0],
            [0.0, 3.0, 1.0, 0.0],
            [1.0, 1.0, 1.0, 1.0],
            [0.0, 0.0, 5.0, -2.0],
        ] {
            let [a, b, c, d] = line;
            add(&mut normal, |k| line[k], -(3.0 * a - b + 2.0 * c + 0.5 * d));
        }
        let [a, b, c, d] = solve(normal);
        for (got, expected) in [(a, 3.0), (b, -1.0), (c, 2.0), (d, 0.5)] {
            assert!((got - expected).abs() < 1e-12, "{got} {expected}");
        }
    }

    /// The response that all is chosen by, against a chain in small steps.
    #[test]
    fn a_bend_through_a_chain_is_where_small_steps_lead() {
        for (lags_s, window_s) in [
            ([0.02, 0.0], 0.04),
            ([0.02, 0.0], 0.0),
            ([0.005, 0.0], 0.1),
            ([0.02, 0.01], 0.0),
            ([0.01, 0.01], 0.03),
        ] {
            let chain = Chain { lags_s, window_s };
            let step_s = 1e-6;
            let shares = lags_s.map(|lag_s: f64| -(-step_s / lag_s).exp_m1());
            let average = |t: f64| {
                let at = |t: f64| t.max(0.0).powi(3) / 6.0;
                if window_s > 0.0 {
                    (at(t) - at(t - window_s)) / window_s
                } else {
                    0.5 * t * t
                }
            };
            let (mut lagged, mut worst) = ([0.0; 2], 0.0f64);
            for k in 0..300_000 {
                let t = f64::from(k) * step_s;
                worst = worst.max((lagged[1] - chain.place(t)).abs());
                lagged[0] += shares[0] * (average(t + 0.5 * step_s) - lagged[0]);
                lagged[1] += shares[1] * (lagged[0] - lagged[1]);
            }
            // Of 6 mm and more; equal lags are told apart by a hundredth.
            assert!(worst < 1e-6, "{lags_s:?}: {worst}");
        }
    }

    #[test]
    fn both_chains_have_the_cumulants_that_were_asked_for() {
        let of = |chain: &Chain| {
            let sums = chain
                .lags_s
                .map(|lag_s| [lag_s.powi(2), 6.0 * lag_s.powi(4)]);
            let [[a2, a4], [b2, b4]] = sums;
            let window = chain.window_s;
            [
                a2 + b2 + window.powi(2) / 12.0,
                a4 + b4 - window.powi(4) / 120.0,
            ]
        };
        for (lag, window) in [(0.02f64, 0.04f64), (0.02, 0.0), (0.02, 0.01), (0.01, 0.06)] {
            let [kappa2_s2, kappa4_s4] = of(&Chain {
                lags_s: [lag, 0.0],
                window_s: window,
            });
            let cumulants = Cumulants {
                kappa2_s2,
                kappa4_s4,
            };
            for chain in Chain::both(&cumulants, lag) {
                let [k2, k4] = of(&chain);
                assert!((k2 / kappa2_s2 - 1.0).abs() < 1e-9, "{chain:?}");
                assert!(
                    (k4 - kappa4_s4).abs() < 1e-9 * kappa2_s2 * kappa2_s2,
                    "{chain:?}"
                );
            }
        }
    }

    #[test]
    fn nothing_below_the_fifth_derivative_is_changed() {
        let bend = Bend {
            chains: [
                Chain {
                    lags_s: [0.02, 0.0],
                    window_s: 0.04,
                },
                Chain {
                    lags_s: [0.02, 0.01],
                    window_s: 0.0,
                },
            ],
            spacing_s: 0.012,
            before_s: 0.028,
        };
        let five = [-0.5, 0.2, 2.0, -0.3, -0.4];
        let (before, after) = (spread(five, 2), bend.settle(spread(five, 2)));
        assert_ne!(before, after);
        for power in 0..5 {
            let moment = |taps: [f64; TAPS]| -> f64 {
                let each = taps.iter().enumerate();
                each.map(|(k, weight)| weight * (k as f64 - 4.0).powi(power))
                    .sum()
            };
            assert!((moment(before) - moment(after)).abs() < 1e-11);
        }
    }
}
