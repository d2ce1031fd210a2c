//! Figures 8 to 11 of the paper for a simulated robot, as SVG with the numbers that they draw.
//!
//! `cargo run --release -p giotto-report --example paper_figures [FOLDER]`
use giotto::analysis;
use giotto::fit::{Observation, Options, RadiusFit};
use giotto::simulation::{Plan, campaign};
use giotto_report::figures::figures;
use std::error::Error;
use std::path::{Path, PathBuf};

/// The paper's plan: three radii, thirteen speeds, both directions. The machine has the paper's β1 as a lag of 6.8 ms.
const ROBOT: &str = r#"
[machine]
both = { kv_per_s = 146.5 }
[grid]
radii_mm = [100.0, 150.0, 300.0]
feeds_mm_s = [20.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0, 600.0, 700.0]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args()
        .nth(1)
        .map_or_else(std::env::temp_dir, PathBuf::from);
    let circles = campaign(&Plan::parse(ROBOT, Path::new("ROBOT"))?, 1);
    let report = analysis::of_campaign(&circles).map_err(|(_, error)| error)?;
    let sizes: Vec<Observation> = report
        .runs
        .iter()
        .map(|run| Observation {
            radius_m: run.radius_m,
            feed_m_s: run.feed_m_s,
            radius_error_m: run.radius_error_m,
            out_of_roundness_m: Some(run.out_of_roundness_m),
        })
        .collect();
    // As the paper does: fitted on 100 mm alone, the other radii are predicted.
    let fit = RadiusFit::new(
        &sizes,
        Options {
            train_radius_m: Some(0.1),
            ..Options::default()
        },
    )?;
    println!(
        "β1 = {:.2}e-6 s², 95 % {:.2} to {:.2} (a SIMULATED robot)",
        fit.model.beta1_s2 * 1e6,
        fit.ci95[0][0] * 1e6,
        fit.ci95[0][1] * 1e6
    );
    let directions: Vec<_> = report.runs.iter().map(|run| run.direction).collect();
    for figure in figures(&fit.points(&sizes), &directions, &fit.model)? {
        let file = folder.join(&figure.file);
        std::fs::write(&file, figure.svg)?;
        std::fs::write(file.with_extension("csv"), figure.csv)?;
        println!("{}", file.display());
    }
    Ok(())
}
