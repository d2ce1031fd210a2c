//! Why an arc was left as it was, and the place that is to blame.
use std::fmt;

/// A code or keyword of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Code {
    /// A letter with its number in tenths: G90.1 is `('G', 901)`.
    Word(char, i64),
    /// A keyword, or a description in words.
    Named(&'static str),
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Word(letter, tenths) if *tenths == super::word::UNKNOWN_TENTHS => {
                write!(f, "{letter} with a number that only the controller knows")
            }
            Self::Word(letter, tenths) if tenths % 10 == 0 => write!(f, "{letter}{}", tenths / 10),
            Self::Word(letter, tenths) => write!(f, "{letter}{}.{}", tenths / 10, tenths % 10),
            Self::Named(name) => f.write_str(name),
        }
    }
}

impl std::str::FromStr for Code {
    type Err = String;

    /// `M101`, `G43.4`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut letters = text.trim().chars();
        let letter = letters.next().map(|c| c.to_ascii_uppercase());
        let number: Option<f64> = letters.as_str().parse().ok();
        match (letter, number) {
            (Some(letter @ ('G' | 'M')), Some(n)) if (0.0..10_000.0).contains(&n) => {
                Ok(Self::Word(letter, (n * 10.0).round() as i64))
            }
            _ => Err("expected a code as M101 or G43.4".to_owned()),
        }
    }
}

/// What made something unknown, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Because {
    /// Line of the original, from 1.
    pub line: usize,
    /// What stands there.
    pub code: Code,
}

impl fmt::Display for Because {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} in line {}", self.code, self.line)
    }
}

/// `since G28 in line 12`, or nothing.
struct Since<'a>(&'a Option<Because>);

impl fmt::Display for Since<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .map_or(Ok(()), |because| write!(f, " since {because}"))
    }
}

/// Why an arc was left as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, thiserror::Error)]
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
    #[error("{0} moves along, and where it starts is not known")]
    OtherAxes(char),
    #[error("U, V or W moves along: which axes those are depends on the controller")]
    SecondaryAxes,
    #[error("the tool turns along the arc")]
    Orientation,
    #[error("where it starts is not known{}", Since(.0))]
    UnknownPosition(Option<Because>),
    #[error("its feed is not known{}", Since(.0))]
    UnknownFeed(Option<Because>),
    #[error("the plane, unit or distance mode in force is not known since {0}")]
    UnknownModes(Because),
    #[error("centre, radius and ends do not agree")]
    Geometry,
    #[error("centre and ends agree only if centres are absolute: say so by `--centres absolute`")]
    AbsoluteCentres,
    #[error("a third centre word, whose meaning depends on the controller")]
    ThirdCentre,
    #[error("cutter radius compensation is on since {0}")]
    CutterCompensation(Because),
    #[error("{0} in the block, which goes with an arc's end only once")]
    Words(Code),
    #[error("parameters or expressions in the block")]
    Expression,
    #[error("in or behind an optional block (line {0})")]
    OptionalBlock(usize),
    #[error("{0}: the order of lines is not that of execution")]
    ProgramFlow(Because),
    #[error("behind {0}, which changes what coordinates mean")]
    Coordinates(Because),
    #[error("{0} stands in the program, whose blocks may run in other coordinates")]
    OtherCoordinates(Because),
    #[error("behind {0}, whose meaning is not known; `--harmless {code}` if it moves nothing", code = .0.code)]
    UnknownCode(Because),
    #[error("behind {0}, which is not understood")]
    Unread(Because),
    #[error("every block ends in a stop since {0}")]
    ExactStop(Because),
    #[error("the calls of this subprogram run it differently")]
    CallsDiffer,
    #[error("no line of the program leads here")]
    NotReached,
    #[error("one of a chain of arcs too long to be kept at once")]
    LongChain,
    #[error("{0}: instructions of this kind are not rewritten")]
    Dialect(&'static str),
    #[error("its via point lies closer than 0.1 mm or 1° to its ends")]
    ControllerLimits,
}
