//! Programs for machines: arcs rewritten with the inverse correction, everything else to the letter; or read as the
//! segments that a controller runs ([`program`]).
//!
//! RS-274 as LinuxCNC and Grbl speak it, and plain RAPID ([`rapid`]). An arc of radius R at feed f becomes one of the radius that the machine
//! turns into R, with tangent transitions where it meets its neighbours (`blend`); the blocks of lines are not
//! touched. What cannot be corrected within bounds stays as it was, with a reason.
//!
//! Only the radius law of the model is used. Its further effects (backlash, squareness, …) act on lines as well
//! and belong to the controller's table. Checked by the plant, by the `gcode` crate and by LinuxCNC's interpreter; no
//! corrected program has been run on a real machine.
#![forbid(unsafe_code)]

mod blend;
mod correct;
mod emit;
mod inverse;
#[cfg(test)]
mod plan_tests;
pub mod program;
#[cfg(test)]
mod proof;
pub mod rapid;
mod state;
#[cfg(test)]
mod tests;
mod transition;
mod word;

use giotto::model_file::ModelFile;
use state::{Action, State};

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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Feed or angular rate kept.
    pub keep: Keep,
    /// Acceleration that the transitions may ask for, mm/s².
    pub acceleration_mm_s2: f64,
    /// Largest change of a radius, mm.
    pub max_offset_mm: f64,
    /// Also in the planes G18 and G19, where no circle was measured.
    pub all_planes: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            keep: Keep::Feed,
            acceleration_mm_s2: 2000.0,
            max_offset_mm: 0.5,
            all_planes: false,
        }
    }
}

/// Why an arc was left as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[allow(
    missing_docs,
    reason = "the message of each variant is its documentation"
)]
pub enum Left {
    #[error("the correction is below 0.5 µm")]
    Negligible,
    #[error("the model was not fitted at so high an angular rate")]
    BeyondModel,
    #[error("the correction is larger than allowed")]
    OffsetTooLarge,
    #[error("no programmed circle gives the wanted one")]
    NoInverse,
    #[error("too short for the transitions at its ends")]
    TooShort,
    #[error("not in the XY plane, where the machine was measured")]
    OtherPlane,
    #[error("other axes move along")]
    OtherAxes,
    #[error("where it starts is not known")]
    UnknownPosition,
    #[error("its feed is not known")]
    UnknownFeed,
    #[error("centre, radius and ends do not agree")]
    Geometry,
    #[error("cutter radius compensation is on")]
    CutterCompensation,
    #[error("words in the block that go with an arc's end only once")]
    Words,
    #[error("parameters or expressions in the block")]
    Expression,
    #[error("in or behind an optional block")]
    OptionalBlock,
    #[error("O-words: the order of lines is not that of execution")]
    ProgramFlow,
    #[error("behind a code whose meaning is not known")]
    UnknownCode,
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
pub fn is_program(program: &[u8]) -> bool {
    let block = |line: &word::Line<'_>| match line.sort {
        word::Sort::Plain | word::Sort::Optional => !line.words.is_empty(),
        word::Sort::Flow => true,
        word::Sort::Unread => false,
    };
    word::lines(program).iter().any(block)
}

/// Rewrites the arcs of a program. The text need not be UTF-8; bytes outside rewritten arcs are copied.
pub fn compensate(program: &[u8], model: &ModelFile, options: &Options) -> Compensated {
    let lines = word::lines(program);
    let mut state = State::new();
    let actions: Vec<Action> = lines.iter().map(|line| state.step(line)).collect();
    let inverse = inverse::Inverse::new(model, options);
    let fates = correct::decide(&lines, &actions, &inverse, options, 0.0);
    emit::emit(&lines, &actions, &fates)
}
