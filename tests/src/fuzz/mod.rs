//! What is fuzzed: each takes any bytes and panics if something is not as it must be. Run by `tests/fuzz` (libFuzzer, guided
//! by coverage) and by the binary `fuzz` (random, seeded, everywhere).
//!
//! | target | what the bytes are |
//! |---|---|
//! | [`frame`] | bytes on the link |
//! | [`server`] | a conversation: frames, raw bytes, time, resets |
//! | [`motion`] | what a controller is driven with: requests, time, starvation, faults, resets |
//! | [`table`] | a table, its header made right if the first byte says so |
//! | [`boot`] | what the flash holds when the power comes |
//!
//! Run at length once on the firmware as it is, by
//! `cargo run --release -p giotto-tests --bin fuzz -- --target NAME --executions COUNT --seed SEED`, without a defect:
//!
//! | target | executions, first seed | µs each, one core |
//! |---|---|---|
//! | `frame` | 1e8, 1,000,001 | 1 |
//! | `table` | 1e8, 1,000,001 | 2 |
//! | `boot` | 1e8, 1,000,001 | 19 |
//! | `server` | 1e8, 1,000,001, in 50 runs of 2e6 | 80 |
//! | `motion` | 3e5, 1 | 200 |
//!
//! `motion` counts what it drives: 1.0e9 requests and ticks in that run. On the way there it found a brake held at the end of the
//! coordinates (seed 381), a fault hidden by a feed hold (1666), a gap joined with a jump of velocity (8408) and a brake out of a sharp turn
//! beyond the acceleration (1,322,760).
#![allow(
    clippy::panic,
    reason = "a defect is reported by a panic: that is what a fuzzer looks for"
)]
mod bench;
pub mod boot;
pub mod frame;
pub mod motion;
pub mod server;
pub mod table;
pub mod watch;

/// A target: its name, what it does, and bytes to begin with.
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Takes any bytes; panics on a defect. Requests and ticks that were looked at, where that is what is counted.
    pub run: fn(&[u8]) -> u64,
    /// Bytes from which something interesting is near.
    pub seeds: fn() -> Vec<Vec<u8>>,
}

fn uncounted(run: fn(&[u8]), bytes: &[u8]) -> u64 {
    run(bytes);
    0
}

/// All targets.
pub const TARGETS: [Target; 5] = [
    Target {
        name: "frame",
        run: |bytes| uncounted(frame::run, bytes),
        seeds: frame::seeds,
    },
    Target {
        name: "server",
        run: |bytes| uncounted(server::run, bytes),
        seeds: server::seeds,
    },
    Target {
        name: "motion",
        run: motion::drive,
        seeds: motion::seeds,
    },
    Target {
        name: "table",
        run: |bytes| uncounted(table::run, bytes),
        seeds: table::seeds,
    },
    Target {
        name: "boot",
        run: |bytes| uncounted(boot::run, bytes),
        seeds: boot::seeds,
    },
];
