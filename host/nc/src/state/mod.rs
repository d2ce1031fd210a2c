//! The modal state of a program: what each line makes the machine do.
//!
//! Whatever is not known is `None`, with the place that is to blame: a line that is not understood, a call, a block that
//! may be skipped make the reader forget what they may have changed, until the program says it again.
mod circular;
mod modes;
mod place;

pub(super) use super::arc::{Arc, FeedMode, Modes, Plane, Shared, sub};
use super::codes::Mode;
use super::left::{Because, Code, Left};
use super::word::{self, CIP_TENTHS, Counts, Keyword, Line, Sort, Word};
use modes::Use;
use std::rc::Rc;

/// What a line does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    /// No motion of an axis.
    Nothing,
    /// A straight feed move.
    Line(Straight),
    /// A circular move.
    Arc(Arc),
    /// A circular move that cannot be read.
    LostArc(Left),
    /// The machine stands still: a dwell, a stop, the end.
    Stop,
    /// Another motion, or what is not understood.
    Other,
}

/// A straight feed move; positions in mm, `None` where the program has not said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Straight {
    pub(super) start: [Option<f64>; 3],
    pub(super) end: [Option<f64>; 3],
    /// Whether its end is given in program coordinates (G90).
    pub(super) absolute: bool,
    /// Nothing but its number, G1 and its end: a part of the way may be gone before it.
    pub(super) bare: bool,
    /// Its own speed, mm/s, where each move has one; `None`: that in force before it.
    pub(super) feed_mm_s: Option<f64>,
}

/// How a program is to be read.
#[derive(Clone, Debug, Default)]
pub(super) struct Reading {
    /// Centres are absolute from the start.
    pub(super) absolute_centres: bool,
    /// M-codes as printers know them.
    pub(super) printer: bool,
    /// Codes that move nothing, by the word of the user.
    pub(super) harmless: Rc<[Code]>,
    /// Calls are followed by whoever asks: they are no riddle here.
    pub(super) followed: bool,
    /// Written for a control of Siemens.
    pub(super) siemens: bool,
}

/// What M70 keeps, and what must be known before numbers mean anything.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Modal {
    inch: Option<bool>,
    absolute: Option<bool>,
    absolute_centres: Option<bool>,
    feed_mode: Option<FeedMode>,
    plane: Option<Plane>,
    cutter_compensation: Option<Because>,
    exact_stop: Option<Because>,
    /// The F word in force, in the units and the mode in force.
    feed: Option<f64>,
    /// Counts changes of the coordinates.
    frame: u32,
}

/// State of the interpreter.
#[derive(Clone, Debug)]
pub(super) struct State {
    reading: Reading,
    now: Modal,
    saved: Option<Modal>,
    /// M73: restored at the end of the subprogram.
    saved_here: Option<Modal>,
    motion: Option<i64>,
    position: [Option<f64>; 3],
    /// Axes whose position counts from an origin that is not the program's: moved by increments only.
    floating: [bool; 3],
    /// E, A, B, C, in program units.
    along: [Option<f64>; 4],
    /// M82, M83; `None`: E goes with G90 and G91.
    absolute_extruder: Option<bool>,
    /// Modes in which coordinates mean something else.
    open: [Option<(Mode, Because)>; 4],
    /// Why arcs cannot be trusted from here on.
    blocked: Option<Left>,
    /// What made a modal group, the place or the feed unknown last.
    lost_modes: Option<Because>,
    lost_place: Option<Because>,
    lost_feed: Option<Because>,
    unit_said: bool,
    /// In this block, against what was said before.
    unit_changed: bool,
    line: usize,
}

/// Letters of [`Shared`] words.
const ALONG: [u8; 4] = *b"EABC";

impl State {
    pub(super) fn new(reading: Reading) -> Self {
        let now = Modal {
            inch: Some(false),
            absolute: Some(true),
            absolute_centres: Some(reading.absolute_centres),
            feed_mode: Some(FeedMode::PerMinute),
            plane: Some(Plane::Xy),
            cutter_compensation: None,
            exact_stop: None,
            feed: None,
            frame: 0,
        };
        Self {
            reading,
            now,
            saved: None,
            saved_here: None,
            motion: None,
            position: [None; 3],
            floating: [false; 3],
            along: [None; 4],
            absolute_extruder: None,
            open: [None; 4],
            blocked: None,
            lost_modes: None,
            lost_place: None,
            lost_feed: None,
            unit_said: false,
            unit_changed: false,
            line: 0,
        }
    }

    /// At a place, mm.
    pub(super) fn at(position_mm: [f64; 3]) -> Self {
        Self {
            position: position_mm.map(Some),
            ..Self::new(Reading::default())
        }
    }

    /// Where the lines so far lead, mm; `None` where they do not say.
    pub(super) fn position(&self) -> [Option<f64>; 3] {
        self.position
    }

    /// The F word in force and what it means.
    pub(super) fn feed(&self) -> (Option<f64>, Option<FeedMode>) {
        (self.now.feed, self.now.feed_mode)
    }

    /// Whether moves are positioning moves (G0).
    pub(super) fn is_rapid(&self) -> bool {
        self.motion == Some(0)
    }

    /// Millimetres of one program unit; those of a millimetre where it is not known.
    pub(super) fn unit_mm(&self) -> f64 {
        if self.now.inch == Some(true) {
            25.4
        } else {
            1.0
        }
    }

