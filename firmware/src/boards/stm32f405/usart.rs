//! USART3 (link) and USART6 (log) (RM0090 30): polled out, interrupt in.
use super::clock::Clock;
use super::common::RECEIVED;
use super::common::port::{Patience, Stuck};
use super::register::Register;
use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::singleton;
use critical_section::Mutex;
use embedded_io::{ErrorType, Read, ReadReady, Write};
use heapless_spsc::spsc::{Consumer, Producer, Queue};

const USART3: usize = 0x4000_4800;
const USART6: usize = 0x4001_1400;
const GPIOB: usize = 0x4002_0400;
const GPIOC: usize = 0x4002_0800;

const STATUS: usize = 0x00;
const DATA: usize = 0x04;
const BAUD: usize = 0x08;
const CONTROL: usize = 0x0c;

const RX_FULL: u32 = 1 << 5;
/// A byte came before the last one was read.
const OVERRUN: u32 = 1 << 3;
const TX_EMPTY: u32 = 1 << 7;
const RX: u32 = 1 << 2;
const TX: u32 = 1 << 3;
const RX_INTERRUPT: u32 = 1 << 5;
const ENABLE: u32 = 1 << 13;

/// Bits a second, as the host expects.
const RATE: u32 = 460_800;

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

/// Gives a pin of a port to a peripheral (alternate function).
fn connect(port: usize, pin: usize, function: u32) {
    let (half, place) = (pin / 8, 4 * (pin % 8));
    Register::at(port, 0x20 + 4 * half).change(0xf << place, function << place);
    Register::at(port, 0x00).change(0b11 << (2 * pin), 0b10 << (2 * pin));
}

/// One USART.
pub struct Usart {
    base: usize,
    received: Option<Consumer<'static, u8, RECEIVED>>,
    patience: Patience,
}

/// Looks at a port before it is given up: without flow control a byte leaves in 22 us.
const PATIENCE: u32 = 100_000;

impl Usart {
    fn open(base: usize, bus_hz: u32, control: u32) -> Self {
        // The divider has four fractional bits, sixteen samples a bit: bus over rate, rounded.
        Register::at(base, BAUD).set((bus_hz + RATE / 2) / RATE);
        Register::at(base, CONTROL).set(control | ENABLE);
        Self { base, received: None, patience: Patience::new(PATIENCE) }
    }

    /// USART3, both ways; `None` if called twice.
    pub fn link(clock: &Clock) -> Option<Self> {
        let queue = singleton!(: Queue<u8, RECEIVED> = Queue::new())?;
        let (producer, consumer) = queue.split();
        critical_section::with(|token| RECEIVER.borrow(token).set(Some(producer)));
        connect(GPIOB, 10, 7);
        connect(GPIOB, 11, 7);
        let mut usart = Self::open(USART3, clock.apb1_hz, TX | RX | RX_INTERRUPT);
        usart.received = Some(consumer);
        Some(usart)
    }

    /// USART6, out only.
    pub fn log(clock: &Clock) -> Self {
        connect(GPIOC, 6, 8);
        Self::open(USART6, clock.apb2_hz, TX)
    }
}

/// USART3's interrupt: one byte into the queue. Reading status, then data, clears all its causes.
pub extern "C" fn received() {
    critical_section::with(|token| {
        let mut receiver = RECEIVER.borrow(token).take();
        let status = Register::at(USART3, STATUS).get();
        if status & (RX_FULL | OVERRUN) != 0 {
            let byte = Register::at(USART3, DATA).get() as u8;
            let fresh = status & RX_FULL != 0;
            let kept = fresh && receiver.as_mut().is_some_and(|queue| queue.enqueue(byte).is_ok());
            let lost = u32::from(!kept) + u32::from(fresh && status & OVERRUN != 0);
            LOST.store(LOST.load(Relaxed).wrapping_add(lost), Relaxed);
        }
        RECEIVER.borrow(token).set(receiver);
    });
}

impl ErrorType for Usart {
    type Error = Stuck;
}

impl ReadReady for Usart {
    fn read_ready(&mut self) -> Result<bool, Stuck> {
        Ok(self.received.as_ref().is_some_and(Consumer::ready))
    }
}

impl Read for Usart {
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

impl Write for Usart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Stuck> {
        for &byte in bytes {
            let status = Register::at(self.base, STATUS);
            self.patience.wait(|| status.get() & TX_EMPTY != 0)?;
            Register::at(self.base, DATA).set(u32::from(byte));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Stuck> {
        Ok(())
    }
}
