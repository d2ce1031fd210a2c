//! `giotto run stream`: set-points from a file, one a tick.
use super::set_points::Record;
use super::stream_file::{Row, read};
use crate::cli::port::PortArgs;
use crate::cli::source::length;
use crate::cli::{Failure, Output};
use crate::controller::{Controller, Pace, Segment, Step};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Arguments of `giotto run stream`.
#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// Set-points, one row a tick: time_s,x_mm,y_mm[,z_mm].
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Feed of the move to the first set-point, mm/s.
    #[arg(long, value_name = "MM_S", default_value_t = 250.0, value_parser = length)]
    rapid: f64,
    #[command(flatten)]
    record: Record,
    #[command(flatten)]
    port: PortArgs,
}

/// Rows may be so far from their tick, of a tick.
const SLACK: f64 = 0.1;

/// Runs the command.
pub(super) fn run(args: Args, out: Output) -> Result<(), Failure> {
    let rows = read(&args.file)?;
    // A stream does not wait: in the emulator its time must not run away from us.
    let mut controller = args.port.connect_at(Pace::Slow, out)?;
    let tick_s = 1.0 / f64::from(controller.identity().tick_hz);
    one_a_tick(&args.file, &rows, tick_s)?;
    let places_nm: Vec<[i32; 3]> = rows.iter().map(|row| row.place_nm).collect();
    approach(&mut controller, places_nm[0], args.rapid)?;
    let streamed = controller.run_stream(&places_nm, feed_m_s(&places_nm, tick_s), args.record.every)?;
    if streamed.missing + streamed.rejected > 0 {
        out.note(format_args!(
            "{} ticks without a set-point ({} came late, {} were farther than the feed): bridged",
            streamed.missing, streamed.late, streamed.rejected
        ));
    }
    let more = [
        ("missing_set_points", json!(streamed.missing)),
        ("late_set_points", json!(streamed.late)),
        ("rejected_set_points", json!(streamed.rejected)),
    ];
    args.record.report(&controller, &streamed.recording, &more, out)
}

fn one_a_tick(path: &Path, rows: &[Row], tick_s: f64) -> Result<(), Failure> {
    let start_s = rows[0].time_s;
    for (n, row) in rows.iter().enumerate() {
        let (is, due) = (row.time_s - start_s, n as f64 * tick_s);
        if (is - due).abs() > SLACK * tick_s {
            let place = format!("{}:{}:1", path.display(), row.line);
            return Err(Failure::input(format_args!(
                "{place}: {is:.6} s after the first row, expected {due:.6} s: one row a tick of {tick_s} s"
            ))
            .help("write the set-points at the rate of the controller; `giotto status` says it"));
        }
    }
    Ok(())
}

/// To the first set-point, and at rest.
fn approach(controller: &mut Controller, to_nm: [i32; 3], rapid_mm_s: f64) -> Result<(), Failure> {
    if controller.status()?.raw_nm == to_nm {
        return Ok(());
    }
    let to_m = to_nm.map(|nm| f64::from(nm) * 1e-9);
    let segment = Segment::Line { to_m, feed_m_s: rapid_mm_s * 1e-3 };
    controller.run_program(&[Step { segment, tolerance_m: 0.0 }], u16::MAX).map_err(|error| error.error)?;
    Ok(())
}

/// The largest feed between rows, m/s, or as little as a controller can be told.
fn feed_m_s(places_nm: &[[i32; 3]], tick_s: f64) -> f64 {
    let step = |pair: &[[i32; 3]]| {
        (0..3).map(|i| (f64::from(pair[1][i]) - f64::from(pair[0][i])).powi(2)).sum::<f64>().sqrt()
    };
    let largest_nm = places_nm.windows(2).map(step).fold(0.0, f64::max);
    (largest_nm * 1e-9 / tick_s).max(1e-3)
}
