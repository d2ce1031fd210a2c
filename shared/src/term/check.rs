//! What a controller accepts of a term's numbers and actuators.
use crate::{Actuator, Plane};
use core::fmt;
use num_traits::Float;
use serde::{Deserialize, Serialize};

/// Which number of a term an error speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the name is the field of the term")]
pub enum Number {
    Length,
    Relative,
    Shear,
    DeltaTau,
    DeltaKappa2,
    Decay,
    Pitch,
    Phase,
    Curvature,
    Angle,
    Waves,
    Loop,
    Rise,
}

impl Number {
    /// The number in words, with its unit.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Length => "length of a term (m)",
            Self::Relative => "relative length of a term (m/m)",
            Self::Shear => "squareness (rad)",
            Self::DeltaTau => "lag mismatch (s)",
            Self::DeltaKappa2 => "bandwidth mismatch (s^2)",
            Self::Decay => "decay of a reversal pulse (s)",
            Self::Pitch => "pitch (m)",
            Self::Phase => "phase (rad)",
            Self::Curvature => "guide curvature (1/m)",
            Self::Angle => "angle of a joint (rad)",
            Self::Waves => "waves in a turn of a joint",
            Self::Rise => "rise of a reversal pulse (s)",
            Self::Loop => "time constant of a joint's loop (s)",
        }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a controller does not accept a term.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// NaN or infinity.
    #[error("{0} is not a finite number")]
    NotFinite(Number),
    /// A number beyond its bounds.
    #[error("{number} is {value}, allowed are {lo} to {hi}")]
    OutOfBounds {
        /// Which number.
        number: Number,
        /// Its value.
        value: f32,
        /// Smallest allowed.
        lo: f32,
        /// Largest allowed.
        hi: f32,
    },
    /// A joint where the term is of slides.
    #[error("{0} is a joint, and this term is of slides")]
    Joint(Actuator),
    /// A slide where the term is of joints.
    #[error("{0} is a slide, and this term is of joints")]
    Slide(Actuator),
    /// Two actuators that span no plane.
    #[error("{0} is given twice: a shift goes across the travel")]
    Same(Actuator),
}

/// Between two bounds.
pub(super) fn within<T: Float>(number: Number, value: T, [lo, hi]: [f32; 2]) -> Result<(), Unfit> {
    let value = value.to_f32().unwrap_or(f32::NAN);
    if !value.is_finite() {
        return Err(Unfit::NotFinite(number));
    }
    if value < lo || value > hi {
        return Err(Unfit::OutOfBounds {
            number,
            value,
            lo,
            hi,
        });
    }
    Ok(())
}

/// No larger than a bound, either sign.
pub(super) fn magnitude<T: Float>(number: Number, value: T, most: f32) -> Result<(), Unfit> {
    within(number, value, [-most, most])
}

/// A slide.
pub(super) fn slide(actuator: Actuator) -> Result<(), Unfit> {
    if actuator.is_slide() {
        Ok(())
    } else {
        Err(Unfit::Joint(actuator))
    }
}

/// A joint.
pub(super) fn joint(actuator: Actuator) -> Result<(), Unfit> {
    if actuator.is_slide() {
        Err(Unfit::Slide(actuator))
    } else {
        Ok(())
    }
}

/// Two slides that are not one.
pub(super) fn across(actuator: Actuator, across: Actuator) -> Result<(), Unfit> {
    slide(actuator)?;
    slide(across)?;
    Plane::of(actuator, across)
        .map(drop)
        .ok_or(Unfit::Same(actuator))
}
