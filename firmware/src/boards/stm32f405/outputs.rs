//! What goes out beside the link: pulses (`pulses`), and three lines on port C.
//!
//! | pin | high while |
//! |---|---|
//! | PC2 (D12) | enable: it is known where the machine stands |
//! | PC1 (D13, the LED) | in position: nothing moves |
//! | PC7 (D5) | fault |
use super::pulses::Pulses;
use super::register::Register;
use core::cell::RefCell;
use critical_section::Mutex;
use giotto_firmware::control::Lines;

const GPIOC: usize = 0x4002_0800;
const MODE: Register = Register::at(GPIOC, 0x00);
const SET_RESET: Register = Register::at(GPIOC, 0x18);
/// Enable, in position, fault.
const PINS: [u32; 3] = [2, 1, 7];

static PULSES: Mutex<RefCell<Option<Pulses>>> = Mutex::new(RefCell::new(None));

/// Before the first tick.
pub fn prepare(pulses: Option<Pulses>) {
    for pin in PINS {
        MODE.change(0b11 << (2 * pin), 0b01 << (2 * pin));
    }
    critical_section::with(|token| {
        if let Ok(mut kept) = PULSES.borrow(token).try_borrow_mut() {
            *kept = pulses;
        }
    });
}

/// In each tick; `false`: it was faster than pulses can be, and the run has to end.
pub fn set(lines: Lines, to_nm: [i32; 3], placed: bool) -> bool {
    let levels = [lines.enable, lines.in_position, lines.fault];
    let mut word = 0;
    for (pin, level) in PINS.into_iter().zip(levels) {
        word |= 1 << (pin + if level { 0 } else { 16 });
    }
    SET_RESET.set(word);
    critical_section::with(|token| {
        let Ok(mut pulses) = PULSES.borrow(token).try_borrow_mut() else {
            return false;
        };
        pulses
            .as_mut()
            .is_none_or(|pulses| pulses.tick(to_nm, placed).is_ok())
    })
}
