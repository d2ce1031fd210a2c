//! Profile terms: departures from the one radius law that depend on actuator, direction or place.
//!
//! One type for three users: the host's diagnosis estimates it, the table carries it, the engine
//! evaluates its inverse. Each term is the *error of the machine* (what is measured); the controller
//! applies the opposite. Every term is defined on actuators, so that it holds on any path in any plane.
//!
//! One file a term. It says what the term is and which radial deviation `r(θ)` it leaves on a circle (θ polar angle in
//! the plane of the circle, `d` = ±1 with the sense of θ), what numbers are allowed, how far a correction reaches, and
//! what the term adds to the [`Profile`] that the tick undoes. A new term is its file, its variant and its line in
//! `with_kind!`; and, since the table's bytes change, the table's version.
mod axis_scale;
mod backlash;
mod bandwidth_mismatch;
mod check;
mod cyclic;
mod joint_backlash;
mod joint_cyclic;
mod joint_lag;
mod joint_reversal;
mod joint_zero;
mod lateral_play;
mod link_length;
mod radius_offset;
mod reach;
mod reversal_spike;
mod scale_error;
mod scale_mismatch;
mod servo_mismatch;
mod squareness;
mod straightness;

pub use check::{Number, Unfit};
pub use reach::{Extent, Reach, TAKE_UP_S};

use crate::law::{Profile, Unmergeable};
use crate::{Actuator, Plane};
use num_traits::Float;
use serde::{Deserialize, Serialize};

/// One compensable error of the machine. `T` is `f64` on the host, `f32` in the controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Term<T> {
    /// Constant radial error of circles (ball, bar or tool calibration): `r = offset`.
    RadiusOffset {
        /// Measured minus true radius, m.
        offset_m: T,
    },
    /// All slides long by the same share: `r = R·relative`.
    ScaleError {
        /// Relative length error, m/m.
        relative: T,
    },
    /// One slide long: error `+relative·u` along it.
    AxisScale {
        /// The slide.
        actuator: Actuator,
        /// Relative length error, m/m.
        relative: T,
    },
    /// The first slide of a plane longer than the second: `r = ½R·relative·cos2θ` in that plane.
    ScaleMismatch {
        /// The two slides.
        plane: Plane,
        /// Share of the first less that of the second, m/m.
        relative: T,
    },
    /// Two slides not square: `r = ½εR·sin2θ` in their plane.
    Squareness {
        /// The two slides.
        plane: Plane,
        /// ε, rad.
        shear_rad: T,
    },
    /// The first slide of a plane lags more than the second: `r = d·½fΔτ·sin2θ` in that plane.
    ServoMismatch {
        /// The two slides.
        plane: Plane,
        /// Δτ, lag of the first less that of the second, s.
        delta_tau_s: T,
    },
    /// The first slide of a plane has the larger second cumulant: `r = −(Δκ2/4)(f²/R)·cos2θ` in that plane.
    BandwidthMismatch {
        /// The two slides.
        plane: Plane,
        /// Δκ2, that of the first less that of the second, s².
        delta_kappa2_s2: T,
    },
    /// Motion lost at each reversal of an actuator, a step outward if positive.
    Backlash {
        /// Actuator that loses motion.
        actuator: Actuator,
        /// B, m.
        step_m: T,
    },
    /// Sideways shift with the sense in which an actuator travels.
    LateralPlay {
        /// Actuator whose sense of travel matters.
        actuator: Actuator,
        /// Actuator along which the machine shifts.
        across: Actuator,
        /// L, m: from one side to the other.
        shift_m: T,
    },
    /// Friction pulse after each reversal of an actuator, outward.
    ReversalSpike {
        /// Actuator that reverses.
        actuator: Actuator,
        /// Height, m.
        peak_m: T,
        /// Time constant of the decay, s.
        decay_s: T,
    },
    /// Periodic error of a screw or gear: `amplitude·sin(2π·position/pitch + phase)` along its actuator.
    Cyclic {
        /// Actuator with the periodic error.
        actuator: Actuator,
        /// Amplitude, m.
        amplitude_m: T,
        /// Period, m.
        pitch_m: T,
        /// Phase at position 0 (machine coordinate of the actuator), rad.
        phase_rad: T,
    },
    /// Bowed guide: travel along an actuator shifts another by `curvature·u²`, u from the centre of the circle.
    Straightness {
        /// Actuator along whose travel the guide is bowed.
        actuator: Actuator,
        /// Actuator along which the bow shifts.
        across: Actuator,
        /// c, 1/m: the bow over ±R is cR².
        curvature_per_m: T,
    },
    /// A joint that lags and smooths more than the others.
    JointLag {
        /// The joint.
        actuator: Actuator,
        /// Δτ, lag beyond that of the others, s.
        delta_tau_s: T,
        /// Δκ2, second cumulant beyond that of the others, s².
        delta_kappa2_s2: T,
    },
    /// Play of a joint's gear.
    JointBacklash {
        /// The joint.
        actuator: Actuator,
        /// From one side to the other, rad.
        play_rad: T,
        /// Time constant of the loop before it, which what takes it up goes through, s; 0: none.
        loop_s: T,
    },
    /// Friction pulse after a joint has turned back, behind the motion.
    JointReversal {
        /// The joint.
        actuator: Actuator,
        /// Height, rad.
        peak_rad: T,
        /// Time constant of the decay, s.
        decay_s: T,
        /// How long it takes to rise, s.
        rise_s: T,
        /// Travel over which the friction changes over, rad.
        presliding_rad: T,
    },
    /// Periodic error of a joint's gear: `amplitude·sin(waves·q + phase)`.
    JointCyclic {
        /// The joint.
        actuator: Actuator,
        /// Amplitude, rad.
        amplitude_rad: T,
        /// Waves in a turn of the joint.
        waves: T,
        /// Phase at angle 0, rad.
        phase_rad: T,
    },
    /// Offset of a joint's zero.
    JointZero {
        /// The joint.
        actuator: Actuator,
        /// Where it stands beyond where it is told to, rad.
        offset_rad: T,
    },
    /// A link longer than programmed.
    LinkLength {
        /// The joint before the link.
        actuator: Actuator,
        /// By so much, m.
        longer_m: T,
    },
}

