//! Lines of a RAPID module as motions.
use super::super::arc::through;
use super::super::left::{Because, Code, Left};
use super::super::state::{Action, Arc, FeedMode, Modes, Plane, Straight};
use std::collections::HashMap;

/// What a line does, and how it is written if it is an arc that may be rewritten.
pub(super) struct Read {
    pub(super) action: Action,
    pub(super) motion: Option<Motion>,
    /// The robot stands still at its end.
    pub(super) stops: bool,
}

/// The words of a `MoveC`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Motion {
    pub(super) to: String,
    pub(super) speed: String,
    /// The speeds beside that of the tool point: orientation, external axes.
    pub(super) other_speeds: String,
    pub(super) zone: String,
    pub(super) tool: String,
    pub(super) height: String,
    /// Orientation, configuration and external axes.
    pub(super) pose: String,
    /// Byte of the line behind its semicolon.
    pub(super) rest: usize,
}

/// A robtarget.
#[derive(Clone, Debug, PartialEq)]
struct Target {
    place: [f64; 3],
    pose: String,
}

/// Where the robot stands.
#[derive(Clone, Debug, PartialEq)]
struct Stand {
    target: Target,
    tool: String,
}

/// State of the reading.
#[derive(Default)]
pub(super) struct Reader {
    targets: HashMap<String, Target>,
    speeds: HashMap<String, [String; 2]>,
    stand: Option<Stand>,
    blocked: Option<Left>,
    /// What made the place unknown last.
    lost: Option<Because>,
    line: usize,
}

/// Heights that differ by less are one plane, mm.
const FLAT_MM: f64 = 1e-3;
/// The predefined speeds v5 … v7000, mm/s.
const PREDEFINED: [u32; 25] = [
    5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500,
    3000, 4000, 5000, 6000, 7000,
];
/// What goes with a predefined speed.
const PREDEFINED_REST: &str = "500,5000,1000";

impl Read {
    fn of(action: Action) -> Self {
        Self {
            action,
            motion: None,
            stops: false,
        }
    }
}

impl Reader {
    /// Takes one line.
    pub(super) fn step(&mut self, line: &[u8]) -> Read {
        self.line += 1;
        let Ok(text) = std::str::from_utf8(code(line)) else {
            // Latin-1 outside comments: a name or a string that is none of ours.
            self.lose("what stands there");
            return Read::of(Action::Other);
        };
        let trimmed = text.trim();
        let first = trimmed
            .split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .next()
            .unwrap_or_default();
        match first.to_ascii_uppercase().as_str() {
            "" if trimmed.is_empty() => Read::of(Action::Nothing),
            "MODULE" | "ENDMODULE" | "PERS" | "VAR" | "TASK" | "RECORD" | "ENDRECORD" | "ALIAS" => {
                Read::of(Action::Nothing)
            }
            "CONST" | "LOCAL" => {
                self.declare(trimmed);
                Read::of(Action::Nothing)
            }
            "PROC" | "ENDPROC" | "FUNC" | "ENDFUNC" | "TRAP" | "ENDTRAP" => {
                (self.stand, self.blocked, self.lost) = (None, None, None);
                Read::of(Action::Other)
            }
            "CONFL" | "CONFJ" | "SINGAREA" | "ACCSET" | "TPWRITE" | "TPERASE" => {
                Read::of(Action::Nothing)
            }
            // The robot may stand still here and is where it was afterwards.
            "STOP" | "WAITTIME" | "WAITDI" | "WAITDO" | "WAITROB" => Read::of(Action::Stop),
            "SETDO" | "SET" | "RESET" | "PULSEDO" | "SETAO" | "SETGO" => Read::of(Action::Other),
            // What follows is run at once or not at all, from where the robot stands.
            "IF" | "TEST" | "GOTO" | "RETURN" => {
                self.may_move(trimmed);
                Read::of(Action::Other)
            }
            // Here several ways meet.
            "ELSE" | "ELSEIF" | "ENDIF" | "FOR" | "ENDFOR" | "WHILE" | "ENDWHILE" | "CASE"
            | "DEFAULT" | "ENDTEST" | "ERROR" | "UNDO" => {
                self.lose("a branch or loop");
                Read::of(Action::Other)
            }
            "VELSET" if trimmed[6..].trim().starts_with("100,") => {
                self.blocked = None;
                Read::of(Action::Other)
            }
            "VELSET" | "SPEEDREFRESH" => {
                let name = Code::Named(if first.eq_ignore_ascii_case("VelSet") {
                    "VelSet"
                } else {
                    "SpeedRefresh"
                });
                self.blocked = Some(Left::UnknownFeed(Some(self.because(name))));
                Read::of(Action::Other)
            }
            "MOVEL" => self.straight(trimmed),
            "MOVEC" => match self.arc(text) {
                Ok(read) => read,
                Err(left) => {
                    self.lose("an arc that is not plain");
                    Read::of(Action::LostArc(left))
                }
            },
            name => self.other(name, trimmed),
        }
    }

