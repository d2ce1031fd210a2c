//! USART3 (link), USART1 (set-points) and USART6 (log) (RM0090 30): polled out, interrupt in.
use super::clock::Clock;
use super::common::port::{self, Port, Transmitter};
use super::register::Register;

const USART1: usize = 0x4001_1000;
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

/// Gives a pin of a port to a peripheral (alternate function).
fn connect(port: usize, pin: usize, function: u32) {
    let (half, place) = (pin / 8, 4 * (pin % 8));
    Register::at(port, 0x20 + 4 * half).change(0xf << place, function << place);
    Register::at(port, 0x00).change(0b11 << (2 * pin), 0b10 << (2 * pin));
}

/// One USART, by the address of its registers.
pub struct Usart(usize);

/// Looks at a port before it is given up: without flow control a byte leaves in 22 us.
const PATIENCE: u32 = 100_000;

impl Usart {
    fn open(base: usize, bus_hz: u32, control: u32) -> Self {
        // The divider has four fractional bits, sixteen samples a bit: bus over rate, rounded.
        Register::at(base, BAUD).set((bus_hz + RATE / 2) / RATE);
        Register::at(base, CONTROL).set(control | ENABLE);
        Self(base)
    }

    /// USART3, both ways; `None` if called twice.
    pub fn link(clock: &Clock) -> Option<Port<Self>> {
        connect(GPIOB, 10, 7);
        connect(GPIOB, 11, 7);
        Port::link(
            Self::open(USART3, clock.apb1_hz, TX | RX | RX_INTERRUPT),
            PATIENCE,
        )
    }

    /// USART1, out only.
    pub fn stream(clock: &Clock) -> Port<Self> {
        connect(GPIOB, 6, 7);
        Port::out(Self::open(USART1, clock.apb2_hz, TX), PATIENCE)
    }

    /// USART6, out only.
    pub fn log(clock: &Clock) -> Port<Self> {
        connect(GPIOC, 6, 8);
        Port::out(Self::open(USART6, clock.apb2_hz, TX), PATIENCE)
    }
}

impl Transmitter for Usart {
    fn ready(&self) -> bool {
        Register::at(self.0, STATUS).get() & TX_EMPTY != 0
    }

    fn put(&self, byte: u8) {
        Register::at(self.0, DATA).set(u32::from(byte));
    }
}

/// USART3's interrupt: one byte into the queue. Reading status, then data, clears all its causes.
pub extern "C" fn received() {
    port::received(|keep| {
        let status = Register::at(USART3, STATUS).get();
        if status & (RX_FULL | OVERRUN) == 0 {
            return 0;
        }
        let byte = Register::at(USART3, DATA).get() as u8;
        if status & RX_FULL != 0 {
            keep(byte);
        }
        u32::from(status & OVERRUN != 0)
    });
}
