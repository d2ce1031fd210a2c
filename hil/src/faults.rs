//! A link that breaks bytes on purpose: flip, drop, duplicate, delay, truncate, split, join, burst. Seeded.
use crate::ticks::largest_table;
use giotto_link::flash::Verdict;
use giotto_link::link::Link;
use giotto_link::virtual_controller::VirtualLink;
use giotto_link::{Controller, ControllerError, Segment, Step};
use giotto_shared::table::{self, MAX_IMAGE_BYTES};
use giotto_shared::wire::{Command, MotionState};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// How often it is asked which table is in use, if the link breaks the answers.
const QUESTIONS: usize = 100;

/// A way to break a piece of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Fault {
    /// One bit changed.
    Flip,
    /// One byte lost.
    Drop,
    /// The piece twice.
    Duplicate,
    /// The piece after the next one.
    Delay,
    /// The end of the piece lost.
    Truncate,
    /// A zero in the middle: two frames of one.
    Split,
    /// The closing zero lost: one frame of two.
    Join,
    /// A run of noise in front.
    Burst,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Flip,
        Self::Drop,
        Self::Duplicate,
        Self::Delay,
        Self::Truncate,
        Self::Split,
        Self::Join,
        Self::Burst,
    ];
}

/// What has passed and what was broken, both ways.
#[derive(Debug, Default)]
pub struct Tally {
    pieces: AtomicU64,
    to_controller: AtomicU64,
    broken: [AtomicU64; Fault::ALL.len()],
}

impl Tally {
    /// Pieces that passed, broken or not.
    pub fn pieces(&self) -> u64 {
        self.pieces.load(Relaxed)
    }

    /// Those of them that hold a frame for the controller.
    pub fn frames_sent(&self) -> u64 {
        self.to_controller.load(Relaxed)
    }

    /// Pieces broken, by kind.
    pub fn broken(&self) -> [(Fault, u64); Fault::ALL.len()] {
        std::array::from_fn(|kind| (Fault::ALL[kind], self.broken[kind].load(Relaxed)))
    }
}

/// What breaks pieces of one direction.
#[derive(Debug)]
struct Breaker {
    random: ChaCha8Rng,
    share: f64,
    delayed: Vec<u8>,
    tally: Arc<Tally>,
}

impl Breaker {
    fn new(seed: u64, share: f64, tally: Arc<Tally>) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
            share,
            delayed: Vec::new(),
            tally,
        }
    }

    /// A place in the piece.
    fn place(&mut self, piece: &[u8]) -> usize {
        self.random.random_range(0..piece.len().max(1))
    }

    fn pass(&mut self, piece: &[u8]) -> Vec<u8> {
        self.tally.pieces.fetch_add(1, Relaxed);
        let mut out = piece.to_vec();
        let held = std::mem::take(&mut self.delayed);
        if !piece.is_empty() && self.random.random_bool(self.share) {
            let at = self.place(piece);
            let kind = self.random.random_range(0..Fault::ALL.len());
            self.tally.broken[kind].fetch_add(1, Relaxed);
            match Fault::ALL[kind] {
                Fault::Flip => out[at] ^= 1 << self.random.random_range(0..8),
                Fault::Drop => drop(out.remove(at)),
                Fault::Duplicate => out.extend_from_slice(piece),
                Fault::Delay => self.delayed = std::mem::take(&mut out),
                Fault::Truncate => out.truncate(at),
                Fault::Split => out.insert(at, 0),
                Fault::Join => out.retain(|byte| *byte != 0),
                Fault::Burst => {
                    let mut noise = vec![0; self.random.random_range(1..400)];
                    self.random.fill_bytes(&mut noise);
                    noise.append(&mut out);
                    out = noise;
                }
            }
        }
        out.extend(held);
        out
    }
}

/// A link with faults in both directions.
pub struct FaultyLink<L> {
    inner: L,
    to_controller: Breaker,
    to_host: Breaker,
    pending: VecDeque<u8>,
}

impl<L: Link> FaultyLink<L> {
    /// Breaks `share` of the pieces that pass, each way.
    pub fn new(inner: L, seed: u64, share: f64) -> Self {
        let tally = Arc::new(Tally::default());
        let breaker = |seed| Breaker::new(seed, share, Arc::clone(&tally));
        Self {
            inner,
            to_controller: breaker(seed),
            to_host: breaker(!seed),
            pending: VecDeque::new(),
        }
    }

    /// The counts, which go on while the link is in use.
    pub fn tally(&self) -> Arc<Tally> {
        Arc::clone(&self.to_host.tally)
    }
}

impl<L: Link> Link for FaultyLink<L> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        // The zero that a client sends before a frame is a piece, but no frame.
        let frame = u64::from(bytes.len() > 1);
        self.to_controller
            .tally
            .to_controller
            .fetch_add(frame, Relaxed);
        let broken = self.to_controller.pass(bytes);
        self.inner.send(&broken)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        while self.pending.is_empty() {
            let mut piece = [0; 4096];
            let count = self.inner.receive(&mut piece, until)?;
            if count == 0 {
                return Ok(0);
            }
            // Several replies may have come at once: each frame is a piece.
            for frame in piece[..count].split_inclusive(|byte| *byte == 0) {
                let broken = self.to_host.pass(frame);
                self.pending.extend(broken);
            }
        }
        let count = buffer.len().min(self.pending.len());
        for (to, from) in buffer.iter_mut().zip(self.pending.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}