/// Longest lever of a joint that is reckoned with where limits are made, m.
const LEVER_M: f64 = 2.0;
/// Time constants of a joint's loop, s.
const LOOP_S: [f32; 2] = [0.0, 0.2];

/// What the file of a term provides.
trait Kind<T: Float>: Copy {
    /// The same term with each of its numbers passed through `f`.
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U>;

    /// Checks actuators and numbers against what a controller accepts.
    fn validate(self) -> Result<(), Unfit>;

    /// How far and how fast its correction moves.
    fn reach(self, extent: &Extent<T>) -> Reach<T>;

    /// Adds its error to that of a machine.
    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable>;
}

/// The term as its file knows it.
macro_rules! with_kind {
    ($term:expr, $kind:ident => $body:expr) => {
        with_kind!(@ $term, $kind => $body;
            RadiusOffset radius_offset { offset_m },
            ScaleError scale_error { relative },
            AxisScale axis_scale { actuator, relative },
            ScaleMismatch scale_mismatch { plane, relative },
            Squareness squareness { plane, shear_rad },
            ServoMismatch servo_mismatch { plane, delta_tau_s },
            BandwidthMismatch bandwidth_mismatch { plane, delta_kappa2_s2 },
            Backlash backlash { actuator, step_m },
            LateralPlay lateral_play { actuator, across, shift_m },
            ReversalSpike reversal_spike { actuator, peak_m, decay_s },
            Cyclic cyclic { actuator, amplitude_m, pitch_m, phase_rad },
            Straightness straightness { actuator, across, curvature_per_m },
            JointLag joint_lag { actuator, delta_tau_s, delta_kappa2_s2 },
            JointBacklash joint_backlash { actuator, play_rad, loop_s },
            JointReversal joint_reversal { actuator, peak_rad, decay_s, rise_s, presliding_rad },
            JointCyclic joint_cyclic { actuator, amplitude_rad, waves, phase_rad },
            JointZero joint_zero { actuator, offset_rad },
            LinkLength link_length { actuator, longer_m },
        )
    };
    (@ $term:expr, $kind:ident => $body:expr; $($name:ident $file:ident { $($field:ident),* },)*) => {
        match $term {
            $(Term::$name { $($field),* } => {
                let $kind = $file::$name { $($field),* };
                $body
            })*
        }
    };
}

