//! The error of a machine beside the radius law, in the few numbers that undo it.
use super::arm::{ArmErrors, JointErrors};
use crate::Actuator;
use num_traits::Float;

/// Periodic errors that can be undone at once.
pub const MAX_CYCLIC: usize = 3;

/// A periodic error of one slide.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct CyclicError<T> {
    /// 0 for X, 1 for Y, 2 for Z.
    pub slide: usize,
    /// Amplitude, m; 0: none.
    pub amplitude_m: T,
    /// Period, m.
    pub pitch_m: T,
    /// Phase at machine position 0, rad.
    pub phase_rad: T,
}

/// A friction pulse of one slide.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Spike<T> {
    /// Height, m; 0: none.
    pub peak_m: T,
    /// Time constant of the decay, s.
    pub decay_s: T,
}

/// All profile terms of a zone, terms of one kind merged: the *error* of the machine along X, Y and Z is
///
/// `position`·q + `velocity`·q̇ + `acceleration`·q̈ (q from the reference point)
/// − ½ Σₖ `play[k]`·sgn(q̇ₖ) + Σₖ `bow[k]`·uₖ² (u from the centre of the arc), with spikes and periodic errors.
///
/// The controller applies its opposite at the programmed position. What that leaves is of second order: the change of
/// the error over a distance as long as the error itself.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Profile<T> {
    /// Constant radial error of circles, m.
    pub radius_offset_m: T,
    /// m per m: error of the slide of the row by the position of the slide of the column.
    pub position: [[T; 3]; 3],
    /// By slide, m per m/s.
    pub velocity_s: [T; 3],
    /// By slide, m per m/s².
    pub acceleration_s2: [T; 3],
    /// By the slide whose sense of travel matters, then by the slide that is off, m.
    pub play_m: [[T; 3]; 3],
    /// By slide.
    pub spike: [Spike<T>; 3],
    /// At most [`MAX_CYCLIC`].
    pub cyclic: [CyclicError<T>; MAX_CYCLIC],
    /// By the slide along which the guide is bowed, then by the slide that is off, 1/m.
    pub bow_per_m: [[T; 3]; 3],
    /// Of the joints, where the table knows the arm.
    pub arm: ArmErrors<T>,
}

/// Why a term cannot be undone together with others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unmergeable {
    /// A number is not finite, or a pitch or decay is not positive.
    #[error("has a number that is not finite, or a pitch or decay that is not positive")]
    Value,
    /// One more of its kind than can be undone at once: periodic errors, or pulses of one actuator with unlike decays.
    #[error("is one more of its kind than can be undone at once")]
    TooMany,
    /// A joint where a slide is needed or the other way round, or one slide where two are needed.
    #[error(
        "is for a joint where it takes a slide, for a slide where it takes a joint, or for one slide where two are needed"
    )]
    Actuator,
}

/// A finite number.
pub(crate) fn finite<T: Float>(value: T) -> Result<T, Unmergeable> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Unmergeable::Value)
    }
}

/// A finite number above 0.
pub(crate) fn positive<T: Float>(value: T) -> Result<T, Unmergeable> {
    finite(value).and_then(|value| {
        if value > T::zero() {
            Ok(value)
        } else {
            Err(Unmergeable::Value)
        }
    })
}

/// Row or column of a slide.
pub(crate) fn slide_index(actuator: Actuator) -> Result<usize, Unmergeable> {
    // Spelt out, so that the compiler sees that an index is below 3.
    match actuator {
        Actuator::X => Ok(0),
        Actuator::Y => Ok(1),
        Actuator::Z => Ok(2),
        _ => Err(Unmergeable::Actuator),
    }
}

/// Errors of a joint.
pub(crate) fn joint_errors<T: Float>(
    profile: &mut Profile<T>,
    joint: Actuator,
) -> Result<&mut JointErrors<T>, Unmergeable> {
    if joint.is_slide() {
        return Err(Unmergeable::Actuator);
    }
    let errors = profile.arm.joint.get_mut(joint.index());
    errors.ok_or(Unmergeable::Actuator)
}
