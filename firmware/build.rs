//! Gives the linker the memory of the board whose image is built. The host's library needs nothing.
use std::env;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

/// Where a board has its memory, for cortex-m-rt's link.x.
struct Memory {
    feature: &'static str,
    flash: u32,
    ram: u32,
    /// Where the code begins, if not behind the vectors.
    code: u32,
    /// Bytes of stack.
    stack: u32,
}

const BOARDS: [Memory; 3] = [
    // SSRAM1 as code memory, SSRAM2 as data memory (ARM DAI0386). The flash stand-in is at 0x0010_0000.
    Memory {
        feature: "CARGO_FEATURE_MPS2_AN386",
        flash: 0x0000_0000,
        ram: 0x2000_0000,
        code: 0,
        stack: STACK,
    },
    // Vectors in sector 0, tables and key in 1 to 3, code from sector 4 on, configuration in 10 and 11 (RM0090 3.3). The first of
    // two RAMs (RM0090 2.3).
    Memory {
        feature: "CARGO_FEATURE_STM32F405",
        flash: 0x0800_0000,
        ram: 0x2000_0000,
        code: 0x0801_0000,
        stack: STACK,
    },
    Memory {
        feature: "CARGO_FEATURE_TICKS",
        flash: 0x0000_0000,
        ram: 0x2000_0000,
        code: 0,
        // It makes everything on its stack, and is for no F405: its variables have all the room.
        stack: 96 * 1024,
    },
];

/// Most text and most RAM, stack and all, of an image: a quarter of what the STM32F405 has, so that what is too large does
/// not link.
const ROOM: [u32; 2] = [256 * 1024, 48 * 1024];
/// Of that RAM, the stack of a controller. It lies below the variables, where memory begins: one that grows too long leaves memory,
/// which is a fault, and never writes into variables. Variables that do not fit above it do not link.
const STACK: u32 = 16 * 1024;

/// Version of the package and, in a git work tree, the commit: what an image says of itself.
fn build() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git")
            .args(arguments)
            .output()
            .ok()
            .filter(|output| output.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    };
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])
        .filter(|log| fs::exists(log).unwrap_or(false));
    if let Some(log) = log {
        println!("cargo:rerun-if-changed={log}");
    }
    let version = env::var("CARGO_PKG_VERSION").unwrap_or_default();
    match git(&["rev-parse", "--short=8", "HEAD"]) {
        Some(commit) => format!("{version}+{commit}"),
        None => version,
    }
}

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    println!("cargo:rustc-env=GIOTTO_BUILD={}", build());
    let chosen = BOARDS
        .iter()
        .find(|board| env::var_os(board.feature).is_some());
    let (Some(board), Some(out)) = (chosen, env::var_os("OUT_DIR")) else {
        return;
    };
    let out = PathBuf::from(out);
    let region =
        |name, (origin, length)| format!("  {name} : ORIGIN = {origin:#010x}, LENGTH = {length}\n");
    let [text, ram] = ROOM;
    let variables = if board.stack < ram {
        ram - board.stack
    } else {
        ram
    };
    let (flash, ram) = (
        region("FLASH", (board.flash, text)),
        region("RAM", (board.ram + board.stack, variables)),
    );
    let stack = format!(
        "_stack_start = {:#010x};\n_stack_end = {:#010x};\n",
        board.ram + board.stack,
        board.ram
    );
    let code = if board.code > 0 {
        format!("_stext = {:#010x};\n", board.code)
    } else {
        String::new()
    };
    let memory = format!("MEMORY\n{{\n{flash}{ram}}}\n{code}{stack}");
    for (name, text) in [
        ("memory.x", memory.as_str()),
        ("device.x", "/* the vector table names its handlers */\n"),
    ] {
        if let Err(error) = fs::write(out.join(name), text) {
            println!("cargo:error=cannot write {name}: {error}");
        }
    }
    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["--nmagic", "--icf=all", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
