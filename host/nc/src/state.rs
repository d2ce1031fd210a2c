//! The modal state of a program: what each line makes the machine do.
//!
//! Whatever is not known is `None`, with the place that is to blame: a line that is not understood, a call, a block that
//! may be skipped make the reader forget what they may have changed, until the program says it again.
pub(super) use super::arc::{Arc, FeedMode, Modes, Plane, Shared, sub};
use super::codes::{self, G, M, Mode};
use super::left::{Because, Code, Left};
use super::word::{CIP_TENTHS, Counts, Keyword, Line, Sort, VIA, Word};
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

    fn leave_subprogram(&mut self) {
        if let Some(saved) = self.saved_here.take() {
            self.restore(saved);
        }
    }

    /// Nothing is known any more but what the program says from here on.
    fn forget(&mut self, code: Code) {
        let because = self.because(code);
        self.now = Modal {
            inch: None,
            absolute: None,
            // Nothing of Siemens makes centres absolute for more than a block.
            absolute_centres: self.reading.siemens.then_some(false),
            feed_mode: None,
            plane: None,
            cutter_compensation: None,
            exact_stop: None,
            feed: None,
            frame: self.now.frame + 1,
        };
        self.motion = None;
        self.absolute_extruder = None;
        self.along = [None; 4];
        self.lose_place(because);
        (self.lost_modes, self.lost_feed) = (Some(because), Some(because));
    }

    fn lose_place(&mut self, because: Because) {
        (self.position, self.floating) = ([None; 3], [false; 3]);
        self.lost_place = Some(because);
    }

    fn lose_feed(&mut self, code: Code) {
        (self.now.feed, self.lost_feed) = (None, Some(self.because(code)));
    }

    /// What holds whether the line was run (`self`) or not.
    fn merge(&mut self, skipped: &Self) {
        fn same<T: PartialEq>(a: &mut Option<T>, b: &Option<T>) -> bool {
            let differs = a.as_ref() != b.as_ref();
            if differs {
                *a = None;
            }
            differs
        }
        let because = self.because(Code::Named("an optional block"));
        let (now, other) = (&mut self.now, &skipped.now);
        let modes = same(&mut now.inch, &other.inch)
            | same(&mut now.absolute, &other.absolute)
            | same(&mut now.absolute_centres, &other.absolute_centres)
            | same(&mut now.feed_mode, &other.feed_mode)
            | same(&mut now.plane, &other.plane);
        if modes {
            self.lost_modes = Some(because);
        }
        if same(&mut now.feed, &other.feed) {
            self.lost_feed = Some(because);
        }
        now.cutter_compensation = now.cutter_compensation.or(other.cutter_compensation);
        now.exact_stop = now.exact_stop.or(other.exact_stop);
        same(&mut self.motion, &skipped.motion);
        if self.position != skipped.position
            || self.floating != skipped.floating
            || now.frame != other.frame
        {
            self.lose_place(because);
        }
        for axis in 0..4 {
            same(&mut self.along[axis], &skipped.along[axis]);
        }
        same(&mut self.saved, &skipped.saved);
        if self.open != skipped.open || self.blocked != skipped.blocked {
            self.blocked.get_or_insert(Left::OptionalBlock(self.line));
        }
    }

    fn moves_on_arc(&self, line: &Line<'_>) -> bool {
        let own = line
            .words
            .iter()
            .rfind(|w| w.letter == b'G' && (0..40).contains(&w.tenths()));
        matches!(own.map(Word::tenths).or(self.motion), Some(20 | 30 | CIP_TENTHS))
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
                bare: line.words.iter().all(|w| {
                    (matches!(w.letter, b'N' | b'X' | b'Y' | b'Z') && w.counts == Counts::InForce)
                        || (w.letter == b'G' && w.tenths() == 10)
                }) && self.now.feed_mode == Some(FeedMode::PerMinute)
                    && self.open_modes().next().is_none()
                    && self.blocked.is_none()
                    && self.now.cutter_compensation.is_none(),
                feed_mm_s: None,
            }),
            Some(direction @ (20 | 30 | CIP_TENTHS)) => match self.arc(line, start, along, direction) {
                Ok(arc) => Action::Arc(arc),
                Err(left) => Action::LostArc(left),
            },
            _ => Action::Other,
        }
    }

    /// Takes a G-word.
    fn g(&mut self, word: &Word, line: &Line<'_>, axes: bool) -> Use {
        let code = Code::Word('G', word.tenths());
        let because = self.because(code);
        if self.reading.harmless.contains(&code) {
            return Use::None;
        }
        let meant = match codes::siemens(word.tenths()) {
            Some(meant) if self.reading.siemens => meant,
            _ => codes::g(word.tenths(), axes, self.reading.printer),
        };
        match meant {
            G::Motion(motion) => self.motion = Some(motion),
            G::Cycle => {
                self.motion = Some(word.tenths());
                self.lose_place(because);
                return Use::Own;
            }
            G::NoMotion => self.motion = None,
            G::Plane(plane) => self.now.plane = Some(plane),
            G::Inch(inch) => {
                if self.now.inch != Some(inch) {
                    self.along = [None; 4];
                    if self.unit_said {
                        self.lose_feed(code);
                        self.unit_changed = true;
                    }
                }
                (self.now.inch, self.unit_said) = (Some(inch), true);
            }
            G::DoubtfulUnit => {
                (self.now.inch, self.lost_modes) = (None, Some(because));
                self.lose_feed(code);
                self.lose_place(because);
                return Use::Own;
            }
            G::Absolute(absolute) => {
                self.now.absolute = Some(absolute);
                if absolute {
                    self.forget_floating();
                }
            }
            G::AbsoluteCentres(absolute) => self.now.absolute_centres = Some(absolute),
            G::Feed(mode) => {
                if self.now.feed_mode != Some(mode) {
                    self.lose_feed(code);
                }
                self.now.feed_mode = Some(mode);
            }
            G::CutterCompensation(on) => self.now.cutter_compensation = on.then_some(because),
            G::ExactStop(on) => self.now.exact_stop = on.then_some(because),
            G::StopsHere | G::Nothing => {}
            G::Dwell => return Use::Stops,
            G::ToolLength => {
                (self.position[2], self.floating[2]) = (None, false);
                self.lost_place = Some(because);
            }
            G::ToolOffset => self.lose_place(because),
            G::Frame => {
                self.move_frame(because);
                return Use::Own;
            }
            G::WorkOffset => self.move_frame(because),
            G::SetPosition => {
                self.set_position(line, because);
                return Use::Own;
            }
            G::Away => {
                self.lose_place(because);
                self.along = [None; 4];
                return Use::Own;
            }
            G::Opens(mode) => {
                self.open_mode(mode, because);
                return if mode == Mode::Polar {
                    Use::None
                } else {
                    Use::Own
                };
            }
            G::Closes(mode) => {
                let was_open = self.open_modes().any(|(m, _)| m == mode);
                self.open.iter_mut().for_each(|slot| {
                    if slot.is_some_and(|(m, _)| m == mode) {
                        *slot = None;
                    }
                });
                if was_open {
                    self.lose_place(because);
                }
                // `G50 S2000` of lathes is a largest spindle speed, `G50 X0` a place.
                if mode == Mode::Scaling && axes {
                    self.move_frame(because);
                    return Use::Own;
                }
            }
            G::Macro => {
                self.forget(code);
                return Use::Own;
            }
            G::Unknown => {
                self.blocked.get_or_insert(Left::UnknownCode(because));
            }
        }
        Use::None
    }

    fn move_frame(&mut self, because: Because) {
        self.now.frame += 1;
        self.lose_place(because);
    }

    /// G92: `G92 E0` is a printer's everyday and moves no axis of an arc.
    fn set_position(&mut self, line: &Line<'_>, because: Because) {
        for (axis, letter) in b"XYZ".iter().enumerate() {
            if line.has(*letter) {
                self.now.frame += 1;
                (self.position[axis], self.floating[axis]) = (None, false);
                self.lost_place = Some(because);
            }
        }
        if !line.has_any(b"XYZEABCUVW") {
            self.move_frame(because);
        }
        for (slot, letter) in self.along.iter_mut().zip(ALONG) {
            if let Some(word) = line.word(letter) {
                *slot = Some(word.value).filter(|v| v.is_finite());
            }
        }
    }

    fn open_modes(&self) -> impl Iterator<Item = (Mode, Because)> {
        self.open.iter().copied().flatten()
    }

    fn open_mode(&mut self, mode: Mode, because: Because) {
        self.lose_place(because);
        let slot = self
            .open
            .iter()
            .position(|s| s.is_some_and(|(m, _)| m == mode))
            .or_else(|| self.open.iter().position(Option::is_none));
        match slot {
            Some(slot) => self.open[slot] = Some((mode, because)),
            None => _ = self.blocked.get_or_insert(Left::Coordinates(because)),
        }
    }

    /// Takes an M-word; true if the machine stands still behind it.
    fn m(&mut self, word: &Word) -> bool {
        let code = Code::Word('M', word.tenths());
        let because = self.because(code);
        if self.reading.harmless.contains(&code) {
            return false;
        }
        match codes::m(word.tenths(), self.reading.printer) {
            M::AtStart | M::Nothing => {}
            M::Stops => return true,
            M::Ends => return true,
            M::Call | M::Return => {}
            M::ToolChange => self.lose_place(because),
            M::SaveModes => {
                self.saved = Some(self.now);
                if word.tenths() == 730 {
                    if self.reading.followed {
                        self.saved_here = Some(self.now);
                    } else {
                        self.forget(code);
                    }
                }
            }
            M::DropModes => self.saved = None,
            M::RestoreModes => match self.saved {
                Some(saved) => self.restore(saved),
                None => self.forget(code),
            },
            M::AbsoluteExtruder(absolute) => self.absolute_extruder = Some(absolute),
            M::Unknown => {
                self.blocked.get_or_insert(Left::UnknownCode(because));
            }
        }
        false
    }

    /// What an M-word does behind the motion of its block.
    fn m_behind(&mut self, word: &Word) {
        let code = Code::Word('M', word.tenths());
        if self.reading.harmless.contains(&code) {
            return;
        }
        // M17 ends a subprogram of Siemens.
        if self.reading.siemens && word.tenths() == 170 {
            self.forget(code);
            return;
        }
        match codes::m(word.tenths(), self.reading.printer) {
            M::Ends => self.forget(code),
            M::Call if self.reading.followed => {}
            M::Return if self.reading.followed => self.leave_subprogram(),
            M::Call | M::Return => self.forget(code),
            _ => {}
        }
    }

    /// What M70 kept is in force again; the machine stands where it stood.
    fn restore(&mut self, saved: Modal) {
        if saved.inch != self.now.inch {
            self.along = [None; 4];
        }
        if saved.frame != self.now.frame {
            let because = self.because(Code::Word('M', 720));
            self.lose_place(because);
        }
        self.now = Modal {
            frame: self.now.frame,
            ..saved
        };
        if self.now.absolute == Some(true) {
            self.forget_floating();
        }
    }

    fn take_feed(&mut self, line: &Line<'_>) {
        if self.reading.siemens && line.has_g(&[40]) {
            // `G4 F2` waits for two seconds.
        } else if line.has(b'F') {
            // Where the unit changes in the same block, controllers differ in which unit F has.
            let value = line.word(b'F').map(|f| f.value);
            self.now.feed = value.filter(|v| v.is_finite() && !self.unit_changed);
            if self.now.feed.is_none() && !self.unit_changed {
                self.lose_feed(Code::Named(
                    "F with a number that only the controller knows",
                ));
            }
        } else if self.now.feed_mode == Some(FeedMode::InverseTime) {
            self.now.feed = None;
        }
    }

    /// Increments need no origin: an axis whose place is not known counts from where it is.
    fn anchor(&mut self, line: &Line<'_>) {
        if self.now.absolute != Some(false) {
            for axis in 0..3 {
                self.floating[axis] &= !line.has(b"XYZ"[axis]);
            }
            return;
        }
        for axis in 0..3 {
            let placed = |w: &Word| w.counts == Counts::FromOrigin;
            if line.word(b"XYZ"[axis]).is_some_and(placed) {
                // Behind the block it counts from the program's origin; before it, from where it did.
                self.floating[axis] = false;
            } else if self.position[axis].is_none() {
                (self.position[axis], self.floating[axis]) = (Some(0.0), true);
            }
        }
    }

    fn forget_floating(&mut self) {
        for axis in 0..3 {
            if std::mem::take(&mut self.floating[axis]) {
                self.position[axis] = None;
            }
        }
    }

    fn end_of(&self, line: &Line<'_>) -> [Option<f64>; 3] {
        let unit = self.now.inch.map(|inch| if inch { 25.4 } else { 1.0 });
        std::array::from_fn(|axis| {
            let letter = b"XYZ"[axis];
            if !line.has(letter) {
                return self.position[axis];
            }
            let word = line.word(letter)?;
            let value = word.value * unit?;
            let absolute = match word.counts {
                Counts::InForce => self.now.absolute?,
                Counts::FromOrigin => true,
                Counts::FromStart => false,
            };
            let end = if absolute {
                value
            } else {
                self.position[axis]? + value
            };
            end.is_finite().then_some(end)
        })
    }

    /// Whether a shared word counts from where the axis is.
    fn relative(&self, letter: u8) -> Option<bool> {
        match (letter, self.absolute_extruder) {
            (b'E', Some(absolute)) => Some(!absolute),
            // Marlin's E goes with G90 and G91, others' does not.
            (b'E', None) => self
                .now
                .absolute
                .filter(|absolute| *absolute)
                .map(|_| false),
            _ => self.now.absolute.map(|absolute| !absolute),
        }
    }

    fn take_along(&mut self, line: &Line<'_>) {
        for (slot, letter) in ALONG.into_iter().enumerate() {
            if !line.has(letter)
                || line
                    .words
                    .iter()
                    .any(|w| w.letter == b'G' && w.tenths() == 920)
            {
                continue;
            }
            let value = line.word(letter).map(|w| w.value);
            self.along[slot] = match (value, self.relative(letter)) {
                (Some(v), Some(false)) => Some(v),
                (Some(v), Some(true)) => self.along[slot].map(|a| a + v),
                _ => None,
            }
            .filter(|v| v.is_finite());
        }
    }

    /// Everything that numbers mean, or why that is not known.
    fn modes(&self) -> Result<(Modes, Plane), Left> {
        if let Some(left) = self.blocked {
            return Err(left);
        }
        if let Some((_, because)) = self.open_modes().next() {
            return Err(Left::Coordinates(because));
        }
        let now = &self.now;
        let known = (|| {
            let modes = Modes {
                inch: now.inch?,
                absolute: now.absolute?,
                absolute_centres: now.absolute_centres?,
                feed_mode: now.feed_mode?,
            };
            Some((modes, now.plane?))
        })();
        let nothing = Code::Named("the start");
        known.ok_or_else(|| {
            Left::UnknownModes(self.lost_modes.unwrap_or_else(|| self.because(nothing)))
        })
    }

    fn arc(
        &self,
        line: &Line<'_>,
        start: [Option<f64>; 3],
        along: [Option<f64>; 4],
        direction: i64,
    ) -> Result<Arc, Left> {
        let (modes, plane) = self.modes()?;
        if let Some(because) = self.now.cutter_compensation {
            return Err(Left::CutterCompensation(because));
        }
        words_of_an_arc(line, direction == CIP_TENTHS)?;
        let unit = modes.unit_mm();
        let [a, b, c] = plane.axes();
        // Centres in program coordinates need a place in program coordinates.
        let own = line.words.iter().any(|w| w.counts == Counts::FromOrigin);
        let from = |axis: usize| {
            start[axis]
                .filter(|_| !((modes.absolute_centres || own) && self.floating[axis]))
                .ok_or(Left::UnknownPosition(self.lost_place))
        };
        let start_2 = [from(a)?, from(b)?];
        let to = |axis: usize, from: f64| match line.word(b"XYZ"[axis]) {
            None => from,
            Some(w) if w.absolute(modes.absolute) => w.value * unit,
            Some(w) => from + w.value * unit,
        };
        let end_2 = [to(a, start_2[0]), to(b, start_2[1])];
        let ends = [start_2, end_2];
        let circle = if direction == CIP_TENTHS {
            super::arc::circle_through(line, plane, modes, ends)?
        } else {
            super::arc::circle(line, plane, modes, ends, direction == 30)?
        };
        let lift = match (line.word(b"XYZ"[c]), start[c]) {
            (None, _) => None,
            (Some(_), None) => return Err(Left::UnknownPosition(self.lost_place)),
            (Some(_), Some(from)) => Some([from, to(c, from)]).filter(|[from, to]| from != to),
        };
        let length = circle.radius_mm * circle.sweep_rad.abs();
        let climb = lift.map_or(0.0, |[from, to]| to - from);
        let lost = Left::UnknownFeed(self.lost_feed);
        let feed = self.now.feed.filter(|f| *f > 0.0).ok_or(lost)?;
        let feed_mm_s = match modes.feed_mode {
            FeedMode::PerMinute => feed * unit / 60.0 * length / length.hypot(climb),
            FeedMode::InverseTime => length * feed / 60.0,
            FeedMode::PerTurn => return Err(lost),
        };
        Ok(Arc {
            plane,
            start: start_2,
            end: end_2,
            centre: circle.centre,
            radius_mm: circle.radius_mm,
            sweep_rad: circle.sweep_rad,
            lift,
            shared: self.shared(line, along)?,
            feed_mm_s,
            feed_word: feed,
            modes,
            exact_stop: self.now.exact_stop,
        })
    }

    fn shared(
        &self,
        line: &Line<'_>,
        along: [Option<f64>; 4],
    ) -> Result<[Option<Shared>; 4], Left> {
        let mut shared = [None; 4];
        for (slot, letter) in ALONG.into_iter().enumerate() {
            let Some(word) = line.word(letter) else {
                continue;
            };
            let lost = Left::OtherAxes(char::from(letter));
            let relative = self.relative(letter).ok_or(lost)?;
            let from = if relative {
                0.0
            } else {
                along[slot].ok_or(lost)?
            };
            shared[slot] = Some(Shared {
                letter,
                from,
                to: word.value,
                relative,
            });
        }
        Ok(shared)
    }
}

