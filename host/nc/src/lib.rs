//! Programs for machines: arcs rewritten with the inverse correction, everything else to the letter; or read as the
//! segments that a controller runs ([`program`]).
//!
//! RS-274 as LinuxCNC, Grbl and Siemens speak it, Klartext of Heidenhain ([`heidenhain`]), and plain RAPID ([`rapid`]). An arc of radius R at feed f becomes one of the radius that the machine
//! turns into R, with tangent transitions where it meets its neighbours (`blend`); the blocks of lines are not
//! touched. What cannot be corrected within bounds stays as it was, with a reason.
//!
//! Only the radius law of the model is used. Its further effects (backlash, squareness, …) act on lines as well
//! and belong to the controller's table. Checked by the plant, by the `gcode` crate and by LinuxCNC's interpreter; no
//! corrected program has been run on a real machine.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod arc;
mod blend;
mod chain;
pub mod check;
mod codes;
pub mod contour;
mod correct;
mod dialect;
mod digits;
mod emit;
mod engine;
mod flow;
pub mod heidenhain;
mod inverse;
mod joint;
mod lead;
mod least_squares;
mod left;
mod mark;
pub mod path;
#[cfg(test)]
mod plan_tests;
pub mod program;
#[cfg(test)]
mod proof;
pub mod rapid;
#[cfg(test)]
mod siemens_tests;
mod state;
mod steps;
#[cfg(test)]
mod tests;
mod transition;
mod word;

use giotto::model_file::ModelFile;
pub use lead::{FreeSide, Leads, Led};
pub use left::{Because, Code, Left};
pub use mark::{Mark, marked};
use std::io;

/// What to keep when the radius changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Keep {
    /// The feed, as programmed; the program's F words stay.
    #[default]
    Feed,
    /// The angular rate: the feed grows with the radius, the arc takes its time.
    Omega,
}

/// How to compensate.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Feed or angular rate kept.
    pub keep: Keep,
    /// Acceleration that the transitions may ask for, mm/s².
    pub acceleration_mm_s2: f64,
    /// Largest change of a radius, mm.
    pub max_offset_mm: f64,
    /// Also in the planes G18 and G19, where no circle was measured.
    pub all_planes: bool,
    /// Centres of arcs count from the origin unless the program says G91.1: a setting of the controller.
    pub absolute_centres: bool,
    /// M-codes from M100 are those of a printer and move nothing.
    pub printer: bool,
    /// Codes of the machine's own that move nothing.
    pub harmless: Vec<Code>,
    /// The last stretch of an arc before a stop may be run more slowly than F says, where the machine would leave the
    /// circle otherwise.
    pub slow_to_stops: bool,
    /// Leads of full circles that begin or end at a stop; not in RAPID.
    pub leads: Leads,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            keep: Keep::Feed,
            acceleration_mm_s2: 2000.0,
            max_offset_mm: 0.5,
            all_planes: false,
            absolute_centres: false,
            printer: false,
            harmless: Vec::new(),
            slow_to_stops: true,
            leads: Leads::No,
        }
    }
}

/// What became of one arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Line of the original, from 1.
    pub line: usize,
    /// What became of it.
    pub fate: Fate,
}

/// What became of one arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fate {
    /// Rewritten.
    Corrected {
        /// Programmed radius, mm.
        radius_mm: f64,
        /// Programmed speed along the circle, mm/s.
        feed_mm_s: f64,
        /// Change of the radius, mm.
        delta_mm: f64,
        /// Blocks that replace the arc.
        blocks: usize,
        /// Largest share of `delta_mm` that is expected to remain as an error where the arc meets its neighbours.
        joint_share: f64,
        /// Time by which the last stretch before a stop takes longer, s.
        slower_s: f64,
        /// Its leads.
        led: Led,
    },
    /// As it was.
    Left(Left),
}

