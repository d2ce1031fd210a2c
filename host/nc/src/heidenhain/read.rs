//! The state of a Klartext program: what each block makes the machine do.
use super::super::arc::{self, Arc, FeedMode, Modes, Plane};
use super::super::left::{Because, Code, Left};
use super::super::state::{Action, Straight};
use super::block::{Block, Said, said};

/// What a block does, and how it is written if it is a circle that may be rewritten.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Read {
    pub(super) action: Action,
    pub(super) form: Option<Form>,
    /// The machine stands still at its end.
    pub(super) stops: bool,
    /// A corner before and behind is cut off or rounded.
    pub(super) trims: bool,
    /// In force, mm/s.
    pub(super) feed_mm_s: Option<f64>,
}

/// How a circle is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// `C`: about the pole that `CC` set.
    Centre,
    /// `CR`.
    Radius,
}

impl Read {
    fn of(action: Action) -> Self {
        Self {
            action,
            form: None,
            stops: false,
            trims: false,
            feed_mm_s: None,
        }
    }
}

/// State of the reading.
#[derive(Default)]
pub(super) struct Reader {
    place: [Option<f64>; 3],
    pole: [Option<f64>; 2],
    /// mm/min.
    feed: Option<f64>,
    /// R0 is in force.
    uncompensated: bool,
    compensation: Option<Because>,
    lost: Option<Because>,
    /// What keeps every circle of the program from being corrected.
    blocked: Option<Left>,
    /// Within a block that goes on in the next line.
    goes_on: bool,
    line: usize,
}

/// Words of a path function.
#[derive(Default)]
struct Words {
    place: [Option<(f64, bool)>; 3],
    radius: Option<f64>,
    ccw: Option<bool>,
    feed: Option<f64>,
    rapid: bool,
    compensation: Option<bool>,
    m: Vec<i64>,
    other: bool,
    twice: bool,
}

impl Words {
    fn of(block: &Block<'_>) -> Self {
        fn once<T>(slot: &mut Option<T>, value: T) -> bool {
            slot.replace(value).is_some()
        }
        let mut words = Self::default();
        for word in &block.words[1..] {
            let twice = match said(word.text) {
                Said::Place {
                    axis,
                    value,
                    incremental,
                } => once(&mut words.place[axis], (value, incremental)),
                Said::Radius(r) => once(&mut words.radius, r),
                Said::Compensation(on) => once(&mut words.compensation, on),
                Said::Turn { ccw } => once(&mut words.ccw, ccw),
                Said::Feed(feed) => once(&mut words.feed, feed),
                Said::Rapid => {
                    words.rapid = true;
                    false
                }
                Said::M(code) => {
                    words.m.push(code);
                    false
                }
                Said::Other => {
                    words.other = true;
                    false
                }
            };
            words.twice |= twice;
        }
        words
    }
}

/// M-codes of spindle and coolant.
fn is_harmless(m: i64) -> bool {
    matches!(m, 30 | 40 | 50 | 70 | 80 | 90 | 130 | 140)
}

impl Reader {
    pub(super) fn new(blocked: Option<Left>) -> Self {
        Self {
            blocked,
            ..Self::default()
        }
    }

    fn because(&self, name: &'static str) -> Because {
        Because {
            line: self.line,
            code: Code::Named(name),
        }
    }

    /// Nothing is known any more but what the program says from here on.
    fn forget(&mut self, name: &'static str) {
        self.lose_place(name);
        (self.pole, self.feed) = ([None; 2], None);
        (self.uncompensated, self.compensation) = (false, None);
    }

    fn lose_place(&mut self, name: &'static str) {
        (self.place, self.lost) = ([None; 3], Some(self.because(name)));
    }

    /// Takes the next line.
    pub(super) fn step(&mut self, block: Option<&Block<'_>>) -> Read {
        let read = self.block(block);
        Read {
            feed_mm_s: self.feed.map(|feed| feed / 60.0),
            ..read
        }
    }