    /// The three points of a plain MoveC, as far as they are known.
    pub(super) fn points(&self, line: &[u8]) -> Option<[[f64; 3]; 3]> {
        let text = std::str::from_utf8(code(line)).ok()?.trim();
        let list = arguments(
            text.get(..5)
                .filter(|n| n.eq_ignore_ascii_case("MoveC"))
                .map(|_| text)?,
            "MoveC",
        )?;
        let start = self.stand.as_ref()?.target.place;
        let via = self.target(list.first()?)?.place;
        Some([start, via, self.target(list.get(1)?)?.place])
    }

    fn because(&self, code: Code) -> Because {
        Because {
            line: self.line,
            code,
        }
    }

    fn lose(&mut self, what: &'static str) {
        (self.stand, self.lost) = (None, Some(self.because(Code::Named(what))));
    }

    /// `IF ready MoveL p1, …;` in one line moves or does not.
    fn may_move(&mut self, text: &str) {
        if text.ends_with(';') && !text.to_ascii_uppercase().starts_with("GOTO") {
            self.lose("what is run on a condition");
        }
    }

    /// Instructions that are not rewritten, but whose end may be known.
    fn other(&mut self, name: &str, text: &str) -> Read {
        // Words of the family, of its arcs, and where its tool stands among the arguments.
        let straight = ["MOVELDO", "MOVELAO", "MOVELGO", "MOVELSYNC"].contains(&name);
        let triggered = name == "TRIGGL";
        let welded = ["ARCL", "ARCLSTART", "ARCLEND", "ARCLS", "ARCLE"].contains(&name);
        let circle = [
            ("MOVEC", "MoveC with a signal or a call"),
            ("TRIGGC", "TriggC"),
            ("ARCC", "ArcC, whose speed stands in its weld data"),
            ("PROCC", "ProcC"),
            ("DISPC", "DispC, whose speed stands in its bead data"),
            ("PAINTC", "PaintC"),
            ("CAPC", "CapC"),
            ("SEARCHC", "SearchC"),
        ]
        .into_iter()
        .find(|(family, _)| name.starts_with(family));
        let to = |skip: usize, tool: usize, from_end: bool| {
            let list = arguments(text, &text[..name.len()])?;
            let tool = if from_end {
                list.len().checked_sub(1)?
            } else {
                tool
            };
            Some(Stand {
                target: self.target(list.get(skip)?)?,
                tool: list.get(tool)?.clone(),
            })
        };
        if let Some((_, words)) = circle {
            // The end is the second argument.
            let stand = if name.starts_with("ARCC") {
                to(1, 6, false)
            } else {
                None
            };
            self.lose("an instruction that is not rewritten");
            self.stand = stand;
            return Read::of(Action::LostArc(Left::Dialect(words)));
        }
        match name {
            "MOVEJ" => {
                let stand = to(0, 3, false);
                self.lose("MoveJ to a place that only the controller knows");
                self.stand = stand;
                Read::of(Action::Other)
            }
            _ if straight || triggered || welded => {
                let stand = to(0, if welded { 5 } else { 3 }, triggered);
                let stops = arguments(text, &text[..name.len()])
                    .is_none_or(|list| list.iter().any(|a| a.eq_ignore_ascii_case("fine")));
                let before = self.stand.take();
                self.lose("an instruction that is not rewritten");
                self.stand = stand;
                Read {
                    stops,
                    ..self.passed(before, false, None)
                }
            }
            _ if text.ends_with(':') => {
                self.lose("a label");
                Read::of(Action::Other)
            }
            _ if text.contains(":=") && !text.contains('(') => Read::of(Action::Nothing),
            // A call, or what is not known: it may move the robot.
            _ => {
                self.lose("a call or an instruction that is not known");
                Read::of(Action::Other)
            }
        }
    }

