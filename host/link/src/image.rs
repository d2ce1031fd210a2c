//! The firmware image of this workspace: where it is, and how it is built when it is missing or older than its
//! sources.
use super::error::ControllerError;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

/// Target of all images.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// Cargo profile of the images.
pub const PROFILE: &str = "firmware";

/// A board with an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// QEMU's mps2-an386.
    Mps2An386,
    /// STM32F405, as QEMU's netduinoplus2 has it.
    Stm32f405,
    /// Not a controller: counts the instructions of a tick, on the mps2-an386.
    Ticks,
}

/// What a serial port of the emulator leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SerialPort {
    /// The pty of the link.
    Link,
    /// A socket.
    Socket(&'static str),
    /// Nothing.
    Nowhere,
}

impl Board {
    /// Name of the binary, and of its feature.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mps2An386 => "mps2_an386",
            Self::Stm32f405 => "stm32f405",
            Self::Ticks => "ticks",
        }
    }

    /// The board of this name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Mps2An386, Self::Stm32f405]
            .into_iter()
            .find(|board| board.name() == name)
    }

    /// The emulator's serial ports in order: which is the link, and which lead to a socket of this name.
    pub const fn serial_ports(self) -> &'static [SerialPort] {
        use SerialPort::{Link, Nowhere, Socket};
        match self {
            Self::Mps2An386 | Self::Ticks => &[Link, Socket("stream"), Socket("log")],
            // USART1, USART3 and USART6.
            Self::Stm32f405 => &[
                Socket("stream"),
                Nowhere,
                Link,
                Nowhere,
                Nowhere,
                Socket("log"),
            ],
        }
    }

    /// Emulated time of an instruction: 2^n ns. About what the board needs for one.
    pub const fn instruction_shift(self) -> u8 {
        match self {
            // 32 ns, a cycle of 25 MHz is 40 ns.
            Self::Mps2An386 | Self::Ticks => 5,
            // 8 ns: QEMU's SysTick counts at 168 MHz whatever the image chose.
            Self::Stm32f405 => 3,
        }
    }

    /// Features of the firmware beside the board's own, for time by grant: the emulator's own board has it always.
    pub const fn features(self, stepped: bool) -> &'static [&'static str] {
        match self {
            Self::Stm32f405 if stepped => &["stepped"],
            Self::Mps2An386 | Self::Stm32f405 | Self::Ticks => &[],
        }
    }

    /// Whether an image of this board takes grants though it was not built for them.
    pub const fn always_steps(self) -> bool {
        matches!(self, Self::Mps2An386)
    }

    /// QEMU's machine that the image runs on.
    pub const fn machine(self) -> &'static str {
        match self {
            Self::Mps2An386 | Self::Ticks => "mps2-an386",
            Self::Stm32f405 => "netduinoplus2",
        }
    }
}

/// How `core` for the target was come by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Toolchain {
    /// rustup has the target installed.
    Rustup,
    /// Debian's rustc with its sources, `core` built along.
    Debian {
        /// The linker that comes with it.
        linker: PathBuf,
    },
}

/// Debian's compiler, which brings the sources of `core` in rust-web-src.
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

fn sysroot(rustc: &str) -> Option<PathBuf> {
    let output = Command::new(rustc)
        .args(["--print", "sysroot"])
        .output()
        .ok()?;
    let path = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| PathBuf::from(path.trim()))
}

impl Toolchain {
    /// Finds a way to compile for the target; `GIOTTO_TOOLCHAIN=debian` forgoes rustup's.
    pub fn find() -> Option<Self> {
        let debian_only = std::env::var("GIOTTO_TOOLCHAIN").is_ok_and(|value| value == "debian");
        let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
        let lib = |root: PathBuf| root.join("lib/rustlib").join(TARGET).join("lib");
        if !debian_only && sysroot(&rustc).is_some_and(|root| lib(root).is_dir()) {
            return Some(Self::Rustup);
        }
        let root = sysroot(DEBIAN_RUSTC)?;
        let sources = root.join("lib/rustlib/src/rust/library/core");
        let linker = |root: &Path| root.join("lib/rustlib/x86_64-unknown-linux-gnu/bin/rust-lld");
        let linker = [Some(root.clone()), sysroot(&rustc)]
            .into_iter()
            .flatten()
            .map(|root| linker(&root))
            .find(|path| path.is_file())?;
        sources.is_dir().then_some(Self::Debian { linker })
    }

    /// The route in words.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Rustup => "rustup's target",
            Self::Debian { .. } => "Debian's rustc with build-std",
        }
    }

    /// The cargo command that builds a board's image with these extra features.
    pub fn cargo(&self, board: Board, features: &[&str]) -> Command {
        let mut cargo =
            Command::new(std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo")));
        let mut wanted = vec![board.name()];
        wanted.extend(features);
        cargo.args([
            "build",
            "-p",
            "giotto-firmware",
            "--bin",
            board.name(),
            "--no-default-features",
        ]);
        cargo.args([
            "--features",
            &wanted.join(","),
            "--target",
            TARGET,
            "--profile",
            PROFILE,
        ]);
        if let Self::Debian { linker } = self {
            cargo.args(["-Z", "build-std=core"]);
            cargo.env("RUSTC", DEBIAN_RUSTC).env("RUSTC_BOOTSTRAP", "1");
            cargo.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker);
        }
        // Flags meant for the host's compiler do not fit the controller's.
        cargo
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS");
        cargo
    }
}