/// A compensated program.
#[derive(Clone, Debug, PartialEq)]
pub struct Compensated {
    /// The program.
    pub program: Vec<u8>,
    /// One entry an arc, in order of lines.
    pub arcs: Vec<Report>,
}

/// Whether any line is a block: words that were understood, or what steers a program.
///
/// ```
/// use giotto_nc::is_program;
///
/// assert!(is_program(b"G21\nG1 X10 F300\nM2\n"));
/// assert!(!is_program(b"Dear machine, please draw a circle.\n"));
/// ```
pub fn is_program(program: &[u8]) -> bool {
    let block = |line: word::Line<'_>| match line.sort {
        word::Sort::Plain | word::Sort::Optional => {
            !line.words.is_empty() && line.words.iter().any(|w| !w.value.is_nan())
        }
        word::Sort::Flow(_) | word::Sort::Setting => true,
        word::Sort::Unread => dialect::arc(line.text).is_some(),
    };
    heidenhain::is_klartext(program) || word::lines(program).any(block)
}

/// Rewrites the arcs of a program. The text need not be UTF-8; bytes outside rewritten arcs are copied.
///
/// ```
/// use giotto_nc::{Fate, Options, compensate};
/// use giotto::model_file::ModelFile;
/// # use std::path::Path;
///
/// let model = ModelFile::parse(
///     "format = 2\ncampaign = \"lab\"\nmachine = \"mill\"\n\
///      [servo]\nkind = \"lag\"\nkv_per_s = 43.3\n\
///      [valid]\nradius_mm = [20.0, 150.0]\nfeed_mm_s = [5.0, 700.0]",
///     Path::new("model.toml"),
/// )?;
/// // A quarter of a circle of 50 mm at 15 m/min, between two straight lines that touch it.
/// let program = "G21 G17 G90\nG0 X-20 Y0\nG1 X0 Y0 F15000\nG3 X50 Y50 I0 J50\nG1 Y80\nM2\n";
/// let corrected = compensate(program.as_bytes(), &model, &Options::default());
/// let Fate::Corrected { radius_mm, delta_mm, .. } = corrected.arcs[0].fate else {
///     unreachable!("{:?}", corrected.arcs)
/// };
/// // The machine draws it 328 µm too small: it is programmed larger.
/// assert_eq!(radius_mm, 50.0);
/// assert!(delta_mm > 0.3 && delta_mm < 0.4, "{delta_mm}");
/// // Everything but the arc is copied to the letter.
/// let text = String::from_utf8(corrected.program)?;
/// assert!(text.starts_with("G21 G17 G90\nG0 X-20 Y0\n") && text.ends_with("G1 Y80\nM2\n"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn compensate(program: &[u8], model: &ModelFile, options: &Options) -> Compensated {
    let mut text = Vec::with_capacity(program.len());
    // Writing into memory does not fail.
    let arcs = compensate_to(program, model, options, None, &mut text).unwrap_or_default();
    Compensated {
        program: text,
        arcs,
    }
}

/// Rewrites the arcs of a program into `out`, as it goes, with a mark that says so. A program of which nothing is
/// corrected is copied to the byte.
///
/// # Errors
/// Those of `out`.
pub fn compensate_to(
    program: &[u8],
    model: &ModelFile,
    options: &Options,
    mark: Option<&Mark>,
    out: &mut dyn io::Write,
) -> io::Result<Vec<Report>> {
    if heidenhain::is_klartext(program) {
        return heidenhain::compensate_to(program, model, options, mark, out);
    }
    let mut arcs = Vec::new();
    // Brackets hold no comment of Siemens.
    let [open, close] = if word::is_siemens(program) {
        ["; ", ""]
    } else {
        ["(", ")"]
    };
    let mut copy = mark::Marking::new(program, mark, open, close);
    engine::run(program, model, options, &mut |line, index, text, fate| {
        engine::report(&mut arcs, index, fate);
        copy.line(line.text.len() + line.end.len(), text, out)
    })?;
    copy.finish(out)?;
    Ok(arcs)
}
