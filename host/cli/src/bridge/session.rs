//! One session: the socket, Ctrl-C, what is shown while it runs, what is said at its end.
use crate::destination::{Destination, Kind};
use crate::failure::cannot_write;
use crate::{Failure, Output, interrupt};
use giotto::whole_file;
use giotto_bridge::record::Record;
use giotto_bridge::{Counters, Door, Phase, socket};
use serde_json::json;
use std::io::{self, Write};
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::atomic::Ordering::Relaxed;
use std::time::{Duration, Instant};

/// Between two looks of a person at a terminal, and between two lines elsewhere.
const LOOK: Duration = Duration::from_millis(500);
const LINE: Duration = Duration::from_secs(10);

/// What a session is told.
pub(super) struct Session<'a> {
    pub(super) name: &'static str,
    pub(super) listen: SocketAddr,
    pub(super) robot: Option<SocketAddr>,
    pub(super) patience: Duration,
    pub(super) record: Option<&'a Path>,
    pub(super) table: &'a Path,
}

/// What is known at its end.
struct Ended {
    robot: Option<SocketAddr>,
    interrupted: bool,
    largest_mm: f64,
    seconds: f64,
    rows: u64,
}

impl Session<'_> {
    pub(super) fn run(&self, mut door: Door, out: Output) -> Result<(), Failure> {
        let record = Destination::maybe(self.record, Kind::Csv, &[self.table])?;
        let socket = UdpSocket::bind(self.listen).map_err(|error| {
            Failure::controller(format_args!(
                "{}: cannot listen there: {error}",
                self.listen
            ))
            .help("another program may have the port; choose one with --listen")
        })?;
        let listen = socket.local_addr().unwrap_or(self.listen);
        out.note(format_args!("listening on {listen}"));
        let failed = |error: io::Error| Failure::controller(format_args!("{listen}: {error}"));
        let ended = match &record {
            None => self
                .guide(&socket, &mut door, &mut io::sink(), out)
                .map_err(failed)?,
            Some(place) => {
                let mut ended = None;
                whole_file::with(place.path(), |file| {
                    ended = Some(self.guide(&socket, &mut door, file, out)?);
                    Ok(())
                })
                .map_err(|error| cannot_write(place.path(), &error))?;
                ended.ok_or_else(|| Failure::input("nothing was recorded"))?
            }
        };
        self.tell(&door, listen, &ended, out)
    }

    /// Guides the robot.
    fn guide(
        &self,
        socket: &UdpSocket,
        door: &mut Door,
        file: &mut dyn Write,
        out: Output,
    ) -> io::Result<Ended> {
        let wish = interrupt::listen();
        let began = Instant::now();
        let mut live = Live::new(out);
        let mut record = Record::begin(file)?;
        let (mut largest_mm, mut lost) = (0.0f64, Ok(()));
        let robot = socket::guide(socket, door, self.robot, &mut |door| {
            if let Some(measured) = door.measured_mm().filter(|_| lost.is_ok()) {
                lost = record.take(measured);
            }
            let size = door
                .correction_mm()
                .iter()
                .map(|c| c * c)
                .sum::<f64>()
                .sqrt();
            largest_mm = largest_mm.max(size);
            live.show(door);
            let tired = door.counters().received == 0 && began.elapsed() > self.patience;
            !wish.load(Relaxed) && !tired && lost.is_ok()
        })?;
        live.done();
        lost?;
        let rows = record.rows();
        record.end()?;
        let seconds = began.elapsed().as_secs_f64();
        Ok(Ended {
            robot,
            interrupted: wish.load(Relaxed),
            largest_mm,
            seconds,
            rows,
        })
    }

    /// Counts as words or as one document; then whether it was a session at all.
    fn tell(
        &self,
        door: &Door,
        listen: SocketAddr,
        ended: &Ended,
        out: Output,
    ) -> Result<(), Failure> {
        let counters = door.counters();
        let record = self.record.map(|path| path.display().to_string());
        if out.json {
            out.document(&json!({
                "door": self.name,
                "listen": listen.to_string(),
                "robot": ended.robot.map(|robot| robot.to_string()),
                "seconds": ended.seconds,
                "latency_s": door.latency_s(),
                "largest_correction_mm": ended.largest_mm,
                "received": counters.received,
                "answered": counters.answered,
                "lost": counters.lost,
                "late": counters.late,
                "reordered": counters.reordered,
                "held": counters.held,
                "limited": counters.limited,
                "malformed": counters.malformed,
                "missed_by_robot": door.missed(),
                "refused": match door.phase() { Phase::Refused(words) => Some(words), _ => None },
                "record": record.as_ref().map(|file| json!({ "file": file, "rows": ended.rows })),
            }))?;
        } else if counters.received > 0 {
            out.say(format_args!("{}: {}", self.name, words(counters)));
            out.say(format_args!(
                "largest correction {:.3} mm, latency {:.0} ms, {:.1} s",
                ended.largest_mm,
                1e3 * door.latency_s(),
                ended.seconds
            ));
            if let Some(missed) = door.missed().filter(|missed| *missed > 0) {
                out.say(format_args!(
                    "the robot counts {missed} answers as late or missing"
                ));
            }
            if let Some(file) = &record {
                out.say(format_args!("{} places in {file}", ended.rows));
            }
        }
        match door.phase() {
            Phase::Refused(words) => Err(Failure::controller(words)
                .help("what to check first is on the guide's page on robots")),
            _ if counters.received == 0 && ended.interrupted => {
                Err(Failure::interrupted("no robot was heard until then"))
            }
            _ if counters.received == 0 => Err(Failure::controller(format_args!(
                "no robot was heard on {listen} in {:.0} s",
                self.patience.as_secs_f64()
            ))
            .help("check its remote address and port, the firewall, and that its program runs")),
            _ => Ok(()),
        }
    }
}

fn words(counters: &Counters) -> String {
    format!(
        "{} received, {} answered, {} lost, {} late, {} out of order, {} held, {} limited, {} unreadable",
        counters.received,
        counters.answered,
        counters.lost,
        counters.late,
        counters.reordered,
        counters.held,
        counters.limited,
        counters.malformed
    )
}

/// What is shown while it runs: a line that changes on a terminal, a line now and then elsewhere.
struct Live {
    out: Output,
    bar: indicatif::ProgressBar,
    last: Instant,
    waits: Option<&'static str>,
}

impl Live {
    fn new(out: Output) -> Self {
        Self {
            out,
            bar: out.spinner("waiting for the robot"),
            last: Instant::now(),
            waits: None,
        }
    }

    fn show(&mut self, door: &Door) {
        if let Phase::Waiting(why) = door.phase()
            && *why != self.waits
        {
            self.waits = *why;
            if let Some(why) = why {
                self.out.note(format_args!("waiting: {why}"));
            }
        }
        let due = if self.out.draws() { LOOK } else { LINE };
        if self.last.elapsed() < due || door.counters().received == 0 {
            return;
        }
        self.last = Instant::now();
        let [x, y, z] = door.correction_mm();
        let line = format!(
            "{}; correction {x:.3} {y:.3} {z:.3} mm",
            words(door.counters())
        );
        if self.out.draws() {
            self.bar.set_message(line);
        } else {
            self.out.note(line);
        }
    }

    fn done(&self) {
        self.bar.finish_and_clear();
    }
}
