//! Where a circle lies in the machine: coordinate planes by name, and frames of any tilt.
use crate::Actuator;
use core::fmt;
use serde::{Deserialize, Serialize};

/// A coordinate plane. Angles run from its first axis to its second, so that the normal is the remaining axis.
///
/// ```
/// use giotto_shared::{Actuator, Plane};
///
/// // G18 runs from Z to X, so that its normal is +Y.
/// assert_eq!(Plane::Zx.axes(), [Actuator::Z, Actuator::X]);
/// assert_eq!(Plane::Zx.normal(), Actuator::Y);
/// // Two slides name their plane in either order; two joints have none.
/// assert_eq!(Plane::of(Actuator::X, Actuator::Z), Some(Plane::Zx));
/// assert_eq!(Plane::of(Actuator::Joint1, Actuator::Joint2), None);
/// ```
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Plane {
    /// G17: from X to Y, seen from +Z.
    #[default]
    Xy,
    /// G19: from Y to Z, seen from +X.
    Yz,
    /// G18: from Z to X, seen from +Y.
    Zx,
}

impl Plane {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Xy, Self::Yz, Self::Zx];

    /// First and second axis.
    pub const fn axes(self) -> [Actuator; 2] {
        match self {
            Self::Xy => [Actuator::X, Actuator::Y],
            Self::Yz => [Actuator::Y, Actuator::Z],
            Self::Zx => [Actuator::Z, Actuator::X],
        }
    }

    /// Places of its two axes in the coordinates of a machine of three slides.
    pub const fn slides(self) -> [usize; 2] {
        match self {
            Self::Xy => [0, 1],
            Self::Yz => [1, 2],
            Self::Zx => [2, 0],
        }
    }

    /// The axis across the plane.
    pub const fn normal(self) -> Actuator {
        match self {
            Self::Xy => Actuator::Z,
            Self::Yz => Actuator::X,
            Self::Zx => Actuator::Y,
        }
    }

    /// The plane of two slides in either order; `None` for joints or one slide twice.
    pub fn of(one: Actuator, other: Actuator) -> Option<Self> {
        Self::ALL.into_iter().find(|plane| {
            let [first, second] = plane.axes();
            [one, other] == [first, second] || [one, other] == [second, first]
        })
    }

    /// Name in files and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xy => "xy",
            Self::Yz => "yz",
            Self::Zx => "zx",
        }
    }
}

impl fmt::Display for Plane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Directions of a circle in machine coordinates: a point at polar angle θ lies at R(cosθ·first + sinθ·second) from
/// the centre. Both are unit vectors, at right angles.
///
/// ```
/// use giotto_shared::{Frame, Plane};
///
/// assert_eq!(Frame::of(Plane::Yz).first(), [0.0, 1.0, 0.0]);
/// // XY tilted about X: its first direction is X still, its second climbs by 1 in 2.
/// let tilted = Frame::across([0.0, -0.5, 1.0]).unwrap();
/// assert_eq!(tilted.plane(), None);
/// assert!((tilted.first()[0] - 1.0).abs() < 1e-12);
/// assert!((tilted.second()[2] / tilted.second()[1] - 0.5).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    first: [f64; 3],
    second: [f64; 3],
}

/// How far a coordinate of a unit vector may be from 0 or 1 and still be called that.
const ALIGNED: f64 = 1e-9;

impl Frame {
    /// The frame of a coordinate plane.
    pub const fn of(plane: Plane) -> Self {
        let (first, second) = match plane {
            Plane::Xy => ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            Plane::Yz => ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
            Plane::Zx => ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
        };
        Self { first, second }
    }

    /// The frame of a plane across `normal` (any length, either sign): the coordinate plane nearest to it, tilted. The
    /// first direction is the projection of that plane's first axis. `None` for a normal that is zero or not finite.
    pub fn across(normal: [f64; 3]) -> Option<Self> {
        let length = norm(normal);
        if !(length.is_finite() && length > 0.0) {
            return None;
        }
        let mut normal = normal.map(|c| c / length);
        let largest = (0..3).fold(0, |best, k| {
            if normal[k].abs() > normal[best].abs() {
                k
            } else {
                best
            }
        });
        if normal[largest] < 0.0 {
            normal = normal.map(|c| -c);
        }
        let plane = [Plane::Yz, Plane::Zx, Plane::Xy][largest];
        let axis = Self::of(plane).first;
        let along = dot(axis, normal);
        let first = [0, 1, 2].map(|k| axis[k] - along * normal[k]);
        let first = first.map(|c| c / norm(first));
        Some(Self {
            first,
            second: cross(normal, first),
        })
    }

    /// Direction of polar angle 0.
    pub const fn first(&self) -> [f64; 3] {
        self.first
    }

    /// Direction of polar angle 90°.
    pub const fn second(&self) -> [f64; 3] {
        self.second
    }

    /// Unit vector across the plane: the circle is counter-clockwise seen from its tip.
    pub fn normal(&self) -> [f64; 3] {
        cross(self.first, self.second)
    }

    /// Of a slide (0 X, 1 Y, 2 Z): its share of the first and the second direction.
    pub fn shares(&self, slide: usize) -> [f64; 2] {
        [self.first[slide], self.second[slide]]
    }

    /// The coordinate plane it is, if it is one.
    pub fn plane(&self) -> Option<Plane> {
        Plane::ALL.into_iter().find(|plane| {
            let other = Self::of(*plane);
            let near =
                |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < ALIGNED);
            near(self.first, other.first) && near(self.second, other.second)
        })
    }
}

impl Default for Frame {
    fn default() -> Self {
        Self::of(Plane::Xy)
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(a: [f64; 3]) -> f64 {
    libm::sqrt(dot(a, a))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_run_from_the_first_axis_to_the_second() {
        for plane in Plane::ALL {
            let frame = Frame::of(plane);
            let [first, second] = plane.axes();
            assert_eq!(frame.shares(first.index()), [1.0, 0.0]);
            assert_eq!(frame.shares(second.index()), [0.0, 1.0]);
            assert_eq!(frame.normal()[plane.normal().index()], 1.0);
            assert_eq!(frame.plane(), Some(plane));
            assert_eq!(Plane::of(second, first), Some(plane));
            // A plane measured from below is the same plane.
            let mut normal = [0.0; 3];
            normal[plane.normal().index()] = -2.0;
            assert_eq!(Frame::across(normal), Some(frame));
        }
        assert_eq!(Plane::of(Actuator::X, Actuator::X), None);
        assert_eq!(Plane::of(Actuator::Joint1, Actuator::Joint2), None);
    }

    #[test]
    fn a_tilted_frame_is_orthonormal_and_nearest_to_its_plane() {
        for normal in [[0.3, -0.2, 0.9], [0.9, 0.1, 0.4], [-0.1, -0.8, 0.5]] {
            let frame = Frame::across(normal).unwrap();
            let (u, v, n) = (frame.first(), frame.second(), frame.normal());
            for (a, b, product) in [(u, u, 1.0), (v, v, 1.0), (u, v, 0.0), (u, normal, 0.0)] {
                assert!((dot(a, b) - product).abs() < 1e-12);
            }
            let largest = n.iter().copied().fold(0.0_f64, |m, c| m.max(c.abs()));
            assert!(n.contains(&largest), "the largest component is positive");
            assert_eq!(frame.plane(), None);
        }
        assert_eq!(Frame::across([0.0; 3]), None);
        assert_eq!(Frame::across([f64::NAN, 0.0, 1.0]), None);
    }
}