    /// Takes the line of a number, from 1.
    pub(super) fn step(&mut self, number: usize, line: &Line<'_>) -> Action {
        self.line = number;
        match line.sort {
            Sort::Plain => self.plain(line),
            Sort::Setting => Action::Nothing,
            Sort::Flow(keyword) => self.flow(keyword),
            Sort::Unread => {
                let code = Code::Named("what stands there");
                let arc = self.moves_on_arc(line);
                self.forget(code);
                if let Some(name) = word::transforms(line.text).filter(|_| self.reading.siemens) {
                    let because = self.because(Code::Named(name));
                    self.blocked.get_or_insert(Left::Coordinates(because));
                }
                if let Some(name) = super::dialect::arc(line.text) {
                    return Action::LostArc(Left::Dialect(name));
                }
                if arc {
                    Action::LostArc(Left::Unread(self.because(code)))
                } else {
                    Action::Other
                }
            }
            Sort::Optional => {
                let mut skipped = self.clone();
                let action = self.plain(line);
                skipped.line = number;
                self.merge(&skipped);
                match action {
                    Action::Arc(_) | Action::LostArc(_) => {
                        Action::LostArc(Left::OptionalBlock(number))
                    }
                    Action::Nothing => Action::Nothing,
                    _ => Action::Other,
                }
            }
        }
    }

    fn because(&self, code: Code) -> Because {
        Because {
            line: self.line,
            code,
        }
    }

    fn flow(&mut self, keyword: Keyword) -> Action {
        match keyword {
            Keyword::Other(name) => {
                let because = self.because(Code::Named(name));
                self.blocked.get_or_insert(Left::ProgramFlow(because));
                Action::Other
            }
            Keyword::Sub | Keyword::Call if self.reading.followed => Action::Nothing,
            Keyword::EndSub if self.reading.followed => {
                self.leave_subprogram();
                Action::Nothing
            }
            Keyword::Sub | Keyword::EndSub | Keyword::Call => {
                self.forget(Code::Named("a subprogram"));
                Action::Other
            }
        }
    }

    fn moves_on_arc(&self, line: &Line<'_>) -> bool {
        let own = line
            .words
            .iter()
            .rfind(|w| w.letter == b'G' && (0..40).contains(&w.tenths()));
        matches!(
            own.map(Word::tenths).or(self.motion),
            Some(20 | 30 | CIP_TENTHS)
        )
    }

    fn plain(&mut self, line: &Line<'_>) -> Action {
        let axes = line.has_any(b"XYZ");
        let mut own = false;
        let mut stops = false;
        self.unit_changed = false;
        for word in line.words.iter().filter(|w| w.letter == b'G') {
            let used = self.g(word, line, axes);
            // `G4 X1.5` is a dwell of Fanuc; beside a motion the words are the motion's.
            own |= used == Use::Own
                || (used == Use::Stops && axes && !line.words.iter().any(Word::is_motion));
            stops |= used == Use::Stops;
        }
        for word in line.words.iter().filter(|w| w.letter == b'M') {
            stops |= self.m(word);
        }
        let action = self.words_done(line, axes, own, stops);
        for word in line.words.iter().filter(|w| w.letter == b'M') {
            self.m_behind(word);
        }
        action
    }

    /// The rest of a block whose G- and M-words are taken.
    fn words_done(&mut self, line: &Line<'_>, axes: bool, own: bool, stops: bool) -> Action {
        self.take_feed(line);
        if self.reading.siemens && line.has(b'L') {
            // A subprogram by its number.
            self.forget(Code::Named("a subprogram"));
            return Action::Other;
        }
        if self.reading.siemens && line.has(b'D') {
            let because = self.because(Code::Named("D with its offsets"));
            self.lose_place(because);
        }
        // Tools of lathes bring their offsets (T0101).
        if line
            .word(b'T')
            .is_some_and(|t| t.value.is_nan() || t.value >= 100.0)
        {
            let because = self.because(Code::Named("a tool with its offsets"));
            self.lose_place(because);
        }
        let moves = axes || line.has_any(b"IJKRABCUVW");
        // E alone turns the extruder.
        if own || !moves {
            let extrudes = line.has(b'E') && !own;
            self.take_along(line);
            return match (stops, own, extrudes) {
                (true, ..) => Action::Stop,
                (_, false, false) => Action::Nothing,
                _ => Action::Other,
            };
        }
        self.motion_of(line)
    }

    /// A block with axis words that belong to the motion in force.
    fn motion_of(&mut self, line: &Line<'_>) -> Action {
        self.anchor(line);
        let start = self.position;
        let along = self.along;
        let end = self.end_of(line);
        self.position = end;
        self.take_along(line);
        if line.has_any(b"UVW") {
            // Axes of their own, or increments of X, Y and Z.
            let because = self.because(Code::Named("U, V or W"));
            self.lose_place(because);
        }
        match self.motion {
            Some(10) if line.has_any(b"ABCUVW") => Action::Other,
            Some(10) => Action::Line(Straight {
                start,
                end: self.position,
                absolute: self.now.absolute == Some(true),
                // A number in the middle of a block is no number to every controller.
                bare: line.words.iter().skip(1).all(|w| w.letter != b'N')
                    && !line.speaks()
                    && line.words.iter().all(|w| {
                        (matches!(w.letter, b'N' | b'X' | b'Y' | b'Z')
                            && w.counts == Counts::InForce)
                            || (w.letter == b'G' && w.tenths() == 10)
                    })
                    && self.now.feed_mode == Some(FeedMode::PerMinute)
                    && self.open_modes().next().is_none()
                    && self.blocked.is_none()
                    && self.now.cutter_compensation.is_none(),
                feed_mm_s: None,
            }),
            Some(direction @ (20 | 30 | CIP_TENTHS)) => {
                match self.arc(line, start, along, direction) {
                    Ok(arc) => Action::Arc(arc),
                    Err(left) => Action::LostArc(left),
                }
            }
            _ => Action::Other,
        }
    }
}
