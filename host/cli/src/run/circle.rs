//! `giotto run circle`.
use super::set_points::Record;
use crate::{Failure, Output, port::PortArgs};
use giotto_link::CircleRun;
use giotto_shared::{Direction, Plane};

/// Arguments of `giotto run circle`.
#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// Programmed radius, mm.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    radius: f64,
    /// Programmed feed, mm/s.
    #[arg(long, value_name = "MM_S", allow_negative_numbers = true)]
    feed: f64,
    /// Direction.
    #[arg(long, value_enum)]
    direction: Sense,
    /// Plane of the circle; angles run from its first axis to its second.
    #[arg(long, value_enum, default_value_t = InPlane::Xy)]
    plane: InPlane,
    /// Turns at full feed.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = crate::choice::whole::<u32>)]
    laps: u32,
    /// Centre in the machine, mm: X,Y,Z.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', num_args = 1, default_values_t = [0.0, 0.0, 0.0],
          allow_hyphen_values = true)]
    centre: Vec<f64>,
    #[command(flatten)]
    record: Record,
    #[command(flatten)]
    port: PortArgs,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Sense {
    Ccw,
    Cw,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum InPlane {
    Xy,
    Yz,
    Zx,
}

/// Runs the command.
pub(super) fn run(args: Args, out: Output) -> Result<(), Failure> {
    let centre: [f64; 3] = args.centre.as_slice().try_into().map_err(|_| {
        Failure::usage(format_args!(
            "--centre has {} numbers, expected X,Y,Z",
            args.centre.len()
        ))
    })?;
    let direction = match args.direction {
        Sense::Ccw => Direction::Ccw,
        Sense::Cw => Direction::Cw,
    };
    let (radius_m, feed_m_s) = (args.radius * 1e-3, args.feed * 1e-3);
    let centre_m = centre.map(|mm| mm * 1e-3);
    let wanted = CircleRun {
        centre_m,
        radius_m,
        feed_m_s,
        plane: match args.plane {
            InPlane::Xy => Plane::Xy,
            InPlane::Yz => Plane::Yz,
            InPlane::Zx => Plane::Zx,
        },
        direction,
        laps: args.laps,
        start_rad: 0.0,
    };
    args.record.ready(&[])?;
    let mut controller = super::open(&args.port, out)?;
    args.record.flash(&mut controller, out)?;
    let before = controller.status()?;
    let recording = controller.run_circle(&wanted, args.record.every)?;
    args.record.report(
        &mut controller,
        &before,
        &recording,
        Some(feed_m_s),
        &[],
        out,
    )
}
