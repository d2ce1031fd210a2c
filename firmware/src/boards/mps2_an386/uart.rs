//! CMSDK APB UARTs (DDI0479 4.3): polled out, interrupt in on UART0.
use super::common::port::{self, Port, Transmitter};
use core::ptr;

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
pub struct Uart(*mut Registers);

/// Looks at the port of the host before it is given up, some tenths of a second.
const LINK_PATIENCE: u32 = 1_000_000;
/// As above, for a port where nobody may be: some milliseconds.
const SIDE_PATIENCE: u32 = 5_000;

impl Uart {
    fn open(registers: *mut Registers, control: u32) -> Self {
        write(register!(registers, baud_divider), DIVIDER);
        write(register!(registers, control), control);
        Self(registers)
    }

    /// UART0, both ways; `None` if called twice.
    pub fn link() -> Option<Port<Self>> {
        let control = CONTROL_TX | CONTROL_RX | CONTROL_RX_INTERRUPT;
        Port::link(Self::open(UART0, control), LINK_PATIENCE)
    }

    /// UART1: set-points out, the stop switch in (see `stop`).
    pub fn stream() -> Port<Self> {
        Port::out(Self::open(UART1, CONTROL_TX | CONTROL_RX), SIDE_PATIENCE)
    }

    /// UART2, out only.
    pub fn log() -> Port<Self> {
        Port::out(Self::open(UART2, CONTROL_TX), SIDE_PATIENCE)
    }
}

impl Transmitter for Uart {
    fn ready(&self) -> bool {
        read(register!(self.0, state)) & STATE_TX_FULL == 0
    }

    fn put(&self, byte: u8) {
        write(register!(self.0, data), u32::from(byte));
    }
}

/// The byte that has come to UART1, if one has.
pub fn stream_received() -> Option<u8> {
    let full = read(register!(UART1, state)) & STATE_RX_FULL != 0;
    full.then(|| read(register!(UART1, data)) as u8)
}

/// UART0's receive interrupt: its bytes into the queue.
pub extern "C" fn received() {
    write(register!(UART0, interrupt), INTERRUPT_RX);
    port::received(|keep| {
        while read(register!(UART0, state)) & STATE_RX_FULL != 0 {
            keep(read(register!(UART0, data)) as u8);
        }
        0
    });
}
