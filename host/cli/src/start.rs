//! `giotto start`: the first time, by questions: files, what was programmed, a provisional verdict, one recommendation.
use super::analyze::show_runs;
use super::destination::quoted;
use super::failure::{Failure, plain};
use super::output::Output;
use super::paragraph::sentence;
use super::source::{length, tell};
use giotto::analysis;
use giotto::campaign::import::{self, Format, Options as Import};
use giotto::campaign::{self, Campaign, Direction};
use giotto::diagnosis::{Action, Diagnosis, Options, diagnose};
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Arguments of `giotto start`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Directory of the campaign that the answers go into; asked for if left out.
    #[arg(short, long, value_name = "CAMPAIGN")]
    output: Option<PathBuf>,
}

/// Most files that are proposed by number.
const PROPOSED: usize = 9;

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let stdin = std::io::stdin();
    let asked = stdin.is_terminal() && std::io::stderr().is_terminal();
    if !asked || out.json || out.non_interactive {
        return Err(Failure::usage("giotto start asks questions and needs a terminal").help(
            "without one: giotto import FILE --radius MM --feed MM_S --direction ccw|cw -o CAMPAIGN, once for each circle, then giotto diagnose CAMPAIGN",
        ));
    }
    let mut dialogue = Dialogue {
        lines: stdin.lock(),
    };
    dialogue.tell(
        "The classic test is a pair of circles: one counter-clockwise, one clockwise. Enter takes what stands in \
         [brackets]; Ctrl-C leaves, and what was brought in until then stays.",
    );
    let folder = match args.output {
        Some(folder) => folder,
        None => dialogue.folder()?,
    };
    let mut last = Last::default();
    while let Some(file) = dialogue.file(&last)? {
        let options = dialogue.options(&last)?;
        match import::add(std::slice::from_ref(&file), &folder, &options, &|_, _| {}) {
            Ok(added) => {
                added.iter().for_each(|a| tell(a, &options, out));
                last.take(&options, added.last().map(|a| a.direction), file);
            }
            Err(error) => {
                let help = error.help();
                dialogue.tell(&plain(&error.to_string()));
                dialogue.tell(&plain(&format!("{help}. Once more, with other answers:")));
            }
        }
    }
    if last.files.is_empty() {
        return Err(Failure::usage("no circle was brought in").help("giotto start begins again"));
    }
    verdict(&folder, out)
}

/// What was answered last: the usual answer to the next question.
#[derive(Default)]
struct Last {
    radius_mm: Option<f64>,
    feed_mm_s: Option<f64>,
    direction: Option<Direction>,
    files: Vec<PathBuf>,
}

impl Last {
    fn take(&mut self, options: &Import, direction: Option<Direction>, file: PathBuf) {
        self.radius_mm = Some((options.radius_m * 1e9).round() / 1e6);
        self.feed_mm_s = Some((options.feed_m_s * 1e9).round() / 1e6);
        self.direction = direction;
        self.files.push(file);
    }

    /// After a circle one way comes the one the other way.
    fn next_way(&self) -> &'static str {
        match self.direction {
            Some(Direction::Ccw) => "cw",
            _ => "ccw",
        }
    }
}

/// Questions on stderr, answers from the terminal.
struct Dialogue<L> {
    lines: L,
}

impl<L: BufRead> Dialogue<L> {
    fn tell(&self, words: &str) {
        let text = super::paragraph::wrapped(words, 0);
        let _ = writeln!(std::io::stderr(), "{text}");
    }

    /// One answer; an empty one is the usual.
    fn ask(&mut self, question: &str, usual: Option<&str>) -> Result<String, Failure> {
        let usual_text = usual.map_or_else(String::new, |u| format!(" [{u}]"));
        let mut stderr = std::io::stderr();
        // A terminal that takes no words takes no answer either.
        let _ = write!(stderr, "{question}{usual_text}? ");
        let _ = stderr.flush();
        let mut line = String::new();
        if self.lines.read_line(&mut line).unwrap_or(0) == 0 {
            let _ = writeln!(stderr);
            return Err(Failure::interrupted("left before the end of the questions")
                .help("giotto start begins again; a campaign that was begun is gone on with"));
        }
        let answer = line.trim();
        Ok(match (answer, usual) {
            ("", Some(usual)) => usual.to_owned(),
            _ => answer.to_owned(),
        })
    }

    /// Asks until `understand` understands.
    fn until<T>(
        &mut self,
        question: &str,
        usual: Option<&str>,
        understand: impl Fn(&str) -> Result<T, String>,
    ) -> Result<T, Failure> {
        loop {
            let answer = self.ask(question, usual)?;
            match understand(&answer) {
                Ok(value) => return Ok(value),
                Err(why) if answer.is_empty() => self.tell(&why),
                Err(why) if why.starts_with(&answer) => self.tell(&why),
                Err(why) => self.tell(&format!("{answer}: {why}")),
            }
        }
    }

    fn folder(&mut self) -> Result<PathBuf, Failure> {
        self.until("Directory for the campaign", Some("campaign"), |answer| {
            let path = PathBuf::from(answer);
            let own = path.join("campaign.toml").is_file();
            let empty = std::fs::read_dir(&path).is_ok_and(|mut inside| inside.next().is_none());
            if own || empty || !path.exists() {
                Ok(path)
            } else {
                Err("exists and is no campaign; give another name".to_owned())
            }
        })
    }

