//! Lines of a RAPID module as motions.
use super::super::arc::through;
use super::super::left::{Because, Code, Left};
use super::super::state::{Action, Arc, FeedMode, Modes, Plane, Straight};
use super::data::{Data, Target};
use super::instruction::{arguments, code};

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

/// Where the robot stands.
#[derive(Clone, Debug, PartialEq)]
struct Stand {
    target: Target,
    tool: String,
}

/// State of the reading.
#[derive(Default)]
pub(super) struct Reader {
    data: Data,
    stand: Option<Stand>,
    blocked: Option<Left>,
    /// What made the place unknown last.
    lost: Option<Because>,
    line: usize,
}

/// Heights that differ by less are one plane, mm.
const FLAT_MM: f64 = 1e-3;
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
                self.data.declare(trimmed);
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
        let via = self.data.target(list.first()?)?.place;
        Some([start, via, self.data.target(list.get(1)?)?.place])
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
                target: self.data.target(list.get(skip)?)?,
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

    fn straight(&mut self, text: &str) -> Read {
        let Some(list) = arguments(text, "MoveL").filter(|a| a.len() == 4) else {
            self.lose("a line that is not plain");
            return Read::of(Action::Other);
        };
        let stops = list[2].eq_ignore_ascii_case("fine");
        let before = self.stand.take();
        let stand = self.data.target(&list[0]).map(|target| Stand {
            target,
            tool: list[3].clone(),
        });
        self.lose("a place that only the controller knows");
        self.stand = stand;
        let feed_mm_s = self.data.speed(&list[1]).map_or(f64::NAN, |(v, _)| v);
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
        let target = self.data.target(to);
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
        let (Some(via), Some(end)) = (self.data.target(via), target) else {
            return lost(Left::Expression);
        };
        let because = match &before {
            Some(_) => Some(self.because(Code::Named("another tool or frame"))),
            None => self.lost,
        };
        let Some(Stand { target: start, .. }) = before.filter(|b| b.tool == *tool) else {
            return lost(Left::UnknownPosition(because));
        };
        let Some((feed_mm_s, other_speeds)) = self.data.speed(speed) else {
            let name = Code::Named("a speed that only the controller knows");
            return lost(Left::UnknownFeed(Some(self.because(name))));
        };
        let arc = match flat_arc(&start, &via, &end, feed_mm_s) {
            Ok(arc) => arc,
            Err(left) => return lost(left),
        };
        let motion = Motion {
            to: to.clone(),
            speed: speed.clone(),
            other_speeds,
            zone: zone.clone(),
            tool: tool.clone(),
            height: end.place[2].to_string(),
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

/// The arc through three targets in one height and with one orientation.
fn flat_arc(start: &Target, via: &Target, end: &Target, feed_mm_s: f64) -> Result<Arc, Left> {
    if start.pose != end.pose {
        return Err(Left::Orientation);
    }
    let aside = |t: &Target| (t.place[2] - end.place[2]).abs() > FLAT_MM;
    if aside(start) || aside(via) {
        return Err(Left::OtherPlane);
    }
    let [start, via, end] = [start, via, end].map(|t| [t.place[0], t.place[1]]);
    let (centre, sweep_rad) = through(start, via, end).ok_or(Left::Geometry)?;
    Ok(Arc {
        plane: Plane::Xy,
        start,
        end,
        centre,
        radius_mm: (start[0] - centre[0]).hypot(start[1] - centre[1]),
        sweep_rad,
        lift: None,
        shared: [None; 4],
        exact_stop: None,
        feed_mm_s,
        feed_word: feed_mm_s,
        modes: Modes {
            inch: false,
            absolute: true,
            absolute_centres: false,
            feed_mode: FeedMode::PerMinute,
        },
    })
}
