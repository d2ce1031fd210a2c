//! Profile terms gathered into the few numbers that undo them.
use crate::term::Term;
use num_traits::Float;

/// Cyclic terms that can be undone at once.
pub const MAX_CYCLIC: usize = 2;

/// A periodic error of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct CyclicError<T> {
    /// 0 for X, 1 for Y.
    pub axis: usize,
    /// Amplitude, m; 0: none.
    pub amplitude_m: T,
    /// Period, m.
    pub pitch_m: T,
    /// Phase at machine position 0, rad.
    pub phase_rad: T,
}

/// A friction pulse of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Spike<T> {
    /// Height, m; 0: none.
    pub peak_m: T,
    /// Time constant of the decay, s.
    pub decay_s: T,
}

/// All profile terms of a zone, terms of one kind merged: the *error* of the machine is
///
/// `position`·q + `velocity`·q̇ + `acceleration`·q̈ (axes X, Y; q from the reference point)
/// − ½ `backlash`·sgn(q̇) on its own axis, ± ½ `lateral`·sgn on the other, spikes, cyclic and bow.
///
/// The controller applies its opposite at the programmed position. What that leaves is of second order: the change of
/// the error over a distance as long as the error itself.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Profile<T> {
    /// Constant radial error of circles, m.
    pub radius_offset_m: T,
    /// m per m.
    pub position: [[T; 2]; 2],
    /// m per m/s.
    pub velocity_s: [[T; 2]; 2],
    /// m per m/s².
    pub acceleration_s2: [[T; 2]; 2],
    /// By axis, m.
    pub backlash_m: [T; 2],
    /// By the axis whose direction matters, m.
    pub lateral_m: [T; 2],
    /// By axis.
    pub spike: [Spike<T>; 2],
    /// At most [`MAX_CYCLIC`].
    pub cyclic: [CyclicError<T>; MAX_CYCLIC],
    /// By the axis along which the guide is bowed, 1/m.
    pub bow_per_m: [T; 2],
}

/// A term that cannot be undone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileError {
    /// A number of this term (0 is the first) is not finite, or a pitch or decay is not positive.
    Value(usize),
    /// One more of its kind than can be undone at once: cyclic terms, or spikes of one axis with unlike decays.
    TooMany(usize),
}

impl<T: Float> Profile<T> {
    /// Merges terms.
    pub fn new(terms: &[Term<T>]) -> Result<Self, ProfileError> {
        let zero = T::zero();
        let none = Spike {
            peak_m: zero,
            decay_s: zero,
        };
        let still = CyclicError {
            axis: 0,
            amplitude_m: zero,
            pitch_m: T::one(),
            phase_rad: zero,
        };
        let flat = [[zero; 2]; 2];
        let mut p = Self {
            radius_offset_m: zero,
            position: flat,
            velocity_s: flat,
            acceleration_s2: flat,
            backlash_m: [zero; 2],
            lateral_m: [zero; 2],
            spike: [none; 2],
            cyclic: [still; MAX_CYCLIC],
            bow_per_m: [zero; 2],
        };
        for (index, term) in terms.iter().enumerate() {
            p.add(term, index)?;
        }
        Ok(p)
    }

    fn add(&mut self, term: &Term<T>, index: usize) -> Result<(), ProfileError> {
        let finite = |v: T| {
            if v.is_finite() {
                Ok(v)
            } else {
                Err(ProfileError::Value(index))
            }
        };
        let positive = |v: T| {
            if v.is_finite() && v > T::zero() {
                Ok(v)
            } else {
                Err(ProfileError::Value(index))
            }
        };
        let half = T::one() / (T::one() + T::one());
        let opposite = |m: &mut [[T; 2]; 2], v: T| {
            m[0][0] = m[0][0] + v;
            m[1][1] = m[1][1] - v;
        };
        match *term {
            Term::RadiusOffset { offset_m } => {
                self.radius_offset_m = self.radius_offset_m + finite(offset_m)?;
            }
            Term::ScaleError { relative } => {
                let v = finite(relative)?;
                self.position[0][0] = self.position[0][0] + v;
                self.position[1][1] = self.position[1][1] + v;
            }
            Term::ScaleMismatch { relative } => {
                opposite(&mut self.position, half * finite(relative)?)
            }
            Term::Squareness { shear_rad } => {
                let v = half * finite(shear_rad)?;
                self.position[0][1] = self.position[0][1] + v;
                self.position[1][0] = self.position[1][0] + v;
            }
            Term::ServoMismatch { delta_tau_s } => {
                opposite(&mut self.velocity_s, -half * finite(delta_tau_s)?);
            }
            Term::BandwidthMismatch { delta_kappa2_s2 } => {
                opposite(
                    &mut self.acceleration_s2,
                    half * half * finite(delta_kappa2_s2)?,
                );
            }
            Term::Backlash { axis, step_m } => {
                let at = &mut self.backlash_m[axis.index()];
                *at = *at + finite(step_m)?;
            }
            Term::LateralPlay { axis, shift_m } => {
                let at = &mut self.lateral_m[axis.index()];
                *at = *at + finite(shift_m)?;
            }
            Term::ReversalSpike {
                axis,
                peak_m,
                decay_s,
            } => {
                let at = &mut self.spike[axis.index()];
                let (peak_m, decay_s) = (finite(peak_m)?, positive(decay_s)?);
                if at.peak_m != T::zero() && at.decay_s != decay_s {
                    return Err(ProfileError::TooMany(index));
                }
                *at = Spike {
                    peak_m: at.peak_m + peak_m,
                    decay_s,
                };
            }
            Term::Cyclic {
                axis,
                amplitude_m,
                pitch_m,
                phase_rad,
            } => {
                let cyclic = CyclicError {
                    axis: axis.index(),
                    amplitude_m: finite(amplitude_m)?,
                    pitch_m: positive(pitch_m)?,
                    phase_rad: finite(phase_rad)?,
                };
                let free = self.cyclic.iter_mut().find(|c| c.amplitude_m == T::zero());
                *free.ok_or(ProfileError::TooMany(index))? = cyclic;
            }
            Term::Straightness {
                axis,
                curvature_per_m,
            } => {
                let at = &mut self.bow_per_m[axis.index()];
                *at = *at + finite(curvature_per_m)?;
            }
        }
        Ok(())
    }
}
