//! Rotations as matrices, row by row.
use super::Real;
use num_traits::Float;

/// A rotation: its rows.
pub type Matrix<T> = [[T; 3]; 3];

/// About Y by an angle, rad.
pub fn about_y<T: Real>(angle_rad: T) -> Matrix<T> {
    let ((s, c), o, l) = (angle_rad.sine_cosine(), T::zero(), T::one());
    [[c, o, s], [o, l, o], [-s, o, c]]
}

/// About Z by an angle, rad.
pub fn about_z<T: Real>(angle_rad: T) -> Matrix<T> {
    let ((s, c), o, l) = (angle_rad.sine_cosine(), T::zero(), T::one());
    [[c, -s, o], [s, c, o], [o, o, l]]
}

/// Product of a matrix and a vector.
pub fn turned<T: Float>(m: &Matrix<T>, v: [T; 3]) -> [T; 3] {
    m.map(|row| dot(row, v))
}

/// Product of two.
pub fn product<T: Float>(a: &Matrix<T>, b: &Matrix<T>) -> Matrix<T> {
    let [b0, b1, b2] = *b;
    let columns = transposed(&[b0, b1, b2]);
    a.map(|row| columns.map(|column| dot(row, column)))
}

/// The way back.
pub fn transposed<T: Float>(m: &Matrix<T>) -> Matrix<T> {
    let [[a, b, c], [d, e, f], [g, h, i]] = *m;
    [[a, d, g], [b, e, h], [c, f, i]]
}

/// Where the three axes point.
pub fn axes<T: Float>(m: &Matrix<T>) -> [[T; 3]; 3] {
    transposed(m)
}

/// Rotation of a unit quaternion w, x, y, z.
pub fn of_quaternion<T: Float>([w, x, y, z]: [T; 4]) -> Matrix<T> {
    let one = T::one();
    let two = one + one;
    [
        [
            one - two * (y * y + z * z),
            two * (x * y - w * z),
            two * (x * z + w * y),
        ],
        [
            two * (x * y + w * z),
            one - two * (x * x + z * z),
            two * (y * z - w * x),
        ],
        [
            two * (x * z - w * y),
            two * (y * z + w * x),
            one - two * (x * x + y * y),
        ],
    ]
}

/// Scalar product.
pub fn dot<T: Float>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> T {
    a * x + b * y + c * z
}

/// Vector product.
pub fn cross<T: Float>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [T; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// Sum.
pub fn sum<T: Float>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [T; 3] {
    [a + x, b + y, c + z]
}

/// Difference.
pub fn difference<T: Float>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [T; 3] {
    [a - x, b - y, c - z]
}
