//! The plane of points in space, and the circle in it.
use super::Frame;
use giotto_shared::circle::{CircleError, Plane, Scatter};

/// How a circle in space lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// Unit normal of the plane; its largest component is positive, so CCW is seen from the positive axis.
    pub normal: [f64; 3],
    /// Angle between the normal and the nearest axis, rad.
    pub tilt_rad: f64,
    /// Highest minus lowest point over the plane, m.
    pub flatness_m: f64,
}

/// A plane seen from the positive end of the axis nearest to its normal, so that CCW means what it means
/// in G17, G18 and G19, and angles run from the first axis of that plane.
pub(super) struct PlaneView {
    plane: Plane,
    pub(super) frame: Frame,
}

impl PlaneView {
    pub(super) fn through(scatter: &Scatter) -> Result<Self, CircleError> {
        let plane = Plane::through(scatter)?;
        let frame = Frame::across(plane.normal).ok_or(CircleError::NonFinite)?;
        Ok(Self { plane, frame })
    }

    pub(super) fn with_heights(mut self, [lowest, highest]: [f64; 2]) -> Self {
        self.plane.flatness = highest - lowest;
        self
    }

    /// Height of a point over the plane, m.
    pub(super) fn height(&self, point: [f64; 3]) -> f64 {
        self.plane.height(point)
    }

    pub(super) fn project(&self, point: [f64; 3]) -> [f64; 2] {
        let from = [0, 1, 2].map(|k| point[k] - self.plane.centroid[k]);
        [self.frame.first(), self.frame.second()]
            .map(|axis| axis[0] * from[0] + axis[1] * from[1] + axis[2] * from[2])
    }

    pub(super) fn lift(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let (first, second) = (self.frame.first(), self.frame.second());
        [0, 1, 2].map(|k| self.plane.centroid[k] + u * first[k] + v * second[k])
    }

    pub(super) fn tilt(&self) -> Tilt {
        let normal = self.frame.normal();
        let axis = normal.iter().copied().fold(0.0, f64::max);
        let across = normal.iter().map(|c| c * c).sum::<f64>() - axis * axis;
        Tilt {
            normal,
            tilt_rad: across.max(0.0).sqrt().atan2(axis),
            flatness_m: self.plane.flatness,
        }
    }
}
