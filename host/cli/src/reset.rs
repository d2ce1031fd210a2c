//! `giotto reset`: a fault is cleared, the position kept; or declared.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_shared::wire::Command;
use serde_json::json;

/// Arguments of `giotto reset`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Where the machine stands, mm: X,Y,Z. Without it the controller keeps the place that it knows.
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    at: Option<Vec<f64>>,
    /// Restart the controller first: stored limits hold from then on, ticks and steps among them. Its place is kept.
    #[arg(long)]
    restart: bool,
    #[command(flatten)]
    port: PortArgs,
}

/// A place in nm.
fn place(mm: &[f64]) -> Result<[i32; 3], Failure> {
    let nm = |mm: &f64| (mm.abs() <= 2100.0).then(|| (mm * 1e6).round() as i32);
    let all: Option<Vec<i32>> = mm.iter().map(nm).collect();
    all.and_then(|all| <[i32; 3]>::try_from(all).ok())
        .ok_or_else(|| {
            let given: Vec<String> = mm.iter().map(f64::to_string).collect();
            Failure::usage(format_args!(
                "--at {}: expected X,Y,Z in mm, each from -2100 to 2100",
                given.join(",")
            ))
            .help("such as --at 120.5,-40,0")
        })
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let place_nm = args.at.as_deref().map(place).transpose()?;
    let mut controller = args.port.open(out)?;
    let before = controller.status()?.fault;
    if args.restart {
        controller.reset()?;
    }
    controller.command(Command::ClearFault)?;
    if let Some(place_nm) = place_nm {
        controller.command(Command::Declare { place_nm })?;
    }
    // Both happen in the next tick.
    let asked_at = controller.status()?.tick;
    let status = loop {
        let status = controller.status()?;
        if status.tick.wrapping_sub(asked_at) >= 2 {
            break status;
        }
    };
    let fault = before.map(|cause| format!("{cause:?}").to_lowercase());
    let known = format!("{:?}", status.position).to_lowercase();
    let place_mm = status.raw_nm.map(|nm| f64::from(nm) * 1e-6);
    let port = controller.port();
    if out.json {
        return out.document(&json!({
            "port": port, "cleared": fault, "position": known, "place_mm": place_mm,
        }));
    }
    let words = fault.map_or("no fault".to_owned(), |cause| {
        format!("fault {cause} cleared")
    });
    let [x, y, z] = place_mm;
    out.say(format_args!(
        "{port}: {words}; position {known}, {x:.6} {y:.6} {z:.6} mm"
    ));
    Ok(())
}
