//! A whole controller on the host: server, store, planner and tick, as on a board.
use super::watch::Watch;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use giotto_firmware::control::{Desk, Job, Receiver, SEGMENTS, SET_POINTS, Sender, Shared, Tick};
use giotto_firmware::engine::{Config, Executor, Output, Planner};
use giotto_firmware::server::{Board, Buffers, Motion, Server, TimedSetPoint};
use giotto_firmware::store::{
    Layout,
    ram::{RamFlash, RamFlashError},
};
use giotto_shared::table::{self, MAX_IMAGE_BYTES, bounds};
use giotto_shared::wire::{
    ClockSource, FromController, MAX_FRAME, MotionState, Pose, PositionState, ResetCause, Status,
    crc32,
};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

const SLOT: usize = 2048;
const ERASE: usize = 512;
/// Bytes of the flash.
pub const FLASH: usize = 2 * SLOT + ERASE;
const LAYOUT: Layout = Layout::new([0, SLOT as u32], SLOT as u32).with_key(2 * SLOT as u32);
/// Slow ticks: a move is as long in seconds, and takes a fourth of the ticks of the boards.
pub const TICK_HZ: u32 = 250;
const BOARD: Board = Board {
    name: "fuzz",
    build: "0",
    tick_hz: TICK_HZ,
    clock: ClockSource::Crystal,
    reset: ResetCause::Power,
    machine: [0; 12],
    step: [[1, 1]; 3],
    bears: |_| Ok(()),
};

/// Its flash.
pub struct Flash {
    cells: Box<RamFlash<FLASH, ERASE>>,
    /// How often something was erased or programmed.
    changes: u32,
}

impl Flash {
    /// Erased.
    pub fn new() -> Self {
        Self {
            cells: Box::default(),
            changes: 0,
        }
    }

    /// The cells, to fill.
    pub fn bytes_mut(&mut self) -> &mut [u8; FLASH] {
        self.cells.bytes_mut()
    }
}

impl ErrorType for Flash {
    type Error = RamFlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), RamFlashError> {
        self.cells.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        FLASH
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = RamFlash::<FLASH, ERASE>::WRITE_SIZE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), RamFlashError> {
        self.changes += 1;
        self.cells.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), RamFlashError> {
        self.changes += 1;
        self.cells.write(offset, bytes)
    }
}

/// The message in a frame, which must be whole and alone. Written anew, not that of the wire.
pub fn message_in(frame: &[u8]) -> FromController {
    let mut content = [0; MAX_FRAME];
    let mut length = 0;
    let (code, rest) = frame.split_first().expect("a frame is not empty");
    assert_ne!(*code, 0, "only the end of a frame is zero");
    let (end, rest) = rest.split_last().expect("a frame has an end");
    assert_eq!(*end, 0, "a frame ends with zero");
    // A code says how many bytes follow up to the next one, which stands for a zero unless the run was the longest.
    let (mut left, mut zero) = (code - 1, *code != u8::MAX);
    for &byte in rest {
        assert_ne!(byte, 0, "only the end of a frame is zero");
        if left > 0 {
            content[length] = byte;
            length += 1;
            left -= 1;
        } else {
            // The content holds zeros already.
            length += usize::from(zero);
            (left, zero) = (byte - 1, byte != u8::MAX);
        }
    }
    assert_eq!(left, 0, "the last run of a frame is whole");
    let (payload, crc) = content[..length]
        .split_last_chunk()
        .expect("a frame has a CRC");
    assert_eq!(u32::from_le_bytes(*crc), crc32(payload), "its CRC holds");
    postcard::from_bytes(payload).expect("a message can be read")
}

/// A queue whose two ends are in one thread.
struct Queue<T>(Rc<RefCell<VecDeque<T>>>, usize);

impl<T> Queue<T> {
    fn new(capacity: usize) -> (Self, Self) {
        let things = Rc::new(RefCell::new(VecDeque::with_capacity(capacity)));
        (Self(Rc::clone(&things), capacity), Self(things, capacity))
    }
}

impl<T: Copy> Sender<T> for Queue<T> {
    fn send(&mut self, thing: &T) -> bool {
        let mut things = self.0.borrow_mut();
        let room = things.len() < self.1;
        if room {
            things.push_back(*thing);
        }
        room
    }

    fn waiting(&self) -> usize {
        self.0.borrow().len()
    }
}

impl<T> Receiver<T> for Queue<T> {
    fn receive(&mut self) -> Option<T> {
        self.0.borrow_mut().pop_front()
    }

    fn look<R>(&mut self, look: impl FnOnce(&T) -> R) -> Option<R> {
        self.0.borrow().front().map(look)
    }

    fn discard(&mut self) {
        self.0.borrow_mut().pop_front();
    }

    fn waiting(&self) -> usize {
        self.0.borrow().len()
    }
}

type BenchDesk = Desk<Box<Planner>, Rc<Shared>, Queue<Job>, Queue<TimedSetPoint>>;
type BenchTick = Tick<Rc<Shared>, Queue<Job>, Queue<TimedSetPoint>>;

