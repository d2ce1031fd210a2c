//! The simulated ballbar: what it adds to the truth.
use super::circle::{CircleTest, Trace};
use crate::campaign::Samples;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// A telescoping ballbar and the way it is set up. The default is perfect.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Instrument {
    /// Standard deviation of the noise of a sample, m.
    pub noise_m: f64,
    /// Standard deviation of the length error that a whole run has in common, m.
    pub spread_m: f64,
    /// Step of the readings, m; 0: none.
    pub resolution_m: f64,
    /// Centre of measurement against the centre of the circle, m.
    pub setup_m: [f64; 2],
    /// Standard deviation of each coordinate of the centre from run to run, m.
    pub setup_spread_m: f64,
    /// Height of the centre of measurement above the plane of the circle, m.
    pub out_of_plane_m: f64,
    /// Growth of the readings over campaign time, m/s.
    pub drift_m_s: f64,
}

impl Instrument {
    /// A good ballbar: 1 µm noise, 0.5 µm from run to run, 0.1 µm steps.
    pub fn ballbar() -> Self {
        Self {
            noise_m: 1e-6,
            spread_m: 0.5e-6,
            resolution_m: 1e-7,
            ..Self::default()
        }
    }

    /// Reads one turn. Draws come in a fixed order, so that a seed gives the same readings again.
    pub fn record(&self, test: &CircleTest, trace: &Trace, rng: &mut impl Rng) -> Samples {
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let spread = self.spread_m * normal();
        let centre = self.setup_m.map(|c| c + self.setup_spread_m * normal());
        let mut samples = trace.samples();
        let step_s = trace.turn_s / samples.deviation_m.len() as f64;
        for (i, (deviation, p)) in samples
            .deviation_m
            .iter_mut()
            .zip(&trace.position_m)
            .enumerate()
        {
            let along = (p[0] - centre[0]).hypot(p[1] - centre[1]);
            let drift = self.drift_m_s * (test.started_s + step_s * i as f64);
            let reading = along.hypot(self.out_of_plane_m) - trace.radius_m
                + spread
                + drift
                + self.noise_m * normal();
            *deviation = match self.resolution_m > 0.0 {
                true => (reading / self.resolution_m).round() * self.resolution_m,
                false => reading,
            };
        }
        samples
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Machine, circle};
    use super::*;
    use giotto_shared::Direction;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn record(instrument: Instrument, seed: u64) -> (Trace, Samples) {
        let test = CircleTest {
            started_s: 100.0,
            ..CircleTest::new(0.1, 0.2, Direction::Ccw)
        };
        let trace = circle(&Machine::default(), &test);
        let samples = instrument.record(&test, &trace, &mut ChaCha8Rng::seed_from_u64(seed));
        (trace, samples)
    }

    fn mean(v: &[f64]) -> f64 {
        v.iter().sum::<f64>() / v.len() as f64
    }

    #[test]
    fn perfect_instrument_reads_the_truth() {
        let (trace, samples) = record(Instrument::default(), 1);
        assert!(
            samples
                .deviation_m
                .iter()
                .zip(&trace.deviation_m)
                .all(|(a, b)| (a - b).abs() < 1e-15)
        );
        assert_eq!(samples.angle_rad, trace.angle_rad);
        assert!(samples.angle_inferred);
    }

    /// Set-up centre e: first harmonic −e·cos(θ − φ), mean e²/(4R); out of plane h: mean h²/(2R).
    #[test]
    fn set_up_has_its_closed_form() {
        let (e, h) = (200e-6, 1e-3);
        let centred = Instrument {
            setup_m: [e, 0.0],
            ..Instrument::default()
        };
        let (_, samples) = record(centred, 1);
        assert!((mean(&samples.deviation_m) - e * e / 0.4).abs() < 1e-10);
        assert!(
            (samples.deviation_m[0] + e).abs() < 1e-9,
            "towards the offset the bar is short"
        );
        let (_, samples) = record(
            Instrument {
                out_of_plane_m: h,
                ..Instrument::default()
            },
            1,
        );
        assert!((mean(&samples.deviation_m) - h * h / 0.2).abs() < 1e-9);
    }

    #[test]
    fn noise_spread_and_steps_are_as_stated() {
        let ballbar = Instrument {
            spread_m: 5e-6,
            ..Instrument::ballbar()
        };
        let means: Vec<f64> = (0..400)
            .map(|seed| mean(&record(ballbar, seed).1.deviation_m))
            .collect();
        let spread = (means.iter().map(|m| m * m).sum::<f64>() / 400.0).sqrt();
        assert!((spread - 5e-6).abs() < 0.6e-6, "{spread:e}");
        let (_, samples) = record(ballbar, 7);
        let centre = mean(&samples.deviation_m);
        let noise = samples
            .deviation_m
            .iter()
            .map(|d| (d - centre).powi(2))
            .sum::<f64>();
        assert!(((noise / 1000.0).sqrt() - 1e-6).abs() < 0.1e-6);
        assert!(
            samples
                .deviation_m
                .iter()
                .all(|d| (d / 1e-7 - (d / 1e-7).round()).abs() < 1e-6)
        );
        assert_eq!(record(ballbar, 7), record(ballbar, 7));
        assert_ne!(record(ballbar, 7).1, record(ballbar, 8).1);
        let (_, drifted) = record(
            Instrument {
                drift_m_s: 1e-8,
                ..Instrument::default()
            },
            1,
        );
        assert!((drifted.deviation_m[0] - 1e-6).abs() < 1e-12);
    }
}
