//! Where a circle lies in the machine: two unit vectors at right angles, by a rule of the tests' own.
use giotto::campaign::Frame;

/// Directions of polar angle 0 and 90° in machine coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Of angle 0.
    pub u: [f64; 3],
    /// Of angle 90°.
    pub v: [f64; 3],
}

impl Plane {
    /// From X to Y.
    pub const XY: Self = Self {
        u: [1.0, 0.0, 0.0],
        v: [0.0, 1.0, 0.0],
    };
    /// From Y to Z.
    pub const YZ: Self = Self {
        u: [0.0, 1.0, 0.0],
        v: [0.0, 0.0, 1.0],
    };
    /// From Z to X.
    pub const ZX: Self = Self {
        u: [0.0, 0.0, 1.0],
        v: [1.0, 0.0, 0.0],
    };
    /// The three planes of two slides.
    pub const ALL: [Self; 3] = [Self::XY, Self::YZ, Self::ZX];
    /// The slides of each of [`Plane::ALL`], in the order of the angle.
    pub const PAIRS: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

    /// The plane across `normal`. The contract reads points by the nearest coordinate plane: its normal looks along
    /// the positive axis, and angle 0 is that plane's first axis laid into this one.
    pub fn tilted(normal: [f64; 3]) -> Self {
        let longest = if normal[0].abs() >= normal[1].abs().max(normal[2].abs()) {
            0
        } else if normal[1].abs() >= normal[2].abs() {
            1
        } else {
            2
        };
        let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt() * normal[longest].signum();
        let n = normal.map(|c| c / length);
        // The axis after the longest one: Y for X, Z for Y, X for Z.
        let axis = (longest + 1) % 3;
        let mut u = n.map(|c| -n[axis] * c);
        u[axis] += 1.0;
        let size = u.iter().map(|c| c * c).sum::<f64>().sqrt();
        let u = u.map(|c| c / size);
        let v =
            [0, 1, 2].map(|k| n[(k + 1) % 3] * u[(k + 2) % 3] - n[(k + 2) % 3] * u[(k + 1) % 3]);
        Self { u, v }
    }

    /// Unit vector across the plane.
    pub fn normal(&self) -> [f64; 3] {
        let (u, v) = (self.u, self.v);
        [0, 1, 2].map(|k| u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3])
    }

    /// A point of the plane in machine coordinates.
    pub fn lift(&self, p: [f64; 2]) -> [f64; 3] {
        [0, 1, 2].map(|k| p[0] * self.u[k] + p[1] * self.v[k])
    }

    /// A place in the coordinates of the plane: along angle 0, along 90°, across.
    pub fn coordinates(&self, p: [f64; 3]) -> [f64; 3] {
        [self.u, self.v, self.normal()].map(|d| d[0] * p[0] + d[1] * p[1] + d[2] * p[2])
    }

    /// Distance in the plane from its origin, m.
    pub fn radius(&self, p: [f64; 3]) -> f64 {
        let [x, y, _] = self.coordinates(p);
        x.hypot(y)
    }

    /// Whether a slide moves on a circle of this plane.
    pub fn moves(&self, slide: usize) -> bool {
        self.u[slide] != 0.0 || self.v[slide] != 0.0
    }

    /// Whether it is none of the three planes of two slides.
    pub fn is_tilted(&self) -> bool {
        !Self::ALL.contains(self)
    }

    /// As the campaign has it.
    pub fn frame(&self) -> Frame {
        Frame::across(self.normal()).unwrap_or_default()
    }
}

impl Default for Plane {
    fn default() -> Self {
        Self::XY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_those_that_the_reader_takes_them_for() {
        let mut planes = Plane::ALL.to_vec();
        planes.extend(
            [
                [0.2, -0.4, 0.8],
                [-0.7, 0.1, 0.2],
                [0.3, -0.9, 0.1],
                [0.0, 0.5, 0.9],
            ]
            .map(Plane::tilted),
        );
        for plane in planes {
            let frame = plane.frame();
            for (own, read) in [(plane.u, frame.first()), (plane.v, frame.second())] {
                for k in 0..3 {
                    assert!((own[k] - read[k]).abs() < 1e-12, "{plane:?} {frame:?}");
                }
            }
        }
        for (plane, normal) in Plane::ALL
            .iter()
            .zip([[0., 0., 1.], [1., 0., 0.], [0., 1., 0.]])
        {
            assert_eq!(Plane::tilted(normal), *plane);
        }
    }
}
