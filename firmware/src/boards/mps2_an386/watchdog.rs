//! CMSDK APB watchdog (DDI0479 4.5), fed by the background: a background that hangs for a second ends in a reset.
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

const LOAD: *mut u32 = 0x4000_8000 as *mut u32;
const CONTROL: *mut u32 = 0x4000_8008 as *mut u32;
const CLEAR: *mut u32 = 0x4000_800c as *mut u32;
const LOCK: *mut u32 = 0x4000_8c00 as *mut u32;
const UNLOCK: u32 = 0x1acc_e551;
/// Count, and reset when it has run out twice.
const RUN: u32 = 0b11;

static PERIOD: AtomicU32 = AtomicU32::new(0);

fn write(register: *mut u32, value: u32) {
    // SAFETY: a register of the watchdog; it has no effect on memory.
    #[allow(unsafe_code, reason = "registers")]
    unsafe {
        ptr::write_volatile(register, value);
    }
}

/// Starts it: half a second to its interrupt (which is off), half a second more to the reset.
pub fn start(clock_hz: u32) {
    PERIOD.store(clock_hz / 2, Relaxed);
    write(LOCK, UNLOCK);
    write(LOAD, clock_hz / 2);
    write(CONTROL, RUN);
}

/// Stops it: where time passes by grant it would find every pause too long.
pub fn stop() {
    write(CONTROL, 0);
}

/// Begins the period anew.
pub fn feed() {
    write(CLEAR, 1);
    write(LOAD, PERIOD.load(Relaxed));
}
