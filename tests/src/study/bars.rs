//! Rates with their uncertainty.

/// Successes out of trials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rate {
    /// Successes.
    pub hits: usize,
    /// Trials.
    pub of: usize,
}

impl Rate {
    /// Counts one trial.
    pub fn add(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.of += 1;
    }

    /// Share of hits in percent; not a number without trials.
    pub fn percent(&self) -> f64 {
        100.0 * self.hits as f64 / self.of as f64
    }

    /// Wilson's 95 % interval, percent.
    pub fn interval(&self) -> [f64; 2] {
        let (n, p, z) = (self.of as f64, self.hits as f64 / self.of as f64, 1.96_f64);
        let centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        [
            100.0 * (centre - half).max(0.0),
            100.0 * (centre + half).min(1.0),
        ]
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.of == 0 {
            return write!(f, "–");
        }
        let [low, high] = self.interval();
        write!(
            f,
            "{:.1} % ({}/{}; {:.1}–{:.1})",
            self.percent(),
            self.hits,
            self.of,
            low,
            high
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_interval_of_ten_out_of_ten() {
        // Known value: 72.2–100 %.
        let [low, high] = Rate { hits: 10, of: 10 }.interval();
        assert!((low - 72.25).abs() < 0.05 && (high - 100.0).abs() < 1e-9);
        assert!(
            Rate { hits: 0, of: 1 }.to_string().ends_with("; 0.0–79.3)"),
            "no share is below nothing"
        );
    }
}
