//! Reading a campaign: pandas and polars. giotto checks every number and every run as well; they only parse.
use crate::Error;
use crate::python::Peers;
use crate::table::{Table, Times};
use crate::timing::timed;
use giotto::campaign;
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

const SIZES: [usize; 3] = [100_000, 1_000_000, 10_000_000];
const RUNS: usize = 100;

/// A campaign of `rows` samples in 100 runs, as an instrument with a resolution of 0.1 µm writes it.
fn write(directory: &Path, rows: usize) -> Result<(), Error> {
    let mut manifest = String::from("[campaign]\nname = \"bench\"\nmachine = \"none\"\n");
    let each = rows / RUNS;
    for run in 0..RUNS {
        let feed_mm_s = 20.0 + 6.8 * run as f64;
        let turn_s = std::f64::consts::TAU * 100.0 / feed_mm_s;
        writeln!(
            manifest,
            "\n[[run]]\nfile = \"run{run:03}.csv\"\nradius_mm = 100.0\nfeed_mm_s = {feed_mm_s:.1}\ndirection = \"ccw\""
        )?;
        let mut text = String::from("time_s,deviation_um\n");
        for i in 0..each {
            let turn = i as f64 / each as f64;
            let wobble = ((i * 7919 + run * 104_729) % 41) as f64 * 0.1 - 2.0;
            // Each run has a size of its own: the same samples twice would be a file given twice.
            let deviation =
                -100.0 - 0.1 * run as f64 + 20.0 * (std::f64::consts::TAU * turn).cos() + wobble;
            writeln!(text, "{:.6},{deviation:.1}", turn * turn_s)?;
        }
        std::fs::write(directory.join(format!("run{run:03}.csv")), text)?;
    }
    Ok(std::fs::write(directory.join("campaign.toml"), manifest)?)
}

/// Runs the part.
pub(crate) fn run(peers: &mut Peers) -> Result<Table, Error> {
    let mut table = Table::new(
        "CSV campaign read",
        "rows",
        &["giotto", "pandas", "polars"],
        &["over pandas", "over polars"],
    );
    for rows in SIZES {
        let directory = tempfile::tempdir()?;
        write(directory.path(), rows)?;
        let data = json!({ "directory": directory.path() });
        let mut times = [Times::default(), Times::default(), Times::default()];
        for _ in 0..if rows > 1_000_000 { 5 } else { 11 } {
            let (seconds, read) = timed(|| campaign::read(directory.path()));
            times[0].push(seconds);
            let read = read?;
            let count: usize = read.runs.iter().map(|r| r.samples.deviation_m.len()).sum();
            let last: f64 = read
                .runs
                .iter()
                .filter_map(|r| r.samples.deviation_m.last())
                .sum();
            drop(read);
            for (k, peer) in ["pandas", "polars"].into_iter().enumerate() {
                let (seconds, found) = peers.run(peer, &data)?;
                if found[0] != count as f64 || (found[1] * 1e-6 / last - 1.0).abs() > 1e-9 {
                    return Err(format!(
                        "{peer} reads {found:?} where giotto reads {count} rows, {last} m"
                    )
                    .into());
                }
                times[1 + k].push(seconds);
            }
        }
        let median = times.each_ref().map(Times::median);
        table.row(
            rows,
            &times.each_ref(),
            &[median[1] / median[0], median[2] / median[0]],
        );
    }
    table.remark("100 runs a campaign, files in the page cache; giotto checks, the peers only parse; bars 5× pandas, 0.8× polars".to_owned());
    Ok(table)
}
