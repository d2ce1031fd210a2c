//! Every n-th of a sequence whose length is not known before its end.

/// Keeps value 0, s, 2s, … of what is pushed, s the smallest power of two for which they are no more than `MOST`.
#[derive(Clone, Debug)]
pub(super) struct Thinned<T, const MOST: usize = 65_536> {
    values: Vec<T>,
    stride: usize,
    pushed: usize,
}

impl<T, const MOST: usize> Default for Thinned<T, MOST> {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            stride: 1,
            pushed: 0,
        }
    }
}

impl<T: Copy, const MOST: usize> Thinned<T, MOST> {
    /// The next value.
    pub(super) fn push(&mut self, value: T) {
        self.extend(1, |_| value);
    }

    /// The next `count` values, of which only those are asked for that are kept.
    pub(super) fn extend(&mut self, count: usize, value: impl Fn(usize) -> T) {
        let end = self.pushed + count;
        let mut next = self.pushed.next_multiple_of(self.stride);
        while next < end {
            if self.values.len() == MOST {
                let mut k = 0;
                self.values.retain(|_| {
                    k += 1;
                    k % 2 == 1
                });
                self.stride *= 2;
                // The stride may just have grown past this one.
                next = next.next_multiple_of(self.stride);
                continue;
            }
            self.values.push(value(next - self.pushed));
            next += self.stride;
        }
        self.pushed = end;
    }

    /// The last value kept at or before `index`, with its place.
    pub(super) fn at(&self, index: usize) -> Option<(usize, T)> {
        let k = (index / self.stride).min(self.values.len().checked_sub(1)?);
        Some((k * self.stride, self.values[k]))
    }

    /// The first value kept behind `index`, with its place.
    pub(super) fn after(&self, index: usize) -> Option<(usize, T)> {
        let k = index / self.stride + 1;
        Some((k * self.stride, *self.values.get(k)?))
    }

    /// The values kept with their places.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, T)> + '_ {
        self.values
            .iter()
            .enumerate()
            .map(|(k, v)| (k * self.stride, *v))
    }

    /// The values kept.
    pub(super) fn into_values(self) -> Vec<T> {
        self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: usize = 1024;

    #[test]
    fn keeps_every_nth_and_knows_which() {
        for n in [1, 5, MOST, MOST + 1, 3 * MOST + 7, 40 * MOST] {
            let (mut thinned, mut blocks) =
                (Thinned::<_, MOST>::default(), Thinned::<_, MOST>::default());
            (0..n).for_each(|k| thinned.push(k));
            (0..n)
                .step_by(1000)
                .for_each(|from| blocks.extend(1000.min(n - from), |k| from + k));
            assert!(thinned.iter().eq(blocks.iter()));
            assert!(thinned.iter().all(|(place, value)| place == value));
            let kept = thinned.iter().count();
            assert!(
                kept <= MOST && (n < MOST || kept > MOST / 2),
                "{kept} of {n}"
            );
            let (place, value) = thinned.at(n - 1).unwrap();
            assert!(place == value && value < n && value + 2 * n / MOST + 1 >= n - 1);
        }
    }
}
