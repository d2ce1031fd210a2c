//! The clock of all parts.
use std::hint::black_box;
use std::time::Instant;

/// How often a work of this size is repeated within a round, by every contender: a clock has a grain, and the first time
/// after a wait is that of a cold machine.
pub(crate) fn repeats(size: usize) -> usize {
    (100_000 / size).clamp(1, 20)
}

/// As [`timed`], the mean of several times in a row.
pub(crate) fn timed_again<T>(times: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let (seconds, value) = timed(|| {
        (1..times).for_each(|_| {
            black_box(work());
        });
        work()
    });
    (seconds / times as f64, value)
}

/// Seconds that a work takes once, and what comes of it.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let value = black_box(work());
    (start.elapsed().as_secs_f64(), value)
}
