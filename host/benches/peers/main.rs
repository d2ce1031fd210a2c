//! giotto side by side with what people would otherwise use: `cargo bench -p giotto --bench peers`.
//!
//! Each round runs giotto and every peer once on the same data, one after the other, so that whatever else the machine
//! does falls on all alike; the table gives medians with quartiles, and the ratio of the medians. Answers are compared:
//! a peer that solves another problem stops the bench. The Python peers live in a virtual environment that is made
//! beside the build (`python3 -m venv`, `pip install`); the last table is in `host/benches/RESULTS.md`.
//!
//! `-- circle`, `stepwise`, `csv`, `diagnosis`, `plant`, `ticks`, `link` run parts alone and write nothing. What the controller does is
//! measured under QEMU by `giotto-hil`, which is built on the way.
mod circle;
mod controller;
mod csv;
mod diagnosis;
mod plant;
mod python;
mod stepwise;
mod table;

use python::Peers;
use table::Table;

type Error = Box<dyn std::error::Error>;

/// One part of the bench.
type Part = fn(&mut Peers) -> Result<Table, Error>;

fn main() -> Result<(), Error> {
    // `cargo test --all-targets` starts benches too; only `cargo bench` says so.
    if !std::env::args().any(|a| a == "--bench") {
        return Ok(());
    }
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let parts: [(&str, Part); 7] = [
        ("circle", circle::run),
        ("stepwise", stepwise::run),
        ("csv", csv::run),
        ("diagnosis", diagnosis::run),
        ("plant", plant::run),
        ("ticks", controller::ticks),
        ("link", controller::link),
    ];
    let mut peers = Peers::start()?;
    let mut page = table::heading(peers.versions());
    for (name, part) in parts {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            let table = part(&mut peers)?;
            println!("{}", table.text());
            page.push_str(&table.markdown());
        }
    }
    if wanted.is_empty() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/RESULTS.md");
        std::fs::write(path, page)?;
        println!("written to {path}");
    }
    Ok(())
}
