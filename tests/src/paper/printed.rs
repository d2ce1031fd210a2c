//! Printed numbers of the paper, held against what the printed model gives on the circles it describes.
use super::{PAPER, RADII_M, feeds_m_s};
use giotto::fit::{FitError, Triangle};

/// Printed: F of X1 alone, of X2 alone, of X2 with X1 in; half-widths of Table 1 (β0 µm, β1 10⁻⁶ s², β2 10⁻⁶ s⁴).
pub const F1: f64 = 1666.5;
/// F of X2 alone.
pub const F2: f64 = 153.6;
/// F of X2 with X1 in.
pub const F21: f64 = 21.4;
/// Half-width of β0, µm (Table 1: 184.27 … 3734.28 ×10⁻³).
pub const HALF_BETA0_UM: f64 = (3734.28 - 184.27) / 2.0 * 1e-3;
/// Half-width of β1, 10⁻⁶ s² (Table 1: −25.45 … −21.14).
pub const HALF_BETA1: f64 = (25.45 - 21.14) / 2.0;
/// Half-width of β2, 10⁻⁶ s⁴ (Table 1: −0.36 … −0.09).
pub const HALF_BETA2: f64 = (0.36 - 0.09) / 2.0;

/// What the model gives where the scatter between runs is chosen so that F1 is the printed one.
#[derive(Clone, Copy, Debug)]
pub struct Follows {
    /// That scatter, µm; `None` if no scatter gives F1: what X1 leaves unexplained is already too much.
    pub scatter_um: Option<f64>,
    /// F1 without any scatter.
    pub f1_without_scatter: f64,
    /// F2, expected.
    pub f2: f64,
    /// F2/1, expected.
    pub f21: f64,
    /// Half-width of β1 over that of β2, s⁻².
    pub half_width_ratio: f64,
}

/// Expected statistics at R = 100 mm, both directions at each feed, with a constant β0 in every model.
///
/// # Errors
/// As [`Triangle::new`].
pub fn follows() -> Result<Follows, FitError> {
    let radius = RADII_M[0];
    let feeds: Vec<f64> = feeds_m_s().flat_map(|f| [f, f]).collect();
    let x1: Vec<f64> = feeds.iter().map(|f| f * f / radius).collect();
    let x2: Vec<f64> = x1.iter().map(|x| x * x / radius).collect();
    let y: Vec<f64> = feeds
        .iter()
        .map(|f| 1e6 * PAPER.radius_error_m(radius, *f))
        .collect();
    let triangle = Triangle::new(&[("f2_r", &x1), ("f4_r3", &x2)], &y, true)?;
    let n = feeds.len() as f64;
    let (only1, only2, both) = (
        triangle.solve(&[0])?,
        triangle.solve(&[1])?,
        triangle.solve(&[0, 1])?,
    );
    // Expected sums of squares: what the model leaves, plus σ² for each degree of freedom.
    let f = |rss: f64, variance: f64| (both.total - rss + variance) / (rss / (n - 2.0) + variance);
    let f1_without_scatter = f(only1.rss, 0.0);
    // F1 = (T − r + σ²)/(r/24 + σ²), solved for σ².
    let variance = (both.total - only1.rss - F1 * only1.rss / (n - 2.0)) / (F1 - 1.0);
    let scatter = variance.max(0.0);
    Ok(Follows {
        scatter_um: (variance > 0.0).then(|| variance.sqrt()),
        f1_without_scatter,
        f2: f(only2.rss, scatter),
        f21: (only1.rss - both.rss + scatter) / scatter,
        half_width_ratio: (both.unscaled_covariance[(1, 1)] / both.unscaled_covariance[(2, 2)])
            .sqrt(),
    })
}
