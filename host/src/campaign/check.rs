//! Whether the numbers of a run can be what the campaign says they are. What cannot is refused by name;
//! what is odd but possible becomes a note.
use super::Note;
use super::clock::Clock;
use super::column_sums::{bounds, sum};
use super::error::{CampaignError, Problem};
use super::manifest::Entry;
use giotto_shared::Direction;
use std::f64::consts::TAU;

/// Largest mean deviation that still is one, share of the radius: a slow loop at full feed draws circles a tenth too small.
pub(super) const LARGEST_SIZE_ERROR: f64 = 0.25;
/// Largest departure of a reading from the mean of its run, share of the radius.
const LARGEST_FORM: f64 = 0.05;
/// Largest sample noise, share of the radius: trackers and encoders are ten times better.
const LARGEST_NOISE: f64 = 0.003;
/// A sample that far from both neighbours is no motion of a machine: the larger of 1 mm and 1 % of the radius.
const SPIKE_M: f64 = 1e-3;
/// Readings this far out that do not move any more stand at the end of a ballbar's range (±1 mm).
pub(super) const INSTRUMENT_LIMIT_M: f64 = 0.99e-3;
const ROWS_AT_LIMIT: usize = 5;
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

/// A deviation (m) of a circle of this radius (m) that no machine has, in the words of its column.
fn implausible(
    column: &str,
    deviation_m: f64,
    radius: f64,
    hint: String,
    expected: String,
) -> Problem {
    let value = if column == "radius_mm" {
        format!("{:.6} mm", (deviation_m + radius) * 1e3)
    } else {
        format!("{:.1} µm", deviation_m * 1e6)
    };
    Problem::Implausible {
        column: column.to_owned(),
        value,
        radius_mm: tidy(radius * 1e3),
        hint,
        expected,
    }
}

/// Deviations must be those of a circle of the programmed radius. Gives their noise, m.
pub(super) fn deviation(
    entry: &Entry,
    deviation: &[f64],
    field: usize,
    column: &str,
) -> Result<f64, CampaignError> {
    let radius = entry.radius_m;
    let mean = sum(deviation) / deviation.len() as f64;
    let [lowest, highest] = bounds(deviation);
    let far = |v: &f64| (v - mean).abs() > LARGEST_FORM * radius;
    let refuse = |row: usize, hint: String, expected: String| {
        let problem = implausible(column, deviation[row], radius, hint, expected);
        Err(err(entry, row, field, problem))
    };
    if mean.abs() > LARGEST_SIZE_ERROR * radius {
        let hint = if column == "radius_mm" {
            unit_hint((mean + radius) / radius)
        } else if (mean / radius - 1.0).abs() < 0.1 {
            "these look like radii, not deviations".to_owned()
        } else {
            "the unit may be wrong".to_owned()
        };
        return refuse(
            0,
            hint,
            format!(
                "a mean within ±{} mm",
                tidy(LARGEST_SIZE_ERROR * radius * 1e3)
            ),
        );
    }
    if let (true, Some(row)) = (
        far(&lowest) || far(&highest),
        deviation.iter().position(far),
    ) {
        let few = deviation.iter().filter(|v| far(v)).count() * 20 < deviation.len();
        let hint = if few {
            "an outlier"
        } else {
            "the unit may be wrong"
        };
        let expected = format!(
            "within {} mm of the mean",
            tidy(LARGEST_FORM * radius * 1e3)
        );
        return refuse(row, hint.to_owned(), expected);
    }
    let noise_m = sample_noise(deviation);
    if noise_m > LARGEST_NOISE * radius {
        let noise_mm = (noise_m * 1e5).round() / 1e2;
        let hint = format!("neighbours scatter by {noise_mm} mm, the unit may be wrong");
        return refuse(
            0,
            hint,
            format!("noise below {} mm", tidy(LARGEST_NOISE * radius * 1e3)),
        );
    }
    let spike = SPIKE_M.max(0.01 * radius);
    let lone = |w: &[f64]| (w[1] - w[0]).abs().min((w[1] - w[2]).abs()) > spike;
    if deviation.len() >= 90
        && highest - lowest > spike
        && let Some(k) = deviation.windows(3).position(lone)
    {
        let expected = format!("within {} mm of its neighbours", tidy(spike * 1e3));
        return refuse(
            k + 1,
            "a single reading far from its neighbours".to_owned(),
            expected,
        );
    }
    if highest.max(-lowest) >= INSTRUMENT_LIMIT_M && lowest != highest {
        at_limit(entry, deviation, field, [lowest, highest])?;
    }
    Ok(noise_m)
}

