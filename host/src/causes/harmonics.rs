//! Signatures that are a few whole waves a turn: known by their coefficients, at no sample at all.

/// Highest order kept.
pub const ORDERS: usize = 8;

/// Mean and waves of an angle: `[mean, 0]`, then `[cos, sin]` of each order, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Harmonics(pub [[f64; 2]; ORDERS + 1]);

impl Harmonics {
    /// The same all around.
    pub fn mean(value: f64) -> Self {
        Self::default().with(0, [value, 0.0])
    }

    /// One order, cosine and sine.
    pub fn wave(order: usize, pair: [f64; 2]) -> Self {
        Self::default().with(order, pair)
    }

    /// With these coefficients of an order (0: the mean).
    pub fn with(mut self, order: usize, pair: [f64; 2]) -> Self {
        self.0[order] = pair;
        self
    }

    /// So many times.
    pub fn times(&self, factor: f64) -> Self {
        Self(self.0.map(|pair| pair.map(|v| v * factor)))
    }

    /// Less another.
    pub fn minus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|order| {
            let ([a, b], [c, d]) = (self.0[order], other.0[order]);
            [a - c, b - d]
        }))
    }

    /// Both multiplied; orders above [`ORDERS`] are left out.
    pub fn product(&self, other: &Self) -> Self {
        let mut out = Self::default();
        let is = |h: &Self, order: usize| h.0[order] != [0.0; 2];
        for i in (0..=ORDERS).filter(|&i| is(self, i)) {
            for j in (0..=ORDERS).filter(|&j| is(other, j)) {
                // (a cos iθ + b sin iθ)(c cos jθ + e sin jθ): half of the sum and of the difference of the orders.
                let ([a, b], [c, e]) = (self.0[i], other.0[j]);
                let half = if i == 0 || j == 0 { 1.0 } else { 0.5 };
                if i + j <= ORDERS {
                    let sum = &mut out.0[i + j];
                    sum[0] += half * (a * c - b * e);
                    sum[1] += half * (a * e + b * c);
                }
                if i != 0 && j != 0 {
                    let sign = if i >= j { 1.0 } else { -1.0 };
                    let difference = &mut out.0[i.abs_diff(j)];
                    difference[0] += half * (a * c + b * e);
                    if i != j {
                        difference[1] += half * sign * (b * c - a * e);
                    }
                }
            }
        }
        out
    }

    /// Multiplied by itself.
    pub fn squared(&self) -> Self {
        self.product(self)
    }

    /// The same pattern as waves of an angle that is larger by `ahead_rad`.
    pub fn seen_from(&self, ahead_rad: f64) -> Self {
        let mut out = *self;
        for (order, pair) in out.0.iter_mut().enumerate().skip(1) {
            let [c, s] = *pair;
            if [c, s] != [0.0; 2] {
                let (sin, cos) = (order as f64 * ahead_rad).sin_cos();
                *pair = [c * cos - s * sin, s * cos + c * sin];
            }
        }
        out
    }

    /// Value at an angle.
    pub fn at(&self, angle_rad: f64) -> f64 {
        let waves = self
            .0
            .iter()
            .enumerate()
            .skip(1)
            .filter(|(_, pair)| **pair != [0.0; 2]);
        waves.fold(self.0[0][0], |sum, (order, [c, s])| {
            let (sin, cos) = (order as f64 * angle_rad).sin_cos();
            sum + c * cos + s * sin
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_values() {
        let one = Harmonics::mean(0.3)
            .with(1, [1.0, -0.4])
            .with(3, [0.2, 2.0]);
        let other = Harmonics::mean(-1.1)
            .with(1, [0.5, 0.7])
            .with(4, [0.1, -0.6]);
        for angle in [0.0_f64, 0.7, 3.9, -2.0] {
            let expected = one.at(angle) * other.at(angle);
            assert!((one.product(&other).at(angle) - expected).abs() < 1e-14);
            assert!((one.squared().at(angle) - one.at(angle).powi(2)).abs() < 1e-14);
        }
    }

    #[test]
    fn a_pattern_is_the_same_seen_from_another_angle() {
        let pattern = Harmonics::mean(0.3)
            .with(2, [1.0, -0.4])
            .with(5, [0.0, 2.0]);
        for angle in [0.0_f64, 0.7, 3.9, -2.0] {
            let expected =
                0.3 + (2.0 * angle).cos() - 0.4 * (2.0 * angle).sin() + 2.0 * (5.0 * angle).sin();
            assert!((pattern.at(angle) - expected).abs() < 1e-14);
            assert!((pattern.seen_from(0.6).at(angle + 0.6) - expected).abs() < 1e-14);
        }
    }
}
