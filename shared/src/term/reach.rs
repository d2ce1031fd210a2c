//! How far and how fast corrections move: what the limits of a table are made from.

/// Time in which a controller takes up play at a reversal unless it is configured otherwise, s.
pub const TAKE_UP_S: f64 = 0.008;

/// Steepest slope of the take-up, of its mean: a smoothstep of degree 5.
const STEEPEST: f64 = 1.875;
/// Largest second derivative of the same.
const SHARPEST: f64 = 5.774;

/// The circles that a zone holds for, by their largest: SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent<T> {
    /// Largest radius, m.
    pub radius_m: T,
    /// Highest feed, m/s.
    pub feed_m_s: T,
    /// Highest rate of turn, rad/s.
    pub omega_rad_s: T,
}

/// The largest that a correction asks for on one actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach<T> {
    /// Offset, m, not negative.
    pub offset_m: T,
    /// Rate of change of the offset, m/s, not negative.
    pub slew_m_s: T,
}

impl<T: num_traits::Float> Reach<T> {
    /// Of either sign.
    pub(super) fn of(offset_m: T, slew_m_s: T) -> Self {
        Self {
            offset_m: offset_m.abs(),
            slew_m_s: slew_m_s.abs(),
        }
    }

    /// From one side to the other at each reversal, by so much.
    pub(super) fn of_step(step_m: T) -> Self {
        Self::of(number::<T>(0.5) * step_m, rise(step_m))
    }
}

/// What a change becomes that is to come through the lag of a loop: as itself and its rate.
pub(super) fn through_loop<T: num_traits::Float>(change: Reach<T>, loop_s: T) -> Reach<T> {
    // The rate of the rate: 5.77 of the mean square over the take-up, of the smoothstep.
    let turns = loop_s / number(TAKE_UP_S);
    Reach {
        offset_m: change.offset_m + loop_s * change.slew_m_s,
        slew_m_s: change.slew_m_s * (T::one() + number::<T>(SHARPEST / STEEPEST) * turns),
    }
}

/// Steepest slope of a change by so much in the time of a take-up.
pub(super) fn rise<T: num_traits::Float>(change: T) -> T {
    change * number(STEEPEST / TAKE_UP_S)
}

/// A constant in the precision at hand.
pub(super) fn number<T: num_traits::Float>(value: f64) -> T {
    T::from(value).unwrap_or_else(T::nan)
}
