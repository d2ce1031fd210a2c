//! The spectrum of one turn, in units of its noise.
use rustfft::Fft;
use rustfft::num_complex::Complex;
use std::sync::Arc;

/// Fewest waves in a turn: below, the tone hides among the low orders.
pub(super) const FEWEST_WAVES: f64 = 9.5;
/// Padding of the transforms.
const PAD: usize = 4;
/// Waves a turn to the side of a tone where nothing of it is left.
const ASIDE_WAVES: f64 = 4.0;

/// How loud a run is at each frequency, noise correlated along the turn taken down to white noise.
pub(super) struct Spectrum {
    pub(super) turn_s: f64,
    pub(super) nyquist_hz: f64,
    /// 2|X|²/(nσ²) at multiples of 1/(length·Δt).
    pub(super) power: Vec<f64>,
    /// Places of `power` a hertz.
    pub(super) per_hz: f64,
}

impl Spectrum {
    /// Of samples without their low orders, evenly over a turn of this length.
    pub(super) fn of(
        samples: &[f64],
        turn_s: f64,
        transform: &Arc<dyn Fft<f64>>,
        noise_m2: f64,
    ) -> Self {
        let (n, length) = (samples.len(), transform.len());
        let mut power = powers(samples, transform, noise_m2);
        whiten(&mut power, length as f64 / n as f64);
        Self {
            turn_s,
            nyquist_hz: 0.5 * n as f64 / turn_s,
            power,
            per_hz: turn_s * length as f64 / n as f64,
        }
    }

    /// Whether a tone of this frequency is faster than the low orders, and slow enough for the sampling.
    pub(super) fn sees(&self, hz: f64) -> bool {
        hz < 0.95 * self.nyquist_hz && hz * self.turn_s > FEWEST_WAVES
    }

    /// Whether there is far more here than a few waves a turn to either side.
    pub(super) fn stands_out(&self, hz: f64) -> bool {
        let aside = ASIDE_WAVES / self.turn_s;
        self.at(hz) > 4.0 * (1.0 + self.at(hz - aside) + self.at(hz + aside))
    }

    pub(super) fn at(&self, hz: f64) -> f64 {
        // The nearest, of frequencies above zero.
        self.power
            .get((hz * self.per_hz + 0.5) as usize)
            .copied()
            .unwrap_or(0.0)
    }
}

/// Length of the transform of so many samples.
pub(super) fn padded(samples: usize) -> usize {
    (PAD * samples).next_power_of_two()
}

/// Brings noise that is louder at some frequencies, as noise correlated along the turn is at low ones, down to the level of white
/// noise: by the median within an octave to either side, which a tone of a wave or two does not move. Nothing is made louder.
fn whiten(power: &mut [f64], places_a_wave: f64) {
    /// Median of χ²₂.
    const MEDIAN: f64 = 1.386;
    /// Knots an octave, between which the level is drawn as a line.
    const KNOTS: f64 = 4.0;
    let lowest = ((FEWEST_WAVES - 1.0) * places_a_wave) as usize;
    let mut part = Vec::new();
    let mut level = |centre: f64| -> f64 {
        let from = ((0.5 * centre) as usize).max(lowest);
        let to = ((2.0 * centre) as usize + 1).min(power.len());
        part.clear();
        part.extend_from_slice(power.get(from..to).unwrap_or(&[]));
        let middle = part.len() / 2;
        if part.is_empty() {
            return 1.0;
        }
        (*part.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN).max(1.0)
    };
    let step = 2f64.powf(1.0 / KNOTS);
    let mut knots = Vec::new();
    let mut at = lowest.max(1) as f64;
    while at < power.len() as f64 * step {
        knots.push((at, level(at)));
        at *= step;
    }
    for pair in knots.windows(2) {
        let [(from, low), (to, high)] = [pair[0], pair[1]];
        let end = (to as usize).min(power.len());
        for (place, value) in power.iter_mut().enumerate().take(end).skip(from as usize) {
            let share = (place as f64 - from) / (to - from);
            *value /= low + (high - low) * share.clamp(0.0, 1.0);
        }
    }
}

