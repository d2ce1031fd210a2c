//! `giotto controller`: start a virtual controller.
use super::{Failure, Output};
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::linuxcnc::LinuxCncLink;
use giotto_link::serve::serve;
use giotto_link::virtual_controller::VirtualLink;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `giotto controller`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// `sim`: the firmware's library in this process; `qemu`: the firmware image in the emulator; `linuxcnc`: the component
    /// in a LinuxCNC that runs on this computer.
    kind: Kind,
    /// Firmware image for `qemu`, instead of the one of this workspace.
    #[arg(long, value_name = "PATH")]
    image: Option<PathBuf>,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Kind {
    Sim,
    Qemu,
    Linuxcnc,
}

/// The line that says where the controller can be reached; always the first on stdout.
fn announce(path: &str) {
    let mut stdout = std::io::stdout();
    let _ = writeln!(stdout, "port: {path}");
    let _ = stdout.flush();
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    match args.kind {
        Kind::Sim => match serve(VirtualLink::new(), &mut announce)? {},
        Kind::Linuxcnc => match serve(LinuxCncLink::open()?, &mut announce)? {},
        Kind::Qemu => {
            let mut note = |text: &str| out.note(text);
            let emulator = Emulator::start(args.image.as_deref(), Pace::Stepped, &mut note)?;
            let (set_points, log) = (emulator.stream_path(), emulator.log_path());
            // Its ticks are granted by the clock: a busy computer delays them, and none of them is ever late.
            let mut ready = |path: &str| {
                announce(path);
                out.note(format_args!("set-points: {}", set_points.display()));
                out.note(format_args!("log: {}", log.display()));
            };
            match serve(emulator.into_link()?, &mut ready)? {}
        }
    }
}
