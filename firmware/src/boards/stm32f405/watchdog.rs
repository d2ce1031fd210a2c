//! Independent watchdog (RM0090 21), fed by the background: one that hangs for four seconds ends in a reset. Its oscillator
//! is good to a factor of two (17 to 47 kHz): never below the two seconds that an erasure may take.
use super::register::Register;

const IWDG: usize = 0x4000_3000;
const KEY: Register = Register::at(IWDG, 0x00);
const PRESCALER: Register = Register::at(IWDG, 0x04);
const RELOAD: Register = Register::at(IWDG, 0x08);
const STATUS: Register = Register::at(IWDG, 0x0c);

const UNLOCK: u32 = 0x5555;
const START: u32 = 0xcccc;
const FEED: u32 = 0xaaaa;
/// 32 kHz / 256 = 125 Hz.
const DIVIDE_BY_256: u32 = 6;
const FOUR_SECONDS: u32 = 500;

/// Starts it; nothing stops it.
pub fn start() {
    KEY.set(START);
    KEY.set(UNLOCK);
    PRESCALER.set(DIVIDE_BY_256);
    RELOAD.set(FOUR_SECONDS);
    // If it never takes the values, it bites earlier, not later.
    let _ = STATUS.wait(0b11, 0);
    feed();
}

/// Begins the period anew.
pub fn feed() {
    KEY.set(FEED);
}
