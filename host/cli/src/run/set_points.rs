//! What a run says of itself, and the file of its set-points.
use super::correction::lacks;
use crate::destination::{Destination, Kind};
use crate::failure::cannot_write;
use crate::{Failure, Output};
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
    /// Where to write the set-points.
    #[arg(short, long, value_name = "SETPOINTS.csv")]
    output: Option<PathBuf>,
}

impl Record {
    /// Says before anything moves that the file cannot be written.
    pub(super) fn ready(&self) -> Result<(), Failure> {
        let Some(path) = &self.output else {
            return Ok(());
        };
        Destination::new(path, Kind::Csv, &[]).map(drop)
    }

    /// Writes the set-points and says what they were; `more` goes into the document.
    pub(super) fn report(
        &self,
        controller: &mut Controller,
        before: &Status,
        recording: &Recording,
        more: &[(&str, Value)],
        out: Output,
    ) -> Result<(), Failure> {
        if let Some(path) = &self.output {
            write(path, recording)?;
        }
        let largest = recording
            .points
            .iter()
            .map(|point| offset_m(point.programmed_m, point.corrected_m));
        let largest_um = largest.fold(0.0, f64::max) * 1e6;
        let seconds = recording.points.last().map_or(0.0, |point| point.time_s);
        let lacks = lacks(controller, before)?;
        if out.json {
            let mut document = json!({
                "port": controller.port(),
                "set_points": recording.points.len(),
                "dt_s": recording.dt_s,
                "duration_s": seconds,
                "largest_offset_um": largest_um,
                "corrected": lacks.is_none(),
                "stopped": recording.stopped,
                "output": self.output,
            });
            for (name, value) in more {
                document[*name] = value.clone();
            }
            out.document(&document)?;
            return self.verdict(recording, lacks);
        }
        out.say(format_args!(
            "{}: {} set-points in {seconds:.3} s, largest correction {largest_um:.3} um{}",
            controller.port(),
            recording.points.len(),
            self.output
                .as_ref()
                .map_or(String::new(), |path| format!(", in {}", path.display()))
        ));
        // Without a table nobody expects a correction, unless they say so.
        if let Some(lacks) = lacks.as_ref().filter(|_| before.active.is_some()) {
            out.note(lacks);
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
                .help("`giotto table show` lists the zones; run inside them, or without --require-correction")),
            _ => Ok(()),
        }
    }
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
