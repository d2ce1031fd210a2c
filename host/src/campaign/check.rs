//! Whether the numbers of a run can be what the campaign says they are. What cannot is refused by name;
//! what is odd but possible becomes a note.
mod angles;
mod deviations;

pub(super) use angles::angles;
pub(super) use deviations::{called_um, deviation};

use super::Note;
use super::clock::Clock;
use super::column_sums::sum;
use super::error::{CampaignError, Problem};
use super::manifest::Entry;
use std::f64::consts::TAU;

/// Largest mean deviation that still is one, share of the radius: a slow loop at full feed draws circles a tenth too small.
pub(super) const LARGEST_SIZE_ERROR: f64 = 0.25;
/// Readings this far out that do not move any more stand at the end of a ballbar's range (±1 mm).
pub(super) const INSTRUMENT_LIMIT_M: f64 = 0.99e-3;
/// A turn shorter than this share of the programmed one is not whole: feed overrides end at 125 %.
const SHORTEST_TURN: f64 = 0.79;
/// A turn longer than this many programmed ones is a wrong unit: controllers slow down by less.
const LONGEST_TURN: f64 = 30.0;
/// Largest hole in a turn, degrees.
pub(super) const LARGEST_GAP_DEG: f64 = 36.0;
/// Noise below which two equal files may be two runs of a simulation without noise, m.
const SMALLEST_NOISE_M: f64 = 0.15e-6;

fn err(entry: &Entry, row: usize, field: usize, problem: Problem) -> CampaignError {
    CampaignError::new(entry.place(row, field), problem)
}

/// Holes in the recording: small ones are noted, large ones refused.
pub(super) fn gaps(
    entry: &Entry,
    clock: &Clock,
    rows: usize,
    field: usize,
    notes: &mut Vec<Note>,
) -> Result<(), CampaignError> {
    let Some((row, gap_s)) = clock.gap else {
        return Ok(());
    };
    let gap_deg = 360.0 * gap_s / clock.turn_s;
    if gap_deg > LARGEST_GAP_DEG {
        return Err(err(
            entry,
            row,
            field,
            Problem::Gap {
                gap_s,
                gap_deg,
                limit_deg: LARGEST_GAP_DEG,
            },
        ));
    }
    let lost = ((clock.turn_s / clock.spacing_s).round() - rows as f64).max(1.0);
    let at = entry.row(row);
    let text = format!(
        "about {lost} samples are missing (largest hole {gap_deg:.2}°); angles follow the time stamps"
    );
    notes.push(Note { at, text });
    Ok(())
}

