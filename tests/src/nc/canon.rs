//! LinuxCNC's interpreter as judge: the canonical calls of two programs, compared.
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The interpreter alone, as Debian's `linuxcnc-uspace` has it.
pub struct Rs274 {
    command: OsString,
    dir: tempfile::TempDir,
}

/// What a program makes the interpreter call.
#[derive(Clone, Debug, Default)]
pub struct Canon {
    /// Calls in order, without comments and without those that set the feed, which each call has beside it.
    pub calls: Vec<Call>,
    /// Where it stopped before its end, and why.
    pub error: Option<String>,
}

/// One canonical call.
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// Its name.
    pub name: String,
    /// Its arguments; what is no number is NaN and stands in `text`.
    pub values: Vec<f64>,
    /// The whole call as printed.
    pub text: String,
    /// Feed in force, in the units of the program.
    pub feed: f64,
}

impl Rs274 {
    /// The interpreter that `GIOTTO_RS274` names, or the one of this machine; `None` where there is none.
    pub fn find() -> Option<Self> {
        let named = std::env::var_os("GIOTTO_RS274");
        let usual = || {
            let path = PathBuf::from("/usr/bin/rs274");
            path.exists().then(|| path.into_os_string())
        };
        let command = named.or_else(usual)?;
        let dir = tempfile::tempdir().ok()?;
        std::fs::write(dir.path().join("tool.tbl"), "T1 P1 D6\nT2 P2 D4 Z3\n").ok()?;
        Some(Self { command, dir })
    }

    /// What the interpreter prints. It keeps its table of tools in a file of the home folder, which it maps: two that share one
    /// read each other's tools, or die of it.
    fn output(&self, dir: &Path, file: &Path) -> std::io::Result<Output> {
        Command::new(&self.command)
            .current_dir(dir)
            .env("HOME", dir)
            .arg("-g")
            .arg("-t")
            .arg(self.dir.path().join("tool.tbl"))
            .arg(file)
            .stdin(Stdio::null())
            .output()
    }

    /// Runs a program.
    ///
    /// # Errors
    /// The interpreter cannot be started.
    pub fn run(&self, program: &str) -> std::io::Result<Canon> {
        // A place of its own: the interpreter keeps its offsets in a file of the folder it is run in.
        let dir = tempfile::tempdir_in(self.dir.path())?;
        let file = dir.path().join("program.ngc");
        std::fs::write(&file, program)?;
        let output = self.output(dir.path(), &file)?;
        let mut canon = Canon::default();
        let mut feed = 0.0;
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            // `   12 N..... CALL(…)`, with the number of the line where it has one.
            let mut words = line.trim_start().splitn(2, ' ');
            let numbered = words.next().is_some_and(|n| n.parse::<u32>().is_ok());
            if let Some(call) = words.next().filter(|_| numbered).and_then(|r| r.get(6..)) {
                let Some(call) = Call::read(call.trim()) else {
                    continue;
                };
                if call.name == "SET_FEED_RATE" {
                    feed = call.values.first().copied().unwrap_or(f64::NAN);
                } else {
                    canon.calls.push(Call { feed, ..call });
                }
            }
        }
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        let mut words = errors.lines().filter(|l| {
            !l.trim().is_empty() && !l.starts_with("executing") && !l.contains("trying to open")
        });
        if !output.status.success() || !canon.calls.iter().any(|c| c.name == "PROGRAM_END") {
            canon.error = Some(match words.next() {
                Some(words) => words.to_owned(),
                None => format!("no end ({})", output.status),
            });
        }
        Ok(canon)
    }
}

impl Call {
    fn read(text: &str) -> Option<Self> {
        let (name, rest) = text.split_once('(')?;
        if name == "COMMENT" && !text.contains("feed mode set") {
            return None;
        }
        let inside = rest.rsplit_once(')').map_or(rest, |(inside, _)| inside);
        Some(Self {
            name: name.to_owned(),
            values: inside
                .split([',', ' '])
                .filter(|v| !v.is_empty())
                .map(|v| v.parse().unwrap_or(f64::NAN))
                .collect(),
            text: text.to_owned(),
            feed: 0.0,
        })
    }

