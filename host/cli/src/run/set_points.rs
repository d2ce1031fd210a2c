//! What a run says of itself, and the file of its set-points.
use super::correction::lacks;
use crate::destination::{Destination, Kind};
use crate::failure::cannot_write;
use crate::{Failure, Output, table_file};
use giotto_link::{Controller, Recording};
use giotto_shared::wire::Status;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What is recorded of a run.
#[derive(clap::Args, Debug)]
pub(super) struct Record {
    /// Record every so many ticks' set-point.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..), value_name = "N")]
    pub(super) every: u16,
    /// Exit code 5 if part of the path was not corrected.
    #[arg(long)]
    require_correction: bool,
    /// Write this table to the controller first, as giotto flash does; it stays there.
    #[arg(long, value_name = "TABLE.bin|MODEL.toml")]
    table: Option<PathBuf>,
    /// Where to write the set-points.
    #[arg(short, long, value_name = "SETPOINTS.csv")]
    output: Option<PathBuf>,
}

/// Share of the feed by which the speed of a steady turn may differ: its set-points are joined by chords.
const STEADY: f64 = 1e-3;

impl Record {
    /// Says before anything moves that the file cannot be written.
    pub(super) fn ready(&self, inputs: &[&Path]) -> Result<(), Failure> {
        let Some(path) = &self.output else {
            return Ok(());
        };
        let inputs: Vec<&Path> = inputs
            .iter()
            .copied()
            .chain(self.table.as_deref())
            .collect();
        Destination::new(path, Kind::Csv, &inputs).map(drop)
    }

    /// Writes the table that was asked for to the controller.
    pub(super) fn flash(&self, controller: &mut Controller, out: Output) -> Result<(), Failure> {
        let Some(path) = &self.table else {
            return Ok(());
        };
        let table = table_file::read(path, out)?;
        let flashed = controller.flash(&table.image, &mut |_| ())?;
        out.note(format_args!(
            "{}: {} bytes in slot {} of {}",
            path.display(),
            flashed.bytes,
            flashed.slot,
            controller.port()
        ));
        Ok(())
    }

    /// Writes the set-points and says what they were; `feed_m_s` is that of steady turns, `more` goes into the document.
    pub(super) fn report(
        &self,
        controller: &mut Controller,
        before: &Status,
        recording: &Recording,
        feed_m_s: Option<f64>,
        more: &[(&str, Value)],
        out: Output,
    ) -> Result<(), Failure> {
        if let Some(path) = &self.output {
            write(path, recording)?;
        }
        let [steady_um, ramps_um] = largest_um(recording, feed_m_s);
        let largest_um = steady_um.max(ramps_um);
        let seconds = recording.points.last().map_or(0.0, |point| point.time_s);
        let lacks = lacks(controller, before)?;
        if out.json {
            let mut document = json!({
                "port": controller.port(),
                "set_points": recording.points.len(),
                "dt_s": recording.dt_s,
                "duration_s": seconds,
                "largest_offset_um": largest_um,
                "largest_steady_offset_um": feed_m_s.map(|_| steady_um),
                "largest_ramp_offset_um": feed_m_s.map(|_| ramps_um),
                "corrected": lacks.is_none(),
                "not_corrected": lacks,
                "stopped": recording.stopped,
                "output": self.output,
            });
            for (name, value) in more {
                document[*name] = value.clone();
            }
            out.document(&document)?;
            return self.verdict(recording, lacks);
        }
        let correction = match (&lacks, feed_m_s) {
            (Some(_), _) if largest_um == 0.0 => String::new(),
            (_, Some(_)) => format!(
                ", largest correction {steady_um:.3} µm at full feed, {ramps_um:.3} µm in the ramps"
            ),
            (_, None) => format!(", largest correction {largest_um:.3} µm"),
        };
        let written = self.output.as_ref();
        let written = written.map_or_else(String::new, |path| format!(", in {}", path.display()));
        out.say(format_args!(
            "{}: {} set-points in {seconds:.3} s{correction}{written}",
            controller.port(),
            recording.points.len(),
        ));
        if let Some(lacks) = lacks.as_ref().filter(|_| !self.require_correction) {
            out.say(lacks);
        }
        self.verdict(recording, lacks)
    }

    /// Whether the run was what was asked for.
    fn verdict(&self, recording: &Recording, lacks: Option<String>) -> Result<(), Failure> {
        if recording.stopped {
            return Err(Failure::interrupted(
                "stopped before its end; what was recorded is kept",
            ));
        }
        match lacks {
            Some(lacks) if self.require_correction => Err(Failure::check(lacks)
                .help("giotto table show lists the zones; run inside them, or without --require-correction")),
            _ => Ok(()),
        }
    }
}

/// Largest correction where the path runs at `feed_m_s`, and elsewhere (the way there, ramps), µm.
fn largest_um(recording: &Recording, feed_m_s: Option<f64>) -> [f64; 2] {
    let points = &recording.points;
    let steady = |k: usize| {
        let ends = [k.checked_sub(1).and_then(|k| points.get(k)), points.get(k)];
        let ([Some(a), Some(b)], Some(feed)) = (ends, feed_m_s) else {
            return false;
        };
        let speed = offset_m(a.programmed_m, b.programmed_m) / (b.time_s - a.time_s);
        (speed / feed - 1.0).abs() < STEADY
    };
    let mut largest = [0.0_f64; 2];
    for (k, point) in points.iter().enumerate() {
        let elsewhere = usize::from(!(steady(k) && steady(k + 1)));
        let offset_um = offset_m(point.programmed_m, point.corrected_m) * 1e6;
        largest[elsewhere] = largest[elsewhere].max(offset_um);
    }
    largest
}

fn offset_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (b - a) * (b - a))
        .sum::<f64>()
        .sqrt()
}

/// Writes `time_s,x_mm,y_mm,z_mm,corrected_x_mm,corrected_y_mm,corrected_z_mm`.
fn write(path: &Path, recording: &Recording) -> Result<(), Failure> {
    let failed = |error: csv::Error| cannot_write(path, &std::io::Error::other(error));
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header = [
        "time_s",
        "x_mm",
        "y_mm",
        "z_mm",
        "corrected_x_mm",
        "corrected_y_mm",
        "corrected_z_mm",
    ];
    writer.write_record(header).map_err(failed)?;
    for point in &recording.points {
        // Nanometres and microseconds, to the last digit.
        let places = point.programmed_m.iter().chain(&point.corrected_m);
        let row = std::iter::once(format!("{:.6}", point.time_s))
            .chain(places.map(|metres| format!("{:.6}", metres * 1e3)));
        writer.write_record(row).map_err(failed)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| cannot_write(path, &std::io::Error::other(error.to_string())))?;
    giotto::whole_file::write(path, &bytes).map_err(|error| cannot_write(path, &error))
}
