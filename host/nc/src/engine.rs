//! From lines to corrected lines, a few at a time.
//!
//! What becomes of an arc depends on the arcs and lines that it meets, no further than the next line or stop on either side.
//! So lines are held back up to there and let go; a program of any length needs the memory of its longest chain of arcs.
use super::blend::{self, Piece};
use super::correct::{Law, Plan, Visit, decide};
use super::emit::Writer;
use super::flow::{Order, order};
use super::inverse::Inverse;
use super::lead::{self, FreeSide, Leads, Led};
use super::state::{Action, Arc, Reading, State};
use super::word::{self, CIP_TENTHS, Line, Sort, Word};
use super::{Fate, Left, Options, Report};
use giotto::model_file::ModelFile;
use std::collections::{BTreeMap, HashSet};
use std::io;

/// Lines of one chain of arcs that are held back at most.
const LONGEST_CHAIN: usize = 20_000;
/// Shortest block, mm: a thousand times the last digit.
const LEAST_MM: f64 = 0.01;
/// Last stretch of an arc whose offset ends inside it, mm.
const TAIL_MM: f64 = 0.02;

/// Where lines go: its index, its text with what became of it. `None` for the text: as it was.
pub(super) type Sink<'s> =
    dyn FnMut(&Line<'_>, usize, Option<&[u8]>, Option<Fate>) -> io::Result<()> + 's;

/// Holds back the lines that are not decided yet.
struct Engine<'a> {
    law: Law<'a>,
    writer: Writer,
    window: Vec<Visit<'a>>,
    /// Lines of the window that are let go already.
    gone: usize,
    /// What the last comment names.
    free_side: Option<FreeSide>,
}

impl<'a> Engine<'a> {
    fn push(&mut self, mut visit: Visit<'a>, sink: &mut Sink<'_>) -> io::Result<()> {
        if self.law.options.leads == Leads::ByName {
            let comment = visit.line.text.iter().any(|b| matches!(b, b'(' | b';'));
            if comment {
                self.free_side = Leads::named(visit.line.text);
            }
            visit.free_side = self.free_side;
        }
        self.keep_through(&visit.line);
        let wall = visit.is_wall();
        self.window.push(visit);
        if wall {
            self.release(self.window.len() - 1, sink)?;
        } else if self.window.len() > LONGEST_CHAIN {
            let last = self.window.len() - 1;
            if self.window[last].twin.is_some() {
                self.window[last].twin = Some(Err(Left::LongChain));
            } else {
                self.window[last].action = Action::Other;
            }
            self.release(last, sink)?;
        }
        Ok(())
    }

    /// A block without a code of its own goes on with the `CIP` before it, which has to stay in force then.
    fn keep_through(&mut self, line: &Line<'_>) {
        let moves = |line: &Line<'_>| line.has_any(b"XYZIJKijk");
        if !moves(line) || line.words.iter().any(Word::is_motion) {
            return;
        }
        if let Some(before) = self.window.iter_mut().rfind(|v| moves(&v.line))
            && before.line.has_g(&[CIP_TENTHS])
            && before.twin.is_some()
        {
            before.twin = Some(Err(Left::Dialect("CIP of Siemens that stays in force")));
        }
    }

    /// Decides what is held back and lets go of all before `keep`.
    fn release(&mut self, keep: usize, sink: &mut Sink<'_>) -> io::Result<()> {
        if self.window.iter().all(|v| v.twin.is_none()) {
            for visit in &self.window[self.gone..keep] {
                sink(&visit.line, visit.index, None, None)?;
            }
        } else {
            let plans = decide(&mut self.window, &self.law);
            let mut text = Vec::new();
            let planned = self.window.iter().zip(&plans).enumerate();
            for (at, (visit, plan)) in planned.take(keep).skip(self.gone) {
                match (&visit.action, plan) {
                    (Action::Arc(arc), Some(Ok(plan))) => {
                        let arc = from_its_start(arc);
                        let (plan, pieces, led) = self.run_of(at, &arc, plan);
                        text.clear();
                        self.writer
                            .arc(&visit.line, &arc, &plan, &pieces, &mut text);
                        let fate = plan.fate(&arc, &pieces, led);
                        sink(&visit.line, visit.index, Some(&text), Some(fate))?;
                    }
                    (_, plan) => {
                        let fate = plan.as_ref().and_then(|p| p.as_ref().err());
                        sink(&visit.line, visit.index, None, fate.map(|l| Fate::Left(*l)))?;
                    }
                }
            }
        }
        self.window.drain(..keep);
        self.gone = 0;
        Ok(())
    }

    /// The blocks of the arc of a visit, with leads where they are asked for and needed.
    fn run_of(&self, at: usize, arc: &Arc, plan: &Plan) -> (Plan, Vec<Piece>, Led) {
        let leads = self.law.options.leads;
        let plain = |led| {
            let pieces = blend::pieces(arc, plan.twin.delta_mm, plan.entry, plan.exit);
            (*plan, pieces, led)
        };
        if leads == Leads::No || !lead::needed(arc, plan) {
            return plain(Led::Not);
        }
        let Some(side) = leads.side(self.window[at].free_side) else {
            return plain(Led::SideUnknown);
        };
        let moves = |v: &&Visit<'_>| v.line.has_any(b"XYZIJKR");
        let next = self.window[at + 1..].iter().find(moves);
        let own_code = next.is_some_and(|v| v.line.words.iter().any(Word::is_motion));
        match lead::lead(arc, plan, &self.law, side, own_code) {
            Some(lead) => (lead.plan, lead.pieces, Led::Tangent),
            None => plain(Led::NoRoom),
        }
    }

