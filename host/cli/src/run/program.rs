//! `giotto run program`: an NC program on the controller.
use super::set_points::Record;
use crate::compensate::{Kind, read};
use crate::port::PortArgs;
use crate::source::length;
use crate::{Failure, Output};
use giotto_link::{ControllerError, ProgramError, Step};
use giotto_nc::program::{self, Block, Running};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Arguments of `giotto run program`.
#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// NC program, RS-274 as LinuxCNC and Grbl speak it; its origin is the machine's.
    #[arg(value_name = "FILE.nc")]
    program: PathBuf,
    /// How far the path may leave a joint where the program says neither G61 nor G64 P, mm. Sent with each segment; the
    /// firmware of today stops exactly at every joint, whatever the tolerance.
    #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = tolerance)]
    tolerance_mm: f64,
    /// Feed of G0, mm/s.
    #[arg(long, value_name = "MM_S", default_value_t = 250.0, value_parser = length)]
    rapid: f64,
    /// The tool is in: M6 does nothing. Otherwise a program with M6 is not run.
    #[arg(long)]
    tool_loaded: bool,
    #[command(flatten)]
    record: Record,
    #[command(flatten)]
    port: PortArgs,
}

fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.0..=1000.0).contains(&v) => Ok(v),
        _ => Err("expected a number from 0 to 1000".to_owned()),
    }
}

/// Runs the command.
pub(super) fn run(args: Args, out: Output) -> Result<(), Failure> {
    let text = read(&args.program, Kind::GCode)?;
    args.record.ready(&[&args.program])?;
    // Read once without the machine: what is wrong is said before a port is opened.
    let running = Running {
        start_mm: [0.0; 3],
        rapid_mm_s: args.rapid,
        tolerance_mm: args.tolerance_mm,
        tool_loaded: args.tool_loaded,
    };
    blocks(&args.program, &text, &running)?;
    let mut controller = super::open(&args.port, out)?;
    args.record.flash(&mut controller, out)?;
    let before = controller.status()?;
    if let (Some((line, words)), Some(slot), false) =
        (giotto_nc::marked(&text), before.active, before.bypass)
    {
        out.note(format_args!(
            "warning: {}:{line}: corrected before ({words}), and the controller corrects by the table in slot {slot}: twice; \
             run the original, or switch the correction off: giotto bypass on",
            args.program.display()
        ));
    }
    let start_mm = before.raw_nm.map(|nm| f64::from(nm) * 1e-6);
    let blocks = blocks(
        &args.program,
        &text,
        &Running {
            start_mm,
            ..running
        },
    )?;
    let steps: Vec<Step> = blocks.iter().map(|block| block.step).collect();
    let recording = controller
        .run_program(&steps, args.record.every)
        .map_err(|error| failure(&args.program, &blocks, error))?;
    args.record.report(
        &mut controller,
        &before,
        &recording,
        None,
        &[("blocks", json!(blocks.len()))],
        out,
    )
}

fn blocks(path: &Path, text: &[u8], running: &Running) -> Result<Vec<Block>, Failure> {
    program::blocks(text, running).map_err(|error| {
        Failure::input(format_args!("{}:{error}", path.display()))
            .help("nothing has moved; a controller runs G0 to G4 with plain numbers, in the machine's own coordinates")
    })
}

/// With the line that could not be run.
fn failure(path: &Path, blocks: &[Block], ProgramError { step, error }: ProgramError) -> Failure {
    let Some(block) = step.and_then(|step| blocks.get(step)) else {
        return error.into();
    };
    let place = format!("{}:{}:1", path.display(), block.line);
    match &error {
        ControllerError::Path(_) => Failure::input(format_args!("{place}: {error}"))
            .help("nothing has moved; change this block"),
        _ => Failure::controller(format_args!("{place}: {error}")).help(
            error
                .help()
                .unwrap_or("the blocks before it have run; change this one"),
        ),
    }
}
