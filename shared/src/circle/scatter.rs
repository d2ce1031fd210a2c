//! Second moments of points in space: what a plane needs, in one pass, mergeable.
use super::points::Merge;

/// Count, mean and centred second moments of points in space (the pairwise update of Chan, Golub and LeVeque,
/// doi 10.1080/00031305.1983.10483115): nothing is accumulated about a far origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scatter {
    /// Number of points.
    pub count: usize,
    /// Mean, m.
    pub mean: [f64; 3],
    /// Σ of xx, xy, xz, yy, yz, zz about the mean, m².
    pub sums: [f64; 6],
}

fn products([x, y, z]: [f64; 3]) -> [f64; 6] {
    [x * x, x * y, x * z, y * y, y * z, z * z]
}

impl Scatter {
    /// Moments of a block of points; the three of equal length, short enough to stay in cache, for they are read twice.
    pub fn of_block(x: &[f64], y: &[f64], z: &[f64]) -> Self {
        let count = x.len().min(y.len()).min(z.len());
        if count == 0 {
            return Self::default();
        }
        let n = count as f64;
        let first = [x[0], y[0], z[0]];
        let points = || x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]);
        let mut offset = [0.0; 3];
        for p in points() {
            for k in 0..3 {
                offset[k] += p[k] - first[k];
            }
        }
        let offset = offset.map(|o| o / n);
        let mut sums = [0.0; 6];
        for p in points() {
            let d = core::array::from_fn(|k| (p[k] - first[k]) - offset[k]);
            for (sum, product) in sums.iter_mut().zip(products(d)) {
                *sum += product;
            }
        }
        Self {
            count,
            mean: core::array::from_fn(|k| first[k] + offset[k]),
            sums,
        }
    }
}

impl Merge for Scatter {
    fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (a, b) = (self.count as f64, other.count as f64);
        let between: [f64; 3] = core::array::from_fn(|k| other.mean[k] - self.mean[k]);
        let weight = a * b / (a + b);
        for ((sum, theirs), product) in self.sums.iter_mut().zip(other.sums).zip(products(between))
        {
            *sum += theirs + weight * product;
        }
        for (mean, by) in self.mean.iter_mut().zip(between) {
            *mean += b / (a + b) * by;
        }
        self.count += other.count;
    }
}
