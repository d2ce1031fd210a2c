//! What halsampler has written: the planner's set-points and the measured places, a row a tick.
use super::machine::{AXES, LOUD, TICK_S};
use super::session::{LinuxCncError, Session};
use serde_json::json;
use std::path::{Path, PathBuf};

/// `motion.motion-type` of an arc.
const ARC: &str = "3";

/// One tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) tick: u64,
    /// mm.
    pub(super) commanded: [f64; AXES],
    pub(super) measured: [f64; AXES],
    /// What was sent to the drives beside what the planner said, mm; 0 only where it is the same to the last bit.
    pub(super) added: [f64; AXES],
    /// The planner is on an arc.
    arc: bool,
}

/// A program that was run.
pub(super) struct Recording {
    pub(super) rows: Vec<Row>,
}

fn row(line: &str) -> Option<Row> {
    let mut words = line.split_whitespace();
    let tick = words.next()?.parse().ok()?;
    let mut places = [[0.0; AXES]; 3];
    for place in places.iter_mut().flatten() {
        *place = words.next()?.parse().ok()?;
    }
    let [commanded, measured, added] = places;
    let arc = words.next()? == ARC;
    Some(Row {
        tick,
        commanded,
        measured,
        added: added.map(|loud| loud / LOUD),
        arc,
    })
}

/// Runs a program and records it.
pub(super) fn run(
    session: &mut Session,
    name: &str,
    program: &[u8],
    within_s: u32,
) -> Result<Recording, LinuxCncError> {
    let file = session.place(format!("{name}.ngc"));
    let samples = session.place(format!("{name}.txt"));
    std::fs::write(&file, program).map_err(LinuxCncError::failed)?;
    session.order(&json!({
        "do": "program", "file": file, "samples": samples, "within_s": within_s,
    }))?;
    let text = std::fs::read_to_string(&samples).map_err(LinuxCncError::failed)?;
    // halsampler's last line can be cut; rows that were lost it names in words.
    let mut rows: Vec<Row> = text.lines().filter_map(row).collect();
    rows.pop();
    if let Some(gap) = rows.windows(2).find(|w| w[1].tick != w[0].tick + 1) {
        return Err(LinuxCncError::Failed(format!(
            "samples were lost after {}",
            gap[0].tick
        )));
    }
    Ok(Recording { rows })
}

/// A stop of a program lasts longer than so many ticks.
const STOP_TICKS: usize = 250;
/// Ticks of standing still that are kept on either side of a run.
const MARGIN_TICKS: usize = 100;

impl Recording {
    /// Ticks in which the component changed anything.
    pub(super) fn touched(&self) -> usize {
        self.rows
            .iter()
            .filter(|row| row.added != [0.0; AXES])
            .count()
    }

    /// The rows of each run. A program stands still before and after each, and between two positions itself, without arcs;
    /// a busy computer makes further stops there.
    pub(super) fn runs(&self) -> Vec<&[Row]> {
        let mut motions: Vec<[usize; 2]> = Vec::new();
        for (k, pair) in self.rows.windows(2).enumerate() {
            if pair[0].commanded == pair[1].commanded {
                continue;
            }
            match motions.last_mut() {
                Some([_, end]) if k - *end < STOP_TICKS => *end = k + 1,
                _ => motions.push([k, k + 1]),
            }
        }
        let arcs = |[from, to]: &[usize; 2]| self.rows[*from..*to].iter().any(|row| row.arc);
        let runs = motions.into_iter().filter(arcs);
        runs.map(|[from, to]| {
            let to = (to + MARGIN_TICKS).min(self.rows.len());
            &self.rows[from.saturating_sub(MARGIN_TICKS)..to]
        })
        .collect()
    }
}

/// Writes the rows of one run as halsampler does, for the importer.
pub(super) fn write(rows: &[Row], folder: &Path, name: &str) -> Result<PathBuf, LinuxCncError> {
    let file = folder.join(name);
    let mut text = String::new();
    for row in rows {
        let [a, b, c] = row.commanded;
        let [x, y, z] = row.measured;
        text += &format!("{} {a:.6} {b:.6} {c:.6} {x:.6} {y:.6} {z:.6}\n", row.tick);
    }
    std::fs::write(&file, text).map_err(LinuxCncError::failed)?;
    Ok(file)
}

/// Largest acceleration of what was sent to a drive, mm/s².
pub(super) fn hardest(rows: &[Row]) -> f64 {
    let sent = |row: &Row, axis: usize| row.commanded[axis] + row.added[axis];
    let mut hardest = 0.0f64;
    for three in rows.windows(3) {
        for axis in 0..AXES {
            let change =
                sent(&three[2], axis) - 2.0 * sent(&three[1], axis) + sent(&three[0], axis);
            hardest = hardest.max(change.abs() / (TICK_S * TICK_S));
        }
    }
    hardest
}

/// Largest distance of a measured place from the commanded path, mm.
pub(super) fn contour(rows: &[Row]) -> f64 {
    let mut path: Vec<[f64; AXES]> = rows.iter().map(|row| row.commanded).collect();
    path.dedup();
    let mut worst = 0.0f64;
    let mut near = 0usize;
    for row in rows {
        // The machine follows: the nearest place is near the last one.
        let (from, to) = (
            near.saturating_sub(300),
            (near + 300).min(path.len().saturating_sub(1)),
        );
        let mut best = (f64::INFINITY, near);
        for k in from..to {
            let distance = distance(row.measured, path[k], path[k + 1]);
            if distance < best.0 {
                best = (distance, k);
            }
        }
        near = best.1;
        if best.0.is_finite() {
            worst = worst.max(best.0);
        }
    }
    worst
}

/// Of a place from a line between two.
fn distance(p: [f64; AXES], a: [f64; AXES], b: [f64; AXES]) -> f64 {
    let (mut along, mut square) = (0.0, 0.0);
    for k in 0..AXES {
        along += (p[k] - a[k]) * (b[k] - a[k]);
        square += (b[k] - a[k]) * (b[k] - a[k]);
    }
    let share = if square > 0.0 {
        (along / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let apart = |k: usize| p[k] - a[k] - share * (b[k] - a[k]);
    (0..AXES).map(|k| apart(k) * apart(k)).sum::<f64>().sqrt()
}
