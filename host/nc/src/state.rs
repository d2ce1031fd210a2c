//! The modal state of a program: what each line makes the machine do.
use super::Left;
use super::word::{Line, Sort, Word};
use std::f64::consts::TAU;

/// What a line does.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    /// No motion of an axis.
    Nothing,
    /// A straight feed move.
    Line(Straight),
    /// A circular move.
    Arc(Arc),
    /// A circular move that cannot be read.
    LostArc(Left),
    /// Another motion, or one that is not understood: whatever follows starts from rest.
    Other,
}

/// A straight feed move; positions in mm, `None` where the program has not said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Straight {
    pub(super) start: [Option<f64>; 3],
    pub(super) end: [Option<f64>; 3],
    /// Whether its end is given in program coordinates (G90).
    pub(super) absolute: bool,
}

/// A circular move in its plane, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arc {
    pub(super) plane: Plane,
    pub(super) start: [f64; 2],
    pub(super) end: [f64; 2],
    pub(super) centre: [f64; 2],
    pub(super) radius_mm: f64,
    /// Angle, CCW positive; more than a turn with P.
    pub(super) sweep_rad: f64,
    /// Start and end of the axis across the plane, if it moves.
    pub(super) lift: Option<[f64; 2]>,
    /// Speed along the circle (without the lift), mm/s.
    pub(super) feed_mm_s: f64,
    /// The F word in force, in its own units.
    pub(super) feed_word: f64,
    /// What the words mean.
    pub(super) modes: Modes,
}

impl Arc {
    /// Direction of travel at the start or the end, of length 1.
    pub(super) fn tangent(&self, at_end: bool) -> [f64; 2] {
        let [x, y] = sub(if at_end { self.end } else { self.start }, self.centre);
        let side = self.sweep_rad.signum() / x.hypot(y);
        [-side * y, side * x]
    }

    pub(super) fn length_mm(&self) -> f64 {
        self.radius_mm * self.sweep_rad.abs()
    }
}

/// Plane of arcs: two axes in right-handed order and the one across.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Plane {
    Xy,
    Zx,
    Yz,
}

impl Plane {
    /// Indices of first, second and third axis in XYZ.
    pub(super) fn axes(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }
}

/// Modal groups that decide what numbers mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Modes {
    pub(super) inch: bool,
    pub(super) absolute: bool,
    pub(super) absolute_centres: bool,
    pub(super) feed_mode: FeedMode,
}

/// Feed as distance a minute (G94), turns of the block a minute (G93) or distance a turn (G95).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FeedMode {
    PerMinute,
    InverseTime,
    PerTurn,
}

/// State of the interpreter.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) modes: Modes,
    plane: Plane,
    motion: Option<i64>,
    /// The F word of G94 in its own units.
    feed: Option<f64>,
    position: [Option<f64>; 3],
    /// Axes whose position counts from an origin that is not the program's: moved by increments only.
    floating: [bool; 3],
    /// Why arcs cannot be trusted from here on.
    blocked: Option<Left>,
    cutter_compensation: bool,
}

/// Largest difference of start and end radius, mm: LinuxCNC's for centre format.
const RADIUS_TOLERANCE_MM: f64 = 0.0127;

impl State {
    pub(super) fn new() -> Self {
        let modes = Modes {
            inch: false,
            absolute: true,
            absolute_centres: false,
            feed_mode: FeedMode::PerMinute,
        };
        Self {
            modes,
            plane: Plane::Xy,
            motion: None,
            feed: None,
            position: [None; 3],
            floating: [false; 3],
            blocked: None,
            cutter_compensation: false,
        }
    }

    /// At a place, mm.
    pub(super) fn at(position_mm: [f64; 3]) -> Self {
        Self {
            position: position_mm.map(Some),
            ..Self::new()
        }
    }

    /// Where the lines so far lead, mm; `None` where they do not say.
    pub(super) fn position(&self) -> [Option<f64>; 3] {
        self.position
    }

    /// The F word in force and what it means.
    pub(super) fn feed(&self) -> (Option<f64>, FeedMode) {
        (self.feed, self.modes.feed_mode)
    }

    /// Whether moves are positioning moves (G0).
    pub(super) fn is_rapid(&self) -> bool {
        self.motion == Some(0)
    }