    /// A line from `before` to where the robot stands now.
    fn passed(&self, before: Option<Stand>, bare: bool, feed_mm_s: Option<f64>) -> Read {
        let Some(now) = &self.stand else {
            return Read::of(Action::Other);
        };
        let before = before.filter(|b| b.tool == now.tool);
        Read::of(Action::Line(Straight {
            start: before.map_or([None; 3], |b| b.target.place.map(Some)),
            end: now.target.place.map(Some),
            absolute: true,
            bare,
            feed_mm_s,
        }))
    }

    /// `CONST robtarget name := [...];` or `CONST speeddata name := [...];`
    fn declare(&mut self, text: &str) {
        let Some((left, right)) = text.split_once(":=") else {
            return;
        };
        let words: Vec<&str> = left.split_whitespace().collect();
        let literal = right.trim().trim_end_matches(';').trim();
        let [kind, name] = match words[..] {
            [c, kind, name] if c.eq_ignore_ascii_case("CONST") => [kind, name],
            [l, c, kind, name]
                if l.eq_ignore_ascii_case("LOCAL") && c.eq_ignore_ascii_case("CONST") =>
            {
                [kind, name]
            }
            _ => return,
        };
        let name = name.to_ascii_lowercase();
        if kind.eq_ignore_ascii_case("robtarget") {
            if let Some(target) = literal_target(literal) {
                self.targets.insert(name, target);
            }
        } else if kind.eq_ignore_ascii_case("speeddata")
            && let Some(speed) = literal_speed(literal)
        {
            self.speeds.insert(name, speed);
        }
    }

    fn target(&self, text: &str) -> Option<Target> {
        let offset = text
            .get(..5)
            .filter(|head| head.eq_ignore_ascii_case("Offs("))
            .and_then(|head| text[head.len()..].strip_suffix(')'));
        if text.starts_with('[') {
            literal_target(text)
        } else if let Some(inside) = offset {
            let (base, by) = inside.split_once(',')?;
            let by: Option<Vec<f64>> = by
                .split(',')
                .map(|n| n.parse().ok().filter(|v: &f64| v.is_finite()))
                .collect();
            let by: [f64; 3] = by?.try_into().ok()?;
            let mut target = self.targets.get(&base.to_ascii_lowercase()).cloned()?;
            (0..3).for_each(|i| target.place[i] += by[i]);
            Some(target)
        } else {
            self.targets.get(&text.to_ascii_lowercase()).cloned()
        }
    }

    /// Speed of the tool point, mm/s, and the words for the other speeds.
    fn speed(&self, text: &str) -> Option<(f64, String)> {
        let (name, own) = match text.split_once('\\') {
            Some((name, switch)) => {
                let (key, value) = switch.split_once(":=")?;
                let value = key
                    .trim()
                    .eq_ignore_ascii_case("V")
                    .then(|| value.trim().parse::<f64>().ok())??;
                (name.trim(), Some(value))
            }
            None => (text, None),
        };
        let [v, rest] = if name.starts_with('[') {
            literal_speed(name)?
        } else if let Some(found) = self.speeds.get(&name.to_ascii_lowercase()) {
            found.clone()
        } else {
            let digits = name.strip_prefix(['v', 'V'])?;
            let v: u32 = digits.parse().ok().filter(|v| PREDEFINED.contains(v))?;
            [v.to_string(), PREDEFINED_REST.to_owned()]
        };
        let v = own.or_else(|| v.parse().ok())?;
        (v > 0.0).then_some((v, rest))
    }

    fn straight(&mut self, text: &str) -> Read {
        let Some(list) = arguments(text, "MoveL").filter(|a| a.len() == 4) else {
            self.lose("a line that is not plain");
            return Read::of(Action::Other);
        };
        let stops = list[2].eq_ignore_ascii_case("fine");
        let before = self.stand.take();
        let stand = self.target(&list[0]).map(|target| Stand {
            target,
            tool: list[3].clone(),
        });
        self.lose("a place that only the controller knows");
        self.stand = stand;
        let feed_mm_s = self.speed(&list[1]).map_or(f64::NAN, |(v, _)| v);
        Read {
            stops,
            ..self.passed(before, true, Some(feed_mm_s))
        }
    }

