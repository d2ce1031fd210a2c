//! `giotto run stream`: set-points from a file, one a tick.
use super::set_points::Record;
use super::stream_file::{Row, read};
use crate::port::PortArgs;
use crate::source::length;
use crate::{Failure, Output};
use giotto_link::ControllerError;
use giotto_shared::wire::{Command, MotionRefusal, PositionState, Quantity, Refusal};
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
    args.record.ready(&[&args.file])?;
    let mut controller = super::open(&args.port, out)?;
    args.record.flash(&mut controller, out)?;
    let tick_s = 1.0 / f64::from(controller.identity().tick_hz);
    one_a_tick(&args.file, &rows, tick_s)?;
    let places_nm: Vec<[i32; 3]> = rows.iter().map(|row| row.place_nm).collect();
    if controller.status()?.position == PositionState::Unknown {
        // Whoever plans this path knows where the machine stands: where it begins.
        controller.command(Command::Declare {
            place_nm: places_nm[0],
        })?;
    }
    controller.move_to(places_nm[0], args.rapid * 1e-3)?;
    let before = controller.status()?;
    let (fastest, feed_m_s) = fastest(&places_nm, tick_s);
    let streamed = controller
        .run_stream(&places_nm, feed_m_s, args.record.every)
        .map_err(|error| too_fast(error, &place(&args.file, &rows[fastest])))?;
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
    args.record.report(
        &mut controller,
        &before,
        &streamed.recording,
        None,
        &more,
        out,
    )
}

/// Where a row's time stands.
fn place(path: &Path, row: &Row) -> String {
    format!("{}:{}:{}", path.display(), row.line, row.column)
}

fn one_a_tick(path: &Path, rows: &[Row], tick_s: f64) -> Result<(), Failure> {
    let start_s = rows[0].time_s;
    for (n, row) in rows.iter().enumerate() {
        let (is, due) = (row.time_s - start_s, n as f64 * tick_s);
        if (is - due).abs() > SLACK * tick_s {
            let place = place(path, row);
            return Err(Failure::input(format_args!(
                "{place}: {is:.6} s after the first row, expected {due:.6} s: one row a tick of {tick_s} s"
            ))
            .help("write the set-points at the rate of the controller, which giotto status says"));
        }
    }
    Ok(())
}

/// The row that is farthest from the one before, and the feed from there to it, m/s: at least what a controller can be told.
fn fastest(places_nm: &[[i32; 3]], tick_s: f64) -> (usize, f64) {
    let step_nm = |row: usize| {
        let between = |i: usize| f64::from(places_nm[row][i]) - f64::from(places_nm[row - 1][i]);
        (0..3).map(|i| between(i).powi(2)).sum::<f64>().sqrt()
    };
    let farthest = (1..places_nm.len())
        .rev()
        .max_by(|&a, &b| step_nm(a).total_cmp(&step_nm(b)))
        .unwrap_or(1);
    (farthest, (step_nm(farthest) * 1e-9 / tick_s).max(1e-3))
}

/// With the row, if the controller does not go so fast.
fn too_fast(error: ControllerError, place: &str) -> Failure {
    use MotionRefusal::{OutOfBounds, Path};
    match &error {
        ControllerError::Refused(Refusal::Motion(
            OutOfBounds {
                quantity: Quantity::Feed,
                ..
            }
            | Path(Quantity::Feed),
        )) => Failure::controller(format_args!("{place}: to this row: {error}"))
            .help("nothing of it has moved; write the set-points closer to each other"),
        _ => error.into(),
    }
}
