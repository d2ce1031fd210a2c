//! What is too small to be of interest, real or not: it may be the error of another explanation's form.
use super::explained::{Explained, energies, energies_of};
use super::tone::Tone;

/// Root mean square below which an explanation is of no interest, as a share of the noise of a sample.
const SMALLEST_OF_NOISE: f64 = 0.12;
/// … and of all that is explained: below, it may be the error of another signature. Causes, patterns.
const SMALLEST_OF_EXPLAINED: [f64; 2] = [0.045, 0.07];

/// Root mean square below which a pattern is of no interest, m.
pub fn smallest_pattern_m(found: &Explained) -> f64 {
    SMALLEST_OF_NOISE * found.spread.noise_m()
}

/// Whether a tone is large enough to be of interest.
pub fn is_material(found: &Explained, tone: &Tone) -> bool {
    let (_, explained) = energies(found, &found.all());
    // Teeth and other tones, too, leave something of the kind.
    let explained = explained + found.apart_m2;
    let count = found.gram.samples(&found.all());
    let rms = (tone.whole_energy_m2() / count).sqrt();
    rms > 2.0 * SMALLEST_OF_NOISE * found.spread.noise_m()
        && rms > SMALLEST_OF_EXPLAINED[1] * (explained / count).sqrt()
}

/// Drops from a set what is real perhaps but of no interest, the smallest first, and bars it from coming back.
pub fn prune(
    found: &Explained,
    weights: &[f64],
    mut set: Vec<usize>,
    barred: &mut Vec<usize>,
) -> Vec<usize> {
    let count = found.gram.samples(weights);
    loop {
        let (each, whole) = energies_of(found, weights, &set);
        // Beside what was taken out before, too, the search's own may be the error of another's form.
        let whole =
            whole + found.apart_m2 * weights.iter().sum::<f64>() / weights.len().max(1) as f64;
        let smallest = each
            .iter()
            .enumerate()
            .filter(|(at, energy)| {
                let share = SMALLEST_OF_EXPLAINED[usize::from(!found.items[set[*at]].listed())];
                let rms = (*energy / count).sqrt();
                rms < SMALLEST_OF_NOISE * found.spread.noise_m()
                    || rms < share * (whole / count).sqrt()
            })
            .min_by(|a, b| a.1.total_cmp(b.1));
        let Some((at, _)) = smallest else { return set };
        barred.push(set.remove(at));
    }
}
