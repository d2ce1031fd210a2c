//! Friction: an actuator lags behind after its velocity changes sign, by a pulse that dies away in time, outward both ways.
//!
//! `r = peak·exp(−t/decay)·|cosθ|` for the first slide of a plane, `|sinθ|` for the second; t since the reversal.
use super::check::{Number, magnitude, slide, within};
use super::reach::{number, rise};
use super::{Extent, Kind, Reach, Term};
use crate::Actuator;
use crate::bounds::OFFSET_MAX_M;
use crate::law::{Profile, Spike, Unmergeable, finite, positive, slide_index};
use num_traits::Float;

/// Shortest and longest decay of a reversal pulse, s.
const DECAY_S: [f32; 2] = [1.0e-3, 1.0];

#[derive(Clone, Copy)]
pub(super) struct ReversalSpike<T> {
    pub(super) actuator: Actuator,
    pub(super) peak_m: T,
    pub(super) decay_s: T,
}

impl<T: Float> Kind<T> for ReversalSpike<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::ReversalSpike {
            actuator: self.actuator,
            peak_m: f(self.peak_m),
            decay_s: f(self.decay_s),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        slide(self.actuator)?;
        magnitude(Number::Length, self.peak_m, OFFSET_MAX_M)?;
        within(Number::Decay, self.decay_s, DECAY_S)
    }

    /// The pulse rises in the time of a take-up, from a last one that may have the other sign, and then decays.
    fn reach(self, _extent: &Extent<T>) -> Reach<T> {
        let both = number::<T>(2.0) * self.peak_m.abs();
        Reach::of(
            self.peak_m,
            rise(both) + self.peak_m.abs() / self.decay_s.abs(),
        )
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let slide = slide_index(self.actuator)?;
        let (peak_m, decay_s) = (finite(self.peak_m)?, positive(self.decay_s)?);
        let at = &mut profile.spike[slide];
        if at.peak_m != T::zero() && at.decay_s != decay_s {
            return Err(Unmergeable::TooMany);
        }
        *at = Spike {
            peak_m: at.peak_m + peak_m,
            decay_s,
        };
        Ok(())
    }
}
