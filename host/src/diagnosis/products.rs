//! Symmetric matrices of scalar products: one row for each column in play, grown row by row.

/// Products of columns with each other; column 0 is the data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Products {
    size: usize,
    /// The lower triangle, one row behind the other: a further row moves none of the others.
    packed: Vec<f64>,
}

const fn place(i: usize, j: usize) -> usize {
    let (row, at) = if i < j { (j, i) } else { (i, j) };
    row * (row + 1) / 2 + at
}

impl Products {
    /// Of so many columns, all zero.
    pub fn zeros(size: usize) -> Self {
        Self {
            size,
            packed: vec![0.0; size * (size + 1) / 2],
        }
    }

    /// From each product of column `i` with column `j ≤ i`.
    pub fn from_fn(size: usize, mut value: impl FnMut(usize, usize) -> f64) -> Self {
        let mut packed = Vec::with_capacity(size * (size + 1) / 2);
        for i in 0..size {
            packed.extend((0..=i).map(|j| value(i, j)));
        }
        Self { size, packed }
    }

    /// Number of columns.
    pub const fn size(&self) -> usize {
        self.size
    }

    /// Product of two columns.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.packed[place(i, j)]
    }

    /// Product of two columns, to be changed.
    pub fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.packed[place(i, j)]
    }

    /// Further columns, up to so many; their products are zero.
    pub fn grow(&mut self, size: usize) {
        self.size = self.size.max(size);
        self.packed.resize(self.size * (self.size + 1) / 2, 0.0);
    }

    /// Takes out all columns from number `size` on.
    pub fn truncate(&mut self, size: usize) {
        self.size = self.size.min(size);
        self.packed.truncate(self.size * (self.size + 1) / 2);
    }

    /// Adds other products of the same columns, so many times.
    pub fn add(&mut self, weight: f64, other: &Self) {
        super::vector::axpy(weight, &other.packed, &mut self.packed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_from_either_side() {
        let mut products = Products::from_fn(2, |i, j| (10 * i + j) as f64);
        products.grow(3);
        for (j, value) in [20.0, 21.0, 22.0].into_iter().enumerate() {
            *products.at_mut(2, j) = value;
        }
        assert_eq!(
            (products.at(2, 1), products.at(1, 2), products.at(1, 0)),
            (21.0, 21.0, 10.0)
        );
        *products.at_mut(0, 2) += 5.0;
        assert_eq!(products.at(2, 0), 25.0);
        let mut sum = Products::zeros(3);
        sum.add(2.0, &products);
        assert_eq!(sum.at(2, 2), 44.0);
        sum.truncate(1);
        assert_eq!((sum.size(), sum.at(0, 0)), (1, 0.0));
    }
}
