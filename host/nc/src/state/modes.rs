//! What codes do to the modes in force, and what makes them unknown.
use super::super::codes::{self, G, M, Mode};
use super::super::left::{Because, Code, Left};
use super::super::word::{Line, Word};
use super::{FeedMode, Modal, State};

impl State {
    pub(super) fn leave_subprogram(&mut self) {
        if let Some(saved) = self.saved_here.take() {
            self.restore(saved);
        }
    }

    /// Nothing is known any more but what the program says from here on.
    pub(super) fn forget(&mut self, code: Code) {
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

    pub(super) fn lose_feed(&mut self, code: Code) {
        (self.now.feed, self.lost_feed) = (None, Some(self.because(code)));
    }

    /// What holds whether the line was run (`self`) or not.
    pub(super) fn merge(&mut self, skipped: &Self) {
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

    /// Takes a G-word.
    pub(super) fn g(&mut self, word: &Word, line: &Line<'_>, axes: bool) -> Use {
        let code = Code::Word('G', word.tenths());
        if self.reading.harmless.contains(&code) {
            return Use::None;
        }
        let meant = match codes::siemens(word.tenths()) {
            Some(meant) if self.reading.siemens => meant,
            _ => codes::g(word.tenths(), axes, self.reading.printer),
        };
        match meant {
            G::Motion(motion) => self.motion = Some(motion),
            G::NoMotion => self.motion = None,
            G::Dwell => return Use::Stops,
            G::Cycle
            | G::DoubtfulUnit
            | G::ToolLength
            | G::ToolOffset
            | G::Frame
            | G::WorkOffset
            | G::SetPosition
            | G::Away
            | G::Opens(_)
            | G::Closes(_)
            | G::Macro => return self.other_coordinates(meant, word, line, axes),
            mode => self.mode(mode, code),
        }
        Use::None
    }

    /// A mode that says what numbers mean.
    fn mode(&mut self, meant: G, code: Code) {
        let because = self.because(code);
        match meant {
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
            G::Absolute(absolute) => {
                self.now.absolute = Some(absolute);
                if absolute {
                    self.forget_floating();
                }
            }
            G::AbsoluteCentres(absolute) => self.now.absolute_centres = Some(absolute),
            G::Feed(mode) => {
                // LinuxCNC takes the feed away even where the mode was in force already.
                self.lose_feed(code);
                self.now.feed_mode = Some(mode);
            }
            G::CutterCompensation(on) => self.now.cutter_compensation = on.then_some(because),
            G::ExactStop(on) => self.now.exact_stop = on.then_some(because),
            G::Unknown => {
                self.blocked.get_or_insert(Left::UnknownCode(because));
            }
            // These stop here or change nothing; the rest is not for this place.
            _ => {}
        }
    }

    /// A code behind which the machine is elsewhere, or its place has other numbers.
    fn other_coordinates(&mut self, meant: G, word: &Word, line: &Line<'_>, axes: bool) -> Use {
        let code = Code::Word('G', word.tenths());
        let because = self.because(code);
        match meant {
            G::Cycle => {
                self.motion = Some(word.tenths());
                self.lose_place(because);
                Use::Own
            }
            G::DoubtfulUnit => {
                (self.now.inch, self.lost_modes) = (None, Some(because));
                self.lose_feed(code);
                self.lose_place(because);
                Use::Own
            }
            G::ToolLength => {
                (self.position[2], self.floating[2]) = (None, false);
                self.lost_place = Some(because);
                Use::None
            }
            G::ToolOffset => {
                self.lose_place(because);
                Use::None
            }
            G::Frame => {
                self.move_frame(because);
                Use::Own
            }
            G::WorkOffset => {
                self.move_frame(because);
                Use::None
            }
            G::SetPosition => {
                self.set_position(line, because);
                Use::Own
            }
            G::Away => {
                self.lose_place(because);
                self.along = [None; 4];
                Use::Own
            }
            G::Opens(mode) => {
                self.open_mode(mode, because);
                if mode == Mode::Polar {
                    Use::None
                } else {
                    Use::Own
                }
            }
            G::Closes(mode) => self.close_mode(mode, because, axes),
            G::Macro => {
                self.forget(code);
                Use::Own
            }
            _ => Use::None,
        }
    }

    fn close_mode(&mut self, mode: Mode, because: Because, axes: bool) -> Use {
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
        Use::None
    }

    pub(super) fn open_modes(&self) -> impl Iterator<Item = (Mode, Because)> {
        self.open.iter().copied().flatten()
    }

    pub(super) fn open_mode(&mut self, mode: Mode, because: Because) {
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
    pub(super) fn m(&mut self, word: &Word) -> bool {
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
    pub(super) fn m_behind(&mut self, word: &Word) {
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
    pub(super) fn restore(&mut self, saved: Modal) {
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

    pub(super) fn take_feed(&mut self, line: &Line<'_>) {
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
}

/// What a code makes of the axis words beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// Nothing.
    None,
    /// They are its own.
    Own,
    /// The machine stands still.
    Stops,
}
