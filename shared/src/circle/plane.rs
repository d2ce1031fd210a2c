//! The plane of a circle measured in space.
use super::{BLOCK, CircleError, Merge, Scatter};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use num_traits::Float;

/// Least-squares (orthogonal) plane through 3-D points, with axes in it for projection.
///
/// ```
/// use giotto_shared::circle::{CircleError, Plane};
///
/// // Points of a table that rises by 1 mm over 1 m along x.
/// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 1e-3], [1.0, 1.0, 1e-3], [0.0, 1.0, 0.0]];
/// let plane = Plane::fit(points.into_iter())?;
/// assert!((plane.tilt_rad - 1e-3).abs() < 1e-8);
/// assert!(plane.flatness < 1e-12);
/// # Ok::<(), CircleError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Mean of the points, m; lies in the plane.
    pub centroid: [f64; 3],
    /// Unit normal, in the hemisphere of +z so that counter-clockwise seen from above stays so.
    pub normal: [f64; 3],
    /// Unit vectors in the plane: the first is x projected (y, for a plane across x), the second completes
    /// the right-handed frame with the normal.
    pub axes: [[f64; 3]; 2],
    /// Angle between normal and z, rad, 0…π/2.
    pub tilt_rad: f64,
    /// Root mean square distance of the points from the plane, m; from moments alone to 1e-8 of their spread.
    pub rms: f64,
    /// Flatness: highest minus lowest point over the plane, m.
    pub flatness: f64,
}

impl Plane {
    /// Fits a plane to points that may be walked twice.
    ///
    /// # Errors
    /// [`CircleError`] for fewer than three points, coincident or collinear points, a coordinate that is not finite.
    pub fn fit<I>(points: I) -> Result<Self, CircleError>
    where
        I: Iterator<Item = [f64; 3]> + Clone,
    {
        let mut scatter = Scatter::default();
        let mut block = [[0.0; BLOCK]; 3];
        let mut n = 0;
        let mut flush = |block: &[[f64; BLOCK]; 3], n: usize| {
            let [x, y, z] = block;
            scatter.merge(&Scatter::of_block(&x[..n], &y[..n], &z[..n]));
        };
        for p in points.clone() {
            for (axis, v) in block.iter_mut().zip(p) {
                axis[n] = v;
            }
            n += 1;
            if n == BLOCK {
                flush(&block, n);
                n = 0;
            }
        }
        flush(&block, n);
        let plane = Self::through(&scatter)?;
        let (mut lowest, mut highest, mut squares) = (0.0_f64, 0.0_f64, 0.0);
        for height in points.map(|p| plane.height(p)) {
            (lowest, highest) = (lowest.min(height), highest.max(height));
            squares += height * height;
        }
        let rms = Float::sqrt(squares / scatter.count as f64);
        Ok(Self {
            rms,
            flatness: highest - lowest,
            ..plane
        })
    }

    /// The plane of points by their moments. Its `flatness` is NaN: moments know of no extremes, see [`height`](Self::height).
    ///
    /// # Errors
    /// As [`fit`](Self::fit).
    pub fn through(scatter: &Scatter) -> Result<Self, CircleError> {
        if scatter.count < 3 {
            return Err(CircleError::TooFew {
                points: scatter.count,
            });
        }
        let [xx, xy, xz, yy, yz, zz] = scatter.sums.map(|sum| sum / scatter.count as f64);
        let moments = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        if !moments.iter().all(|v| v.is_finite()) {
            return Err(CircleError::NonFinite);
        }
        let spread = Float::sqrt(moments.trace());
        let digits = 4.0 * f64::EPSILON * Vector3::from(scatter.mean).amax();
        if spread <= digits.max(f64::MIN_POSITIVE) || !(1.0 / (spread * spread)).is_finite() {
            return Err(CircleError::Coincident);
        }
        let eigen = SymmetricEigen::new(moments / (spread * spread));
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        // Below 1e-7 of the spread the second direction is lost in the rounding of the scatter.
        if eigen.eigenvalues[order[1]] <= 1e-14 {
            return Err(CircleError::Collinear);
        }
        let mut normal: Vector3<f64> = eigen.eigenvectors.column(order[0]).normalize();
        if normal.z < 0.0 {
            normal = -normal;
        }
        let reference = if Float::abs(normal.x) < 0.999 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let along = (reference - normal * normal.dot(&reference)).normalize();
        let across = normal.cross(&along);
        Ok(Self {
            centroid: scatter.mean,
            normal: normal.into(),
            axes: [along.into(), across.into()],
            tilt_rad: Float::atan2(Float::hypot(normal.x, normal.y), normal.z),
            rms: spread * Float::sqrt(eigen.eigenvalues[order[0]].max(0.0)),
            flatness: f64::NAN,
        })
    }

    /// Distance of a point from the plane, m, positive on the side of the normal.
    pub fn height(&self, point: [f64; 3]) -> f64 {
        let d: [f64; 3] = core::array::from_fn(|i| point[i] - self.centroid[i]);
        self.normal[0] * d[0] + self.normal[1] * d[1] + self.normal[2] * d[2]
    }

    /// Coordinates of a point along [`axes`](Self::axes), from the centroid, m.
    pub fn project(&self, point: [f64; 3]) -> [f64; 2] {
        let d: [f64; 3] = core::array::from_fn(|i| point[i] - self.centroid[i]);
        self.axes
            .map(|axis| axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2])
    }

    /// The point in space at coordinates that [`project`](Self::project) gives.
    pub fn lift(&self, point: [f64; 2]) -> [f64; 3] {
        core::array::from_fn(|i| {
            self.centroid[i] + point[0] * self.axes[0][i] + point[1] * self.axes[1][i]
        })
    }
}
