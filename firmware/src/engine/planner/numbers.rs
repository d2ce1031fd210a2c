//! Numbers at the border: what a program gives in double precision becomes whole nanometres and single precision here.
use super::Refused;
use crate::engine::config::MAX_POSITION_M;
use giotto_shared::fixed::rounded;

/// Nanometres in a metre.
const NM: f64 = 1e9;
/// Largest coordinate, nm.
const MAX_POSITION_NM: u64 = (MAX_POSITION_M * NM) as u64;

/// Every number is finite, and of a size that single precision has.
pub(super) fn finite(values: &[f64], name: &'static str) -> Result<(), Refused> {
    if values.iter().all(|v| (*v as f32).is_finite()) { Ok(()) } else { Err(Refused::NotANumber(name)) }
}

/// In single precision, finite and above 0.
pub(super) fn positive(value: f64, name: &'static str) -> Result<f32, Refused> {
    let single = value as f32;
    if single.is_finite() && single > 0.0 { Ok(single) } else { Err(Refused::NotANumber(name)) }
}

/// A place, nm.
pub(super) fn to_nm(metres: &[f64; 3], name: &'static str) -> Result<[i32; 3], Refused> {
    finite(metres, name)?;
    let nm = metres.map(|m| rounded(m, NM));
    if nm.iter().any(|nm| nm.unsigned_abs() > MAX_POSITION_NM) {
        return Err(Refused::OutOfBounds("position"));
    }
    Ok(nm.map(|nm| nm as i32))
}

/// A length in half nanometres, one on an arm of a circle; for lengths up to [`MAX_RADIUS_M`](crate::engine::MAX_RADIUS_M).
pub(super) fn to_half_nm(metres: f64) -> i32 {
    rounded(metres, 2.0 * NM) as i32
}

/// Metres from nanometres, to 24 bits.
pub(super) fn to_m(nm: [i32; 3]) -> [f32; 3] {
    nm.map(|nm| nm as f32 * 1e-9)
}

/// Length of a vector.
pub(super) fn length([x, y, z]: [f32; 3]) -> f32 {
    libm::sqrtf(x * x + y * y + z * z)
}

/// X and Y of a point seen from another.
pub(super) fn seen_from([x, y, _]: [f32; 3], [rx, ry, _]: [f32; 3]) -> [f32; 2] {
    [x - rx, y - ry]
}