    fn is_arc(&self) -> bool {
        self.name == "ARC_FEED"
    }

    fn is_line(&self) -> bool {
        self.name == "STRAIGHT_FEED"
    }

    fn same(&self, other: &Self) -> bool {
        let near = |a: &f64, b: &f64| (a - b).abs() <= 1.01e-4 + 1e-9 * a.abs();
        if self.values.iter().chain(&other.values).any(|v| v.is_nan()) {
            return self.text == other.text;
        }
        self.name == other.name
            && self.values.len() == other.values.len()
            && self
                .values
                .iter()
                .zip(&other.values)
                .all(|(a, b)| near(a, b))
    }
}

/// What is needed to place a call: plane, unit, feed mode, where the tool is.
#[derive(Clone, Copy)]
struct Place {
    axes: [usize; 3],
    unit_mm: f64,
    inverse_time: bool,
    at: [f64; 6],
    /// G92 and G54 … in force, and the turn of the latter, rad.
    offsets: [[f64; 3]; 2],
    turn: f64,
}

impl Place {
    fn new() -> Self {
        Self {
            axes: [0, 1, 2],
            unit_mm: 1.0,
            inverse_time: false,
            at: [0.0; 6],
            offsets: [[0.0; 3]; 2],
            turn: 0.0,
        }
    }

    fn take(&mut self, call: &Call) {
        match call.name.as_str() {
            "SELECT_PLANE" => {
                self.axes = match call.text.as_str() {
                    t if t.contains("XZ") => [2, 0, 1],
                    t if t.contains("YZ") => [1, 2, 0],
                    _ => [0, 1, 2],
                }
            }
            "USE_LENGTH_UNITS" => {
                let unit = if call.text.contains("INCH") {
                    25.4
                } else {
                    1.0
                };
                let scale = self.unit_mm / unit;
                (0..3).for_each(|i| self.at[i] *= scale);
                self.unit_mm = unit;
            }
            // The tool stands still, and its place has other numbers.
            "SET_G92_OFFSET" => self.count_from(0, call.values.get(..3)),
            "SET_G5X_OFFSET" => self.count_from(1, call.values.get(1..4)),
            "SET_XY_ROTATION" => {
                let turn = call.values.first().copied().unwrap_or(0.0).to_radians();
                let (sin, cos) = (self.turn - turn).sin_cos();
                let [x, y, ..] = self.at;
                (self.at[0], self.at[1]) = (cos * x - sin * y, sin * x + cos * y);
                self.turn = turn;
            }
            "COMMENT" => self.inverse_time = call.text.contains("inverse time"),
            "STRAIGHT_FEED" | "STRAIGHT_TRAVERSE" => {
                (0..6).for_each(|i| self.at[i] = call.values.get(i).copied().unwrap_or(0.0));
            }
            "ARC_FEED" => self.at = self.end_of(call),
            _ => {}
        }
    }

    fn count_from(&mut self, which: usize, origin: Option<&[f64]>) {
        let Some([x, y, z]) = origin.and_then(|o| <[f64; 3]>::try_from(o).ok()) else {
            return;
        };
        let before = std::mem::replace(&mut self.offsets[which], [x, y, z]);
        let moved = [before[0] - x, before[1] - y];
        // G92 counts in the turned axes, the others turn about their origin.
        let (sin, cos) = if which == 1 { self.turn } else { 0.0 }.sin_cos();
        self.at[0] += cos * moved[0] + sin * moved[1];
        self.at[1] += cos * moved[1] - sin * moved[0];
        self.at[2] += before[2] - z;
    }

    fn end_of(&self, call: &Call) -> [f64; 6] {
        if !call.is_arc() {
            let value = |i: usize| call.values.get(i).copied().unwrap_or(0.0);
            return std::array::from_fn(value);
        }
        let mut end = self.at;
        let value = |i: usize| call.values.get(i).copied().unwrap_or(0.0);
        let [a, b, c] = self.axes;
        (end[a], end[b], end[c]) = (value(0), value(1), value(5));
        (0..3).for_each(|i| end[3 + i] = value(6 + i));
        end
    }

