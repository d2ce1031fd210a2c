//! Programs made up: what posts write, in a random order, and some of them spoilt.
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

/// The program of a seed. Every fourth is spoilt: lines lost, doubled, exchanged, a byte another one.
pub fn program(seed: u64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut writer = Writer::new(&mut random);
    writer.head();
    let parts = writer.random.random_range(3..30);
    for _ in 0..parts {
        writer.part();
    }
    writer.text.push_str("M2\n");
    let (text, subs) = (writer.text, writer.subs);
    let text = text + &subs;
    if seed % 4 == 3 {
        spoilt(text, &mut random)
    } else {
        text
    }
}

fn spoilt(text: String, random: &mut ChaCha8Rng) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..random.random_range(1..4) {
        let at = random.random_range(0..lines.len());
        let other = random.random_range(0..lines.len());
        match random.random_range(0..6) {
            0 if lines.len() > 4 => _ = lines.remove(at),
            1 => lines.insert(at, lines[other].clone()),
            2 => lines.swap(at, other),
            3 => {
                let word = [
                    "G91 ", "G20 ", "G18 ", "S5 ", "M8 ", "F77 ", "A3 ", "K2 ", "/", "G92 ",
                ];
                let word = word[random.random_range(0..word.len())];
                lines[at].insert_str(0, word);
            }
            4 => {
                let words = [
                    " S0", " M63 P1", " F100", " G40", " (x)", " ; y", " M5", " Z1", " E2", " D1",
                ];
                lines[at].push_str(words[random.random_range(0..words.len())]);
            }
            _ => {
                let letters = b"GMXYZIJKRFSPN0123456789.-[#";
                let mut bytes = lines[at].clone().into_bytes();
                if !bytes.is_empty() {
                    let place = random.random_range(0..bytes.len());
                    bytes[place] = letters[random.random_range(0..letters.len())];
                }
                lines[at] = String::from_utf8_lossy(&bytes).into_owned();
            }
        }
    }
    lines.join("\n") + "\n"
}

struct Writer<'r> {
    random: &'r mut ChaCha8Rng,
    text: String,
    /// Fanuc subprograms behind the end.
    subs: String,
    count: usize,
    at: [f64; 3],
    heading: f64,
    plane: [usize; 3],
    inch: bool,
    absolute: bool,
    absolute_centres: bool,
    inverse_time: bool,
    rotary: f64,
    /// The G-word in force, if it need not be said again.
    modal: &'static str,
    decimals: usize,
}

impl<'r> Writer<'r> {
    fn new(random: &'r mut ChaCha8Rng) -> Self {
        Self {
            random,
            text: String::new(),
            subs: String::new(),
            count: 0,
            at: [0.0; 3],
            heading: 0.0,
            plane: [0, 1, 2],
            inch: false,
            absolute: true,
            absolute_centres: false,
            inverse_time: false,
            rotary: 0.0,
            modal: "",
            decimals: 4,
        }
    }

    fn head(&mut self) {
        self.decimals = self.random.random_range(3..6);
        self.text.push_str("G21 G17 G90 G94 G91.1 G40 F3000\n");
        self.text.push_str("G0 X0 Y0 Z0\n");
    }

