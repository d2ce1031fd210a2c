//! Two links that turn about Z, then the height as a slide along Z.
use super::{ReachError, Real, STRETCHED, Scalar, number};
use serde::{Deserialize, Serialize};

/// A SCARA, or any two-link arm. The forearm's own turn of the hand does not move the measured point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scara<T> {
    /// From the base to the elbow, m.
    pub l1_m: T,
    /// From the elbow to the measured point, m.
    pub l2_m: T,
    /// Which of the two solutions.
    pub elbow: Elbow,
}

/// Sign of the second angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Elbow {
    /// Second angle above 0.
    Positive,
    /// Second angle below 0.
    Negative,
}

impl<T: Real> Scara<T> {
    pub(super) fn place(&self, q: &[T; 6]) -> [T; 3] {
        let [q1, q2, height, ..] = *q;
        let ((s1, c1), (s12, c12)) = (q1.sine_cosine(), (q1 + q2).sine_cosine());
        [
            self.l1_m * c1 + self.l2_m * c12,
            self.l1_m * s1 + self.l2_m * s12,
            height,
        ]
    }

    pub(super) fn angles<S: Scalar<Base = T>>(
        &self,
        [x, y, z]: [S; 3],
    ) -> Result<[S; 6], ReachError> {
        let (l1, l2) = (S::constant(self.l1_m), S::constant(self.l2_m));
        let cosine = (x * x + y * y - l1 * l1 - l2 * l2) / ((l1 + l1) * l2);
        let size = cosine.value().abs();
        if size.is_nan() || size > T::one() {
            return Err(ReachError::OutOfReach);
        }
        if size > number(STRETCHED) {
            return Err(ReachError::Elbow);
        }
        let (zero, one) = (S::constant(T::zero()), S::constant(T::one()));
        let sine = (one - cosine * cosine).root();
        let sine = match self.elbow {
            Elbow::Positive => sine,
            Elbow::Negative => -sine,
        };
        let q1 = x.angle(y) - (l1 + l2 * cosine).angle(l2 * sine);
        Ok([q1, cosine.angle(sine), z, zero, zero, zero])
    }

    pub(super) fn levers(&self, q: &[T; 6]) -> [[T; 3]; 6] {
        let (zero, one) = (T::zero(), T::one());
        let ([x, y, _], [q1, q2, ..]) = (self.place(q), *q);
        let (s12, c12) = (q1 + q2).sine_cosine();
        let still = [zero; 3];
        [
            [-y, x, zero],
            [-self.l2_m * s12, self.l2_m * c12, zero],
            [zero, zero, one],
            still,
            still,
            still,
        ]
    }

    pub(super) fn along_link(&self, joint: usize, q: &[T; 6]) -> Option<[T; 3]> {
        let [q1, q2, ..] = *q;
        let angle_rad = match joint {
            0 => q1,
            1 => q1 + q2,
            _ => return None,
        };
        let (sin, cos) = angle_rad.sine_cosine();
        Some([cos, sin, T::zero()])
    }
}
