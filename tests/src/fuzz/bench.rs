//! A whole controller on the host: server, store, planner and tick, as on a board.
use giotto_firmware::control::{Desk, Job, Receiver, SEGMENTS, SET_POINTS, Sender, Shared, Tick};
use giotto_firmware::engine::{Config, Executor, Planner};
use giotto_firmware::server::{Board, Buffers, Server, TimedSetPoint};
use giotto_firmware::store::{Layout, ram::RamFlash};
use giotto_shared::table::{self, MAX_IMAGE_BYTES, bounds};
use giotto_shared::wire::{MotionState, Status};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

const SLOT: usize = 2048;
const ERASE: usize = 512;
/// Bytes of the flash.
pub const FLASH: usize = 2 * SLOT + ERASE;
const LAYOUT: Layout = Layout::new([0, SLOT as u32], SLOT as u32).with_key(2 * SLOT as u32);
const BOARD: Board = Board { name: "fuzz", build: "0", tick_hz: 1000 };

/// Its flash.
pub type Flash = RamFlash<FLASH, ERASE>;

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
}

impl Bench {
    /// Boots with what is in the flash.
    pub fn boot(flash: Flash) -> Self {
        let config = Config::robot(BOARD.tick_hz);
        let shared = Rc::new(Shared::new());
        let (segments_in, segments_out) = Queue::new(SEGMENTS);
        let (points_in, points_out) = Queue::new(SET_POINTS);
        let planner = Box::new(Planner::new(&config, [0; 3]));
        let desk = Desk::new(planner, Rc::clone(&shared), segments_in, points_out);
        let executor = Executor::new([0; 3], config.engage_ticks(), true);
        Self {
            server: Server::boot(BOARD, flash, LAYOUT, desk, Box::default()),
            tick: Tick::new(executor, Rc::clone(&shared), segments_out, points_in),
            shared,
            last_nm: None,
        }
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
    /// one before than the fastest machine goes.
    pub fn ticks(&mut self, count: usize, late: bool) {
        let farthest = (f64::from(bounds::OFFSET_MAX_M) * 1e9) as i64 + 16;
        // 10 m/s, the fastest that a configuration may ask for, in a tick of 1 ms.
        let fastest = 10_000_000;
        for at in 0..count {
            let output = self.tick.tick(late && at == 0);
            self.server.supervise();
            for (nominal, corrected) in output.nominal_nm.into_iter().zip(output.corrected_nm) {
                let apart = (i64::from(nominal) - i64::from(corrected)).abs();
                assert!(apart <= farthest, "{output:?}");
            }
            if let Some(last) = self.last_nm.replace(output.corrected_nm) {
                for (last, now) in last.into_iter().zip(output.corrected_nm) {
                    assert!((i64::from(last) - i64::from(now)).abs() <= fastest, "{last} to {now}");
                }
            }
        }
    }

    /// Never a correction without a whole table that this build reads.
    pub fn check(&mut self, status: &Status) {
        match self.server.active() {
            None => assert!(status.bypass, "corrects without a table"),
            Some(slot) => {
                let mut stored = [0; MAX_IMAGE_BYTES];
                self.server.store_mut().read(slot, 0, &mut stored).expect("the slot is there");
                let header = table::Header::check(&stored).expect("the table in use is whole");
                table::decode(&stored[..header.length]).expect("the table in use can be read");
            }
        }
        // Rest is rest.
        assert!(status.motion != MotionState::Fault || status.fault.is_some(), "a fault without a cause");
    }

    /// As a reset leaves it.
    pub fn reset(self) -> Self {
        Self::boot(self.server.into_parts().0)
    }
}
