//! giotto in LinuxCNC: a real-time component of its HAL, between the planner's set-points and the drives.
//!
//! ```text
//! loadrt giotto joints=3 table=/path/to/TABLE.bin
//! addf giotto.update servo-thread          # after motion-controller, before the drives
//! ```
//!
//! | pin | | |
//! |---|---|---|
//! | `giotto.N.in`, `giotto.N.out` | float | from `joint.N.motor-pos-cmd`, to the drive |
//! | `giotto.N.fb-in`, `giotto.N.fb-out` | float | from the drive, to `joint.N.motor-pos-fb` |
//! | `giotto.N.motor-offset` | float in | from `joint.N.motor-offset`: where the table's places are counted from |
//! | `giotto.enable` | bit in | correct |
//! | `giotto.coordinated` | bit in, on if not connected | from `motion.coord-mode`: jogging and homing pass untouched |
//! | `giotto.machine-on` | bit in, on if not connected | from `motion.motion-enabled` |
//! | `giotto.active`, `giotto.fault` | bit out | a correction acts; none is possible |
//! | `giotto.cuts` | u32 out | ticks in which the offset was cut to a bound |
//! | `giotto.latency-s` | float out | from a set-point in to the same one out |
//! | `giotto.stop` | bit out | `giotto stop` was said: for `halui.abort` |
//!
//! Parameters `giotto.N.min`, `giotto.N.max`: soft limits of the joint that the correction keeps. Given at load: `joints`,
//! `table`, `coordinates` (`XYZABCUVW`), `units_per_mm` (1.0), `window_ms` (15: the latency is twice that).
//!
//! Everything that can go wrong happens at load, in `rtapi_app_main`. `giotto.update` allocates nothing, calls nothing of
//! the system, and does not panic; a panic would end the process, which is what LinuxCNC's watchdogs are for.
//!
//! With `panic = "abort"` (profile `firmware`) the component is `no_std`; where panics unwind, `std` lends the handler.
#![cfg_attr(panic = "abort", no_std)]
#![allow(
    unsafe_code,
    reason = "a foreign interface: HAL, and memory shared with another process"
)]

mod component;
mod hal;
mod page;
mod parameters;
mod pins;

#[cfg(panic = "abort")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: of the C library; does not return.
    unsafe { hal::abort() }
}