/// What came of flashing over a link that breaks what passes.
#[derive(Debug)]
pub struct Report {
    /// Tables flashed.
    pub flashes: u64,
    /// Flashes that were given up, and begun anew.
    pub retries: u64,
    /// Requests repeated.
    pub repeats: u32,
    /// Times that a table was in use that is neither the old nor the new one.
    pub wrong: u64,
    /// What passed.
    pub tally: Arc<Tally>,
}

/// The largest table, with a number for its name.
fn table(number: u64) -> Vec<u8> {
    let mut image = largest_table();
    let Ok(mut table) = table::decode(&image) else {
        return image;
    };
    table.machine = number.to_string().chars().collect();
    image.resize(MAX_IMAGE_BYTES, 0);
    let length = table::encode(&table, &mut image).unwrap_or(0);
    image.truncate(length);
    image
}

/// A program of its own for each number: out and back on a line, an arc and a helix.
fn program(number: u64) -> Vec<Step> {
    let x = 0.01 + 0.001 * (number % 20) as f64;
    let arc = |sweep_rad, rise_m| {
        let (centre_m, normal) = ([x, 0.01, 0.0], [0.0, 0.0, 1.0]);
        Segment::Arc {
            centre_m,
            normal,
            sweep_rad,
            rise_m,
            feed_m_s: 0.3,
        }
    };
    let line = |to_m| Segment::Line {
        to_m,
        feed_m_s: 0.3,
    };
    let segments = [
        line([x, 0.0, 0.0]),
        arc(2.0, 0.002),
        arc(-2.0, -0.002),
        line([0.0; 3]),
        arc(0.5, 0.0),
    ];
    segments
        .map(|segment| Step {
            segment,
            tolerance_m: 0.0,
        })
        .to_vec()
}

/// What came of programs over a link that breaks what passes.
#[derive(Debug)]
pub struct ProgramReport {
    /// Programs run to the end that the host foretold, to the nanometre.
    pub programs: u64,
    /// Programs that ended elsewhere though every segment was accepted.
    pub astray: u64,
    /// Programs that the host gave up.
    pub given_up: u64,
    /// Requests repeated.
    pub repeats: u32,
    /// What passed.
    pub tally: Arc<Tally>,
}

/// Runs one program after the other until so many frames have been sent to the virtual controller, and looks where each ends.
///
/// # Errors
/// Those of opening the session.
pub fn programs_over_faults(
    frames: u64,
    share: f64,
    seed: u64,
) -> Result<ProgramReport, ControllerError> {
    let link = FaultyLink::new(VirtualLink::new(), seed, share);
    let tally = link.tally();
    let mut controller = Controller::connect(Box::new(link), "sim with faults", 1)?;
    // A disturbed line is not a dead one.
    controller.supervise(None)?;
    let mut report = ProgramReport {
        programs: 0,
        astray: 0,
        given_up: 0,
        repeats: 0,
        tally,
    };
    while report.tally.frames_sent() < frames {
        let sent = controller.send_program(&program(report.programs));
        if sent.is_err() {
            // Half a program: it ends somewhere, within limits.
            let _ = controller.command(Command::Stop);
        }
        let ended = loop {
            controller.listen(Duration::from_millis(100))?;
            match controller.status() {
                Ok(status) if matches!(status.motion, MotionState::Idle | MotionState::Fault) => {
                    break status.raw_nm;
                }
                _ => {}
            }
        };
        match sent {
            Ok(expected) if expected == ended => report.programs += 1,
            Ok(_) => report.astray += 1,
            Err(_) => report.given_up += 1,
        }
    }
    report.repeats = controller.repeats();
    Ok(report)
}

/// Flashes one table after the other until so many frames have been sent to the virtual controller, and looks after each
/// which table is in use.
///
/// # Errors
/// Those of opening the session.
pub fn flash_over_faults(frames: u64, share: f64, seed: u64) -> Result<Report, ControllerError> {
    let link = FaultyLink::new(VirtualLink::new(), seed, share);
    let tally = link.tally();
    let mut controller = Controller::connect(Box::new(link), "sim with faults", 1)?;
    let mut report = Report {
        flashes: 0,
        retries: 0,
        repeats: 0,
        wrong: 0,
        tally,
    };
    let mut good: Option<Vec<u8>> = None;
    while report.tally.frames_sent() < frames {
        let new = table(report.flashes);
        match controller.flash(&new, &mut |_| {}) {
            Ok(_) => {
                report.flashes += 1;
                good = Some(new.clone());
            }
            Err(_) => report.retries += 1,
        }
        let mut verdict = |image| (0..QUESTIONS).find_map(|_| controller.verify(image).ok());
        let verdicts: Vec<_> = good
            .iter()
            .chain([&new])
            .map(|image| verdict(image))
            .collect();
        let same = verdicts
            .iter()
            .any(|verdict| matches!(verdict, Some(Verdict::Same { .. })));
        let unknown = verdicts.iter().all(Option::is_none);
        let none_yet = good.is_none() && verdicts.contains(&Some(Verdict::None));
        report.wrong += u64::from(!(same || unknown || none_yet));
    }
    report.repeats = controller.repeats();
    Ok(report)
}