impl<T> Term<T> {
    /// Whether it is of a joint or a link: it needs the kinematics of the arm.
    pub const fn is_of_arm(&self) -> bool {
        matches!(
            self,
            Self::JointLag { .. }
                | Self::JointBacklash { .. }
                | Self::JointReversal { .. }
                | Self::JointCyclic { .. }
                | Self::JointZero { .. }
                | Self::LinkLength { .. }
        )
    }
}

impl<T: Float> Term<T> {
    /// The same term with each of its numbers passed through `f`: from the host's `f64` to the table's `f32`.
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        with_kind!(self, kind => kind.map(f))
    }

    /// Checks actuators and numbers against what a controller accepts.
    ///
    /// # Errors
    /// The first [`Unfit`] number or actuator.
    pub fn validate(&self) -> Result<(), Unfit> {
        with_kind!(*self, kind => kind.validate())
    }

    /// Largest offset (m) and rate of change of the offset (m/s) that its correction asks for inside an extent, on one
    /// actuator, at constant feed.
    pub fn reach(&self, extent: &Extent<T>) -> Reach<T> {
        with_kind!(*self, kind => kind.reach(extent))
    }

    /// Largest offset that its correction asks for on circles up to `radius_m`, feeds up to `feed_m_s` and rates of turn
    /// up to `omega_rad_s`, m.
    pub fn reach_m(&self, radius_m: T, feed_m_s: T, omega_rad_s: T) -> T {
        self.reach(&Extent {
            radius_m,
            feed_m_s,
            omega_rad_s,
        })
        .offset_m
    }

    /// Adds its error to that of a machine.
    ///
    /// # Errors
    /// [`Unmergeable`]; the profile is as it was.
    pub fn add_to(&self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        with_kind!(*self, kind => kind.add(profile))
    }
}

/// A term that cannot be undone together with those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("term {} {reason}", index + 1)]
pub struct ProfileError {
    /// Place of the term, from 0.
    pub index: usize,
    /// Why.
    pub reason: Unmergeable,
}

/// All terms of a zone as one error of the machine.
///
/// # Errors
/// The first term that cannot be merged with those before it.
///
/// ```
/// use giotto_shared::term::{merged, ProfileError, Term};
/// use giotto_shared::{Actuator, Plane};
///
/// let terms = [
///     Term::Backlash { actuator: Actuator::Z, step_m: 8e-6_f64 },
///     Term::Squareness { plane: Plane::Zx, shear_rad: 20e-6 },
///     Term::Backlash { actuator: Actuator::Z, step_m: 1e-6 },
/// ];
/// let profile = merged(&terms)?;
/// // Both plays of Z are one; X and Y have none.
/// assert!((profile.play_m[2][2].abs() - 9e-6).abs() < 1e-12);
/// assert_eq!(profile.play_m[1], [0.0; 3]);
/// # Ok::<(), ProfileError>(())
/// ```
pub fn merged<T: Float + Default>(terms: &[Term<T>]) -> Result<Profile<T>, ProfileError> {
    let mut profile = Profile::default();
    for (index, term) in terms.iter().enumerate() {
        term.add_to(&mut profile)
            .map_err(|reason| ProfileError { index, reason })?;
    }
    Ok(profile)
}

#[cfg(test)]
mod tests;