/// Deviations that span less than any instrument resolves are millimetres called micrometres: refused where the file is
/// foreign, noted where a campaign says so.
pub(super) fn called_um(
    entry: &Entry,
    deviation: &[f64],
    noise_m: f64,
    field: usize,
    is_radius: bool,
    notes: &mut Vec<Note>,
) -> Result<(), CampaignError> {
    const SPAN_M: f64 = 1e-6;
    const NOISE_M: [f64; 2] = [0.05e-9, 20e-9];
    const STEP_M: f64 = 1.1e-9;
    let [lowest, highest] = bounds(deviation);
    let small = highest - lowest < SPAN_M && highest.max(-lowest) < SPAN_M;
    if is_radius || !small || !(NOISE_M[0]..NOISE_M[1]).contains(&noise_m) {
        return Ok(());
    }
    // Micrometres have one or two decimals; these have more.
    let steps = deviation.windows(2).map(|w| (w[1] - w[0]).abs());
    let finest = steps
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    if finest > STEP_M {
        return Ok(());
    }
    let problem = Problem::CalledMicrometres {
        span_um: ((highest - lowest) * 1e9).round() / 1e3,
        noise_nm: (noise_m * 1e11).round() / 1e2,
    };
    if entry.slice.is_some() {
        return Err(err(entry, 0, field, problem));
    }
    notes.push(Note {
        at: entry.row(0),
        text: problem.to_string(),
    });
    Ok(())
}

/// Readings that stay where none lies further out stand at the end of the instrument's range.
fn at_limit(
    entry: &Entry,
    deviation: &[f64],
    field: usize,
    ends: [f64; 2],
) -> Result<(), CampaignError> {
    let mut run = 1;
    for k in 1..deviation.len() {
        let value = deviation[k];
        let stays = value == deviation[k - 1] && value.abs() >= INSTRUMENT_LIMIT_M;
        run = if stays { run + 1 } else { 1 };
        if run >= ROWS_AT_LIMIT && value == ends[usize::from(value > 0.0)] {
            let rows = run
                + deviation[k + 1..]
                    .iter()
                    .take_while(|&&v| v == value)
                    .count();
            let value_um = tidy(value * 1e6);
            return Err(err(
                entry,
                k + 1 - run,
                field,
                Problem::OutOfInstrumentRange { value_um, rows },
            ));
        }
    }
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

/// Unwrapped angles must make one turn (or the declared arc) in the direction of travel.
pub(super) fn angles(
    entry: &Entry,
    angle: &[f64],
    field: usize,
    covered: &mut f64,
    notes: &mut Vec<Note>,
) -> Result<(), CampaignError> {
    let n = angle.len();
    let (lowest, highest) = angle
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, h), &a| (l.min(a), h.max(a)));
    if (highest - lowest).to_degrees() < 0.5 {
        return Err(err(
            entry,
            n - 1,
            field,
            Problem::AngleConstant {
                at_deg: angle[0].to_degrees(),
            },
        ));
    }
    sense(entry, angle, field)?;
    let span = angle[n - 1] - angle[0];
    let spacing = span.abs() / (n - 1) as f64;
    *covered = span.abs() + spacing;
    coverage(entry, angle, field, spacing, *covered)?;
    hole(entry, angle, field, spacing)?;
    notes.extend(other_start(entry, angle, field, spacing));
    Ok(())
}