/// The controller.
pub struct Bench {
    server: Server<Flash, BenchDesk, Box<Buffers>>,
    tick: BenchTick,
    shared: Rc<Shared>,
    last_nm: Option<[i32; 3]>,
    /// Every tick is made, also those of a rest.
    pub thorough: bool,
    /// Slot and changes of the flash of the table looked at last.
    checked: Option<(u8, u32)>,
    /// Set-points are looked at one by one, by the watch.
    pub watched: bool,
    watch: Watch,
}

impl Bench {
    /// Boots with what is in the flash.
    pub fn boot(flash: Flash) -> Self {
        Self::boot_at(flash, [0; 3], PositionState::Known)
    }

    /// The same, its machine standing somewhere.
    fn boot_at(flash: Flash, place_nm: Pose, known: PositionState) -> Self {
        let config = Config::robot(BOARD.tick_hz);
        let shared = Rc::new(Shared::new());
        let (segments_in, segments_out) = Queue::new(SEGMENTS);
        let (points_in, points_out) = Queue::new(SET_POINTS);
        shared.stands(place_nm, known);
        let planner = Box::new(Planner::new(&config, place_nm));
        let desk = Desk::new(planner, Rc::clone(&shared), segments_in, points_out);
        let executor = Executor::new(place_nm, config.engage_ticks(), true);
        Self {
            server: Server::boot(BOARD, flash, LAYOUT, desk, Box::default()),
            tick: Tick::new(executor, Rc::clone(&shared), segments_out, points_in),
            shared,
            last_nm: None,
            thorough: false,
            checked: None,
            watched: false,
            watch: Watch::default(),
        }
    }

    /// Who looks at the set-points.
    pub fn watch(&mut self) -> &mut Watch {
        &mut self.watch
    }

    /// What it is doing.
    pub fn state(&mut self) -> MotionState {
        self.server.motion_mut().snapshot().state
    }

    /// Takes a byte from the link; the reply it completed, if any.
    pub fn receive(&mut self, byte: u8) -> Option<&[u8]> {
        self.server.receive(byte)
    }

    /// The stop input.
    pub fn set_stop_input(&self, active: bool) {
        self.shared.set_stop_input(active);
    }

    /// Lets ticks pass. No set-point may be farther from the programmed one than the image allows, nor from the
    /// one before than the fastest machine goes. What is left of a rest in which nothing can happen any more passes
    /// at once.
    pub fn ticks(&mut self, count: usize, late: bool) {
        let mut late = late;
        for at in 1..=count {
            let output = self.tick.tick(std::mem::take(&mut late));
            self.server.supervise();
            if self.watched {
                self.watch.look(&output);
                continue;
            }
            let still = self.look(&output) && output.flags == 0;
            if still && !self.thorough && self.tick.rest((count - at) as u32) {
                return;
            }
        }
    }

    /// Looks at a set-point; whether it is the same as the one before.
    fn look(&mut self, output: &Output) -> bool {
        const FARTHEST: u32 = (bounds::OFFSET_MAX_M as f64 * 1e9) as u32 + 16;
        // The machine's 1 m/s in a tick, on each axis, with what set-points may be off, and the rate of the offset: 0.2 m/s.
        // A set-point that comes after a gap is joined within half as much again.
        const FASTEST: u32 = (1_850_000_000 / BOARD.tick_hz as u64) as u32;
        let (nominal, corrected) = (output.nominal_nm, output.corrected_nm);
        let apart = |a: [i32; 3], b: [i32; 3]| {
            let [x, y, z] = [0, 1, 2].map(|axis| a[axis].abs_diff(b[axis]));
            x.max(y).max(z)
        };
        assert!(apart(nominal, corrected) <= FARTHEST, "{output:?}");
        let last = self.last_nm.replace(corrected);
        let moved = last.map(|last| apart(last, corrected));
        assert!(
            moved.is_none_or(|moved| moved <= FASTEST),
            "{last:?} to {output:?}"
        );
        moved == Some(0)
    }

    /// Never a correction without a whole table that this build reads.
    pub fn check(&mut self, status: &Status) {
        match self.server.active() {
            None => assert!(status.bypass, "corrects without a table"),
            Some(slot) => {
                let store = self.server.store_mut();
                let now = (slot, store.flash_mut().changes);
                // What was looked at is what is there until the flash is changed or the other slot is in use.
                if self.checked.replace(now) != Some(now) {
                    let mut stored = [0; MAX_IMAGE_BYTES];
                    store.read(slot, 0, &mut stored).expect("the slot is there");
                    let header = table::Header::check(&stored).expect("the table in use is whole");
                    table::decode(&stored[..header.length]).expect("the table in use can be read");
                }
            }
        }
        // Rest is rest.
        assert!(
            status.motion != MotionState::Fault || status.fault.is_some(),
            "a fault without a cause"
        );
    }

    /// As a reset leaves it: where it stands is kept.
    pub fn reset(self) -> Self {
        let (thorough, watched, watch) = (self.thorough, self.watched, self.watch);
        let last_nm = self.last_nm;
        let (flash, desk) = self.server.into_parts();
        let place_nm = desk.snapshot().corrected_nm;
        Self {
            thorough,
            last_nm,
            watched,
            watch,
            ..Self::boot_at(flash, place_nm, PositionState::Kept)
        }
    }
}
