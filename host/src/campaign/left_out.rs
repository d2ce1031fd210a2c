//! Rows that are not the machine's steady turn: getting up to speed, slowing down, readings that are none.
use super::error::{CampaignError, Problem};
use super::manifest::Entry;
use super::outliers::Strays;
use super::samples::FEWEST;
use super::{Note, Run, check, steady};
use std::f64::consts::TAU;
use std::ops::Range;

/// Takes out the rows while the machine got up to speed and slowed down, and says so.
pub(super) fn keep_steady(
    entry: &Entry,
    points: &[(f64, f64)],
    run: &mut Run,
    time: &mut Option<Vec<f64>>,
    notes: &mut Vec<Note>,
) {
    let Some([from, to]) = steady::window_rad(points) else {
        return;
    };
    let sign = (to - from).signum();
    let angle = &run.samples.angle_rad;
    let first = angle.partition_point(|a| sign * (a - from) < 0.0);
    let end = angle.partition_point(|a| sign * (a - to) <= 0.0);
    if end < first + FEWEST {
        return;
    }
    // A larger hole than any recording may have makes an arc of the turn: only where the slower part shows.
    let lost = (TAU - (to - from).abs()).to_degrees();
    if lost > check::LARGEST_GAP_DEG && !steady::shows(&run.samples, first..end) {
        return;
    }
    notes.push(Note {
        at: entry.row(0),
        text: format!(
            "{} rows left out: getting up to speed ({first}) and slowing down ({}), slower than the programmed feed",
            first + angle.len() - end,
            angle.len() - end,
        ),
    });
    let cut = |column: &mut Vec<f64>| {
        column.truncate(end);
        column.drain(..first);
    };
    cut(&mut run.samples.angle_rad);
    cut(&mut run.samples.deviation_m);
    if let Some(time) = time {
        cut(time);
    }
    run.start_angle_rad = run.samples.angle_rad[0];
}

/// Takes out readings that are none of the machine's, and says so.
pub(super) fn strays(
    entry: &Entry,
    run: &mut Run,
    time: &mut Option<Vec<f64>>,
    noise_m: f64,
    notes: &mut Vec<Note>,
) -> Result<(), CampaignError> {
    let strays = Strays::of(&run.samples.deviation_m, noise_m);
    if strays.is_empty() {
        return Ok(());
    }
    if let Some(held) = strays.held.iter().find(|held| {
        let angle = &run.samples.angle_rad;
        let after = held.end.min(angle.len() - 1);
        (angle[after] - angle[held.start]).abs().to_degrees() > check::LARGEST_GAP_DEG
    }) {
        let value_um = (run.samples.deviation_m[held.start] * 1e9).round() / 1e3;
        let problem = Problem::Held {
            value_um,
            rows: held.len() + 1,
        };
        return Err(CampaignError::new(entry.row(held.start), problem));
    }
    let lines = |ranges: &[Range<usize>]| {
        let line = |row: usize| entry.row(row).line.unwrap_or(0).to_string();
        let mut lines: Vec<String> = ranges.iter().take(8).map(|r| line(r.start)).collect();
        if ranges.len() > lines.len() {
            lines.push("…".to_owned());
        }
        lines.join(", ")
    };
    let count = |ranges: &[Range<usize>]| ranges.iter().map(Range::len).sum::<usize>();
    let mut note = |ranges: &[Range<usize>], why: &str| {
        if let Some(first) = ranges.first() {
            let text = format!(
                "{} rows left out: {why} (lines {})",
                count(ranges),
                lines(ranges)
            );
            let at = entry.row(first.start);
            notes.push(Note { at, text });
        }
    };
    note(
        &strays.lone,
        "lone readings far from their neighbours, a dirty ball?",
    );
    note(&strays.held, "a value held while the machine went on");
    strays.remove(&mut run.samples.angle_rad);
    strays.remove(&mut run.samples.deviation_m);
    if let Some(time) = time {
        strays.remove(time);
    }
    Ok(())
}
