#![no_main]
#[path = "../../src/fuzz/mod.rs"]
#[allow(dead_code, reason = "each target is one of several")]
mod fuzz;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::motion::run(bytes));
