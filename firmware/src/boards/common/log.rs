//! defmt's log: encoded into a ring in memory, sent by the background when it has time. What finds no room is
//! lost; defmt's frames show the gap. Only the background logs, never the tick.
use core::cell::{Cell, RefCell};
use critical_section::{Mutex, RestoreState};
use embedded_io::Write;
use giotto_firmware::server::link::write_whole;
use heapless::Deque;

/// Bytes that wait to be sent, at most.
const RING: usize = 256;

static BYTES: Mutex<RefCell<Deque<u8, RING>>> = Mutex::new(RefCell::new(Deque::new()));
static ENCODER: Mutex<RefCell<defmt::Encoder>> = Mutex::new(RefCell::new(defmt::Encoder::new()));
static RESTORE: Mutex<Cell<RestoreState>> = Mutex::new(Cell::new(RestoreState::invalid()));

#[defmt::global_logger]
struct Logger;

fn push(bytes: &[u8]) {
    critical_section::with(|token| {
        if let Ok(mut ring) = BYTES.borrow(token).try_borrow_mut() {
            for &byte in bytes {
                // No room: lost, as the module says.
                let _ = ring.push_back(byte);
            }
        }
    });
}

fn with_encoder(act: impl FnOnce(&mut defmt::Encoder)) {
    critical_section::with(|token| {
        if let Ok(mut encoder) = ENCODER.borrow(token).try_borrow_mut() {
            act(&mut encoder);
        }
    });
}

// SAFETY: `acquire` enters a critical section that `release` leaves, so that frames do not mix; on the one core
// nothing else runs in between.
#[allow(unsafe_code, reason = "defmt asks for it")]
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: released in `release`, which defmt calls once for each `acquire`.
        let restore = unsafe { critical_section::acquire() };
        critical_section::with(|token| RESTORE.borrow(token).set(restore));
        with_encoder(|encoder| encoder.start_frame(push));
    }

    unsafe fn flush() {}

    unsafe fn release() {
        with_encoder(|encoder| encoder.end_frame(push));
        let restore = critical_section::with(|token| RESTORE.borrow(token).get());
        // SAFETY: the state that `acquire` was given.
        unsafe { critical_section::release(restore) };
    }

    unsafe fn write(bytes: &[u8]) {
        with_encoder(|encoder| encoder.write(bytes, push));
    }
}

/// Sends what waits.
pub fn drain<W: Write>(port: &mut W) {
    loop {
        let byte =
            critical_section::with(|token| BYTES.borrow(token).try_borrow_mut().ok()?.pop_front());
        let Some(byte) = byte else { return };
        // A log that cannot be sent is a log that is lost.
        let _ = write_whole(port, &[byte]);
    }
}
