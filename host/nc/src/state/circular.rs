//! A block as an arc, where everything that its words mean is known.
use super::super::arc;
use super::super::codes::{self, M};
use super::super::left::{Code, Left};
use super::super::word::{CIP_TENTHS, Counts, Line, VIA, Word};
use super::{ALONG, Arc, FeedMode, Modes, Plane, Shared, State};

impl State {
    /// Everything that numbers mean, or why that is not known.
    pub(super) fn modes(&self) -> Result<(Modes, Plane), Left> {
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

    pub(super) fn arc(
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
            arc::circle_through(line, plane, modes, ends)?
        } else {
            arc::circle(line, plane, modes, ends, direction == 30)?
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

    pub(super) fn shared(
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
