//! The controller's side, under QEMU: instructions of the set-point tick by other means, and bytes a second of the link. Both
//! are measured by `giotto-hil`, which boots the images; this asks it and tabulates.
use crate::Error;
use crate::python::Peers;
use crate::table::Table;
use serde_json::Value;
use std::process::Command;

/// Fewest instructions that a β arc at constant feed needs, counted by hand: phase 3 (load, add, store); sine and cosine of an i32 phase
/// by polynomials of degree 7 and 8 on an eighth of a turn 24 (octant and sign 8, scaling 2, square 1, Horner 4 + 4, swap 5); two
/// products for the corrected radius beside the programmed one 4; three coordinates of both circles by two multiply-adds on
/// preloaded vectors 12; six conversions to integer nanometres with their moves 12; six sums with the centre 6; six stores 6; bounds
/// of the offset 6; call and return 5; load of the constants 10.
const FEWEST_BETA: u64 = 88;

/// `giotto-hil NAME --json`, built if it is not.
fn ask(name: &str) -> Result<Value, Error> {
    let out = Command::new(std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()))
        .args([
            "run",
            "--release",
            "--quiet",
            "-p",
            "giotto-hil",
            "--",
            name,
            "--json",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()?;
    if !out.status.success() {
        return Err(format!(
            "giotto-hil {name}: {}",
            String::from_utf8_lossy(&out.stderr)
        )
        .into());
    }
    Ok(serde_json::from_slice(&out.stdout)?)
}

/// Instructions of the tick.
pub(crate) fn ticks(_: &mut Peers) -> Result<Table, Error> {
    let counts = ask("ticks")?;
    let mut table = Table::new(
        "Set-point tick on the Cortex-M4F, instructions",
        "tick",
        &["fewest", "most", "steady"],
        &["libm over it"],
    );
    let most = |name: &str| counts[name]["max"].as_u64().unwrap_or(0);
    for (words, name, steady) in [
        ("giotto, β arc", "arc_beta", Some("arc_beta_steady")),
        ("giotto, stream", "stream", None),
        (
            "giotto, eight profile terms",
            "arc_extended",
            Some("arc_extended_steady"),
        ),
        ("libm, β arc", "naive_libm", None),
        ("nalgebra, β arc", "naive_nalgebra", None),
        ("idsp::cossin, β arc", "naive_idsp", None),
    ] {
        let least = counts[name]["min"].as_u64().unwrap_or(0);
        let steady = steady.map_or_else(|| "–".to_owned(), |s| most(s).to_string());
        let ratio = most("naive_libm") as f64 / most(name) as f64;
        table.words(&[
            words.to_owned(),
            least.to_string(),
            most(name).to_string(),
            steady,
            format!("{ratio:.1}×"),
        ]);
    }
    let steady = most("arc_beta_steady") as f64;
    table.remark(format!(
        "compute only, QEMU with -icount; bar 15× libm. Fewest that the law needs at constant feed, counted by hand \
         (host/benches/peers/controller.rs): {FEWEST_BETA}; {:.2} of it are taken, bar 1.5",
        steady / FEWEST_BETA as f64
    ));
    Ok(table)
}

/// Bytes a second on the link.
pub(crate) fn link(_: &mut Peers) -> Result<Table, Error> {
    let report = ask("link")?;
    let mut table = Table::new(
        "Link under QEMU, table of maximum size",
        "bytes",
        &["table, bytes/s", "raw echo, bytes/s"],
        &["share"],
    );
    let number = |name: &str| report[name].as_f64().unwrap_or(f64::NAN);
    table.words(&[
        report["table_bytes"].to_string(),
        format!("{:.0}", number("table_bytes_per_s")),
        format!("{:.0}", number("echo_bytes_per_s")),
        format!("{:.1} %", number("percent")),
    ]);
    table.remark(
        "written, read back, committed and confirmed, beside the same bytes sent and returned raw; bar 70 %"
            .to_owned(),
    );
    Ok(table)
}