    fn chance(&mut self, percent: u32) -> bool {
        self.random.random_range(0..100_u32) < percent
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    fn unit(&self) -> f64 {
        if self.inch { 25.4 } else { 1.0 }
    }

    fn round(&self, v: f64) -> f64 {
        let places = self.decimals + usize::from(self.inch);
        let scale = 10_f64.powi(places as i32);
        (v * scale).round() / scale
    }

    /// A word of a length in millimetres.
    fn word(&mut self, letter: char, mm: f64) {
        let value = self.round(mm / self.unit());
        let _ = write!(self.text, " {letter}{value}");
    }

    fn part(&mut self) {
        match self.random.random_range(0..100_u32) {
            0..=29 => self.contour(),
            30..=39 => self.circle(),
            40..=49 => self.line(),
            50..=54 => self.rapid(),
            55..=57 => {
                let plane = self.random.random_range(0..3_usize);
                self.plane = [[0, 1, 2], [2, 0, 1], [1, 2, 0]][plane];
                self.text.push_str(["G17\n", "G18\n", "G19\n"][plane]);
            }
            58..=60 => {
                self.inch = !self.inch;
                let feed = if self.inch { "F110" } else { "F2800" };
                let code = if self.inch { "G20" } else { "G21" };
                let line = if self.chance(50) {
                    format!("{code}\n{feed}\n")
                } else {
                    format!("{code}\n")
                };
                self.text.push_str(&line);
            }
            61..=65 => {
                self.absolute = !self.absolute;
                self.text
                    .push_str(if self.absolute { "G90\n" } else { "G91\n" });
            }
            66..=67 => {
                self.absolute_centres = !self.absolute_centres;
                self.text.push_str(if self.absolute_centres {
                    "G90.1\n"
                } else {
                    "G91.1\n"
                });
            }
            68..=70 => {
                self.inverse_time = !self.inverse_time;
                let unit = if self.inch { "F100\n" } else { "F2500\n" };
                let line = if self.inverse_time {
                    "G93\n".into()
                } else {
                    format!("G94 {unit}")
                };
                self.text.push_str(&line);
            }
            71..=73 => self.modes_kept(),
            74..=76 => self.offsets(),
            77..=79 => self.parameters(),
            80..=83 => self.call(),
            84..=85 => self.rotary_move(),
            86..=87 => self.optional(),
            88..=89 => self.printed(),
            _ => {
                let lines = [
                    "G4 P0.05",
                    "M3 S1000",
                    "S500",
                    "M5",
                    "M8",
                    "M9",
                    "M0",
                    "M1",
                    "T1 M6",
                    "(part)",
                    "; words",
                    "M62 P1",
                    "M63 P1",
                    "M64 P2",
                    "M65 P2",
                    "M67 E1 Q5",
                    "M68 E1 Q2",
                    "G64 P0.01",
                    "G61",
                    "G64",
                    "(MSG, here)",
                    "G98",
                    "N77",
                    "",
                    "G43 H2 Z20",
                    "G49 Z5",
                    "G61.1",
                    "G64 P0.02",
                ];
                let line = lines[self.random.random_range(0..lines.len())];
                if line.starts_with("G43") || line.starts_with("G49") {
                    // Their Z is a move by the motion in force: said by a line of its own.
                    self.text.push_str(if line.starts_with("G43") {
                        "G43 H2\n"
                    } else {
                        "G49\n"
                    });
                    self.text.push_str("G90 G0 X0 Y0 Z0\n");
                    self.absolute = true;
                    (self.at, self.modal) = ([0.0; 3], "G0");
                } else {
                    self.text.push_str(line);
                    self.text.push('\n');
                }
            }
        }
    }

    fn code(&mut self, code: &'static str) {
        if self.chance(10) {
            self.count += 10;
            let _ = write!(self.text, "N{} ", self.count);
        }
        if self.modal != code || self.chance(60) {
            self.text.push_str(code);
            self.modal = code;
        }
    }

    /// Words that posts put behind a move.
    fn behind(&mut self) {
        let words = [
            " S0",
            " S300",
            " F400",
            " F2000",
            " M62 P1",
            " M63 P1",
            " M8",
            " M9",
            " M3",
            " M5",
            " (c)",
            " ; c",
            " M68 E0 Q5",
        ];
        if self.chance(25) {
            let word = words[self.random.random_range(0..words.len())];
            let feed_of_time = self.inverse_time && word.contains('F');
            if !feed_of_time {
                self.text.push_str(word);
            }
        }
        self.text.push('\n');
    }

    fn time_word(&mut self, length: f64) {
        if self.inverse_time {
            let speed = self.between(600.0, 3000.0);
            let _ = write!(self.text, " F{:.3}", speed / length.max(0.01));
        }
    }

    /// Axis words to a place in the plane; the place as the program has it.
    fn go(&mut self, to: [f64; 2], across: Option<f64>) {
        let [a, b, c] = self.plane;
        let from = self.at;
        let mut ends = [(a, to[0]), (b, to[1]), (c, across.unwrap_or(self.at[c]))].to_vec();
        if across.is_none() {
            ends.pop();
        }
        for (axis, end) in ends {
            let unit = self.unit();
            let letter = ['X', 'Y', 'Z'][axis];
            let (value, place) = if self.absolute {
                let value = self.round(end / unit);
                (value, value * unit)
            } else {
                let value = self.round((end - from[axis]) / unit);
                (value, from[axis] + value * unit)
            };
            let unchanged = (place - from[axis]).abs() < 1e-12;
            if !(unchanged && self.absolute && self.random.random_range(0..2) == 0) {
                let _ = write!(self.text, " {letter}{value}");
            }
            self.at[axis] = place;
        }
    }

    fn line(&mut self) {
        let length = self.between(0.5, 40.0);
        if self.chance(50) {
            self.heading = self.between(-PI, PI);
        }
        if self.chance(30) {
            // Along an axis.
            self.heading = f64::from(self.random.random_range(0..4)) * PI / 2.0;
        }
        self.straight(length);
    }

    fn straight(&mut self, length: f64) {
        let [a, b, c] = self.plane;
        let to = [
            self.at[a] + length * self.heading.cos(),
            self.at[b] + length * self.heading.sin(),
        ];
        let across = self.chance(8).then(|| self.at[c] + 0.5);
        self.code("G1");
        self.go(to, across);
        self.time_word(length);
        self.behind();
    }

    fn rapid(&mut self) {
        let to = [self.between(-80.0, 80.0), self.between(-80.0, 80.0)];
        self.code("G0");
        self.go(to, None);
        self.text.push('\n');
        self.heading = self.between(-PI, PI);
    }

    /// Lines and arcs that meet along their tangents.
    fn contour(&mut self) {
        for _ in 0..self.random.random_range(1..6) {
            if self.chance(40) {
                let length = self.between(1.0, 30.0);
                self.straight(length);
            } else {
                let (radius, sweep) = (self.between(2.0, 30.0), self.between(0.2, 3.0));
                let ccw = self.chance(50);
                self.arc(radius, sweep, ccw);
            }
            if self.chance(10) {
                self.text.push_str(
                    ["(between)\n", "F1500\n", "N5\n", "\n", "S100\n"]
                        [self.random.random_range(0..5)],
                );
                if self.text.ends_with("F1500\n") && self.inverse_time {
                    self.text.truncate(self.text.len() - 6);
                }
            }
        }
    }

    fn circle(&mut self) {
        let (radius, ccw) = (self.between(3.0, 25.0), self.chance(50));
        if self.chance(50) {
            self.heading = self.between(-PI, PI);
        }
        self.arc(radius, TAU, ccw);
    }

    fn arc(&mut self, radius: f64, sweep: f64, ccw: bool) {
        let [a, b, c] = self.plane;
        let side = if ccw { 1.0 } else { -1.0 };
        let full = sweep >= TAU;
        let start = [self.at[a], self.at[b]];
        let normal = [-self.heading.sin() * side, self.heading.cos() * side];
        let centre = [start[0] + radius * normal[0], start[1] + radius * normal[1]];
        let angle = (-normal[1]).atan2(-normal[0]) + side * sweep;
        let end = if full {
            start
        } else {
            [
                centre[0] + radius * angle.cos(),
                centre[1] + radius * angle.sin(),
            ]
        };
        let climb = self.chance(12).then(|| self.between(-3.0, 3.0));
        let turns = if full && self.chance(30) { 2 } else { 1 };
        self.code(if ccw { "G3" } else { "G2" });
        let across = climb.map(|d| self.at[c] + d);
        self.go(end, across);
        let by_radius = !full && self.chance(25) && sweep > 0.3 && (sweep - PI).abs() > 0.2;
        if by_radius {
            let r = if sweep > PI { -radius } else { radius };
            self.word('R', r);
        } else {
            for (slot, axis) in [a, b].into_iter().enumerate() {
                let from = if self.absolute_centres {
                    0.0
                } else {
                    start[slot]
                };
                self.word(['I', 'J', 'K'][axis], centre[slot] - from);
            }
        }
        if turns > 1 {
            let _ = write!(self.text, " P{turns}");
        }
        if self.chance(5) && !self.inch {
            self.rotary += self.between(-20.0, 20.0);
            let value = if self.absolute { self.rotary } else { 7.5 };
            self.rotary = if self.absolute {
                value
            } else {
                self.rotary + 7.5
            };
            let _ = write!(self.text, " A{value:.3}");
        }
        self.time_word(radius * sweep);
        if turns > 1 {
            self.text.push('\n');
        } else {
            self.behind();
        }
        self.heading = if full {
            self.heading
        } else {
            self.heading + side * sweep
        };
    }

    fn modes_kept(&mut self) {
        let before = (self.plane, self.absolute, self.absolute_centres);
        self.text.push_str("M70\n");
        let feed = if self.inch { "F105" } else { "F2600" };
        self.text
            .push_str(["G91\n", "G18\n", "G90.1\n", "G90\n"][self.random.random_range(0..4)]);
        if self.text.ends_with("G91\n") {
            self.absolute = false;
        } else if self.text.ends_with("G18\n") {
            self.plane = [2, 0, 1];
        } else if self.text.ends_with("G90.1\n") {
            self.absolute_centres = true;
        } else {
            self.absolute = true;
        }
        self.contour();
        (self.plane, self.absolute, self.absolute_centres) = before;
        self.text.push_str("M72\n");
        if !self.inverse_time {
            self.text.push_str(feed);
            self.text.push('\n');
        }
    }

    fn offsets(&mut self) {
        let lines = [
            "G92 X1 Y2",
            "G92.1",
            "G92.2",
            "G55",
            "G54",
            "G10 L2 P1 X3 Y4",
            "G10 L2 P1 R15",
            "G10 L2 P1 R0",
            "G53 G0 X1 Y1",
            "G28",
            "G30",
        ];
        let line = lines[self.random.random_range(0..lines.len())];
        self.text.push_str(line);
        self.text.push('\n');
        if line.contains("G0") {
            self.modal = "G0";
        }
        // Now and then nobody says where things are again.
        if self.chance(80) || !self.absolute {
            self.text.push_str("G90 G0 X0 Y0 Z0\n");
            self.absolute = true;
            (self.at, self.modal) = ([0.0; 3], "G0");
        }
    }

    fn parameters(&mut self) {
        let lines = [
            "#1=5\n",
            "#<a> = [1 + 2]\n",
            "#2 = #5420\n",
            "o77 if [#1 GT 0]\no77 endif\n",
            "o78 repeat [2]\nG4 P0.01\no78 endrepeat\n",
        ];
        let line = lines[self.random.random_range(0..lines.len())];
        self.text.push_str(line);
        if self.chance(30) {
            let absolute = self.absolute;
            self.text.push_str("#1=5\nG91 G1 X[#1] Y0\n");
            if self.inverse_time {
                self.text.truncate(self.text.len() - 1);
                self.text.push_str(" F100\n");
            }
            self.at[0] += 5.0 * self.unit();
            (self.absolute, self.modal) = (false, "G1");
            self.contour();
            if absolute {
                self.absolute = true;
                self.text.push_str("G90\n");
            }
        }
    }

    /// A subprogram with arcs, in LinuxCNC's words or in Fanuc's, called once or more.
    fn call(&mut self) {
        self.count += 1;
        let name = 100 + self.count;
        let times = self.random.random_range(1..4);
        let fanuc = self.chance(40);
        // What it draws it draws from where it is called, in increments, and in the modes in force.
        if self.inverse_time {
            return;
        }
        let outside = std::mem::take(&mut self.text);
        let (absolute, at) = (self.absolute, self.at);
        self.text.push_str("G91\n");
        (self.absolute, self.modal) = (false, "");
        self.contour();
        self.text.push_str("G90\n");
        let body = std::mem::replace(&mut self.text, outside);
        let moved = [0, 1, 2].map(|i| self.at[i] - at[i]);
        (self.absolute, self.modal) = (true, "");
        if fanuc {
            let _ = write!(self.subs, "O{name}\n{body}M99\n");
            for _ in 0..times {
                let _ = writeln!(self.text, "M98 P{name}");
            }
        } else {
            let _ = write!(self.text, "o{name} sub\n{body}o{name} endsub\n");
            for _ in 0..times {
                let _ = writeln!(self.text, "o{name} call");
                if self.chance(30) {
                    self.text.push_str("G1 X3 Y3 F2000\n");
                }
            }
        }
        self.at = [0, 1, 2].map(|i| at[i] + moved[i] * f64::from(times));
        if !absolute || self.chance(50) {
            self.text.push_str("G0 X0 Y0 Z0\n");
            (self.at, self.modal) = ([0.0; 3], "G0");
        } else {
            self.text.push_str("G0 X1 Y1 Z1\n");
            (self.at, self.modal) = ([self.unit(); 3], "G0");
        }
    }

    fn rotary_move(&mut self) {
        let value = self.between(-90.0, 90.0);
        self.code("G1");
        let _ = write!(self.text, " A{value:.2}");
        if self.inverse_time {
            self.text.push_str(" F50");
        }
        self.text.push('\n');
        self.rotary = if self.absolute {
            value
        } else {
            self.rotary + value
        };
    }

    fn optional(&mut self) {
        let lines = [
            "/G4 P0.1\n",
            "/M8\n",
            "/(c)\n",
            "/S5\n",
            "/G0 X1 Y1\nG0 X0 Y0 Z0\n",
        ];
        let line = lines[self.random.random_range(0..lines.len())];
        if line.contains("G0") && !self.absolute {
            return;
        }
        self.text.push_str(line);
        if line.contains("G0") {
            (self.at, self.modal) = ([0.0; 3], "G0");
        }
    }

    /// Many short arcs of one size, as converters write them.
    fn printed(&mut self) {
        let (radius, ccw) = (self.between(4.0, 12.0), self.chance(50));
        for _ in 0..self.random.random_range(2..6) {
            self.arc(radius, 0.7, ccw);
        }
    }
}