    /// Distance from the circle of an arc, mm.
    fn off(&self, arc: &Call, p: [f64; 6]) -> f64 {
        let [a, b, _] = self.axes;
        let centre = [arc.values[2], arc.values[3]];
        let end = self.end_of(arc);
        let radius = (end[a] - centre[0]).hypot(end[b] - centre[1]);
        ((p[a] - centre[0]).hypot(p[b] - centre[1]) - radius).abs() * self.unit_mm
    }
}

/// Largest correction, and what a step goes beyond it, mm.
const ASIDE_MM: f64 = 0.9;

fn distance(p: [f64; 6], q: [f64; 6]) -> f64 {
    (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt()
}

/// Distance of a point from a line, and how far along it lies, in units of its length.
fn beside(p: [f64; 6], from: [f64; 6], to: [f64; 6]) -> (f64, f64) {
    let length = distance(from, to);
    if length == 0.0 {
        return (distance(p, from), 0.0);
    }
    let along: f64 = (0..3)
        .map(|i| (p[i] - from[i]) * (to[i] - from[i]))
        .sum::<f64>()
        / length;
    let foot = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * along / length);
    (distance(p, foot), along / length)
}

/// Every call but arcs and their entries is the same, in the same order, at the same place.
///
/// # Errors
/// The first difference, in words.
pub fn compare(before: &Canon, after: &Canon, feeds_may_differ: bool) -> Result<(), String> {
    let (mut place, mut j) = (Place::new(), 0);
    let mut out = Place::new();
    let mut i = 0;
    while i < before.calls.len() {
        let call = &before.calls[i];
        // With inverse time each block has its own.
        let feeds = !(feeds_may_differ || place.inverse_time);
        if !call.is_arc() {
            let Some(other) = after.calls.get(j) else {
                return match &after.error {
                    Some(error) => Err(format!("the output stops: {error}, before {}", call.text)),
                    None => Err(format!("{} is missing", call.text)),
                };
            };
            // From the end of an arc a line may begin farther along.
            if !call.same(other) {
                return Err(format!("{} became {}", call.text, other.text));
            }
            if feeds && call.is_line() && call.feed != other.feed {
                let (was, is) = (call.feed, other.feed);
                return Err(format!("{} at a feed of {is}, not {was}", call.text));
            }
            place.take(call);
            out.take(other);
            (i, j) = (i + 1, j + 1);
            continue;
        }
        // A group of arcs, and what takes its place.
        let first = i;
        let start = place.at;
        while before.calls.get(i).is_some_and(Call::is_arc) {
            place.take(&before.calls[i]);
            i += 1;
        }
        let arcs: Vec<&Call> = before.calls[first..i].iter().collect();
        let fastest = arcs.iter().map(|a| a.feed).fold(0.0, f64::max);
        let next = before.calls.get(i);
        let next_line = next.filter(|c| c.is_line());
        let (mut pieces, mut arc_length) = (0, 0.0);
        while let Some(other) = after.calls.get(j) {
            let moves = other.is_arc() || other.is_line();
            let is_next = next_line.is_some_and(|n| n.same(other));
            if !moves || (is_next && pieces >= arcs.len()) {
                break;
            }
            // A stretch before a stop may be slower.
            if feeds && !(other.feed > 0.0 && other.feed <= fastest) {
                return Err(format!("{} at a feed of {}", other.text, other.feed));
            }
            let begin = out.at;
            let end = out.end_of(other);
            let near_arc = arcs
                .iter()
                .map(|a| place.off(a, end))
                .fold(f64::INFINITY, f64::min);
            let near_line = next_line.map_or(f64::INFINITY, |n| {
                beside(end, place.at, place.end_of(n)).0 * place.unit_mm
            });
            if near_arc.min(near_line) > ASIDE_MM {
                return Err(format!("{} lies {near_arc} mm off its arc", other.text));
            }
            arc_length += path_mm(&out, begin, other);
            out.take(other);
            (pieces, j) = (pieces + 1, j + 1);
        }
        if pieces < arcs.len() {
            return Err(match &after.error {
                Some(error) => format!("the output stops: {error}, in {}", arcs[0].text),
                None => format!("{} became nothing", arcs[0].text),
            });
        }
        let mut meant = Place { at: start, ..place };
        let mut expected = 0.0;
        // A turn with P whose ends are one but for the digits printed is a hair more than P − 1 turns, or less than P.
        let mut doubtful = vec![0.0];
        for arc in &arcs {
            let length = path_mm(&meant, meant.at, arc);
            expected += length;
            if arc.values[4].abs() > 1.0 && distance(meant.at, meant.end_of(arc)) > 0.0 {
                doubtful.push(length / arc.values[4].abs());
            }
            meant.take(arc);
        }
        let room = next_line.map_or(0.0, |n| distance(place.at, place.end_of(n)) * place.unit_mm);
        let near = |turn: &f64| {
            let meant = expected - turn;
            (0.9 * meant - 1.0..=1.1 * meant + room + 1.0).contains(&arc_length)
        };
        if !doubtful.iter().any(near) {
            return Err(format!(
                "{} of {expected} mm became {arc_length} mm",
                arcs[0].text
            ));
        }
        // What stands between two arcs acts where the first ends, which the correction moves aside.
        let still = [
            "STRAIGHT_TRAVERSE",
            "STRAIGHT_FEED",
            "ARC_FEED",
            "DWELL",
            "PROGRAM_STOP",
        ];
        let moves = before.calls[i..]
            .iter()
            .find(|c| still.contains(&c.name.as_str()));
        if !(moves.is_some_and(Call::is_arc)
            && distance(out.at, place.at) * place.unit_mm < ASIDE_MM)
        {
            check_end(&place, out.at, next_line)?;
        }
    }
    match (&before.error, &after.error) {
        (None, Some(error)) => Err(format!("the output stops: {error}")),
        _ if j < after.calls.len() && before.error.is_none() => {
            let rest = after.calls.get(j);
            rest.map_or(Ok(()), |c| Err(format!("{} is new", c.text)))
        }
        _ => Ok(()),
    }
}