    /// The next file; `None`: no more. What is no measurement is said at once.
    fn file(&mut self, last: &Last) -> Result<Option<PathBuf>, Failure> {
        let found = measurements(&last.files);
        for (k, file) in found.iter().enumerate() {
            let _ = writeln!(std::io::stderr(), "  {} {}", k + 1, file.display());
        }
        let question = match (found.is_empty(), last.files.is_empty()) {
            (true, true) => "File of a measured circle",
            (false, true) => "File of a measured circle, or its number",
            (true, false) => "File of the next circle (Enter: no more)",
            (false, false) => "File of the next circle, or its number (Enter: no more)",
        };
        self.until(question, None, |answer| {
            if answer.is_empty() && !last.files.is_empty() {
                return Ok(None);
            }
            let numbered = answer
                .parse()
                .ok()
                .and_then(|k: usize| found.get(k.wrapping_sub(1)));
            let file = numbered
                .cloned()
                .unwrap_or_else(|| PathBuf::from(unquoted(answer)));
            if last.files.contains(&file) {
                return Err(
                    "is in the campaign already; give the file of another circle".to_owned(),
                );
            }
            match import::recognise(&file, Format::Auto, None) {
                Ok(_) => Ok(Some(file)),
                Err(error) => Err(plain(&format!("{error}; {}", error.help()))),
            }
        })
    }

    /// What was programmed.
    fn options(&mut self, last: &Last) -> Result<Import, Failure> {
        let number = |answer: &str| length(&answer.replace(',', "."));
        let usual = |v: Option<f64>| v.map(|v| v.to_string());
        let radius = usual(last.radius_mm);
        let radius = self.until("Programmed radius, mm", radius.as_deref(), number)?;
        let feed = usual(last.feed_mm_s);
        let feed = self.until("Programmed feed, mm/s", feed.as_deref(), number)?;
        let way = Some(last.next_way());
        let direction = self.until("Direction, ccw or cw", way, super::source::direction)?;
        let machine = if last.files.is_empty() {
            let name = self.ask("Name of the machine", Some("machine"))?;
            Some(name)
        } else {
            None
        };
        Ok(Import {
            machine,
            ..Import::of_circle(radius * 1e-3, feed * 1e-3, direction)
        })
    }
}

/// Tables in this directory that look like measurements and are not in the campaign yet.
fn measurements(taken: &[PathBuf]) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(".").into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries
        .filter(|entry| entry.path().is_file())
        .map(|entry| PathBuf::from(entry.file_name()))
        .filter(|file| !taken.contains(file))
        .filter(|file| {
            let end = file.extension().and_then(|e| e.to_str()).unwrap_or("");
            ["csv", "txt", "log"].contains(&end.to_ascii_lowercase().as_str())
                && import::recognise(file, Format::Auto, None).is_ok()
        })
        .collect();
    found.sort();
    found.truncate(PROPOSED);
    found
}

/// A path as a shell or a file manager pastes it.
fn unquoted(answer: &str) -> &str {
    let inside = |quote: char| {
        answer
            .strip_prefix(quote)
            .and_then(|a| a.strip_suffix(quote))
    };
    inside('\'').or_else(|| inside('"')).unwrap_or(answer)
}

/// Analyses and diagnoses what was brought in: figures, a provisional verdict, one thing to do.
fn verdict(folder: &Path, out: Output) -> Result<(), Failure> {
    let (campaign, notes) = campaign::read_with_notes(folder)?;
    notes.iter().for_each(|note| out.note(note));
    let refused = |reason: &dyn std::fmt::Display| {
        Failure::input(format_args!("{}: {reason}", folder.display())).help(format_args!(
            "see what the runs hold: giotto analyze {}",
            quoted(folder)
        ))
    };
    let report = analysis::of_campaign(&campaign).map_err(|(_, error)| refused(&error))?;
    let diagnosis = diagnose(&campaign, &Options::default()).map_err(|error| refused(&error))?;
    out.say("");
    show_runs(&report, out);
    out.say("");
    let [circle, cause, _] = giotto_report::sentences(&campaign, &diagnosis);
    out.tell(0, circle);
    out.tell(0, cause);
    next(&campaign, &diagnosis, folder, out);
    Ok(())
}

/// One thing to do, with the command for it.
fn next(campaign: &Campaign, d: &Diagnosis, folder: &Path, out: Output) {
    let name = quoted(folder);
    if let Some(first) = d.findings.first() {
        out.tell(0, sentence(&first.remedy));
    }
    let ways = |way| campaign.runs.iter().any(|run| run.direction == way);
    if !(ways(Direction::Ccw) && ways(Direction::Cw)) {
        out.tell(
            0,
            "Next: measure the same circle the other way round: what flips with the direction cannot be told from geometry without it.",
        );
        out.say(format_args!("  giotto start -o {name}"));
        return;
    }
    out.tell(0, format_args!("Next: {}.", d.recommendation.words));
    let command = match d.recommendation.action {
        Action::Measure => format!("giotto plan {name} --gcode measure.nc"),
        _ => format!("giotto diagnose {name}"),
    };
    out.say(format_args!("  {command}"));
}
