//! Programs made up, corrected by `giotto compensate`, and judged by readers that are not ours.
//!
//! [`generate`] writes programs as posts and people do and spoils some of them; [`canon`] has LinuxCNC's interpreter run
//! original and output and compares them call by call; [`grbl`] reads in 32 bits as a small controller does; [`contour`] moves a plant
//! of other laws than the host's along what it read.
pub mod canon;
pub mod contour;
pub mod generate;
pub mod grbl;

use giotto::model_file::{FORMAT, ModelFile, Servo, Valid};
use giotto_nc::{Keep, Options};

/// A lag of 40 ms that was measured at every radius and feed of the made-up programs.
pub fn model() -> ModelFile {
    ModelFile {
        format: FORMAT,
        campaign: "made up".into(),
        machine: "made up".into(),
        servo: Servo::Lag { kv_per_s: 25.0 },
        valid: Valid {
            radius_mm: [0.01, 1000.0],
            feed_mm_s: [0.1, 5000.0],
            centre_mm: None,
        },
        kinematics: None,
        effects: Vec::new(),
        delay_s: None,
    }
}

/// Options by number: what the users of one program in eight choose.
pub fn options(seed: u64) -> Options {
    Options {
        keep: if seed % 8 == 7 {
            Keep::Omega
        } else {
            Keep::Feed
        },
        all_planes: !seed.is_multiple_of(8),
        ..Options::default()
    }
}

/// One program made up, corrected and compared.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Arcs that were corrected.
    pub corrected: usize,
    /// Arcs that were left.
    pub left: usize,
    /// The original runs to its end; not asked where nothing was corrected.
    pub runs: bool,
    /// Why arcs were left, in words.
    pub reasons: Vec<String>,
    /// Where the interpreter stops in the original.
    pub error: Option<String>,
}

/// Makes up the program of a seed, corrects it and has LinuxCNC's interpreter compare.
///
/// # Errors
/// What differs, with both programs.
pub fn judge(rs274: &canon::Rs274, seed: u64) -> Result<Outcome, String> {
    let program = generate::program(seed);
    let options = options(seed);
    let result = giotto_nc::compensate(program.as_bytes(), &model(), &options);
    let output = String::from_utf8_lossy(&result.program).into_owned();
    let wrong = |what: String| {
        format!("seed {seed}: {what}\n--- original\n{program}\n--- corrected\n{output}")
    };
    let corrected = result
        .arcs
        .iter()
        .filter(|a| matches!(a.fate, giotto_nc::Fate::Corrected { .. }))
        .count();
    let mut before = canon::Canon::default();
    if corrected > 0 {
        before = rs274.run(&program).map_err(|e| wrong(e.to_string()))?;
        let after = rs274.run(&output).map_err(|e| wrong(e.to_string()))?;
        canon::compare(&before, &after, options.keep == Keep::Omega).map_err(wrong)?;
        if options.keep == Keep::Feed {
            grbl::compare(&program, &output).map_err(wrong)?;
        }
    } else if output != program {
        return Err(wrong("nothing corrected, and yet other bytes".into()));
    }
    Ok(Outcome {
        corrected,
        left: result.arcs.len() - corrected,
        runs: corrected > 0 && before.error.is_none(),
        reasons: result
            .arcs
            .iter()
            .filter_map(|a| match a.fate {
                giotto_nc::Fate::Left(left) => Some(left.to_string()),
                giotto_nc::Fate::Corrected { .. } => None,
            })
            .collect(),
        error: before.error,
    })
}
