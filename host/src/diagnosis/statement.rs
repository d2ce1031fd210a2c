//! What is said of a finding beside its size: the largest thing it does, what to set right.
use super::explained::Explained;
use super::finding::Largest;
use super::roughness::Teeth;
use super::search::columns_of;
use super::survey::Prepared;
use super::tone::Tone;
use crate::causes::{Amplitude, Cause};
use giotto_shared::Actuator;

/// What to set right, and which way.
pub fn remedy(cause: Cause, actuators: &[Actuator], value: f64) -> String {
    let names: Vec<String> = actuators.iter().map(ToString::to_string).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    crate::causes::remedy::remedy(cause, &names, value)
}

fn on(run: &Prepared, size_m: f64) -> Largest {
    Largest {
        max: size_m.abs() * 1e6,
        radius_mm: run.view.radius_m * 1e3,
        feed_mm_s: run.programmed_m_s * 1e3,
    }
}

fn largest_of(all: impl Iterator<Item = Largest>) -> Largest {
    all.max_by(|a, b| a.max.total_cmp(&b.max))
        .unwrap_or_default()
}

/// The largest deviation that a chosen explanation makes in the campaign.
pub fn largest(found: &Explained, item: usize) -> Largest {
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    let own: Vec<(usize, f64)> = found.items[item]
        .columns
        .iter()
        .filter_map(|own| {
            let at = columns.iter().position(|column| column == own)?;
            Some((*own, found.solution.coefficients[at]))
        })
        .collect();
    largest_of(found.runs.iter().enumerate().map(|(index, run)| {
        let mut sum = vec![0.0; run.deviation_m.len()];
        for (column, amount) in &own {
            let samples = found.gram.column(*column).samples(run, index);
            super::vector::axpy(*amount, &samples, &mut sum);
        }
        on(run, sum.iter().fold(0.0, |most, x| f64::max(most, x.abs())))
    }))
}

/// The largest change of size by a turn that is slower than programmed.
pub fn of_slower_feed(found: &Explained) -> Largest {
    largest_of(found.runs.iter().map(|run| {
        let programmed = found.response.gain(run.programmed_m_s / run.view.radius_m);
        on(run, run.view.radius_m * (run.view.gain - programmed))
    }))
}

/// The largest amplitude of a tone.
pub fn of_tone(found: &Explained, tone: &Tone) -> Largest {
    let acceleration = |run: &Prepared| run.view.feed_m_s.powi(2) / run.view.radius_m;
    let count = found.runs.len().max(1) as f64;
    let rms = (found
        .runs
        .iter()
        .map(|run| acceleration(run).powi(2))
        .sum::<f64>()
        / count)
        .sqrt();
    largest_of(found.runs.iter().map(|run| {
        let share = match tone.amplitude {
            Amplitude::Constant => 1.0,
            Amplitude::Centripetal => acceleration(run) / rms.max(f64::MIN_POSITIVE),
        };
        on(run, share * tone.amplitude_m)
    }))
}

/// The height of teeth, on the slowest circle.
pub fn of_teeth(found: &Explained, teeth: &Teeth) -> Largest {
    let slowest = found
        .runs
        .iter()
        .min_by(|a, b| a.view.feed_m_s.total_cmp(&b.view.feed_m_s));
    slowest.map_or_else(Largest::default, |run| on(run, teeth.height_m))
}