/// What a code makes of the axis words beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// Nothing.
    None,
    /// They are its own.
    Own,
    /// The machine stands still.
    Stops,
}

/// Every word of the block is one that may stand in the first of several blocks.
fn words_of_an_arc(line: &Line<'_>, through: bool) -> Result<(), Left> {
    let code = |w: &Word| Code::Word(char::from(w.letter), w.tenths());
    for w in &line.words {
        let twice = w.letter != b'G' && w.letter != b'M' && line.word(w.letter).is_none();
        let allowed = match w.letter {
            b'U' | b'V' | b'W' => return Err(Left::SecondaryAxes),
            b'M' => codes::m(w.tenths(), false) == M::AtStart && !line.has(b'P'),
            b'G' => match w.tenths() {
                20 | 30 | 170..=190 | 200 | 210 | 900..=940 if w.tenths() != 920 => true,
                CIP_TENTHS => true,
                640 => !line.has(b'P') && !line.has(b'Q'),
                _ => false,
            },
            letter if VIA.contains(&letter) => through,
            b'I' | b'J' | b'K' | b'R' | b'P' => !through,
            b'N' | b'X' | b'Y' | b'Z' | b'F' | b'S' | b'E' | b'A' | b'B' | b'C' => true,
            _ => false,
        };
        if !allowed || twice {
            return Err(Left::Words(code(w)));
        }
        if w.value.is_nan() {
            return Err(Left::Expression);
        }
    }
    Ok(())
}
