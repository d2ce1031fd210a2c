//! How a stop slows down: in three pieces of constant jerk, as sums of integers.
//!
//! The acceleration goes to that of braking at the limit of jerk, stays there, and returns to none with the speed: from a constant
//! speed v within v²/2a + v·a/2j, where a is the braking and j the jerk, or within v·√(v/j) where v is below a²/j, so that a is not
//! reached. Whole ticks add less than one and a half of them at v. A ramp takes 315/128 times v²/2a: it is made for the correction, which asks for
//! four derivatives of the speed, and a stop is not.
use super::config::whole_above;

/// What a stop may take: shares of the constant rate per tick, and per tick².
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Slowing {
    pub(crate) braking: f32,
    pub(crate) jerk: f32,
}

/// Fraction bits of shares.
const BITS: u32 = 60;

/// So little below a number that rounding does not make it more: the share never comes to all, which its 31 bits do not hold, and the
/// last jerk never takes back more than there is.
const BELOW: f32 = 1.0 - 4e-7;

/// A way to rest: shares of the constant rate, and their first and second differences.
#[derive(Clone, Debug, Default)]
pub(crate) struct Descent {
    share: i64,
    change: i64,
    jerk: i64,
    /// Ticks left of the piece in hand, and of those behind it; jerk of the last one.
    left: u32,
    held: u32,
    last: u32,
    last_jerk: i64,
}

impl Descent {
    /// From a share (Q31), its growth in the tick before, and what the stop may take. `None`: it slows down by more than that already.
    pub(crate) fn begin(share_q31: i32, growth: f32, slowing: Slowing) -> Option<Self> {
        let Slowing { braking, jerk } = slowing;
        let share = share_q31 as f32 * (BELOW / 2_147_483_648.0);
        // What it gains while the growth is taken back does not lead beyond the constant rate.
        let growth = growth.min(libm::sqrtf(2.0 * jerk * (1.0 - share).max(0.0)));
        // Without a second piece the speed is used up at this change.
        let most = braking.min(libm::sqrtf(jerk * share + 0.5 * growth * growth));
        if growth < 0.0 && (growth <= -most || 2.0 * jerk * share <= growth * growth) {
            return None;
        }
        let (first, last) = (
            whole_above((growth + most) / jerk).max(1),
            whole_above(most / jerk).max(1),
        );
        let gained = share + 0.5 * growth * (first as f32 - 1.0);
        let edges = 0.5 * (first as f32 + last as f32);
        let held = whole_above(gained / most - edges);
        // Whole ticks take longer: the change that ends at rest.
        let most = gained / (held as f32 + edges);
        let whole = |value: f32| (value * (1u64 << BITS) as f32) as i64;
        let mut descent = Self {
            change: whole(growth),
            jerk: whole((growth + most) / first as f32).wrapping_neg(),
            left: first,
            held,
            last,
            ..Self::default()
        };
        // What comes of the rounded ones, summed up: so it is at rest to the last unit, and never beyond.
        let n = i64::from(first);
        let lowest = descent.change.wrapping_add(descent.jerk.wrapping_mul(n));
        let (held, last) = (i64::from(held), i64::from(last));
        descent.last_jerk =
            whole(lowest.wrapping_neg() as f32 * (BELOW / (1u64 << BITS) as f32) / last as f32);
        let triangle = |n: i64| n.wrapping_mul(n.wrapping_add(1)) >> 1;
        let first = descent
            .change
            .wrapping_mul(n)
            .wrapping_add(descent.jerk.wrapping_mul(triangle(n)));
        let rest = lowest.wrapping_mul(held.wrapping_add(last));
        let rest = rest.wrapping_add(descent.last_jerk.wrapping_mul(triangle(last)));
        descent.share = first.wrapping_add(rest).wrapping_neg();
        Some(descent)
    }

    /// Shares of the next tick, Q31: of the way in it, and of the rate at its end.
    #[inline(always)]
    pub(crate) fn next_q31(&mut self) -> [i32; 2] {
        if self.left == 0 {
            self.turn();
        }
        self.left = self.left.wrapping_sub(1);
        self.change = self.change.wrapping_add(self.jerk);
        self.share = self.share.wrapping_add(self.change);
        let end = self.share.wrapping_add(self.change >> 1);
        [self.share, end].map(|share| (share >> (BITS - 31)) as i32)
    }

    /// The piece in hand is over.
    #[inline(never)]
    fn turn(&mut self) {
        if self.held > 0 {
            (self.left, self.jerk) = (self.held, 0);
            self.held = 0;
        } else if self.last > 0 {
            (self.left, self.jerk) = (self.last, self.last_jerk);
            self.last = 0;
        } else {
            *self = Self {
                left: u32::MAX,
                ..Self::default()
            };
        }
    }

