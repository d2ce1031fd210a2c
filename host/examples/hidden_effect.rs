//! An effect is hidden in a simulated machine, and the diagnosis is asked what is wrong with it.
//!
//! `cargo run --release -p giotto --example hidden_effect [SEED]`
use giotto::diagnosis::{Options, diagnose};
use giotto::simulation::{Plan, campaign};
use giotto::units::shown;
use std::error::Error;
use std::path::Path;

/// Servo loops of 20 ms behind a linear acceleration filter, and a screw of Y with play and a periodic error.
const MACHINE: &str = r#"
[machine]
moving_average_s = 0.02
both = { kv_per_s = 50.0 }
y = { backlash_um = 9.0, cyclic_um = 3.0, cyclic_pitch_mm = 10.0 }
[grid]
radii_mm = [50.0, 100.0, 150.0]
feeds_mm_s = [20.0, 60.0, 150.0, 300.0]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let seed = match std::env::args().nth(1) {
        Some(seed) => seed.parse()?,
        None => 1,
    };
    let plan = Plan::parse(MACHINE, Path::new("MACHINE"))?;
    let circles = campaign(&plan, seed);
    println!(
        "{} circles of a SIMULATED machine, seed {seed}",
        circles.runs.len()
    );

    let diagnosis = diagnose(
        &circles,
        &Options {
            seed,
            ..Options::default()
        },
    )?;
    for finding in &diagnosis.findings {
        let words = finding.cause.model().words();
        let size = shown(
            finding.estimate.value,
            finding.estimate.ci95,
            finding.estimate.unit,
        );
        println!(
            "{} {}: {} {} ({} to {}), p {:.3}",
            words.name,
            finding.place(),
            size.value,
            size.unit,
            size.low,
            size.high,
            finding.probability
        );
    }
    println!("gain on circles left out: {:.0} %", diagnosis.gain_percent);
    println!("{}", diagnosis.recommendation.words);
    Ok(())
}
