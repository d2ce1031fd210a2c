//! Periodic error of a screw or gear: error `amplitude·sin(2π·u/pitch + phase)` along its actuator, u its machine
//! coordinate.
//!
//! The first slide of a plane leaves `r = A·cosθ·sin(2π(u₀ + R cosθ)/P + φ)`, u₀ the coordinate of the centre: a chirp.
use super::check::{Number, magnitude, slide, within};
use super::reach::number;
use super::{Extent, Kind, Reach, Term};
use crate::Actuator;
use crate::bounds::OFFSET_MAX_M;
use crate::law::{CyclicError, Profile, Unmergeable, finite, positive, slide_index};
use core::f64::consts::TAU;
use num_traits::Float;

/// Shortest and longest pitch of a periodic error, m.
const PITCH_M: [f32; 2] = [1.0e-4, 10.0];
/// Largest |phase|, rad: one turn, rounded up.
const PHASE_MAX_RAD: f32 = 6.3;

#[derive(Clone, Copy)]
pub(super) struct Cyclic<T> {
    pub(super) actuator: Actuator,
    pub(super) amplitude_m: T,
    pub(super) pitch_m: T,
    pub(super) phase_rad: T,
}

impl<T: Float> Kind<T> for Cyclic<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::Cyclic {
            actuator: self.actuator,
            amplitude_m: f(self.amplitude_m),
            pitch_m: f(self.pitch_m),
            phase_rad: f(self.phase_rad),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        slide(self.actuator)?;
        magnitude(Number::Length, self.amplitude_m, OFFSET_MAX_M)?;
        within(Number::Pitch, self.pitch_m, PITCH_M)?;
        magnitude(Number::Phase, self.phase_rad, PHASE_MAX_RAD)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        let per_m = number::<T>(TAU) / self.pitch_m;
        Reach::of(self.amplitude_m, self.amplitude_m * per_m * extent.feed_m_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let cyclic = CyclicError {
            slide: slide_index(self.actuator)?,
            amplitude_m: finite(self.amplitude_m)?,
            pitch_m: positive(self.pitch_m)?,
            phase_rad: finite(self.phase_rad)?,
        };
        let mut places = profile.cyclic.iter_mut();
        let free = places.find(|c| c.amplitude_m == T::zero());
        *free.ok_or(Unmergeable::TooMany)? = cyclic;
        Ok(())
    }
}