/// Top of the workspace that this program was built from.
pub fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_owned()
}

/// Where cargo puts the image of a board.
pub fn path(board: Board) -> PathBuf {
    below(&target_folder(), board)
}

fn target_folder() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace().join("target"), PathBuf::from)
}

fn below(target: &Path, board: Board) -> PathBuf {
    target.join(TARGET).join(PROFILE).join(board.name())
}

/// The image of a board, built first if it is missing or older than its sources. `note` is told before.
///
/// # Errors
/// [`ControllerError::NoImage`] with cargo's own words.
pub fn ensure(board: Board, note: &mut dyn FnMut(&str)) -> Result<PathBuf, ControllerError> {
    ensure_with(board, &[], note)
}

/// As [`ensure`], with features of the firmware beside those of the board; such an image has a folder of its own.
///
/// # Errors
/// As there.
pub fn ensure_with(
    board: Board,
    features: &[&str],
    note: &mut dyn FnMut(&str),
) -> Result<PathBuf, ControllerError> {
    let mut target = target_folder();
    if !features.is_empty() {
        target.push(features.join("-"));
    }
    let path = below(&target, board);
    let built = modified(&path);
    let newest = newest_source(&workspace());
    if built.is_some() && newest.is_none_or(|newest| built >= Some(newest)) {
        return Ok(path);
    }
    let what = if built.is_some() {
        "older than its sources"
    } else {
        "missing"
    };
    let no_image = |reason: String| ControllerError::NoImage {
        path: path.clone(),
        reason,
    };
    let Some(toolchain) = Toolchain::find() else {
        return Err(no_image(format!("no compiler for {TARGET} is installed")));
    };
    note(&format!(
        "firmware image {} is {what}: building it with {}",
        board.name(),
        toolchain.name()
    ));
    let mut cargo = toolchain.cargo(board, features);
    let output = cargo
        .arg("--target-dir")
        .arg(&target)
        .current_dir(workspace())
        .output();
    let output = output.map_err(|error| no_image(format!("cargo cannot be run: {error}")))?;
    if !output.status.success() {
        return Err(no_image(
            String::from_utf8_lossy(&output.stderr)
                .trim_end()
                .to_owned(),
        ));
    }
    // Cargo leaves an image alone that nothing in a newer file has changed: without this it would be asked every time.
    let touched = std::fs::File::options().write(true).open(&path);
    let touched = touched.and_then(|image| image.set_modified(SystemTime::now()));
    touched.map_err(|error| no_image(format!("its time cannot be set: {error}")))?;
    Ok(path)
}

/// When the newest source of an image was changed: its rooms, and what says how they are built and from what.
fn newest_source(workspace: &Path) -> Option<SystemTime> {
    let rooms = ["firmware", "shared"].map(|room| newest_below(&workspace.join(room)));
    let settings = ["Cargo.toml", "Cargo.lock", ".cargo/config.toml"]
        .map(|file| modified(&workspace.join(file)));
    rooms.into_iter().chain(settings).flatten().max()
}

fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().ok()?.modified().ok()
}

/// When the newest file below a folder was changed.
fn newest_below(folder: &Path) -> Option<SystemTime> {
    let entries = folder.read_dir().ok()?;
    let times = entries.flatten().filter_map(|entry| {
        let path = entry.path();
        if path.is_dir() {
            newest_below(&path)
        } else {
            modified(&path)
        }
    });
    times.max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{File, create_dir_all};
    use std::time::Duration;

    /// Each of them alone being newer makes the image older than its sources: profiles and versions are in the workspace's files.
    #[test]
    fn settings_of_the_workspace_are_sources_of_an_image() {
        let folder = tempfile::tempdir().unwrap();
        let sources = [
            "firmware/src/lib.rs",
            "shared/src/lib.rs",
            "Cargo.toml",
            "Cargo.lock",
            ".cargo/config.toml",
        ];
        let old = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000);
        let make = |name: &str, time: SystemTime| {
            let path = folder.path().join(name);
            create_dir_all(path.parent().unwrap()).unwrap();
            File::create(path).unwrap().set_modified(time).unwrap();
        };
        for name in sources {
            make(name, old);
        }
        assert_eq!(newest_source(folder.path()), Some(old));
        for (name, hours) in sources.into_iter().zip(1..) {
            let new = old + Duration::from_secs(3600 * hours);
            make(name, new);
            assert_eq!(newest_source(folder.path()), Some(new), "{name}");
        }
    }
}
