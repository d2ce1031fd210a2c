//! The firmware's library on the host: the same server, store, planner and tick, over a flash in memory.
//!
//! In this process ([`VirtualLink`]) time is simulated: it passes only while someone waits for an answer, as fast
//! as the ticks can be computed. Behind a pty ([`serve`](super::serve::serve)) it is the clock's.
use super::link::Link;
use super::wires::Wires;
use giotto_firmware::control::{Desk, Job, Receiver, SEGMENTS, SET_POINTS, Sender, Shared, Tick};
use giotto_firmware::engine::{Config, Executor, Planner, RATE_HZ};
use giotto_firmware::server::{Board, Buffers, Motion, Server, TimedSetPoint};
use giotto_firmware::store::{Layout, ram::RamFlash, stored_config};
use giotto_shared::table::image::MachineId;
use giotto_shared::wire::{ClockSource, Pose, PositionState, ResetCause};
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Ticks a second, unless others are stored.
pub const TICK_HZ: u32 = 1000;
/// Bytes of a slot.
pub(crate) const SLOT: usize = 4096;
/// Two slots, the key and two units of the configuration, each one erase unit.
pub(crate) const LAYOUT: Layout = Layout::new([0, SLOT as u32], SLOT as u32)
    .with_key(2 * SLOT as u32)
    .with_config([3 * SLOT as u32, 4 * SLOT as u32]);
const BOARD: Board = Board {
    name: "virtual",
    build: env!("CARGO_PKG_VERSION"),
    tick_hz: TICK_HZ,
    clock: ClockSource::Crystal,
    reset: ResetCause::Power,
    machine: MACHINE,
    step: [[1, 1]; 3],
    // It has no outputs, and all the time in the world.
    bears: |_| Ok(()),
};
/// Whom tables are bound to.
pub const MACHINE: MachineId = *b"virtual\0\0\0\0\0";

/// Flash of a virtual controller.
pub type Flash = RamFlash<{ 5 * SLOT }, SLOT>;

/// A queue whose two ends are in one process.
#[derive(Debug)]
struct Queue<T> {
    things: Arc<Mutex<VecDeque<T>>>,
    capacity: usize,
}

impl<T> Queue<T> {
    /// Both ends.
    fn new(capacity: usize) -> (Self, Self) {
        let things = Arc::new(Mutex::new(VecDeque::with_capacity(capacity)));
        (
            Self {
                things: Arc::clone(&things),
                capacity,
            },
            Self { things, capacity },
        )
    }

    fn with<R>(&self, act: impl FnOnce(&mut VecDeque<T>) -> R) -> R {
        act(&mut self.things.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<T: Copy> Sender<T> for Queue<T> {
    fn send(&mut self, thing: &T) -> bool {
        let capacity = self.capacity;
        self.with(|things| {
            let room = things.len() < capacity;
            if room {
                things.push_back(*thing);
            }
            room
        })
    }

    fn waiting(&self) -> usize {
        self.with(|things| things.len())
    }
}

impl<T> Receiver<T> for Queue<T> {
    fn receive(&mut self) -> Option<T> {
        self.with(VecDeque::pop_front)
    }

    fn look<R>(&mut self, look: impl FnOnce(&T) -> R) -> Option<R> {
        self.with(|things| things.front().map(look))
    }

    fn discard(&mut self) {
        self.with(VecDeque::pop_front);
    }

    fn waiting(&self) -> usize {
        self.with(|things| things.len())
    }
}

type VirtualTick = Tick<Arc<Shared>, Queue<Job>, Queue<TimedSetPoint>>;
type VirtualDesk = Desk<Box<Planner>, Arc<Shared>, Queue<Job>, Queue<TimedSetPoint>>;
type VirtualServer = Server<Flash, VirtualDesk, Box<Buffers>>;

/// A controller without hardware.
pub struct VirtualController {
    server: VirtualServer,
    tick: VirtualTick,
    shared: Arc<Shared>,
    wires: Wires,
    tick_hz: u32,
    /// Since it was made, over resets.
    age: Duration,
}

impl Default for VirtualController {
    fn default() -> Self {
        Self::boot(Flash::new())
    }
}

impl VirtualController {
    /// Boots with what is in the flash.
    pub fn boot(flash: Flash) -> Self {
        Self::boot_at(flash, [0; 3], PositionState::Known)
    }

    /// The same, its machine standing somewhere.
    pub fn boot_at(flash: Flash, place_nm: Pose, known: PositionState) -> Self {
        let own = BOARD.limits();
        let (flash, stored) = stored_config(flash, LAYOUT, &own);
        let tick_hz = stored
            .map(|stored| stored.tick_hz)
            .filter(|hz| (RATE_HZ[0]..=RATE_HZ[1]).contains(hz))
            .unwrap_or(TICK_HZ);
        let config = Config::robot(tick_hz);
        let shared = Arc::new(Shared::new());
        let (segments_in, segments_out) = Queue::new(SEGMENTS);
        let (points_in, points_out) = Queue::new(SET_POINTS);
        shared.stands(place_nm, known);
        let executor = Executor::new(place_nm, config.engage_ticks(), true);
        let planner = Box::new(Planner::new(&config, place_nm));
        let desk = Desk::new(planner, Arc::clone(&shared), segments_in, points_out);
        let reset = if known == PositionState::Kept {
            ResetCause::Request
        } else {
            BOARD.reset
        };
        let board = Board {
            reset,
            tick_hz,
            ..BOARD
        };
        let server = Server::boot(board, flash, LAYOUT, desk, Box::default());
        let tick = Tick::new(executor, Arc::clone(&shared), segments_out, points_in);
        Self {
            server,
            tick,
            shared,
            wires: Wires::default(),
            tick_hz,
            age: Duration::ZERO,
        }
    }

    /// Takes bytes from the host.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.wires.to_controller.extend(bytes);
    }

    /// The stop input, as a switch on a board.
    pub fn set_stop_input(&mut self, active: bool) {
        self.shared.set_stop_input(active);
    }

    /// Answers what has come, then lets one period pass.
    pub fn step(&mut self) {
        let Ok(()) = self.server.serve(&mut self.wires);
        if self.server.reset_requested() {
            self.reset();
        }
        self.tick.tick(false);
        self.age += Duration::from_secs(1) / self.tick_hz;
    }

    /// Bytes for the host.
    pub fn take(&mut self, buffer: &mut [u8]) -> usize {
        self.wires.take(buffer)
    }

    /// Warm reset: the flash stays, and so does what the drives were told last.
    fn reset(&mut self) {
        let place_nm = self.server.motion_mut().snapshot().corrected_nm;
        let flash = self.server.store_mut().flash_mut().clone();
        let wires = std::mem::take(&mut self.wires);
        let age = self.age;
        *self = Self {
            wires,
            age,
            ..Self::boot_at(flash, place_nm, PositionState::Kept)
        };
    }
}

/// A virtual controller in this process, in simulated time.
#[derive(Default)]
pub struct VirtualLink {
    controller: VirtualController,
}

impl VirtualLink {
    /// A controller that has just booted, its flash erased.
    pub fn new() -> Self {
        Self::default()
    }
}

impl Link for VirtualLink {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.controller.receive(bytes);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        loop {
            let count = self.controller.take(buffer);
            if count > 0 || self.now() >= until {
                return Ok(count);
            }
            self.controller.step();
        }
    }

    fn now(&self) -> Duration {
        self.controller.age
    }
}
