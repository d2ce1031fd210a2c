//! Deviations of a run: their size, form and noise, lone readings, and the end of the instrument's range.
use super::{INSTRUMENT_LIMIT_M, LARGEST_SIZE_ERROR, err, sample_noise, tidy, unit_hint};
use crate::campaign::Note;
use crate::campaign::column_sums::{bounds, sum};
use crate::campaign::error::{CampaignError, Problem};
use crate::campaign::manifest::Entry;

/// Largest departure of a reading from the mean of its run, share of the radius.
const LARGEST_FORM: f64 = 0.05;

/// Largest sample noise, share of the radius: trackers and encoders are ten times better.
const LARGEST_NOISE: f64 = 0.003;

/// A sample that far from both neighbours is no motion of a machine: the larger of 1 mm and 1 % of the radius.
const SPIKE_M: f64 = 1e-3;

const ROWS_AT_LIMIT: usize = 5;

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
pub(in crate::campaign) fn deviation(
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
pub(in crate::campaign) fn called_um(
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