    fn block(&mut self, block: Option<&Block<'_>>) -> Read {
        self.line += 1;
        let Some(block) = block else {
            self.forget("what stands there");
            return Read::of(Action::Other);
        };
        let part = std::mem::take(&mut self.goes_on);
        let Some(first) = block.words.first() else {
            self.goes_on = part;
            return Read::of(Action::Nothing);
        };
        self.goes_on = block.words.last().is_some_and(|w| w.text.ends_with('~'));
        if part {
            // Parameters of a cycle.
            return Read::of(Action::Nothing);
        }
        match first.text.to_ascii_uppercase().as_str() {
            "BEGIN" | "BLK" | "*" => Read::of(Action::Nothing),
            "END" => self.lost("the end of the program"),
            "L" => self.straight(block),
            "CC" => self.pole(block),
            "C" => self.circle(block, Form::Centre),
            "CR" => self.circle(block, Form::Radius),
            "CT" => self.other_arc(block, "CT of Heidenhain"),
            "CP" => self.other_arc(block, "CP of Heidenhain"),
            "CTP" => self.other_arc(block, "CTP of Heidenhain"),
            "RND" => self.corner(Some("RND of Heidenhain")),
            "CHF" => self.corner(None),
            "APPR" | "DEP" => self.other_arc(block, "APPR and DEP of Heidenhain"),
            "FC" | "FCT" => self.other_arc(block, "FC of Heidenhain"),
            "CYCL" => self.cycle(block),
            "STOP" => Read::of(Action::Stop),
            "LBL" => self.lost("LBL"),
            "CALL" => self.lost("CALL"),
            "TOOL" if block.starts(&["TOOL", "DEF"]) => Read::of(Action::Nothing),
            "TOOL" => self.lost("TOOL CALL"),
            text if text.starts_with('M') => self.functions(block),
            "FN" => match block
                .words
                .get(1)
                .map(|w| w.text.trim_end_matches(':').parse())
            {
                // Sums, and jumps to labels, where everything is forgotten.
                Some(Ok(0_u32..=15)) => Read::of(Action::Nothing),
                _ => self.lost("FN"),
            },
            text if is_setting(text) => Read::of(Action::Nothing),
            "LP" => self.lost("LP"),
            _ => self.lost("what stands there"),
        }
    }

    fn lost(&mut self, name: &'static str) -> Read {
        self.forget(name);
        Read::of(Action::Other)
    }

    /// Circles that are not read; where they end is known where the program says so in X and Y.
    fn other_arc(&mut self, block: &Block<'_>, name: &'static str) -> Read {
        let words = Words::of(block);
        self.forget(name);
        if let ([Some((x, false)), Some((y, false)), None], false) = (words.place, words.other) {
            self.place = [Some(x), Some(y), None];
        }
        Read::of(Action::LostArc(Left::Dialect(name)))
    }

    /// RND and CHF cut off the corner between two blocks; the place in the program stays the corner.
    fn corner(&mut self, arc: Option<&'static str>) -> Read {
        let action = match arc {
            Some(name) => Action::LostArc(Left::Dialect(name)),
            None => Action::Other,
        };
        Read {
            trims: true,
            ..Read::of(action)
        }
    }

    fn cycle(&mut self, block: &Block<'_>) -> Read {
        let number = block.words.get(2).map_or("", |w| w.text);
        let number = number.split('.').next().unwrap_or_default();
        match number.parse() {
            _ if !block.starts(&["CYCL", "DEF"]) => self.lost("CYCL CALL"),
            Ok(7_u32 | 247) => {
                self.lose_place("CYCL DEF of a datum");
                self.pole = [None; 2];
                Read::of(Action::Other)
            }
            Ok(9) => Read::of(Action::Stop),
            // A tolerance, and cycles that run when they are called.
            Ok(32 | 200..=209 | 240 | 241 | 251..=258 | 262..=265) => Read::of(Action::Nothing),
            _ => self.lost("CYCL DEF"),
        }
    }

    /// A block of M-functions alone.
    fn functions(&mut self, block: &Block<'_>) -> Read {
        let codes: Option<Vec<i64>> = block
            .words
            .iter()
            .map(|w| match said(w.text) {
                Said::M(code) => Some(code),
                _ => None,
            })
            .collect();
        match codes {
            Some(codes) if codes.iter().all(|m| is_harmless(*m)) => Read::of(Action::Nothing),
            Some(codes) if codes.iter().all(|m| matches!(m, 0 | 10) || is_harmless(*m)) => {
                Read::of(Action::Stop)
            }
            _ => self.lost("an M-function"),
        }
    }

    fn pole(&mut self, block: &Block<'_>) -> Read {
        let words = Words::of(block);
        let plain = !words.other && !words.twice && words.place[2].is_none() && words.m.is_empty();
        let here = block.words.len() == 1;
        for axis in 0..2 {
            self.pole[axis] = match words.place[axis] {
                _ if !plain => None,
                Some((value, false)) => Some(value),
                // Counted from the last place of the tool.
                Some((value, true)) => self.place[axis].map(|at| at + value),
                None if here => self.place[axis],
                None => self.pole[axis],
            };
        }
        Read::of(Action::Nothing)
    }

    fn end(&self, words: &Words) -> [Option<f64>; 3] {
        std::array::from_fn(|axis| match words.place[axis] {
            None => self.place[axis],
            Some((value, false)) => Some(value),
            Some((value, true)) => self.place[axis].map(|at| at + value),
        })
    }