/// Rounds away what the conversion of units left behind.
fn tidy(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Words for a length that is `relative` times what it should be.
pub(super) fn unit_hint(relative: f64) -> String {
    let near = |factor: f64| (relative / factor - 1.0).abs() < 0.1;
    if near(1e-3) {
        "1000 times too small, as if in metres".to_owned()
    } else if near(1e3) {
        "1000 times too large, as if in micrometres".to_owned()
    } else if near(1.0 / 25.4) {
        "25.4 times too small, as if in inches".to_owned()
    } else if near(2.0) {
        "twice as large, as if the diameter were meant".to_owned()
    } else if near(0.5) {
        "half as large, as if the diameter were programmed".to_owned()
    } else {
        format!("{relative:.4} times as large")
    }
}

/// Measured over programmed duration of one turn, refused where only a wrong unit explains it.
pub(super) fn slowness(entry: &Entry, turn_s: f64) -> Result<f64, CampaignError> {
    let programmed_s = TAU * entry.radius_m / entry.feed_m_s;
    let ratio = turn_s / programmed_s;
    if !(1.0 / LONGEST_TURN..=LONGEST_TURN).contains(&ratio) {
        let problem = Problem::TooLong {
            measured_s: turn_s,
            programmed_s,
            hint: duration_hint(ratio),
        };
        return Err(CampaignError::new(entry.row(0), problem));
    }
    Ok(ratio)
}

/// Measured against programmed feed, for files with angles of their own.
pub(super) fn feed(entry: &Entry, turn_s: f64, notes: &mut Vec<Note>) -> Result<(), CampaignError> {
    let ratio = slowness(entry, turn_s)?;
    if ratio < 0.97 {
        notes.push(fast(entry, ratio));
    }
    Ok(())
}

/// As [`feed`] where the whole file stands for one turn; tells how many laps the file may hold instead.
pub(super) fn duration(
    entry: &Entry,
    turn_s: f64,
    deviation: &[f64],
    notes: &mut Vec<Note>,
) -> Result<Option<u32>, CampaignError> {
    let ratio = slowness(entry, turn_s)?;
    if ratio < SHORTEST_TURN {
        let problem = Problem::TooShort {
            measured_s: turn_s,
            programmed_s: turn_s / ratio,
            share: ratio,
        };
        return Err(CampaignError::new(entry.row(deviation.len() - 1), problem));
    }
    if ratio < 0.97 {
        notes.push(fast(entry, ratio));
    }
    Ok(laps(entry, turn_s, deviation))
}

/// How many laps readings hold that last `lasts_s` and repeat themselves; nothing where they are one turn.
pub(super) fn laps(entry: &Entry, lasts_s: f64, deviation: &[f64]) -> Option<u32> {
    let ratio = lasts_s * entry.feed_m_s / (TAU * entry.radius_m);
    let laps = ratio.round();
    let several = laps >= 2.0 && (ratio / laps - 1.0).abs() < 0.03;
    (several && repeats(deviation, laps as usize)).then_some(laps as u32)
}

/// The refusal for a file of several laps.
pub(super) fn several_laps(entry: &Entry, turn_s: f64, rows: usize, laps: u32) -> CampaignError {
    let programmed_s = TAU * entry.radius_m / entry.feed_m_s;
    let problem = Problem::SeveralLaps {
        measured_s: turn_s,
        programmed_s,
        laps,
    };
    CampaignError::new(entry.row(rows / laps as usize), problem)
}

fn fast(entry: &Entry, ratio: f64) -> Note {
    let text = format!(
        "the turn took {:.0} % of the programmed time: a feed override?",
        100.0 * ratio
    );
    Note {
        at: entry.row(0),
        text,
    }
}

fn duration_hint(ratio: f64) -> String {
    let near = |factor: f64| (ratio / factor - 1.0).abs() < 0.2;
    if near(1e3) {
        "1000 times as long, as if time were in ms, the radius in m or the feed in µm/s".to_owned()
    } else if near(1e-3) {
        "1000 times shorter, as if the feed were in m/s or the radius in µm".to_owned()
    } else if near(60.0) {
        "60 times as long, as if the feed were in mm/min".to_owned()
    } else if near(1.0 / 60.0) {
        "60 times shorter, as if time were in minutes".to_owned()
    } else {
        format!("{ratio:.4} times as long")
    }
}

/// Whether the deviations show only orders that are multiples of `laps` over the file: the same circle again.
fn repeats(deviation: &[f64], laps: usize) -> bool {
    let n = deviation.len();
    if n.is_multiple_of(laps) && (n / laps..n).all(|k| deviation[k] == deviation[k - n / laps]) {
        return deviation.iter().any(|v| *v != deviation[0]);
    }
    let stride = n.div_ceil(1 << 14);
    let used: Vec<f64> = deviation.iter().copied().step_by(stride).collect();
    let m = used.len() as f64;
    let amplitude = |order: usize| {
        let (mut c, mut s) = (0.0, 0.0);
        for (k, v) in used.iter().enumerate() {
            let (sin, cos) = (TAU * order as f64 * k as f64 / m).sin_cos();
            c += v * cos;
            s += v * sin;
        }
        2.0 / m * f64::hypot(c, s)
    };
    let noise = 6.0 * sample_noise(&used) * (2.0 / m).sqrt();
    let all: Vec<(usize, f64)> = (1..=8 * laps)
        .map(|order| (order, amplitude(order)))
        .collect();
    let strongest = |multiple: bool| {
        all.iter()
            .filter(|(o, _)| o.is_multiple_of(laps) == multiple)
            .map(|(_, a)| *a)
            .fold(0.0, f64::max)
    };
    let (own, other) = (strongest(true), strongest(false));
    own > noise && (other <= noise || other < 0.02 * own)
}

/// Standard deviation of white noise on a smooth sequence: the root mean square of the smaller nine tenths of the
/// second differences, so that steps, spikes and outliers do not enter.
pub fn sample_noise(values: &[f64]) -> f64 {
    const SHARE: f64 = 0.9;
    // ∫x²φ(x)dx over the central nine tenths of N(0, 1), over 0.9: 1 − 2zφ(z)/0.9 at z = 1.644854.
    const TRIMMED_VARIANCE: f64 = 0.623_016;
    if values.len() < 12 {
        return 0.0;
    }
    let stride = (values.len() - 2).div_ceil(1 << 15);
    // The order of squares is that of their bits.
    let mut squares: Vec<u64> = values
        .windows(3)
        .step_by(stride)
        .map(|w| (w[2] - 2.0 * w[1] + w[0]).powi(2).to_bits())
        .collect();
    let kept = (squares.len() as f64 * SHARE).round() as usize;
    squares.select_nth_unstable(kept - 1);
    let smaller: Vec<f64> = squares[..kept]
        .iter()
        .map(|bits| f64::from_bits(*bits))
        .collect();
    // The second difference of white noise has variance 6σ².
    (sum(&smaller) / kept as f64 / TRIMMED_VARIANCE / 6.0).sqrt()
}

/// Identity of a measurement by its noise: two runs of a machine never share it.
pub(super) fn fingerprint(deviation: &[f64], noise_m: f64) -> Option<u64> {
    if noise_m < SMALLEST_NOISE_M {
        return None;
    }
    let mix = |h: u64, v: u64| (h ^ v).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
    // Four side by side, for one waits for itself.
    let (chunks, rest) = deviation.as_chunks::<4>();
    let mut prints = [deviation.len() as u64; 4];
    for chunk in chunks {
        prints = std::array::from_fn(|k| mix(prints[k], chunk[k].to_bits()));
    }
    Some(rest.iter().map(|v| v.to_bits()).chain(prints).fold(0, mix))
}
