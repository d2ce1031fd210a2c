//! The simulation as it stands: one servo lag, kv fitted to the sizes, or a model that was given.
use super::survey::Response;
use crate::campaign::Run;

/// Mean radius error and angular rate of a run, as the fit of kv sees it.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Radius, m.
    pub radius_m: f64,
    /// ω, rad/s.
    pub omega_rad_s: f64,
    /// Mean deviation, m.
    pub error_m: f64,
}

impl Size {
    /// Of a run at a feed.
    pub fn of(run: &Run, feed_m_s: f64) -> Self {
        let deviation = &run.samples.deviation_m;
        Self {
            radius_m: run.radius_m,
            omega_rad_s: feed_m_s / run.radius_m,
            error_m: deviation.iter().sum::<f64>() / deviation.len().max(1) as f64,
        }
    }
}

/// κ2 = 1/kv² of the lag that fits the sizes best (least squares, exact |G|); negative where circles grow with speed.
pub fn fit_lag(sizes: &[Size]) -> Response {
    let cost = |a_s2: f64| -> f64 {
        let response = Response { a_s2, b_s4: 0.0 };
        sizes
            .iter()
            .map(|s| (s.error_m - s.radius_m * (response.gain(s.omega_rad_s) - 1.0)).powi(2))
            .sum()
    };
    // Start: least squares of ΔR = −½a·ω²R.
    let (mut up, mut down) = (0.0, 0.0);
    for s in sizes {
        let x = -0.5 * s.radius_m * s.omega_rad_s.powi(2);
        up += x * s.error_m;
        down += x * x;
    }
    let mut a = if down > 0.0 { up / down } else { 0.0 };
    let mut step = (0.2 * a.abs()).max(1e-9);
    for _ in 0..60 {
        let (low, mid, high) = (cost(a - step), cost(a), cost(a + step));
        let bend = low - 2.0 * mid + high;
        let delta = if bend > 0.0 {
            (0.5 * step * (low - high) / bend).clamp(-step, step)
        } else {
            0.0
        };
        if cost(a + delta) <= mid {
            a += delta;
        }
        step *= 0.7;
    }
    Response { a_s2: a, b_s4: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_is_found_again() {
        let truth = Response {
            a_s2: 1.2e-4,
            b_s4: 0.0,
        };
        let sizes: Vec<Size> = [0.1, 0.15, 0.3]
            .into_iter()
            .flat_map(|radius_m| (1..8).map(move |i| (radius_m, 0.1 * f64::from(i) / radius_m)))
            .map(|(radius_m, omega_rad_s)| Size {
                radius_m,
                omega_rad_s,
                error_m: radius_m * (truth.gain(omega_rad_s) - 1.0),
            })
            .collect();
        assert!((fit_lag(&sizes).a_s2 / truth.a_s2 - 1.0).abs() < 1e-9);
    }
}