    /// R0, RL and RR stay in force, and so does F.
    fn take_modes(&mut self, words: &Words) {
        match words.compensation {
            Some(true) => {
                self.compensation = Some(self.because("RL or RR"));
                self.uncompensated = false;
            }
            Some(false) => (self.compensation, self.uncompensated) = (None, true),
            None => {}
        }
        self.feed = words.feed.or(self.feed);
    }

    fn straight(&mut self, block: &Block<'_>) -> Read {
        let words = Words::of(block);
        let start = self.place;
        self.take_modes(&words);
        if words.twice
            || words
                .m
                .iter()
                .any(|m| !is_harmless(*m) && !matches!(m, 0 | 10))
        {
            // M91 counts from the machine's zero, M99 calls a cycle, M2 ends.
            return self.lost("an M-function");
        }
        let moves = words.place.iter().any(Option::is_some);
        self.place = self.end(&words);
        let stops = words.m.iter().any(|m| matches!(m, 0 | 10));
        if words.other {
            // A rotary axis, a parameter, a feed by another unit.
            self.lose_place("a word with a value that is not plain");
            self.feed = None;
            return Read::of(Action::Other);
        }
        if words.rapid || !moves || words.radius.is_some() || words.ccw.is_some() {
            return Read {
                stops,
                ..Read::of(Action::Other)
            };
        }
        let absolute = words
            .place
            .iter()
            .flatten()
            .all(|(_, incremental)| !incremental);
        Read {
            stops,
            ..Read::of(Action::Line(Straight {
                start,
                end: self.place,
                absolute,
                bare: words.feed.is_none() && words.m.is_empty() && self.uncompensated,
                feed_mm_s: None,
            }))
        }
    }

    fn circle(&mut self, block: &Block<'_>, form: Form) -> Read {
        let words = Words::of(block);
        let start = self.place;
        self.take_modes(&words);
        self.place = self.end(&words);
        match self.arc(&words, start, form) {
            Ok(arc) => Read {
                form: Some(form),
                ..Read::of(Action::Arc(arc))
            },
            Err(left) => {
                let odd = words.other || words.twice || !words.m.is_empty();
                if odd {
                    self.forget("a circle that is not plain");
                }
                Read::of(Action::LostArc(left))
            }
        }
    }

    fn arc(&self, words: &Words, start: [Option<f64>; 3], form: Form) -> Result<Arc, Left> {
        if let Some(left) = self.blocked {
            return Err(left);
        }
        if words.other || words.twice || words.rapid {
            return Err(Left::Expression);
        }
        if let Some(m) = words.m.first() {
            return Err(Left::Words(Code::Word('M', *m)));
        }
        if words.place[2].is_some() {
            return Err(Left::Dialect("a helix of Heidenhain"));
        }
        if let Some(because) = self.compensation {
            return Err(Left::CutterCompensation(because));
        }
        let unknown = Left::UnknownPosition(self.lost);
        if !self.uncompensated {
            return Err(unknown);
        }
        let flat = |p: [Option<f64>; 3]| Some([p[0]?, p[1]?]);
        let (Some(start), Some(end)) = (flat(start), flat(self.place)) else {
            return Err(unknown);
        };
        let feed_word = self.feed.ok_or(Left::UnknownFeed(self.lost))?;
        let ccw = words.ccw.ok_or(Left::Geometry)?;
        let centre = match (form, words.radius, self.pole) {
            (Form::Radius, Some(r), _) if start != end => {
                arc::radius_centre(start, end, r, ccw).ok_or(Left::Geometry)?
            }
            (Form::Centre, None, [Some(x), Some(y)]) => [x, y],
            (Form::Centre, None, _) => {
                return Err(Left::Dialect(
                    "a circle of Heidenhain about a pole that is not known",
                ));
            }
            _ => return Err(Left::Geometry),
        };
        let circle = arc::about(start, end, centre, ccw).ok_or(Left::Geometry)?;
        Ok(Arc {
            plane: Plane::Xy,
            start,
            end,
            centre,
            radius_mm: circle.radius_mm,
            sweep_rad: circle.sweep_rad,
            lift: None,
            shared: [None; 4],
            feed_mm_s: feed_word / 60.0,
            feed_word,
            modes: Modes {
                inch: false,
                absolute: true,
                absolute_centres: true,
                feed_mode: FeedMode::PerMinute,
            },
            exact_stop: None,
        })
    }
}

/// `Q5 = …`, which moves nothing.
fn is_setting(word: &str) -> bool {
    let mut letters = word.chars();
    letters.next() == Some('Q')
        && letters
            .next()
            .is_some_and(|c| c.is_ascii_digit() || matches!(c, 'S' | 'L' | 'R'))
}