/// Angles run as the direction says, and never back.
fn sense(entry: &Entry, angle: &[f64], field: usize) -> Result<(), CampaignError> {
    let n = angle.len();
    let d = f64::from(entry.direction.sign());
    let span = angle[n - 1] - angle[0];
    if span * d < 0.0 {
        let words = |up: bool| {
            if up {
                "counter-clockwise (growing)"
            } else {
                "clockwise (falling)"
            }
        };
        let ccw = entry.direction == Direction::Ccw;
        let direction = if ccw { "ccw" } else { "cw" };
        let problem = Problem::DirectionContradicted {
            found: words(!ccw),
            expected: words(ccw),
            direction,
        };
        return Err(err(entry, n - 1, field, problem));
    }
    let one_degree = 1f64.to_radians();
    if let Some(k) = angle
        .windows(2)
        .position(|w| d * (w[1] - w[0]) < -one_degree)
    {
        let back_deg = (d * (angle[k] - angle[k + 1])).to_degrees();
        return Err(err(
            entry,
            k + 1,
            field,
            Problem::AngleBackwards { back_deg },
        ));
    }
    Ok(())
}

/// Angles cover what is declared: an arc, or one turn.
fn coverage(
    entry: &Entry,
    angle: &[f64],
    field: usize,
    spacing: f64,
    covered: f64,
) -> Result<(), CampaignError> {
    let last = angle.len() - 1;
    let tolerance = 2.0 * spacing + 1f64.to_radians();
    let covered_deg = covered.to_degrees();
    match entry.arc_rad {
        Some(declared) if (covered - declared).abs() > tolerance => {
            let problem = Problem::ArcContradicted {
                covered_deg,
                declared_deg: tidy(declared.to_degrees()),
            };
            return Err(err(entry, last, field, problem));
        }
        Some(_) => {}
        None if covered < TAU - tolerance => {
            return Err(err(entry, last, field, Problem::Arc { covered_deg }));
        }
        None if covered > TAU + tolerance => {
            let row = angle
                .iter()
                .position(|a| (a - angle[0]).abs() >= TAU)
                .unwrap_or(last);
            return Err(err(
                entry,
                row,
                field,
                Problem::SeveralTurns {
                    turns: covered / TAU,
                },
            ));
        }
        None => {}
    }
    Ok(())
}

/// No hole lies between neighbours.
fn hole(entry: &Entry, angle: &[f64], field: usize, spacing: f64) -> Result<(), CampaignError> {
    if let Some(k) = angle.windows(2).position(|w| {
        let hole = (w[1] - w[0]).abs();
        hole.to_degrees() > LARGEST_GAP_DEG && hole > 3.0 * spacing
    }) {
        let gap_deg = (angle[k + 1] - angle[k]).abs().to_degrees();
        let gap_s = gap_deg.to_radians() * entry.radius_m / entry.feed_m_s;
        return Err(err(
            entry,
            k + 1,
            field,
            Problem::Gap {
                gap_s,
                gap_deg,
                limit_deg: LARGEST_GAP_DEG,
            },
        ));
    }
    Ok(())
}

/// A start that is not the one stated.
fn other_start(entry: &Entry, angle: &[f64], field: usize, spacing: f64) -> Option<Note> {
    let start = entry.start_angle_rad?;
    let off = ((angle[0] - start + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0).to_degrees();
    (off.abs() > 5.0 + spacing.to_degrees()).then(|| {
        let (said, found) = (start.to_degrees(), angle[0].to_degrees());
        let text = format!(
            "start_angle_deg = {said:.1}, the first sample lies at {found:.1}°: the file is believed"
        );
        Note {
            at: entry.place(0, field),
            text,
        }
    })
}
