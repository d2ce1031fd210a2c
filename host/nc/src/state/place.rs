//! Where the machine is: the axes of places and those that go along.
use super::super::left::Because;
use super::super::word::{Counts, Line, Word};
use super::{ALONG, State};

impl State {
    pub(super) fn lose_place(&mut self, because: Because) {
        (self.position, self.floating) = ([None; 3], [false; 3]);
        self.lost_place = Some(because);
    }

    pub(super) fn move_frame(&mut self, because: Because) {
        self.now.frame += 1;
        self.lose_place(because);
    }

    /// G92: `G92 E0` is a printer's everyday and moves no axis of an arc.
    pub(super) fn set_position(&mut self, line: &Line<'_>, because: Because) {
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

    /// Increments need no origin: an axis whose place is not known counts from where it is.
    pub(super) fn anchor(&mut self, line: &Line<'_>) {
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

    pub(super) fn forget_floating(&mut self) {
        for axis in 0..3 {
            if std::mem::take(&mut self.floating[axis]) {
                self.position[axis] = None;
            }
        }
    }

    pub(super) fn end_of(&self, line: &Line<'_>) -> [Option<f64>; 3] {
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
    pub(super) fn relative(&self, letter: u8) -> Option<bool> {
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

    pub(super) fn take_along(&mut self, line: &Line<'_>) {
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
}