    fn finish(mut self, sink: &mut Sink<'_>) -> io::Result<()> {
        self.release(self.window.len(), sink)
    }
}

/// Increments are the same wherever they begin: to the last digit if they are counted from the start of the arc.
fn from_its_start(arc: &Arc) -> Arc {
    if arc.modes.absolute || arc.modes.absolute_centres {
        return *arc;
    }
    let moved = |p: [f64; 2]| [p[0] - arc.start[0], p[1] - arc.start[1]];
    Arc {
        start: [0.0; 2],
        end: moved(arc.end),
        centre: moved(arc.centre),
        lift: arc.lift.map(|[from, to]| [0.0, to - from]),
        ..*arc
    }
}

/// How to read a program whose calls are followed or not.
pub(super) fn reading(program: &[u8], options: &Options, followed: bool) -> Reading {
    let siemens = word::is_siemens(program);
    Reading {
        absolute_centres: options.absolute_centres,
        printer: options.printer,
        harmless: options.harmless.as_slice().into(),
        followed,
        siemens,
    }
}

fn line_end(program: &[u8]) -> &'static [u8] {
    match memchr::memchr(b'\n', program) {
        Some(at) if at > 0 && program[at - 1] == b'\r' => b"\r\n",
        _ => b"\n",
    }
}

/// Reads a program and gives its lines to `sink`, in order, corrected.
pub(super) fn run(
    program: &[u8],
    model: &ModelFile,
    options: &Options,
    sink: &mut Sink<'_>,
) -> io::Result<()> {
    let inverse = Inverse::new(model, options);
    match order(program) {
        Order::Straight => {
            let mut engine = Engine::new(program, &inverse, options);
            let mut state = State::new(reading(program, options, false));
            for (index, line) in word::lines(program).enumerate() {
                let action = state.step(index + 1, &line);
                let visit = Visit::new(index, line, action, &engine.law);
                engine.push(visit, sink)?;
            }
            engine.finish(sink)
        }
        Order::Followed(order) => followed(program, &order, &inverse, options, sink),
    }
}

impl<'a> Engine<'a> {
    fn new(program: &[u8], inverse: &'a Inverse, options: &'a Options) -> Self {
        Self {
            law: Law {
                inverse,
                options,
                least_mm: LEAST_MM,
                tail_mm: TAIL_MM,
            },
            writer: Writer::new(line_end(program)),
            window: Vec::new(),
            gone: 0,
            free_side: None,
        }
    }
}

/// A line as one of its calls has it.
type Written = (Option<Vec<u8>>, Option<Fate>);

/// A program whose calls were followed: a line is rewritten where every call gives it the same text.
fn followed(
    program: &[u8],
    order: &[usize],
    inverse: &Inverse,
    options: &Options,
    sink: &mut Sink<'_>,
) -> io::Result<()> {
    let lines: Vec<Line<'_>> = word::lines(program).collect();
    let mut refused: HashSet<usize> = HashSet::new();
    let written = loop {
        let mut written: BTreeMap<usize, Written> = BTreeMap::new();
        let mut differ = HashSet::new();
        let mut engine = Engine::new(program, inverse, options);
        let mut state = State::new(reading(program, options, true));
        let mut keep = |_: &Line<'_>, index: usize, text: Option<&[u8]>, fate: Option<Fate>| {
            let text = text.map(<[u8]>::to_vec);
            match written.get(&index) {
                Some((before, _)) if *before != text => _ = differ.insert(index),
                Some(_) => {}
                None => _ = written.insert(index, (text, fate)),
            }
            Ok(())
        };
        for &index in order {
            let line = lines[index].clone();
            let action = state.step(index + 1, &line);
            let mut visit = Visit::new(index, line, action, &engine.law);
            if refused.contains(&index) && visit.twin.is_some() {
                visit.twin = Some(Err(Left::CallsDiffer));
            }
            engine.push(visit, &mut keep)?;
        }
        engine.finish(&mut keep)?;
        if differ.is_empty() {
            break written;
        }
        refused.extend(differ);
    };
    for (index, line) in lines.iter().enumerate() {
        match written.get(&index) {
            Some((text, fate)) => sink(line, index, text.as_deref(), *fate)?,
            None => sink(line, index, None, not_reached(line))?,
        }
    }
    Ok(())
}

fn not_reached(line: &Line<'_>) -> Option<Fate> {
    let arc = matches!(line.sort, Sort::Plain | Sort::Optional)
        && line
            .words
            .iter()
            .any(|w| w.letter == b'G' && matches!(w.tenths(), 20 | 30))
        && line.has_any(b"XYZIJKR");
    arc.then_some(Fate::Left(Left::NotReached))
}

/// Keeps reports beside whatever else is done with the lines.
pub(super) fn report(arcs: &mut Vec<Report>, index: usize, fate: Option<Fate>) {
    arcs.extend(fate.map(|fate| Report {
        line: index + 1,
        fate,
    }));
}
