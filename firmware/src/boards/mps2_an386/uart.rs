//! CMSDK APB UARTs (DDI0479 4.3): polled out, interrupt in on UART0.
use super::common::RECEIVED;
use super::common::port::{Patience, Stuck};
use core::cell::Cell;
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::singleton;
use critical_section::Mutex;
use embedded_io::{ErrorType, Read, ReadReady, Write};
use heapless_spsc::spsc::{Consumer, Producer, Queue};

/// Registers of one UART.
#[repr(C)]
struct Registers {
    data: u32,
    state: u32,
    control: u32,
    interrupt: u32,
    baud_divider: u32,
}

const UART0: *mut Registers = 0x4000_4000 as *mut Registers;
const UART1: *mut Registers = 0x4000_5000 as *mut Registers;
const UART2: *mut Registers = 0x4000_6000 as *mut Registers;

const STATE_TX_FULL: u32 = 1;
const STATE_RX_FULL: u32 = 1 << 1;
const CONTROL_TX: u32 = 1;
const CONTROL_RX: u32 = 1 << 1;
const CONTROL_RX_INTERRUPT: u32 = 1 << 3;
const INTERRUPT_RX: u32 = 1 << 1;
/// 25 MHz / 460,800 Hz.
const DIVIDER: u32 = 54;

static RECEIVER: Mutex<Cell<Option<Producer<'static, u8, RECEIVED>>>> = Mutex::new(Cell::new(None));
static LOST: AtomicU32 = AtomicU32::new(0);

/// Bytes lost since last asked, because the background was busy for too long.
pub fn lost() -> u32 {
    critical_section::with(|_| {
        let lost = LOST.load(Relaxed);
        LOST.store(0, Relaxed);
        lost
    })
}

fn read(register: *const u32) -> u32 {
    // SAFETY: `register` is one of a UART of this part.
    #[allow(unsafe_code, reason = "registers")]
    unsafe {
        ptr::read_volatile(register)
    }
}

fn write(register: *mut u32, value: u32) {
    // SAFETY: as in `read`; a UART's registers have no effect on memory.
    #[allow(unsafe_code, reason = "registers")]
    unsafe {
        ptr::write_volatile(register, value);
    }
}

/// The address of a register, without touching it.
macro_rules! register {
    ($uart:expr, $field:ident) => {{
        // SAFETY: the field of a register block whose address is that of the part.
        #[allow(unsafe_code, reason = "registers")]
        unsafe {
            &raw mut (*$uart).$field
        }
    }};
}

/// One UART.
pub struct Uart {
    registers: *mut Registers,
    received: Option<Consumer<'static, u8, RECEIVED>>,
    patience: Patience,
}

/// Looks at the port of the host before it is given up, some tenths of a second.
const LINK_PATIENCE: u32 = 1_000_000;
/// As above, for a port where nobody may be: some milliseconds.
const SIDE_PATIENCE: u32 = 5_000;

impl Uart {
    fn open(registers: *mut Registers, control: u32, patience: u32) -> Self {
        write(register!(registers, baud_divider), DIVIDER);
        write(register!(registers, control), control);
        Self { registers, received: None, patience: Patience::new(patience) }
    }

    /// UART0, both ways; `None` if called twice.
    pub fn link() -> Option<Self> {
        let queue = singleton!(: Queue<u8, RECEIVED> = Queue::new())?;
        let (producer, consumer) = queue.split();
        critical_section::with(|token| RECEIVER.borrow(token).set(Some(producer)));
        let mut uart = Self::open(UART0, CONTROL_TX | CONTROL_RX | CONTROL_RX_INTERRUPT, LINK_PATIENCE);
        uart.received = Some(consumer);
        Some(uart)
    }

    /// UART1: set-points out, the stop switch in (see `stop`).
    pub fn stream() -> Self {
        Self::open(UART1, CONTROL_TX | CONTROL_RX, SIDE_PATIENCE)
    }

    /// UART2, out only.
    pub fn log() -> Self {
        Self::open(UART2, CONTROL_TX, SIDE_PATIENCE)
    }
}

/// The byte that has come to UART1, if one has.
pub fn stream_received() -> Option<u8> {
    let full = read(register!(UART1, state)) & STATE_RX_FULL != 0;
    full.then(|| read(register!(UART1, data)) as u8)
}

/// UART0's receive interrupt: one byte into the queue.
pub extern "C" fn received() {
    write(register!(UART0, interrupt), INTERRUPT_RX);
    critical_section::with(|token| {
        let mut receiver = RECEIVER.borrow(token).take();
        while read(register!(UART0, state)) & STATE_RX_FULL != 0 {
            let byte = read(register!(UART0, data)) as u8;
            let kept = receiver.as_mut().is_some_and(|queue| queue.enqueue(byte).is_ok());
            if !kept {
                LOST.store(LOST.load(Relaxed).wrapping_add(1), Relaxed);
            }
        }
        RECEIVER.borrow(token).set(receiver);
    });
}

impl ErrorType for Uart {
    type Error = Stuck;
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Stuck> {
        Ok(self.received.as_ref().is_some_and(Consumer::ready))
    }
}

impl Read for Uart {
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

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Stuck> {
        for &byte in bytes {
            let state = register!(self.registers, state);
            self.patience.wait(|| read(state) & STATE_TX_FULL == 0)?;
            write(register!(self.registers, data), u32::from(byte));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Stuck> {
        Ok(())
    }
}
