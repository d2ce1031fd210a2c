//! Numbers at the border, which may be anything, and vectors in single precision.
use super::Refused;
use giotto_shared::path::{MAX_POSITION_M, Quantity};

/// Largest coordinate, nm.
const MAX_POSITION_NM: u32 = (MAX_POSITION_M * 1e9) as u32;

/// Finite and above 0.
pub(super) fn positive(value: f32, quantity: Quantity) -> Result<f32, Refused> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(Refused::NotANumber(quantity))
    }
}

/// Every coordinate is one that the engine can hold.
pub(super) fn inside(place_nm: &[i32; 3], quantity: Quantity) -> Result<(), Refused> {
    let inside = place_nm
        .iter()
        .all(|nm| nm.unsigned_abs() <= MAX_POSITION_NM);
    if inside {
        Ok(())
    } else {
        Err(Refused::OutOfBounds(quantity))
    }
}

/// Metres from nanometres, to 24 bits.
pub(super) fn to_m(nm: [i32; 3]) -> [f32; 3] {
    nm.map(|nm| nm as f32 * 1e-9)
}

/// Metres from half nanometres, to 24 bits.
pub(super) fn arm(half_nm: [i32; 3]) -> [f32; 3] {
    half_nm.map(|half_nm| half_nm as f32 * 0.5e-9)
}

pub(super) fn dot([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> f32 {
    a * x + b * y + c * z
}

/// Length of a vector.
pub(super) fn length(v: [f32; 3]) -> f32 {
    libm::sqrtf(dot(v, v))
}

/// A point seen from another.
pub(super) fn seen_from([x, y, z]: [f32; 3], [rx, ry, rz]: [f32; 3]) -> [f32; 3] {
    [x - rx, y - ry, z - rz]
}

/// Square to both.
pub(super) fn cross([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// Whether a turn from u to v is counter-clockwise, seen from where the largest coordinate of its axis is positive: the
/// coordinate plane nearest to it, as a [`Frame`](giotto_shared::Frame) counts.
pub(super) fn is_counter_clockwise(u: [f32; 3], v: [f32; 3]) -> bool {
    // Of two as large the first counts, whatever rounding says.
    let largest = |best: f32, c: f32| {
        if c.abs() > 1.000_01 * best.abs() {
            c
        } else {
            best
        }
    };
    cross(u, v).into_iter().fold(0.0, largest) >= 0.0
}
