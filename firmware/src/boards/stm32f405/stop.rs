//! The stop input, PC3: a contact that is closed to ground while running is allowed. The pin is pulled up, so an open
//! contact and a broken wire stop alike.
use super::register::Register;

const GPIOC: usize = 0x4002_0800;
const MODE: Register = Register::at(GPIOC, 0x00);
const PULL: Register = Register::at(GPIOC, 0x0c);
const INPUT: Register = Register::at(GPIOC, 0x10);
const PIN: u32 = 3;

/// Makes the pin an input, pulled up.
pub fn prepare() {
    MODE.change(0b11 << (2 * PIN), 0);
    PULL.change(0b11 << (2 * PIN), 0b01 << (2 * PIN));
}

/// Whether the contact is open; asked in every tick.
pub fn active() -> bool {
    INPUT.get() & 1 << PIN != 0
}
