//! `giotto bridge`: corrected set-points to a robot controller over its own protocol.
//!
//! | file | holds |
//! |---|---|
//! | `program` | what is loaded on the controller |
//! | `session` | the socket, Ctrl-C, counts while it runs and at its end |
mod program;
mod session;

use super::source::length;
use super::{Failure, Output, table_file};
use clap::ValueEnum;
use giotto_bridge::{Door, Kind, Mode, Motion, Path as SetPoints, Setup, SetupError};
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Headings of the options.
const ROBOT: &str = "How the robot is set up";
const PATH: &str = "A path for egm and j519";

/// Arguments of `giotto bridge`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// `egm`: ABB position guidance; `egm-path`: ABB path correction; `rsi`: KUKA; `j519`: FANUC stream motion.
    door: Kinds,
    /// Table (TABLE.bin) or model (MODEL.toml).
    #[arg(long, value_name = "TABLE", required_unless_present = "program")]
    table: Option<PathBuf>,
    /// Address that the robot sends to: ADDRESS:PORT, or a port on all addresses [default: 6510, for rsi 59152].
    #[arg(long, value_name = "ADDR")]
    listen: Option<String>,
    /// Address of the robot, where we have to call (j519) or nobody else may [default port: 60015].
    #[arg(long, value_name = "ADDR")]
    robot: Option<String>,
    /// Seconds to wait for the robot, or until it is ready.
    #[arg(long, value_name = "S", default_value_t = 300.0)]
    wait: f64,
    /// Write what the robot measured, for `giotto import`.
    #[arg(long, value_name = "FILE.csv")]
    record: Option<PathBuf>,
    /// Write what is to be loaded on the controller, and do nothing else.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["record", "path", "robot"])]
    program: Option<PathBuf>,
    #[command(flatten)]
    setup: RobotArgs,
    #[command(flatten)]
    path: PathArgs,
}

/// How the robot is set up.
#[derive(clap::Args, Debug)]
struct RobotArgs {
    /// Its cycle [default: 4, for egm-path 48, for j519 8].
    #[arg(long, value_name = "MS", value_parser = length, help_heading = ROBOT)]
    cycle: Option<f64>,
    /// From its datagram until a correction acts (rsi, egm-path) [default: one cycle].
    #[arg(long, value_name = "MS", value_parser = length, help_heading = ROBOT)]
    dead_time: Option<f64>,
    /// Largest correction of each coordinate (rsi, egm-path), as in POSCORR.
    #[arg(long, value_name = "MM", value_parser = length, default_value_t = 5.0, help_heading = ROBOT)]
    limit: f64,
    /// What it does with a correction: put it in the place of the last one, or add it (rsi, egm-path).
    #[arg(long, value_enum, default_value_t = Modes::Absolute, help_heading = ROBOT)]
    mode: Modes,
    /// Its planned place has the correction in it (rsi, egm-path).
    #[arg(long, help_heading = ROBOT)]
    planned_is_corrected: bool,
    /// Side of the path that a positive correction leads to, tool pointing down (egm-path).
    #[arg(long, value_enum, default_value_t = Sides::Right, help_heading = ROBOT)]
    across: Sides,
}

