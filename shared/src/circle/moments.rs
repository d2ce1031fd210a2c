//! Centred moments of a point set, up to what an algebraic circle needs.
//!
//! With p = (x, y) measured from the mean and z = x² + y², the set {n, mean, Σpp', Σpz, Σzz} is closed
//! under a change of origin, so parts can be merged exactly (the pairwise update of Chan, Golub and
//! LeVeque, doi 10.1080/00031305.1983.10483115, carried on to fourth order). Nothing is ever accumulated
//! about a far origin.
use super::lanes::{Lanes, Terms, sums};
use super::points::{Merge, Part, Points, Walk};

/// Count, mean and centred moment sums of a point set. One pass, mergeable.
///
/// ```
/// use giotto_shared::circle::{hyper, CircleError, Merge, Moments};
///
/// // Two halves of a recording, gathered apart and merged, give the circle of the whole.
/// let first = [[6.0, 2.0], [1.0, 7.0]];
/// let second = [[-4.0, 2.0], [4.0, 6.0]];
/// let mut moments = Moments::of(first.as_slice());
/// moments.merge(&Moments::of(second.as_slice()));
/// assert_eq!(moments.count, 4);
/// assert!((hyper(&moments)?.radius - 5.0).abs() < 1e-9);
/// # Ok::<(), CircleError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Moments {
    /// Number of points.
    pub count: usize,
    /// Mean of the points, to the last digit.
    pub mean: [f64; 2],
    /// What the mean is beyond that digit: at 100 m a digit is 1e-14 m, and merging many parts would add them up.
    rest: [f64; 2],
    /// Σx².
    pub xx: f64,
    /// Σxy.
    pub xy: f64,
    /// Σy².
    pub yy: f64,
    /// Σxz, z = x² + y².
    pub xz: f64,
    /// Σyz.
    pub yz: f64,
    /// Σz².
    pub zz: f64,
}

impl Moments {
    /// Moments of all points of a source, in one pass.
    pub fn of(points: &(impl Points + ?Sized)) -> Self {
        Self::of_walk(Walk::ALL, points)
    }

    /// Moments of some points of a source.
    pub(super) fn of_walk(walk: Walk, points: &(impl Points + ?Sized)) -> Self {
        points.sum(walk, &OfBlock)
    }

    /// Sums about an origin at (`rx`, `ry`), the true mean, where they were taken about 0. The residue of
    /// the rounded mean is so small that its square matters in no sum but the second moments.
    fn recentred(mut self, n: f64, rx: f64, ry: f64) -> Self {
        let z = self.xx + self.yy;
        self.zz -= 4.0 * (self.xz * rx + self.yz * ry);
        self.xz -= 2.0 * (self.xx * rx + self.xy * ry) + rx * z;
        self.yz -= 2.0 * (self.xy * rx + self.yy * ry) + ry * z;
        self.xx -= n * rx * rx;
        self.xy -= n * rx * ry;
        self.yy -= n * ry * ry;
        self.rest = [rx, ry];
        self
    }

    /// The sums (xx, xy, yy, xz, yz, zz) of the same points about an origin at mean − (`dx`, `dy`).
    fn about(&self, dx: f64, dy: f64) -> [f64; 6] {
        let n = self.count as f64;
        let z = self.xx + self.yy;
        let s = dx * dx + dy * dy;
        let along_x = self.xx * dx + self.xy * dy;
        let along_y = self.xy * dx + self.yy * dy;
        [
            self.xx + n * dx * dx,
            self.xy + n * dx * dy,
            self.yy + n * dy * dy,
            self.xz + 2.0 * along_x + dx * (z + n * s),
            self.yz + 2.0 * along_y + dy * (z + n * s),
            self.zz
                + 4.0 * (self.xz * dx + self.yz * dy)
                + 4.0 * (along_x * dx + along_y * dy)
                + s * (2.0 * z + n * s),
        ]
    }
}

/// Moments of a block.
struct OfBlock;

impl Part for OfBlock {
    type Sum = Moments;

    #[inline(always)]
    fn of<L: Lanes>(&self, lanes: L, x: &[f64], y: &[f64]) -> Moments {
        let count = x.len().min(y.len());
        if count == 0 {
            return Moments::default();
        }
        let n = count as f64;
        let (x0, y0) = (x[0], y[0]);
        let [dx, dy] = sums(lanes, x, y, &SeenFrom([x0, y0])).map(|sum| sum / n);
        let (mx, my) = (x0 + dx, y0 + dy);
        let [sx, sy, xx, xy, yy, xz, yz, zz] = sums(lanes, x, y, &SeenFrom([mx, my]));
        // The mean is rounded: at 100 m its last digit is 1e-14 m. Move the origin by what is left.
        let (rx, ry) = (sx / n, sy / n);
        Moments {
            count,
            mean: [mx, my],
            rest: [0.0; 2],
            xx,
            xy,
            yy,
            xz,
            yz,
            zz,
        }
        .recentred(n, rx, ry)
    }
}