/// A group of arcs ends where it ended, or farther along the line that follows.
fn check_end(place: &Place, end: [f64; 6], next_line: Option<&Call>) -> Result<(), String> {
    let off = distance(end, place.at);
    if off <= 1.5e-4 && (3..6).all(|i| (end[i] - place.at[i]).abs() <= 1.5e-4) {
        return Ok(());
    }
    if let Some(line) = next_line {
        let (aside, along) = beside(end, place.at, place.end_of(line));
        // Ends are printed to 1e-4 of a unit, of an inch as well: three of them, each off by half of that.
        if aside <= f64::max(2e-3 / place.unit_mm, 1.5e-4) && (0.0..1.0).contains(&along) {
            return Ok(());
        }
    }
    Err(format!(
        "arcs end {off} units off, at {end:?} instead of {:?}",
        place.at
    ))
}

/// Length of a feed move in its plane, mm.
fn path_mm(place: &Place, from: [f64; 6], call: &Call) -> f64 {
    let end = place.end_of(call);
    if !call.is_arc() {
        return distance(from, end) * place.unit_mm;
    }
    let [a, b, _] = place.axes;
    let centre = [call.values[2], call.values[3]];
    let angle = |p: [f64; 6]| (p[b] - centre[1]).atan2(p[a] - centre[0]);
    let radius = (end[a] - centre[0]).hypot(end[b] - centre[1]);
    let turns = call.values[4];
    let raw = (turns.signum() * (angle(end) - angle(from))).rem_euclid(std::f64::consts::TAU);
    // Printed digits: an arc of a hair less than nothing is a full turn only if its ends are one.
    // Ends printed in inches are good to 2.5 µm.
    let closed = (from[a] - end[a]).hypot(from[b] - end[b]) < 6e-3 / place.unit_mm;
    let first = if closed { std::f64::consts::TAU } else { raw };
    let small = closed && radius * place.unit_mm < 2e-2;
    if small {
        return 0.0;
    }
    (first + std::f64::consts::TAU * (turns.abs() - 1.0)) * radius * place.unit_mm
}
