//! giotto side by side with what people would otherwise use: `cargo bench -p giotto --bench peers`.
//!
//! Each round runs giotto and every peer once on the same data, one after the other, so that whatever else the machine
//! does falls on all alike; the table gives medians with quartiles, and the ratio of the medians. Answers are compared:
//! a peer that solves another problem stops the bench. The Python peers live in a virtual environment that is made
//! beside the build (`python3 -m venv`, `pip install`); the last table is in `host/benches/RESULTS.md`.
//!
//! Each part runs in a process of its own. `-- circle`, `stepwise`, `csv`, `plant`, `ticks`, `link` run parts
//! alone and write nothing. What the controller does is measured under QEMU by `giotto-hil`, which is built on the way.
mod circle;
mod controller;
mod csv;
mod plant;
mod python;
mod stepwise;
mod table;
mod timing;

use python::Peers;
use std::process::{Command, Stdio};
use table::Table;

type Error = Box<dyn std::error::Error>;

/// Markdown on the standard output, the table for a reader on the other.
const FOR_PAGE: &str = "--page";

/// One part of the bench.
type Part = fn(&mut Peers) -> Result<Table, Error>;

fn main() -> Result<(), Error> {
    // `cargo test --all-targets` starts benches too; only `cargo bench` says so.
    if !std::env::args().any(|a| a == "--bench") {
        return Ok(());
    }
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with("--"))
        .collect();
    let for_page = std::env::args().any(|a| a == FOR_PAGE);
    let parts: [(&str, Part); 6] = [
        ("circle", circle::run),
        ("stepwise", stepwise::run),
        ("csv", csv::run),
        ("plant", plant::run),
        ("ticks", controller::ticks),
        ("link", controller::link),
    ];
    if wanted.is_empty() {
        return page(&parts.map(|(name, _)| name));
    }
    let mut peers = Peers::start()?;
    for (_, part) in parts
        .iter()
        .filter(|(name, _)| wanted.iter().any(|w| w == name))
    {
        let table = part(&mut peers)?;
        if for_page {
            eprintln!("{}", table.text());
            print!("{}", table.markdown());
        } else {
            println!("{}", table.text());
        }
    }
    Ok(())
}

/// Writes the page. Each part runs in a process of its own: what one leaves of the memory says nothing of the next.
fn page(parts: &[&str]) -> Result<(), Error> {
    let mut page = table::heading(Peers::start()?.versions());
    for part in parts {
        let mut alone = Command::new(std::env::current_exe()?);
        let done = alone
            .args(["--bench", FOR_PAGE, part])
            .stderr(Stdio::inherit())
            .output()?;
        if !done.status.success() {
            return Err(format!("{part} failed").into());
        }
        page.push_str(&String::from_utf8(done.stdout)?);
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/RESULTS.md");
    std::fs::write(path, page)?;
    println!("written to {path}");
    Ok(())
}