    /// Takes one line.
    pub(super) fn step(&mut self, line: &Line<'_>) -> Action {
        match line.sort {
            Sort::Plain => {}
            Sort::Flow => {
                self.blocked = Some(Left::ProgramFlow);
                return Action::Other;
            }
            Sort::Unread => {
                // Nothing that the line may have changed can be relied on, arcs least of all.
                self.position = [None; 3];
                self.feed = None;
                return if self.moves_on_arc(line) {
                    Action::LostArc(Left::Expression)
                } else {
                    Action::Other
                };
            }
            Sort::Optional => {
                let moves = line.words.iter().any(|w| b"XYZ".contains(&w.letter));
                let arc = moves && self.moves_on_arc(line);
                let changes = line
                    .words
                    .iter()
                    .any(|w| w.letter == b'G' && !(0..40).contains(&w.tenths()));
                if moves {
                    self.position = [None; 3];
                }
                if line.has(b'F') {
                    self.feed = None;
                }
                if changes {
                    self.blocked = Some(Left::OptionalBlock);
                }
                return if arc {
                    Action::LostArc(Left::OptionalBlock)
                } else {
                    Action::Other
                };
            }
        }
        let mut special = false;
        for word in line.words.iter().filter(|w| w.letter == b'G') {
            special |= self.g(word);
        }
        let axes = line.words.iter().any(|w| b"XYZIJKR".contains(&w.letter));
        self.take_feed(line);
        if special {
            self.position = [None; 3];
            return Action::Other;
        }
        if !axes {
            return Action::Nothing;
        }
        self.anchor(line);
        let start = self.position;
        let end = self.end_of(line);
        self.position = end;
        match self.motion {
            Some(10) if line.words.iter().any(|w| b"ABCUVW".contains(&w.letter)) => Action::Other,
            Some(10) => Action::Line(Straight {
                start,
                end,
                absolute: self.modes.absolute,
            }),
            Some(direction @ (20 | 30)) => match self.arc(line, start, direction == 30) {
                Ok(arc) => Action::Arc(arc),
                Err(left) => Action::LostArc(left),
            },
            _ => Action::Other,
        }
    }

    fn moves_on_arc(&self, line: &Line<'_>) -> bool {
        let own = line
            .words
            .iter()
            .rfind(|w| w.letter == b'G' && (0..40).contains(&w.tenths()));
        matches!(own.map(Word::tenths).or(self.motion), Some(20 | 30))
    }

    /// Takes a G-word; true if it uses the axis words for itself or loses the position.
    fn g(&mut self, word: &Word) -> bool {
        match word.tenths() {
            motion @ (0 | 10 | 20 | 30) => self.motion = Some(motion),
            170 => self.plane = Plane::Xy,
            180 => self.plane = Plane::Zx,
            190 => self.plane = Plane::Yz,
            200 => self.modes.inch = true,
            210 => self.modes.inch = false,
            400 => self.cutter_compensation = false,
            410 | 411 | 420 | 421 => self.cutter_compensation = true,
            900 => {
                self.modes.absolute = true;
                self.forget_floating();
            }
            910 => self.modes.absolute = false,
            901 => self.modes.absolute_centres = true,
            911 => self.modes.absolute_centres = false,
            930 => self.set_feed_mode(FeedMode::InverseTime),
            940 => self.set_feed_mode(FeedMode::PerMinute),
            950 => self.set_feed_mode(FeedMode::PerTurn),
            800 => self.motion = None,
            // Dwell, tool length, path control, spindle modes, return levels: no motion in the plane.
            40 | 430 | 431 | 490 | 610 | 611 | 640 | 500 | 690 | 960..=999 => {}
            // Coordinate systems, homing, probing: the position is another one or unknown.
            100 | 280 | 281 | 300 | 301 | 520 | 530 | 540..=593 | 920..=923 | 382..=385 => {
                return true;
            }
            330 | 331 | 730 | 760 | 810..=890 => {
                self.motion = Some(word.tenths());
                return true;
            }
            _ => self.blocked = Some(Left::UnknownCode),
        }
        false
    }

    fn set_feed_mode(&mut self, mode: FeedMode) {
        if mode != self.modes.feed_mode {
            self.feed = None;
        }
        self.modes.feed_mode = mode;
    }

    fn take_feed(&mut self, line: &Line<'_>) {
        if let Some(f) = line.word(b'F') {
            self.feed = Some(f.value);
        } else if self.modes.feed_mode == FeedMode::InverseTime {
            self.feed = None;
        }
    }

