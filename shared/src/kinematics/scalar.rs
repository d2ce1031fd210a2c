//! What a closed form is computed with: a number, or a number with its derivatives along a path.
use crate::angle::{RAD_PER_UNIT, sincos};
use core::ops::{Add, Div, Mul, Neg, Sub};
use num_traits::Float;

/// A number, or a [`Jet`](super::Jet): the same closed form gives angles from places and their derivatives from those of a path.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// What lengths are given in.
    type Base: Float;

    /// A number that does not change along the path.
    fn constant(value: Self::Base) -> Self;
    /// The number itself.
    fn value(self) -> Self::Base;
    /// Square root of a number above 0.
    fn root(self) -> Self;
    /// Sine and cosine of an angle, rad.
    fn sine_cosine(self) -> (Self, Self);
    /// Angle of the vector (`self`, `y`), rad.
    fn angle(self, y: Self) -> Self;
}

macro_rules! number {
    ($float:ty, $sine_cosine:expr) => {
        impl Scalar for $float {
            type Base = Self;

            fn constant(value: Self) -> Self {
                value
            }
            fn value(self) -> Self {
                self
            }
            fn root(self) -> Self {
                Float::sqrt(self)
            }
            fn sine_cosine(self) -> (Self, Self) {
                $sine_cosine(self)
            }
            fn angle(self, y: Self) -> Self {
                Float::atan2(y, self)
            }
        }
    };
}
number!(f64, Float::sin_cos);
number!(f32, single);

/// Sine and cosine by the tick's own series: to 24 bits of a turn. Those of `libm` compute in `f64`, which a Cortex-M4F has
/// not: a thousand instructions each.
fn single(angle_rad: f32) -> (f32, f32) {
    const UNITS_PER_RAD: f32 = (1.0 / RAD_PER_UNIT) as f32;
    const OF_Q31: f32 = 1.0 / 2_147_483_648.0;
    let (cos, sin) = sincos((angle_rad * UNITS_PER_RAD) as i64 as u32);
    (sin as f32 * OF_Q31, cos as f32 * OF_Q31)
}

/// A plain number: `f32` or `f64`.
pub trait Real: Float + Scalar<Base = Self> {}

impl<T: Float + Scalar<Base = T>> Real for T {}
