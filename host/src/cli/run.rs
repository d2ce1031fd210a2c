//! `giotto run`: execute a path on the controller and record its set-points.
use super::failure::cannot_write;
use super::port::PortArgs;
use super::{Failure, Output};
use crate::controller::{CircleRun, Recording};
use giotto_shared::Direction;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Arguments of `giotto run`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    path: Shape,
}

#[derive(clap::Subcommand, Debug)]
enum Shape {
    /// Whole circles, with entry and exit along the circle.
    Circle(CircleArgs),
}

#[derive(clap::Args, Debug)]
struct CircleArgs {
    /// Programmed radius, mm.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    radius: f64,
    /// Programmed feed, mm/s.
    #[arg(long, value_name = "MM_S", allow_negative_numbers = true)]
    feed: f64,
    /// Direction.
    #[arg(long, value_enum)]
    direction: Sense,
    /// Turns at full feed.
    #[arg(long, default_value_t = 1, value_name = "N")]
    laps: u32,
    /// Centre in the machine, mm: X,Y,Z.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', num_args = 1, default_values_t = [0.0, 0.0, 0.0],
          allow_hyphen_values = true)]
    centre: Vec<f64>,
    /// Record every so many ticks' set-point.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..), value_name = "N")]
    every: u16,
    /// Where to write the set-points.
    #[arg(short, long, value_name = "SETPOINTS.csv")]
    output: Option<PathBuf>,
    #[command(flatten)]
    port: PortArgs,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Sense {
    Ccw,
    Cw,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let Shape::Circle(args) = args.path;
    let centre: [f64; 3] = args.centre.as_slice().try_into().map_err(|_| {
        Failure::usage(format_args!("--centre has {} numbers, expected X,Y,Z", args.centre.len()))
    })?;
    let direction = match args.direction {
        Sense::Ccw => Direction::Ccw,
        Sense::Cw => Direction::Cw,
    };
    let (radius_m, feed_m_s) = (args.radius * 1e-3, args.feed * 1e-3);
    let centre_m = centre.map(|mm| mm * 1e-3);
    let wanted = CircleRun { centre_m, radius_m, feed_m_s, direction, laps: args.laps, start_rad: 0.0 };
    let mut controller = args.port.open(out)?;
    let recording = controller.run_circle(&wanted, args.every)?;
    if let Some(path) = &args.output {
        write(path, &recording)?;
    }
    let largest = recording.points.iter().map(|point| offset_m(point.programmed_m, point.corrected_m));
    let largest_um = largest.fold(0.0, f64::max) * 1e6;
    let seconds = recording.points.last().map_or(0.0, |point| point.time_s);
    if out.json {
        return out.document(&json!({
            "port": controller.port(),
            "set_points": recording.points.len(),
            "dt_s": recording.dt_s,
            "duration_s": seconds,
            "largest_offset_um": largest_um,
            "output": args.output,
        }));
    }
    out.say(format_args!(
        "{}: {} set-points in {seconds:.3} s, largest correction {largest_um:.3} um{}",
        controller.port(),
        recording.points.len(),
        args.output.map_or(String::new(), |path| format!(", in {}", path.display()))
    ));
    Ok(())
}

fn offset_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt()
}

/// Writes `time_s,x_mm,y_mm,z_mm,corrected_x_mm,corrected_y_mm,corrected_z_mm`.
fn write(path: &Path, recording: &Recording) -> Result<(), Failure> {
    let failed = |error: csv::Error| cannot_write(path, &std::io::Error::other(error));
    let mut writer = csv::Writer::from_path(path).map_err(failed)?;
    let header = ["time_s", "x_mm", "y_mm", "z_mm", "corrected_x_mm", "corrected_y_mm", "corrected_z_mm"];
    writer.write_record(header).map_err(failed)?;
    for point in &recording.points {
        // Nanometres and microseconds, to the last digit.
        let places = point.programmed_m.iter().chain(&point.corrected_m);
        let row = std::iter::once(format!("{:.6}", point.time_s))
            .chain(places.map(|metres| format!("{:.6}", metres * 1e3)));
        writer.write_record(row).map_err(failed)?;
    }
    writer.flush().map_err(|error| cannot_write(path, &error))
}