/// Points as seen from this one.
struct SeenFrom([f64; 2]);

impl SeenFrom {
    #[inline(always)]
    fn point<L: Lanes>(&self, lanes: L, x: L::Four, y: L::Four) -> [L::Four; 2] {
        [x - lanes.splat(self.0[0]), y - lanes.splat(self.0[1])]
    }
}

impl Terms<2> for SeenFrom {
    #[inline(always)]
    fn of<L: Lanes>(&self, lanes: L, x: L::Four, y: L::Four) -> [L::Four; 2] {
        self.point(lanes, x, y)
    }
}

impl Terms<8> for SeenFrom {
    #[inline(always)]
    fn of<L: Lanes>(&self, lanes: L, x: L::Four, y: L::Four) -> [L::Four; 8] {
        let [x, y] = self.point(lanes, x, y);
        let z = x * x + y * y;
        [x, y, x * x, x * y, y * y, x * z, y * z, z * z]
    }
}

impl Merge for Moments {
    fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (na, nb) = (self.count as f64, other.count as f64);
        let (wa, wb) = (na / (na + nb), nb / (na + nb));
        let [dx, dy] = core::array::from_fn(|k| {
            (other.mean[k] - self.mean[k]) + (other.rest[k] - self.rest[k])
        });
        let a = self.about(-wb * dx, -wb * dy);
        let b = other.about(wa * dx, wa * dy);
        let [xx, xy, yy, xz, yz, zz] = core::array::from_fn(|i| a[i] + b[i]);
        let by = [self.rest[0] + wb * dx, self.rest[1] + wb * dy];
        let mean: [f64; 2] = core::array::from_fn(|k| self.mean[k] + by[k]);
        let rest = core::array::from_fn(|k| by[k] - (mean[k] - self.mean[k]));
        *self = Self {
            count: self.count + other.count,
            mean,
            rest,
            xx,
            xy,
            yy,
            xz,
            yz,
            zz,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circle::{Sampled, Xy};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Textbook definition, two plain passes about the mean.
    fn naive(points: &[[f64; 2]]) -> Moments {
        let n = points.len() as f64;
        let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
        let mut m = Moments {
            count: points.len(),
            mean,
            ..Moments::default()
        };
        for p in points {
            let (x, y) = (p[0] - mean[0], p[1] - mean[1]);
            let z = x * x + y * y;
            m.xx += x * x;
            m.xy += x * y;
            m.yy += y * y;
            m.xz += x * z;
            m.yz += y * z;
            m.zz += z * z;
        }
        m
    }

    fn close(a: &Moments, b: &Moments) -> Result<(), TestCaseError> {
        let size = (b.xx + b.yy).sqrt();
        prop_assert_eq!(a.count, b.count);
        for (a, b, power) in [
            (a.xx, b.xx, 2),
            (a.xy, b.xy, 2),
            (a.yy, b.yy, 2),
            (a.xz, b.xz, 3),
            (a.yz, b.yz, 3),
            (a.zz, b.zz, 4),
        ] {
            prop_assert!(
                (a - b).abs() <= 1e-11 * size.powi(power),
                "{a} against {b}, order {power}"
            );
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn blocks_and_merges_agree_with_the_definition(
            points in prop::collection::vec(prop::array::uniform2(-3.0..5.0), 1..1500),
            at in 0usize..1500,
        ) {
            let whole = Moments::of(points.as_slice());
            close(&whole, &naive(&points))?;
            let (left, right) = points.split_at(at.min(points.len()));
            let mut merged = Moments::of(left);
            merged.merge(&Moments::of(right));
            close(&merged, &whole)?;
        }
    }

    #[test]
    fn a_far_origin_costs_nothing() {
        // Multiples of 2⁻²⁰ survive the shift by 2²⁰ exactly, so both sets hold the same points.
        let at = |i: usize| {
            [
                (i * 37 % 1000) as f64 / 1048576.0,
                (i * 91 % 1000) as f64 / 1048576.0,
            ]
        };
        let near = Moments::of(&Sampled::new(5000, at));
        let far = Moments::of(&Sampled::new(5000, |i| at(i).map(|v| v + 1048576.0)));
        for (a, b) in [(near.xx, far.xx), (near.yy, far.yy), (near.zz, far.zz)] {
            assert!((a - b).abs() <= 1e-14 * a, "{a} {b}");
        }
    }

    #[test]
    fn both_layouts_give_the_same_bits() {
        let aos: Vec<[f64; 2]> = (0..2000)
            .map(|i| [f64::from(i).sin(), f64::from(i).cos()])
            .collect();
        let (x, y): (Vec<_>, Vec<_>) = aos.iter().map(|p| (p[0], p[1])).unzip();
        assert_eq!(
            Moments::of(aos.as_slice()),
            Moments::of(&Xy::new(&x, &y).unwrap())
        );
    }
}
