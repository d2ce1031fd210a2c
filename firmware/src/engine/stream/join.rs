//! How a stream goes on after a gap: from where the gap was bridged to what comes in, without a step of place or of velocity.
//!
//! With b the distance between the two when the set-points came back, w its rate and u the share of T that is over, what is
//! taken is the set-point and b·H(u) + w·T·h(u), where H = (1 − u)³(1 + 3u + 6u²) and h = u(1 − u)³(1 + 3u): the least
//! polynomials with value and slope of 1 at the start that end with three derivatives of 0 and start with a second one of 0. T is as
//! long as keeps what they add to the acceleration, at most |H″| b/T² + |h″| w/T, below a share of the machine's.
use super::brake::{Limits, size};
use giotto_shared::fixed::mulh;

/// Shortest, and longest, ticks: what a sender within the acceleration can be away after the longest gap is joined in less.
const TICKS: [f32; 2] = [32.0, 512.0];
/// Of the machine's acceleration, added to that of the set-points.
const SHARE: f32 = 0.125;
/// Largest |H″|, at u = (1 − 1/√3)/2, and |h″|, at u = (16 − √76)/30, rounded up.
const SECOND: [f32; 2] = [5.774, 3.941];

/// A join under way.
#[derive(Clone, Debug)]
pub(super) struct Join {
    /// b and w·T, nm.
    apart_nm: [i32; 3],
    drift_nm: [i32; 3],
    /// u and its step, Q32.
    u: u32,
    du: u32,
}

impl Join {
    /// From a distance (nm) and its rate (nm per tick). `None`: the set-points are not those of the path that was bridged.
    pub(super) fn begin(apart_nm: [i32; 3], rate_nm: [i32; 3], limits: Limits) -> Option<Self> {
        let single = |v: [i32; 3]| size(v.map(|nm| nm as f32));
        let [by_place, by_rate] = SECOND;
        let (place, rate) = (by_place * single(apart_nm), by_rate * single(rate_nm));
        // SHARE·a T² = place + rate T.
        let twice = 2.0 * SHARE * limits.acceleration;
        let root = libm::sqrtf(rate * rate + 2.0 * twice * place);
        let [shortest, longest] = TICKS;
        let ticks = ((rate + root) / twice).max(shortest);
        // No number is not within either.
        (ticks <= longest).then(|| Self {
            apart_nm,
            drift_nm: rate_nm.map(|nm| (nm as f32 * ticks) as i32),
            u: 0,
            du: (4_294_967_296.0 / ticks) as u32,
        })
    }

    /// What is to be added to the next set-point, nm; `None`: nothing any more.
    pub(super) fn next_nm(&mut self) -> Option<[i32; 3]> {
        let (u, over) = self.u.overflowing_add(self.du);
        self.u = u;
        if over {
            return None;
        }
        let (u_q31, left_q31) = ((u >> 1) as i32, (!u >> 1) as i32);
        let cube_q31 = mulh(mulh(left_q31, left_q31), left_q31).wrapping_mul(4);
        // 1 + 3u, and 1 + 3u + 6u², which is 10 at most.
        let line_q27 = (1 << 27) + (u_q31 >> 4).wrapping_mul(3);
        let square_q27 = mulh(u_q31, u_q31) >> 3;
        let whole_q27 = line_q27.wrapping_add(square_q27.wrapping_mul(6));
        let scaled = |a: i32, b_q27: i32| i64::from(a).wrapping_mul(i64::from(b_q27)) >> 27;
        let apart_q31 = scaled(cube_q31, whole_q27);
        let drift_q31 = scaled(mulh(cube_q31, u_q31).wrapping_mul(2), line_q27);
        let mut added = [0; 3];
        for ((added, b), w) in added.iter_mut().zip(self.apart_nm).zip(self.drift_nm) {
            let sum = i64::from(b).wrapping_mul(apart_q31);
            let sum = sum.wrapping_add(i64::from(w).wrapping_mul(drift_q31));
            *added = (sum.wrapping_add(1 << 30) >> 31) as i32;
        }
        Some(added)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        feed: 1e6,
        acceleration: 5000.0,
        jerk: 100.0,
    };

    /// Against the polynomials in double precision, and their second differences against the share that is stated.
    #[test]
    fn joins_are_the_polynomials_and_add_no_more_than_their_share() {
        for (b, w) in [
            (0, 0),
            (40_000, 0),
            (-900_000, 30_000),
            (900_000, 30_000),
            (0, -55_000),
            (3, -7),
        ] {
            let mut join = Join::begin([b, 0, -b], [w, 0, -w], LIMITS).unwrap();
            let ticks = 4_294_967_296.0 / f64::from(join.du);
            let exact = |t: f64| {
                let u = (t / ticks).min(1.0);
                let cube = (1.0 - u).powi(3);
                let (b, w) = (f64::from(b), f64::from(w));
                cube * ((1.0 + 3.0 * u + 6.0 * u * u) * b + (1.0 + 3.0 * u) * w * t)
            };
            let mut before = [f64::from(b) - f64::from(w), f64::from(b)];
            let mut tick = 0.0;
            while let Some([x, y, z]) = join.next_nm() {
                tick += 1.0;
                assert!(
                    (f64::from(x) - exact(tick)).abs() < 1.5,
                    "{b} {w} {tick}: {x}"
                );
                assert!(y == 0 && (x + z).abs() <= 2);
                let second = f64::from(x) - 2.0 * before[1] + before[0];
                // In space it is √2 of that on one axis; whole nanometres add 3, the tick before the first half a tick's.
                let most = f64::from(SHARE * LIMITS.acceleration) / 2f64.sqrt();
                assert!(second.abs() < 1.02 * most + 3.0, "{b} {w} {tick}: {second}");
                before = [before[1], f64::from(x)];
            }
            assert!(tick + 1.0 >= ticks && tick < ticks + 1.0);
        }
    }

    #[test]
    fn what_no_sender_within_the_acceleration_sends_is_not_joined() {
        assert!(Join::begin([0; 3], [900_000, 0, 0], LIMITS).is_none());
        assert!(Join::begin([i32::MIN; 3], [0; 3], LIMITS).is_none());
        assert!(Join::begin([0; 3], [i32::MIN; 3], LIMITS).is_none());
        let seven_ticks_at_most = [2 * 5000 * 7, 0, 0];
        assert!(Join::begin([5000 * 49, 0, 0], seven_ticks_at_most, LIMITS).is_some());
        assert!(Join::begin([1; 3], [1; 3], Limits::default()).is_none());
    }
}