    fn arc(&mut self, text: &str) -> Result<Read, Left> {
        let trimmed = text.trim();
        let list = arguments(trimmed, "MoveC")
            .filter(|a| a.len() == 5)
            .ok_or(Left::Expression)?;
        let [via, to, speed, zone, tool] = [&list[0], &list[1], &list[2], &list[3], &list[4]];
        let before = self.stand.take();
        let target = self.target(to);
        self.stand = target.clone().map(|target| Stand {
            target,
            tool: tool.clone(),
        });
        let stops = zone.eq_ignore_ascii_case("fine");
        let lost = |left| {
            Ok(Read {
                stops,
                ..Read::of(Action::LostArc(left))
            })
        };
        if let Some(left) = self.blocked {
            return lost(left);
        }
        let (Some(via), Some(end)) = (self.target(via), target) else {
            return lost(Left::Expression);
        };
        let because = match &before {
            Some(_) => Some(self.because(Code::Named("another tool or frame"))),
            None => self.lost,
        };
        let Some(Stand { target: start, .. }) = before.filter(|b| b.tool == *tool) else {
            return lost(Left::UnknownPosition(because));
        };
        let Some((feed_mm_s, other_speeds)) = self.speed(speed) else {
            return lost(Left::UnknownFeed(None));
        };
        if start.pose != end.pose {
            return lost(Left::Orientation);
        }
        let height = end.place[2];
        if [&start, &via]
            .iter()
            .any(|t| (t.place[2] - height).abs() > FLAT_MM)
        {
            return lost(Left::OtherPlane);
        }
        let flat = |t: &Target| [t.place[0], t.place[1]];
        let Some((centre, sweep_rad)) = through(flat(&start), flat(&via), flat(&end)) else {
            return lost(Left::Geometry);
        };
        let radius_mm = (start.place[0] - centre[0]).hypot(start.place[1] - centre[1]);
        let modes = Modes {
            inch: false,
            absolute: true,
            absolute_centres: false,
            feed_mode: FeedMode::PerMinute,
        };
        let arc = Arc {
            plane: Plane::Xy,
            start: flat(&start),
            end: flat(&end),
            centre,
            radius_mm,
            sweep_rad,
            lift: None,
            shared: [None; 4],
            exact_stop: None,
            feed_mm_s,
            feed_word: feed_mm_s,
            modes,
        };
        let motion = Motion {
            to: to.clone(),
            speed: speed.clone(),
            other_speeds,
            zone: zone.clone(),
            tool: tool.clone(),
            height: height.to_string(),
            pose: end.pose,
            rest: text.rfind(';').map_or(text.len(), |at| at + 1),
        };
        Ok(Read {
            action: Action::Arc(arc),
            motion: Some(motion),
            stops,
        })
    }
}

/// A line without its comment and its end; marks in strings are no comments.
fn code(line: &[u8]) -> &[u8] {
    let mut inside = false;
    let end = line.iter().position(|b| {
        inside ^= *b == b'"';
        *b == b'!' && !inside
    });
    line[..end.unwrap_or(line.len())].trim_ascii_end()
}

/// The arguments of a single instruction, blanks around and inside literals taken out.
fn arguments(text: &str, name: &str) -> Option<Vec<String>> {
    let body = text.get(name.len()..)?.strip_suffix(';')?;
    if !body.starts_with(char::is_whitespace) || body.contains([';', '"']) {
        return None;
    }
    let (mut depth, mut list) = (0, vec![String::new()]);
    for c in body.chars().filter(|c| !c.is_whitespace()) {
        match c {
            '[' | '(' => depth += 1,
            ']' | ')' => depth -= 1,
            ',' if depth == 0 => {
                list.push(String::new());
                continue;
            }
            _ => {}
        }
        list.last_mut()?.push(c);
    }
    (depth == 0).then_some(list)
}

fn literal_target(text: &str) -> Option<Target> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let inner = text.strip_prefix("[[")?.strip_suffix("]]")?;
    let (place, rest) = inner.split_once("],")?;
    let numbers: Option<Vec<f64>> = place
        .split(',')
        .map(|n| n.parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    let place = numbers?.try_into().ok()?;
    let pose = format!("{rest}]");
    // Four numbers of orientation, four of configuration, six of external axes.
    let counts: Vec<usize> = pose
        .split("],[")
        .map(|part| {
            part.trim_matches(['[', ']'])
                .split(',')
                .filter(|n| n.parse::<f64>().is_ok())
                .count()
        })
        .collect();
    (counts == [4, 4, 6]).then_some(Target { place, pose })
}

fn literal_speed(text: &str) -> Option<[String; 2]> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let (v, rest) = text.strip_prefix('[')?.strip_suffix(']')?.split_once(',')?;
    let all = std::iter::once(v).chain(rest.split(','));
    (all.clone().count() == 4 && all.clone().all(|n| n.parse::<f64>().is_ok()))
        .then(|| [v.into(), rest.into()])
}