    /// Increments need no origin: an axis whose place is not known counts from where it is.
    fn anchor(&mut self, line: &Line<'_>) {
        if self.modes.absolute {
            for axis in 0..3 {
                self.floating[axis] &= !line.has(b"XYZ"[axis]);
            }
            return;
        }
        for axis in 0..3 {
            if self.position[axis].is_none() {
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

    /// Millimetres of one program unit.
    pub(super) fn unit_mm(&self) -> f64 {
        if self.modes.inch { 25.4 } else { 1.0 }
    }

    fn end_of(&self, line: &Line<'_>) -> [Option<f64>; 3] {
        std::array::from_fn(|axis| match line.word(b"XYZ"[axis]) {
            None => self.position[axis],
            Some(w) if self.modes.absolute => Some(w.value * self.unit_mm()),
            Some(w) => self.position[axis].map(|p| p + w.value * self.unit_mm()),
        })
    }

    fn arc(&self, line: &Line<'_>, start: [Option<f64>; 3], ccw: bool) -> Result<Arc, Left> {
        if let Some(left) = self.blocked {
            return Err(left);
        }
        if self.cutter_compensation {
            return Err(Left::CutterCompensation);
        }
        let once = |l: u8| line.words.iter().filter(|w| w.letter == l).count() <= 1;
        if !b"XYZIJKRPF".iter().all(|l| once(*l)) {
            return Err(Left::Words);
        }
        let allowed = |w: &Word| match w.letter {
            b'A' | b'B' | b'C' | b'U' | b'V' | b'W' => Err(Left::OtherAxes),
            b'M' if matches!(w.tenths(), 0 | 10 | 20 | 300 | 600 | 980 | 990) => Err(Left::Words),
            b'M' if line.has(b'P') => Err(Left::Words),
            b'G' if !matches!(w.tenths(), 20 | 30 | 170..=190 | 200 | 210 | 900..=940 | 610 | 611 | 640) => {
                Err(Left::Words)
            }
            _ => Ok(()),
        };
        line.words.iter().try_for_each(allowed)?;
        let unit = self.unit_mm();
        let [a, b, c] = self.plane.axes();
        let offset = |axis: usize| line.word(b"IJK"[axis]).map(|w| w.value * unit);
        // Centres in program coordinates need a place in program coordinates.
        let anchored = |axis: usize| !(self.modes.absolute_centres && self.floating[axis]);
        let from = |axis: usize| {
            start[axis]
                .filter(|_| anchored(axis))
                .ok_or(Left::UnknownPosition)
        };
        let start_2 = [from(a)?, from(b)?];
        let to = |axis: usize, from: f64| match line.word(b"XYZ"[axis]) {
            None => from,
            Some(w) if self.modes.absolute => w.value * unit,
            Some(w) => from + w.value * unit,
        };
        let end_2 = [to(a, start_2[0]), to(b, start_2[1])];
        let turns = match line.word(b'P') {
            None => 1.0,
            Some(p) if p.value >= 1.0 && p.value.fract() == 0.0 && p.value < 1e4 => p.value,
            Some(_) => return Err(Left::Words),
        };
        let same = (end_2[0] - start_2[0]).hypot(end_2[1] - start_2[1]) < 1e-9;
        let centre = match line.word(b'R') {
            Some(r) if !same && offset(a).is_none() && offset(b).is_none() => {
                radius_centre(start_2, end_2, r.value * unit, ccw).ok_or(Left::Geometry)?
            }
            Some(_) => return Err(Left::Geometry),
            None if offset(a).is_none() && offset(b).is_none() => return Err(Left::Geometry),
            None if self.modes.absolute_centres => [
                offset(a).ok_or(Left::Geometry)?,
                offset(b).ok_or(Left::Geometry)?,
            ],
            None => [
                start_2[0] + offset(a).unwrap_or(0.0),
                start_2[1] + offset(b).unwrap_or(0.0),
            ],
        };
        let (from_centre, to_centre) = (sub(start_2, centre), sub(end_2, centre));
        let radius_mm = from_centre[0].hypot(from_centre[1]);
        let miss = (to_centre[0].hypot(to_centre[1]) - radius_mm).abs();
        if radius_mm < 1e-6 || miss > RADIUS_TOLERANCE_MM {
            return Err(Left::Geometry);
        }
        let raw = to_centre[1].atan2(to_centre[0]) - from_centre[1].atan2(from_centre[0]);
        let mut sweep = if ccw {
            raw.rem_euclid(TAU)
        } else {
            (-raw).rem_euclid(TAU)
        };
        if same || sweep < 1e-12 {
            sweep = TAU;
        }
        sweep += TAU * (turns - 1.0);
        let lift = match (line.word(b"XYZ"[c]), start[c]) {
            (None, _) => None,
            (Some(_), None) => return Err(Left::UnknownPosition),
            (Some(_), Some(from)) => Some([from, to(c, from)]).filter(|[from, to]| from != to),
        };
        let length = radius_mm * sweep;
        let climb = lift.map_or(0.0, |[from, to]| to - from);
        let feed = self.feed.filter(|f| *f > 0.0).ok_or(Left::UnknownFeed)?;
        let feed_mm_s = match self.modes.feed_mode {
            FeedMode::PerMinute => feed * unit / 60.0 * length / length.hypot(climb),
            FeedMode::InverseTime => length * feed / 60.0,
            FeedMode::PerTurn => return Err(Left::UnknownFeed),
        };
        let sweep_rad = if ccw { sweep } else { -sweep };
        Ok(Arc {
            plane: self.plane,
            start: start_2,
            end: end_2,
            centre,
            radius_mm,
            sweep_rad,
            lift,
            feed_mm_s,
            feed_word: feed,
            modes: self.modes,
        })
    }
}

/// Centre from the radius format: R > 0 takes the arc of less than half a turn.
fn radius_centre(start: [f64; 2], end: [f64; 2], r: f64, ccw: bool) -> Option<[f64; 2]> {
    let [dx, dy] = sub(end, start);
    let chord = dx.hypot(dy);
    let square = r * r - chord * chord / 4.0;
    // Half a turn may miss its chord by the rounding of the program.
    if square < -RADIUS_TOLERANCE_MM * r.abs() {
        return None;
    }
    let height = square.max(0.0).sqrt() / chord;
    let side = if ccw == (r > 0.0) { height } else { -height };
    Some([
        0.5 * (start[0] + end[0]) - side * dy,
        0.5 * (start[1] + end[1]) + side * dx,
    ])
}

pub(super) fn sub(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
