//! The emulated machine has no pins: nothing goes out but set-points.
use giotto_firmware::control::Lines;

/// In each tick.
#[inline(always)]
pub fn set(_: Lines, _: [i32; 3], _: bool) -> bool {
    true
}
