//! Serial ports: what comes waits in a queue that an interrupt fills; what goes is polled out. A port that does not take
//! what it is given must not keep the background from its work.
use super::RECEIVED;
use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::singleton;
use critical_section::Mutex;
use embedded_io::{Error, ErrorKind, ErrorType, Read, ReadReady, Write};
use heapless_spsc::spsc::{Consumer, Producer, Queue};

/// The port did not take a byte in time; what was being sent is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stuck;

impl core::fmt::Display for Stuck {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the port takes nothing")
    }
}

impl core::error::Error for Stuck {}

impl Error for Stuck {
    fn kind(&self) -> ErrorKind {
        ErrorKind::TimedOut
    }
}

/// How long a port is waited for.
pub struct Patience {
    polls: u32,
    stuck: bool,
}

impl Patience {
    /// So many looks at the port for each byte; once it was stuck, one, until it takes a byte again.
    pub const fn new(polls: u32) -> Self {
        Self {
            polls,
            stuck: false,
        }
    }

    /// Waits until the port is ready.
    pub fn wait(&mut self, ready: impl Fn() -> bool) -> Result<(), Stuck> {
        let polls = if self.stuck { 1 } else { self.polls };
        self.stuck = !(0..polls).any(|_| ready());
        if self.stuck { Err(Stuck) } else { Ok(()) }
    }
}

static RECEIVER: Mutex<Cell<Option<Producer<'static, u8, RECEIVED>>>> = Mutex::new(Cell::new(None));
static LOST: AtomicU32 = AtomicU32::new(0);

/// Bytes lost since last asked: the background was busy for too long, or the core stood still.
pub fn lost() -> u32 {
    critical_section::with(|_| {
        let lost = LOST.load(Relaxed);
        LOST.store(0, Relaxed);
        lost
    })
}

/// The link's receive interrupt: `take` hands over each byte that has come, and says how many the port itself lost.
pub fn received(take: impl Fn(&mut dyn FnMut(u8)) -> u32) {
    critical_section::with(|token| {
        let mut receiver = RECEIVER.borrow(token).take();
        let mut lost = 0_u32;
        let overrun = take(&mut |byte| {
            let kept = receiver
                .as_mut()
                .is_some_and(|queue| queue.enqueue(byte).is_ok());
            lost += u32::from(!kept);
        });
        LOST.store(LOST.load(Relaxed).wrapping_add(lost + overrun), Relaxed);
        RECEIVER.borrow(token).set(receiver);
    });
}

/// The sending half of a board's port.
pub trait Transmitter {
    /// Whether it takes a byte.
    fn ready(&self) -> bool;
    /// Gives it one.
    fn put(&self, byte: u8);
}

/// A port as the background knows it.
pub struct Port<T> {
    transmitter: T,
    received: Option<Consumer<'static, u8, RECEIVED>>,
    patience: Patience,
}

impl<T> Port<T> {
    /// Out only; `polls` as for [`Patience::new`].
    pub fn out(transmitter: T, polls: u32) -> Self {
        Self {
            transmitter,
            received: None,
            patience: Patience::new(polls),
        }
    }

    /// The link, both ways; `None` if called twice. To be opened before its interrupt is let through.
    pub fn link(transmitter: T, polls: u32) -> Option<Self> {
        let queue = singleton!(: Queue<u8, RECEIVED> = Queue::new())?;
        let (producer, consumer) = queue.split();
        critical_section::with(|token| RECEIVER.borrow(token).set(Some(producer)));
        Some(Self {
            received: Some(consumer),
            ..Self::out(transmitter, polls)
        })
    }
}

impl<T> ErrorType for Port<T> {
    type Error = Stuck;
}

impl<T> ReadReady for Port<T> {
    fn read_ready(&mut self) -> Result<bool, Stuck> {
        Ok(self.received.as_ref().is_some_and(Consumer::ready))
    }
}

impl<T> Read for Port<T> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Stuck> {
        let mut count = 0;
        if let Some(queue) = &mut self.received {
            for place in buffer {
                let Some(byte) = queue.dequeue() else { break };
                *place = byte;
                count += 1;
            }
        }
        Ok(count)
    }
}

impl<T: Transmitter> Write for Port<T> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Stuck> {
        for &byte in bytes {
            self.patience.wait(|| self.transmitter.ready())?;
            self.transmitter.put(byte);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Stuck> {
        Ok(())
    }
}
