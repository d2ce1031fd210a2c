//! `giotto kinematics`: the block of a campaign from the description of a robot.
use super::{Failure, Output};
use giotto::kinematics::{Kinematics, ReachError, WrittenKinematics, urdf};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `giotto kinematics`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// URDF of the robot, as ROS has it (xacro files expanded first).
    #[arg(value_name = "ROBOT.urdf")]
    urdf: PathBuf,
    /// Measured point in the flange's frame, mm.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true, default_values_t = [0.0, 0.0, 0.0])]
    tool: Vec<f64>,
    /// Place that the arm is to reach, mm: says whether it does.
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    reaches: Vec<f64>,
}

#[derive(Serialize)]
struct Document {
    kinematics: WrittenKinematics,
    #[serde(skip_serializing_if = "Option::is_none")]
    reached: Option<bool>,
}

/// Three finite numbers, mm, as m.
fn place(option: &str, mm: &[f64]) -> Result<[f64; 3], Failure> {
    match mm {
        [x, y, z] if mm.iter().all(|mm| mm.abs() <= 1e4) => Ok([x, y, z].map(|mm| mm * 1e-3)),
        _ => Err(Failure::usage(format!(
            "--{option} takes three lengths in mm with commas between them, −10000 to 10000"
        ))),
    }
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let tool_m = place("tool", &args.tool)?;
    let named =
        |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", args.urdf.display()));
    let text = std::fs::read_to_string(&args.urdf).map_err(|error| named(&error))?;
    let mut arm = urdf::read(&text).map_err(|error| named(&error))?;
    arm.tool_m = tool_m;
    let kinematics = Kinematics::Opw(arm);
    let reach: Option<Result<_, ReachError>> = if args.reaches.is_empty() {
        None
    } else {
        let place_m = place("reaches", &args.reaches)?;
        Some(kinematics.angles(place_m))
    };
    let document = Document {
        kinematics: WrittenKinematics::from(&kinematics),
        reached: reach.as_ref().map(Result::is_ok),
    };
    if out.json {
        return out.document(&document);
    }
    let lines = toml::to_string(&document.kinematics).map_err(Failure::input)?;
    out.say("[kinematics]");
    out.say(lines.trim_end());
    match reach {
        None => {}
        Some(Ok(q)) => {
            let degrees: Vec<String> = q
                .iter()
                .map(|q| format!("{:.1}°", q.to_degrees()))
                .collect();
            out.note(format!(
                "it reaches that place with the joints at {}",
                degrees.join(", ")
            ));
        }
        Some(Err(error)) => return Err(Failure::check(format!("{error}"))),
    }
    Ok(())
}