/// A path of ours.
#[derive(clap::Args, Debug)]
struct PathArgs {
    /// Set-points to be followed: a CSV with time_s,x_mm,y_mm[,z_mm], as `giotto run -o` writes it.
    #[arg(long, value_name = "FILE", help_heading = PATH)]
    path: Option<PathBuf>,
    /// Largest speed of its set-points, mm/s.
    #[arg(long, value_name = "MM_S", value_parser = length, default_value_t = Motion::default().speed_mm_s, help_heading = PATH)]
    speed: f64,
    /// Largest acceleration, mm/s².
    #[arg(long, value_name = "MM_S2", value_parser = length, default_value_t = Motion::default().acceleration_mm_s2, help_heading = PATH)]
    acceleration: f64,
    /// Largest jerk, mm/s³.
    #[arg(long, value_name = "MM_S3", value_parser = positive, default_value_t = Motion::default().jerk_mm_s3, help_heading = PATH)]
    jerk: f64,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Kinds {
    Egm,
    EgmPath,
    Rsi,
    J519,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Modes {
    Absolute,
    Relative,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Sides {
    Right,
    Left,
}

impl Kinds {
    const fn kind(self) -> Kind {
        match self {
            Self::Egm => Kind::Egm,
            Self::EgmPath => Kind::EgmPath,
            Self::Rsi => Kind::Rsi,
            Self::J519 => Kind::J519,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Egm => "egm",
            Self::EgmPath => "egm-path",
            Self::Rsi => "rsi",
            Self::J519 => "j519",
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a number above 0".to_owned()),
    }
}

/// An address with its port, a port, or an address alone.
fn address(text: &str, port: u16) -> Result<SocketAddr, Failure> {
    let whole = match text.parse::<u16>() {
        Ok(port) => format!("0.0.0.0:{port}"),
        Err(_) if text.contains(':') => text.to_owned(),
        Err(_) => format!("{text}:{port}"),
    };
    let found = whole.to_socket_addrs().ok().and_then(|mut all| all.next());
    found.ok_or_else(|| {
        Failure::usage(format_args!(
            "\"{text}\" is no address; expected one as in 192.168.1.10:{port}"
        ))
    })
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    if !(args.wait > 0.0 && args.wait <= 1e6) {
        return Err(Failure::usage(format_args!(
            "--wait is {}, expected seconds above 0",
            args.wait
        )));
    }
    let kind = args.door.kind();
    let mut setup = Setup::new(kind, Vec::new());
    setup.cycle_ms = args.setup.cycle.unwrap_or(setup.cycle_ms);
    setup.dead_time_ms = args.setup.dead_time.unwrap_or(setup.cycle_ms);
    setup.limit_mm = args.setup.limit;
    setup.mode = match args.setup.mode {
        Modes::Absolute => Mode::Absolute,
        Modes::Relative => Mode::Relative,
    };
    setup.planned_is_corrected = args.setup.planned_is_corrected;
    setup.left_handed = args.setup.across == Sides::Left;
    setup.patience = Duration::from_secs_f64(args.wait);
    setup.motion = Motion {
        speed_mm_s: args.path.speed,
        acceleration_mm_s2: args.path.acceleration,
        jerk_mm_s3: args.path.jerk,
    };
    if let Some(file) = &args.program {
        let listen = address(args.listen.as_deref().unwrap_or("0"), kind.usual_port())?;
        return program::write(file, &setup, listen, out);
    }
    let robot = args
        .robot
        .as_deref()
        .map(|text| address(text, kind.usual_port()))
        .transpose()?;
    if kind == Kind::J519 && robot.is_none() && args.listen.is_none() {
        return Err(Failure::usage(
            "j519 has to call the robot: its address is missing (--robot ADDR)",
        ));
    }
    let Some(table) = &args.table else {
        return Err(Failure::usage("--table is missing"));
    };
    setup.table = table_file::read(table, out)?.image;
    setup.path = args.path.path.as_deref().map(set_points).transpose()?;
    let door = Door::new(setup).map_err(|error| refused(&error, &args, table))?;
    let usual = if kind == Kind::J519 {
        0
    } else {
        kind.usual_port()
    };
    let listen = address(args.listen.as_deref().unwrap_or(&usual.to_string()), usual)?;
    session::Session {
        name: args.door.name(),
        listen,
        robot,
        patience: Duration::from_secs_f64(args.wait),
        record: args.record.as_deref(),
        table,
    }
    .run(door, out)
}

/// Reads the set-points of a path.
fn set_points(path: &Path) -> Result<SetPoints, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path).map_err(|error| {
        Failure::input(format_args!("{name}: cannot be read: {error}")).help("check the path")
    })?;
    SetPoints::read(&text).map_err(|error| Failure::input(format_args!("{name}:{error}")))
}

/// Why a door cannot be set up, with the file that is to blame.
fn refused(error: &SetupError, args: &Args, table: &Path) -> Failure {
    match (error, &args.path.path) {
        (SetupError::Table(_) | SetupError::Term(..), _) => {
            Failure::input(format_args!("{}: {error}", table.display()))
                .help("make the table anew: giotto table MODEL.toml -o TABLE.bin")
        }
        (SetupError::Path(_), Some(path)) => {
            Failure::input(format_args!("{}: {error}", path.display())).help(
                "make the path slower or smoother, or say what the robot can do: --speed, --acceleration, --jerk",
            )
        }
        _ => Failure::usage(error),
    }
}

#[cfg(test)]
mod tests {
    use super::address;

    #[test]
    fn addresses_are_read_with_and_without_their_ports() {
        for (text, expected) in [
            ("7000", "0.0.0.0:7000"),
            ("127.0.0.1:7001", "127.0.0.1:7001"),
            ("127.0.0.1", "127.0.0.1:6510"),
            ("[::1]:7002", "[::1]:7002"),
        ] {
            assert_eq!(address(text, 6510).unwrap().to_string(), expected);
        }
        assert!(address("127.0.0.1:99999", 6510).is_err());
    }
}
