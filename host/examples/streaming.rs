//! Time and memory of `analyze` on large campaigns.
//!
//! `cargo run --release -p giotto --example streaming -- [--runs 1] [--rows 10000000] [--keep DIR]` writes a campaign
//! of ballbar runs, analyses it in a process of its own and prints seconds and peak memory (Linux: VmHWM, which
//! counts everything the process ever held at once) as one line of JSON.
use giotto::analysis;
use giotto::campaign::Manifest;
use std::error::Error;
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

const RADIUS_MM: f64 = 100.0;
const RADII_MM: [f64; 3] = [100.0, 150.0, 300.0];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|k| arguments.get(k + 1));
    if let Some(dir) = value("--measure") {
        return measure(Path::new(dir));
    }
    let number = |name, usual: usize| value(name).map_or(Ok(usual), |v| v.parse());
    let (runs, rows) = (number("--runs", 1)?, number("--rows", 10_000_000)?);
    let folder = tempfile::tempdir()?;
    let dir = value("--keep").map_or_else(|| folder.path().to_path_buf(), PathBuf::from);
    if !dir.join("campaign.toml").exists() {
        eprintln!("writing {runs} runs of {rows} rows to {}", dir.display());
        write(&dir, runs, rows)?;
    }
    let status = std::process::Command::new(std::env::current_exe()?).arg("--measure").arg(&dir).status()?;
    if status.success() { Ok(()) } else { Err("the measurement failed".into()) }
}

fn measure(dir: &Path) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let manifest = Manifest::open(dir)?;
    let report = analysis::of_files(&manifest, || {})?;
    let seconds = start.elapsed().as_secs_f64();
    let rows: usize = report.runs.iter().map(|r| r.samples).sum();
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status
        .lines()
        .find_map(|l| l.strip_prefix("VmHWM:")?.trim().strip_suffix("kB")?.trim().parse::<f64>().ok());
    println!(
        "{{\"runs\":{},\"rows\":{rows},\"seconds\":{seconds:.3},\"rows_per_second\":{:.3e},\"peak_mb\":{}}}",
        report.runs.len(),
        rows as f64 / seconds,
        peak.map_or_else(|| "null".to_owned(), |kb| format!("{:.1}", kb / 1024.0))
    );
    Ok(())
}

fn write(dir: &Path, runs: usize, rows: usize) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(dir)?;
    let mut toml = "[campaign]\nname = \"streaming\"\nmachine = \"made up\"\n".to_owned();
    let mut state = 1u64;
    for run in 0..runs {
        let (radius, feed) =
            (if runs == 1 { RADIUS_MM } else { RADII_MM[run / 2 % 3] }, 20.0 * (1 + run / 6 % 35) as f64);
        let direction = if run % 2 == 0 { "ccw" } else { "cw" };
        toml += &format!(
            "[[run]]\nfile = \"run{run:05}.csv\"\nradius_mm = {radius}\nfeed_mm_s = {feed}\ndirection = \"{direction}\"\n"
        );
        let mut out = BufWriter::with_capacity(1 << 20, File::create(dir.join(format!("run{run:05}.csv")))?);
        writeln!(out, "time_s,deviation_um")?;
        let turn = TAU * radius / feed;
        for k in 0..rows {
            // White noise: the high bits of a linear congruence.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = (state >> 40) as f64 / f64::from(1 << 23) - 1.0;
            let a = TAU * k as f64 / rows as f64;
            writeln!(out, "{:.7},{:.1}", turn * k as f64 / rows as f64, 45.0 * a.cos() - 30.0 + 2.0 * noise)?;
        }
        out.flush()?;
    }
    std::fs::write(dir.join("campaign.toml"), toml)?;
    Ok(())
}
