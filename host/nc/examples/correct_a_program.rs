//! A program is corrected for a machine that draws circles too small, and each of its arcs is accounted for.
//!
//! `cargo run --release -p giotto-nc --example correct_a_program [IN.nc MODEL.toml]`
use giotto::model_file::ModelFile;
use giotto_nc::{Fate, Options, compensate};
use std::error::Error;
use std::path::Path;

/// A position loop of kv = 43.3/s: a lag of 23 ms.
const MODEL: &str = r#"
format = 2
campaign = "example"
machine = "a lag of 23 ms"
[servo]
kind = "lag"
kv_per_s = 43.3
[valid]
radius_mm = [20.0, 150.0]
feed_mm_s = [5.0, 400.0]
"#;

/// A pocket: a quarter of a circle between two lines, then an arc too small for the model.
const PROGRAM: &str = "G21 G17 G90
G0 X-20 Y0
G1 X0 Y0 F15000
G3 X50 Y50 I0 J50
G1 Y80
G2 X55 Y85 I5 J0
M2
";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (program, model) = match arguments.as_slice() {
        [program, model] => (std::fs::read(program)?, ModelFile::load(Path::new(model))?),
        _ => (PROGRAM.into(), ModelFile::parse(MODEL, Path::new("MODEL"))?),
    };
    let corrected = compensate(&program, &model, &Options::default());
    for arc in &corrected.arcs {
        match arc.fate {
            Fate::Corrected {
                radius_mm,
                delta_mm,
                blocks,
                ..
            } => println!(
                "line {}: R {radius_mm} mm, {delta_mm:+.3} mm, in {blocks} blocks",
                arc.line
            ),
            Fate::Left(why) => println!("line {}: as it was: {why}", arc.line),
        }
    }
    print!("{}", String::from_utf8_lossy(&corrected.program));
    Ok(())
}
