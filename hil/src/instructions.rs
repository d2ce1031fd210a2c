//! Instruction counts of hot kernels (callgrind, host) and of the ticks (QEMU, Cortex-M4F), held against a record.
//!
//! Counts do not depend on what else a machine does, so a check of them can fail for one reason only: the code. Host kernels
//! use what the processor has: one without AVX2 takes more, which the line on who made the record shows.
use crate::ticks;
use giotto_link::ControllerError;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where the record is.
pub const RECORD: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../host/benches/instructions.toml"
);
/// A count may grow by so much, percent.
pub const TOLERANCE_PERCENT: f64 = 3.0;
/// Kernels of `host/examples/kernels.rs`.
const KERNELS: [&str; 4] = ["circle_fit", "campaign_rows", "plant_lap", "stepwise_fit"];

/// Instructions by name.
pub type Counts = BTreeMap<String, u64>;

/// Why there is no count.
#[derive(Debug, thiserror::Error)]
pub enum CountError {
    /// The emulated ones.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// Anything else, with what to do.
    #[error("{0}")]
    Other(String),
}

fn other(reason: impl ToString) -> CountError {
    CountError::Other(reason.to_string())
}

/// The example that the tests build beside this program.
fn kernels() -> Result<PathBuf, CountError> {
    let exe = std::env::current_exe().map_err(other)?;
    let built = exe.ancestors().find(|a| a.join("examples").is_dir());
    let path = built
        .map(|a| a.join("examples").join("kernels"))
        .filter(|p| p.is_file());
    path.ok_or_else(|| other("the kernels are not built: run cargo build --workspace --examples"))
}

/// Whether callgrind is installed.
pub fn has_valgrind() -> bool {
    Command::new("valgrind")
        .arg("--version")
        .output()
        .is_ok_and(|out| out.status.success())
}

fn collected(program: &Path, kernel: &str, times: u32) -> Result<u64, CountError> {
    let out = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args([kernel, &times.to_string()])
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .map_err(other)?;
    let text = String::from_utf8_lossy(&out.stderr);
    let count = text
        .lines()
        .find_map(|line| line.split("Collected :").nth(1)?.trim().parse().ok());
    count
        .filter(|_| out.status.success())
        .ok_or_else(|| other(format_args!("{kernel}: callgrind says {text}")))
}

/// Instructions of each kernel on this machine, by callgrind.
///
/// # Errors
/// No example, or callgrind fails.
pub fn of_kernels() -> Result<Counts, CountError> {
    let program = kernels()?;
    let one = |name: &&str| {
        let [few, many] = [collected(&program, name, 2)?, collected(&program, name, 6)?];
        Ok((format!("kernel.{name}"), many.saturating_sub(few) / 4))
    };
    KERNELS.iter().map(one).collect()
}

/// Most instructions of each tick on the emulated controller.
///
/// # Errors
/// As [`ticks::count`].
pub fn of_ticks(note: &mut dyn FnMut(&str)) -> Result<Counts, CountError> {
    let ours = |name: &String| !name.starts_with("naive");
    let counts = ticks::count(note)?
        .into_iter()
        .filter(|(name, _)| ours(name));
    Ok(counts
        .map(|(name, (_, most))| (format!("tick.{name}"), u64::from(most)))
        .collect())
}

/// The record as text.
pub fn write(counts: &Counts, compiler: &str) -> String {
    let mut text = format!(
        "# Instructions, written by `giotto-hil instructions --record`: kernels by callgrind in the dev profile, ticks under QEMU.\n\
         # `giotto-hil instructions` fails when one has grown by more than {TOLERANCE_PERCENT} %.\ncompiler = \"{compiler}\"\n"
    );
    for (name, count) in counts {
        let _ = writeln!(text, "{name} = {count}"); // a String takes everything
    }
    text
}

/// The record as numbers, and the compiler that it was made with.
///
/// # Errors
/// A line that is neither.
pub fn read(text: &str) -> Result<(Counts, String), CountError> {
    let (mut counts, mut compiler) = (Counts::new(), String::new());
    for line in text
        .lines()
        .filter(|l| !l.starts_with('#') && !l.trim().is_empty())
    {
        let (name, value) = line
            .split_once(" = ")
            .ok_or_else(|| other(format_args!("not a count: {line}")))?;
        match value.parse() {
            Ok(count) => drop(counts.insert(name.to_owned(), count)),
            Err(_) if name == "compiler" => value.trim_matches('"').clone_into(&mut compiler),
            Err(_) => return Err(other(format_args!("not a count: {line}"))),
        }
    }
    Ok((counts, compiler))
}

/// Growth of a count, percent; `None` for one that was never recorded.
pub fn growth_percent(now: u64, recorded: Option<&u64>) -> Option<f64> {
    recorded.map(|&then| 100.0 * (now as f64 / then as f64 - 1.0))
}

/// The compiler at hand, and the vectors that host kernels are counted with.
pub fn compiler() -> String {
    let out = Command::new("rustc").arg("--version").output();
    let version = out.map_or_else(
        |_| "unknown".to_owned(),
        |out| String::from_utf8_lossy(&out.stdout).trim().to_owned(),
    );
    #[cfg(target_arch = "x86_64")]
    let vectors = if std::arch::is_x86_feature_detected!("avx2") {
        "AVX2"
    } else {
        "SSE2"
    };
    #[cfg(not(target_arch = "x86_64"))]
    let vectors = std::env::consts::ARCH;
    format!("{version}, {vectors}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_read_as_it_was_written() {
        let counts = Counts::from([
            ("kernel.circle_fit".to_owned(), 12_345),
            ("tick.stream".to_owned(), 150),
        ]);
        let text = write(&counts, "rustc 1.95.0 (59807616e 2026-04-14)");
        assert_eq!(
            read(&text).unwrap(),
            (counts, "rustc 1.95.0 (59807616e 2026-04-14)".to_owned())
        );
        assert!(read("tick.stream = many").is_err());
    }

    #[test]
    fn growth_is_seen_and_shrinking_is_not_growth() {
        assert!(growth_percent(1_031, Some(&1_000)).unwrap() > TOLERANCE_PERCENT);
        assert!(growth_percent(1_029, Some(&1_000)).unwrap() < TOLERANCE_PERCENT);
        assert!(growth_percent(500, Some(&1_000)).unwrap() < 0.0);
        assert_eq!(growth_percent(1, None), None);
    }
}
