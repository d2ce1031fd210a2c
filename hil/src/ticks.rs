//! Instructions of one tick, counted by the emulator, and what the image takes.
use crate::elf;
use giotto_link::emulator::program;
use giotto_link::image::{self, Board};
use giotto_link::{ControllerError, OpenOptions, Port, circle, open};
use giotto_shared::Direction;
use giotto_shared::model::Cumulants;
use giotto_shared::table::{
    self, Limits, MAX_IMAGE_BYTES, MAX_TERMS, MAX_ZONES, Table, Travel, Zone,
};
use giotto_shared::term::Term;
use std::collections::BTreeMap;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Profile terms of the extended case, reversal pulses among them.
pub const TERMS: usize = 8;
/// How long the emulator may take, by the clock: a guard against a hang, not a measurement.
const PATIENCE: Duration = Duration::from_secs(120);

/// Smallest and largest count of each case.
pub type Counts = BTreeMap<String, (u32, u32)>;

/// What the image takes, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize {
    /// Flash.
    pub text: u32,
    /// Variables and the deepest stack.
    pub ram: u32,
    /// The deepest stack.
    pub stack: u32,
}

/// Most instructions that a kind of tick may take: β model, eight profile terms, stream, and all that the timer interrupt does in a
/// run; in the one tick of a run in which a stop begins, and on its way to rest after that, no more than there are between two ticks
/// at the most that the emulated board bears, 8 kHz on 25 MHz; an arm corrected by its joints a fifth of a millisecond of the F405's
/// 168 MHz.
const BARS: [(&str, u32); 7] = [
    ("arc_beta", 300),
    ("arc_extended", 450),
    ("stream", 250),
    ("interrupt", 1000),
    ("arm", 33_600),
    ("interrupt_stop", 3125),
    ("interrupt_stopping", 3125),
];

/// The bar of a kind of tick, if it has one.
pub fn bar(name: &str) -> Option<u32> {
    BARS.iter()
        .find(|(barred, _)| *barred == name)
        .map(|(_, bar)| *bar)
}

/// Kinds of tick that are over their bar, or were not counted.
pub fn over(counts: &Counts) -> Vec<&'static str> {
    let over =
        |(name, bar): &&(&'static str, u32)| counts.get(*name).is_none_or(|(_, most)| most > bar);
    BARS.iter().filter(over).map(|(name, _)| *name).collect()
}

fn emulator(reason: impl ToString) -> ControllerError {
    ControllerError::Emulator {
        reason: reason.to_string(),
    }
}

fn parse(text: &str) -> Option<Counts> {
    let mut counts = Counts::new();
    for line in text.lines() {
        if line == "end" {
            return Some(counts);
        }
        let mut words = line.split(' ');
        let (name, least, most) = (
            words.next()?,
            words.next()?.parse().ok()?,
            words.next()?.parse().ok()?,
        );
        counts.insert(name.to_owned(), (least, most));
    }
    None
}

/// Counts the instructions of the ticks of all cases.
///
/// # Errors
/// [`ControllerError::NoImage`], [`ControllerError::Emulator`].
pub fn count(note: &mut dyn FnMut(&str)) -> Result<Counts, ControllerError> {
    let image = image::ensure(Board::Ticks, note)?;
    let folder = tempfile::tempdir().map_err(emulator)?;
    let output = folder.path().join("uart0");
    let mut process = Command::new(program())
        .args([
            "-machine",
            Board::Ticks.machine(),
            "-display",
            "none",
            "-monitor",
            "none",
        ])
        .args(["-icount", "shift=10,sleep=off", "-kernel"])
        .arg(&image)
        .args(["-serial", &format!("file:{}", output.display())])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|_| ControllerError::NoEmulator { program: program() })?;
    let started = Instant::now();
    let counts = loop {
        let text = std::fs::read_to_string(&output).unwrap_or_default();
        if let Some(counts) = parse(&text) {
            break Ok(counts);
        }
        if text.contains("failed") || started.elapsed() > PATIENCE {
            break Err(emulator("the count did not come to its end"));
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    let _ = process.kill();
    let _ = process.wait();
    counts
}

/// The largest table there is.
pub fn largest_table() -> Vec<u8> {
    let mut table = Table::empty();
    table.limits = Limits {
        offset_m: 2e-3,
        slew_m_s: 0.1,
    };
    let mut zone = Zone {
        place_m: Some([[-1.0; 3], [1.0; 3]]),
        radius_m: [0.05, 0.3],
        feed_m_s: [0.02, 0.7],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 46.58e-6,
            kappa4_s4: -5.53e-6,
        },
        terms: heapless_terms(),
    };
    while !table.zones.is_full() {
        zone.radius_m[0] += 1e-3;
        if table.zones.push(zone.clone()).is_err() {
            break;
        }
    }
    debug_assert_eq!(table.zones.len(), MAX_ZONES);
    while table.machine.push('m').is_ok() {}
    let mut bytes = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap_or(0);
    bytes.truncate(length);
    bytes
}

fn heapless_terms() -> giotto_shared::table::Terms {
    let spike = Term::ReversalSpike {
        actuator: giotto_shared::Actuator::X,
        peak_m: 2e-6,
        decay_s: 0.02,
    };
    std::iter::repeat_n(spike, MAX_TERMS).collect()
}

/// Boots the image, gives it the largest table and a run, and reads how deep its stack went.
///
/// # Errors
/// Any [`ControllerError`].
pub fn image_size(note: &mut dyn FnMut(&str)) -> Result<ImageSize, ControllerError> {
    let path = image::ensure(Board::Mps2An386, note)?;
    let size = elf::size(&path).map_err(emulator)?;
    let mut controller = open(&Port::Qemu, &OpenOptions::default(), note)?;
    controller.flash(&largest_table(), &mut |_| {})?;
    controller.run_circle(&circle(0.1, 0.5, Direction::Ccw, 1), 1)?;
    // The board looks at its stack a few times a second.
    for _ in 0..600 {
        controller.status()?;
    }
    let stack = controller.status()?.stack_bytes;
    Ok(ImageSize {
        text: size.text,
        ram: size.variables + stack,
        stack,
    })
}