    /// At rest.
    #[inline(always)]
    pub(crate) const fn over(&self) -> bool {
        self.share == 0
    }

    /// Its way, in ticks of the constant rate.
    pub(crate) fn way(&self) -> f32 {
        let real = |whole: i64| whole as f32 * (1.0 / (1u64 << BITS) as f32);
        let (n, held, last) = (self.left as f32, self.held as f32, self.last as f32);
        let (share, change, jerk) = (real(self.share), real(self.change), real(self.jerk));
        let lowest = change + jerk * n;
        let turned = share + n * (change + 0.5 * jerk * (n + 1.0));
        let first = n * (share + (n + 1.0) * (0.5 * change + (n + 2.0) * jerk * (1.0 / 6.0)));
        let held = held * (turned + 0.5 * lowest * (held + 1.0));
        first + held + real(self.last_jerk) * last * (last - 1.0) * (last - 2.0) * (1.0 / 6.0)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// Shares from the first tick to the first one at rest.
    fn run(mut descent: Descent) -> std::vec::Vec<f64> {
        let mut shares = std::vec![];
        while !descent.over() {
            shares.push(f64::from(descent.next_q31()[0]) / 2_147_483_648.0);
            assert!(shares.len() < 3_000_000);
        }
        assert_eq!([descent.next_q31(), descent.next_q31()], [[0; 2]; 2]);
        shares
    }

    #[test]
    fn from_constant_rate_it_is_the_stated_way_within_braking_and_jerk() {
        for rate_hz in [250.0, 1000.0, 8000.0, 20_000.0] {
            for speed in [0.002f64, 0.05, 0.3, 1.0, 2.0] {
                for (braking, jerk) in [(5.0, 100.0), (5.0, 1000.0), (0.5, 1.0), (20.0, 200.0)] {
                    let slowing = Slowing {
                        braking: (braking / speed / rate_hz) as f32,
                        jerk: (jerk / speed / (rate_hz * rate_hz)) as f32,
                    };
                    let descent = Descent::begin(i32::MAX, 0.0, slowing).unwrap();
                    let stated = f64::from(descent.way());
                    let shares = run(descent);
                    let what = std::format!("{rate_hz} {speed} {braking} {jerk}");
                    let way: f64 = shares.iter().sum();
                    assert!(
                        (way - stated).abs() < 1e-5 * way + 1e-3,
                        "{what}: {way} {stated}"
                    );
                    // In ticks of the constant rate.
                    let reached = speed >= braking * braking / jerk;
                    let exact = if reached {
                        0.5 * (speed / braking + braking / jerk)
                    } else {
                        (speed / jerk).sqrt()
                    } * rate_hz;
                    assert!(
                        way > exact - 1.0 - 1e-6 * exact && way < exact + 1.5 + 1e-5 * exact,
                        "{what}: {way} of {exact}"
                    );
                    let mut before = [1.0, 1.0];
                    for share in shares {
                        let [first, now] = before;
                        let (change, last) = (share - now, now - first);
                        let most = f64::from(slowing.braking) + 8e-7;
                        assert!(change <= 8e-7 && change >= -most, "{what}: {change}");
                        // Single precision shows in the first tick.
                        let most = f64::from(slowing.jerk) * 1.000_001 + 8e-7;
                        assert!((change - last).abs() <= most, "{what}: {}", change - last);
                        before = [now, share];
                    }
                }
            }
        }
    }

    #[test]
    fn from_a_growing_or_falling_rate_neither_rate_nor_growth_jumps() {
        let slowing = Slowing {
            braking: 5e-3,
            jerk: 1e-4,
        };
        let mut left = 0;
        for share in [0.0f64, 1e-6, 1e-3, 0.1, 0.4, 0.8, 0.95, 1.0] {
            for growth in [0.0f64, 1e-5, 1e-3, 4e-3, -1e-5, -1e-3, -4e-3] {
                let share_q31 = (share * 2_147_483_647.0) as i32;
                let Some(descent) = Descent::begin(share_q31, growth as f32, slowing) else {
                    // It falls faster than the jerk can take back, or than it may.
                    assert!(
                        growth < 0.0 && growth * growth >= 2e-4 * 0.999 * share,
                        "{share} {growth}"
                    );
                    left += 1;
                    continue;
                };
                let lawful = growth.min((2e-4 * (1.0 - share)).sqrt());
                let mut before = [share - lawful, share];
                for now in run(descent) {
                    let second = now - 2.0 * before[1] + before[0];
                    assert!(
                        second.abs() < 1.0001e-4 + 8e-7,
                        "{share} {growth}: {second}"
                    );
                    assert!((0.0..1.0).contains(&now), "{share} {growth}: {now}");
                    before = [before[1], now];
                }
            }
        }
        assert!(left > 3);
    }
}