/// Powers of the transformed samples in units of χ²₂. Through a Hann window, or a loud tone hides in its own leakage: a run
/// is no whole number of its waves.
fn powers(samples: &[f64], transform: &Arc<dyn Fft<f64>>, noise_m2: f64) -> Vec<f64> {
    let n = samples.len() as f64;
    let hann = |i: usize| 1.0 - (std::f64::consts::TAU / n * (i as f64 + 0.5)).cos();
    let mut buffer: Vec<Complex<f64>> = samples
        .iter()
        .enumerate()
        .map(|(i, &x)| Complex::new(x * hann(i), 0.0))
        .collect();
    buffer.resize(transform.len(), Complex::default());
    transform.process(&mut buffer);
    // The mean square of the window is 3/2.
    let scale = 2.0 / (1.5 * n * noise_m2);
    buffer[..transform.len() / 2]
        .iter()
        .map(|x| scale * x.norm_sqr())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use rustfft::FftPlanner;

    /// A run of 400 samples in 2 s with this spectrum at multiples of 1/8 Hz.
    fn spectrum_of(power: impl Fn(f64) -> f64) -> Spectrum {
        let step_hz: f64 = 0.125;
        let power = (0..800)
            .map(|line| power(f64::from(line) * step_hz))
            .collect();
        Spectrum {
            turn_s: 2.0,
            nyquist_hz: 100.0,
            power,
            per_hz: step_hz.recip(),
        }
    }

    #[test]
    fn noise_has_power_two_and_a_loud_tone_does_not_leak() {
        let transform = FftPlanner::new().plan_fft_forward(padded(1000));
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let noise: Vec<f64> = (0..1000)
            .map(|_| 3.0 * random.sample::<f64, _>(StandardNormal))
            .collect();
        let powers_of = |samples: &[f64]| powers(samples, &transform, 9.0);
        let levels = powers_of(&noise);
        let mean = levels.iter().sum::<f64>() / levels.len() as f64;
        assert!((mean - 2.0).abs() < 0.2, "{mean}");
        // Thirty waves and a half: n·A²/2σ² = 5556 without a window, two thirds of it with one.
        let tone: Vec<f64> = (0..1000)
            .map(|i| 10.0 * (std::f64::consts::TAU * 30.5e-3 * f64::from(i)).sin())
            .collect();
        let levels = powers_of(&tone);
        let line = |waves: f64| levels[(waves * transform.len() as f64 * 1e-3).round() as usize];
        assert!(
            (line(30.5) / (5555.6 * 2.0 / 3.0) - 1.0).abs() < 0.02,
            "{}",
            line(30.5)
        );
        assert!(
            (12..200)
                .filter(|k| !(24..=37).contains(k))
                .all(|k| line(f64::from(k)) < 1.0)
        );
    }

    #[test]
    fn a_tone_stands_out_from_beside_it_and_a_slope_does_not() {
        let around = |waves: f64, loud: f64| {
            spectrum_of(move |hz| {
                if (hz - 30.0).abs() <= waves / 2.0 {
                    loud
                } else {
                    0.5
                }
            })
        };
        // The main lobe of a Hann window, two waves a turn to either side, and the sidebands of a swing along an axis.
        let tone = |loud: f64| around(3.0, loud);
        assert!(tone(9.0).stands_out(30.0));
        // Four times what is beside it and the noise, 1 + 0.5 + 0.5.
        assert!(tone(8.5).stands_out(30.0) && !tone(7.5).stands_out(30.0));
        assert!(!tone(1e6).stands_out(32.0), "four waves beside it");
        assert!(!around(5.0, 1e6).stands_out(30.0), "wider than any tone");
        assert!(
            !spectrum_of(|hz| 1e6 / (hz * hz + 1.0)).stands_out(30.0),
            "the foot of something slow"
        );
        assert!(!spectrum_of(|_| 1e6).stands_out(30.0), "loud everywhere");
    }

    #[test]
    fn a_tone_is_seen_between_the_low_orders_and_the_sampling() {
        let run = spectrum_of(|_| 2.0);
        assert!(!run.sees(4.5) && run.sees(5.0) && run.sees(94.0) && !run.sees(96.0));
    }
}
