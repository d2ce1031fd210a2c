//! Numbers at the border, and vectors.
use super::Refused;
use crate::engine::config::MAX_POSITION_M;
use giotto_shared::fixed::to_fixed;

pub(super) fn finite(values: &[f64], name: &'static str) -> Result<(), Refused> {
    if values.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(Refused::NotANumber(name)) }
}

pub(super) fn positive(value: f64, name: &'static str) -> Result<(), Refused> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(Refused::NotANumber(name)) }
}

pub(super) fn to_nm(metres: &[f64; 3], name: &'static str) -> Result<[i32; 3], Refused> {
    finite(metres, name)?;
    if metres.iter().any(|m| libm::fabs(*m) > MAX_POSITION_M) {
        return Err(Refused::OutOfBounds("position"));
    }
    Ok(metres.map(|m| to_fixed(m * 1e9, 0)))
}

pub(super) fn in_u32(value: f64) -> Option<u32> {
    (0.0..4e9).contains(&value).then_some(value as u32)
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// X and Y of a point seen from another.
pub(super) fn seen_from(point: [f64; 3], reference: [f64; 3]) -> [f64; 2] {
    [point[0] - reference[0], point[1] - reference[1]]
}

pub(super) fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = libm::sqrt(dot(a, a));
    (length > 1e-12).then(|| a.map(|x| x / length))
}
