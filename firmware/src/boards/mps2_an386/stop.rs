//! The stop switch. QEMU's machine has no input pin, so the switch is on UART1: `!` presses it, `.` releases it.
use super::uart;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

static PRESSED: AtomicBool = AtomicBool::new(false);

/// Whether the switch is pressed; asked in every tick.
pub fn active() -> bool {
    match uart::stream_received() {
        Some(b'!') => PRESSED.store(true, Relaxed),
        Some(b'.') => PRESSED.store(false, Relaxed),
        _ => {}
    }
    PRESSED.load(Relaxed)
}
