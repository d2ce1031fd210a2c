//! The simulation as it stands: one servo lag, kv fitted to the sizes, or a model that was given.
use super::survey::Response;
use crate::campaign::Run;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

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

/// Chance with which circles that do not shrink at all are given a servo.
const FALSE_SERVO: f64 = 0.01;

/// κ2 = 1/kv² of the lag that fits the sizes best (least squares, exact |G|), the static error β0 of each radius free;
/// negative where circles grow with speed, 0 where f²/R is not significant beside the β0.
///
/// A radius with one feed says nothing beside its β0: without a radius that has two, no servo is claimed.
pub fn fit_lag(sizes: &[Size]) -> Response {
    let groups = radii_with_feeds(sizes);
    let used: usize = groups.iter().map(Vec::len).sum();
    let cost = |a_s2: f64| -> f64 { groups.iter().map(|group| scatter(group, a_s2)).sum() };
    let a_s2 = lowest(sizes, &groups, &cost);
    let dof = used.saturating_sub(groups.len() + 1);
    let (with, without) = (cost(a_s2), cost(0.0));
    let significant = match FisherSnedecor::new(1.0, dof as f64) {
        // Sizes that are exact to the last digit leave nothing to divide by.
        Ok(law) if with > 0.0 => {
            (without - with) / with * dof as f64 > law.inverse_cdf(1.0 - FALSE_SERVO)
        }
        Ok(_) => without > with,
        Err(_) => without > 0.0,
    };
    Response {
        a_s2: if significant { a_s2 } else { 0.0 },
        b_s4: 0.0,
    }
}

/// The sizes of each radius that was run at two rates of turn or more.
fn radii_with_feeds(sizes: &[Size]) -> Vec<Vec<&Size>> {
    let same = |a: f64, b: f64| (a - b).abs() < 1e-6 * b.abs();
    let mut groups: Vec<Vec<&Size>> = Vec::new();
    for size in sizes {
        match groups
            .iter_mut()
            .find(|group| same(group[0].radius_m, size.radius_m))
        {
            Some(group) => group.push(size),
            None => groups.push(vec![size]),
        }
    }
    groups.retain(|group| {
        group
            .iter()
            .any(|size| !same(size.omega_rad_s, group[0].omega_rad_s))
    });
    groups
}

/// Sum of squares that a lag leaves of the sizes of one radius, their mean taken off, m².
fn scatter(group: &[&Size], a_s2: f64) -> f64 {
    let response = Response { a_s2, b_s4: 0.0 };
    let left = |s: &&Size| s.error_m - s.radius_m * (response.gain(s.omega_rad_s) - 1.0);
    let mean = group.iter().map(left).sum::<f64>() / group.len() as f64;
    group.iter().map(|s| (left(s) - mean).powi(2)).sum()
}

/// The minimum of `cost` over κ2: from the linear least squares ΔR = −½κ2·ω²R, then by parabolas.
fn lowest(sizes: &[Size], groups: &[Vec<&Size>], cost: &dyn Fn(f64) -> f64) -> f64 {
    let x = |s: &Size| -0.5 * s.radius_m * s.omega_rad_s.powi(2);
    let (mut up, mut down) = (0.0, 0.0);
    for group in groups {
        let mean = group.iter().map(|s| x(s)).sum::<f64>() / group.len() as f64;
        for s in group {
            up += (x(s) - mean) * s.error_m;
            down += (x(s) - mean).powi(2);
        }
    }
    let fastest = sizes.iter().map(|s| s.omega_rad_s).fold(0.0, f64::max);
    // A response that blows up within the measured range is no response.
    let least = -0.9 / fastest.powi(2).max(f64::MIN_POSITIVE);
    let mut a = if down > 0.0 {
        (up / down).max(least)
    } else {
        0.0
    };
    let mut step = (0.2 * a.abs()).max(1e-9);
    for _ in 0..60 {
        let (low, mid, high) = (cost(a - step), cost(a), cost(a + step));
        let bend = low - 2.0 * mid + high;
        let delta = if bend > 0.0 {
            (0.5 * step * (low - high) / bend).clamp(-step, step)
        } else {
            0.0
        };
        if a + delta > least && cost(a + delta) <= mid {
            a += delta;
        }
        step *= 0.7;
    }
    a
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
        assert!((fit_lag(&sizes).a_s2 / truth.a_s2 - 1.0).abs() < 1e-6);
    }

    /// Every radius has a calibration error of its own: no lag is read from it.
    #[test]
    fn a_static_error_of_each_radius_is_no_servo() {
        let sizes = |a_s2: f64| -> Vec<Size> {
            let response = Response { a_s2, b_s4: 0.0 };
            [(0.1, 30e-6), (0.15, -200e-6)]
                .into_iter()
                .flat_map(|(radius_m, offset_m)| {
                    (1..6).map(move |i| {
                        let omega_rad_s = 0.1 * f64::from(i) / radius_m;
                        let odd = f64::from((i * 7) % 3 - 1) * 0.5e-6;
                        let error_m =
                            radius_m * (response.gain(omega_rad_s) - 1.0) + offset_m + odd;
                        Size {
                            radius_m,
                            omega_rad_s,
                            error_m,
                        }
                    })
                })
                .collect()
        };
        assert_eq!(fit_lag(&sizes(0.0)).a_s2, 0.0);
        assert!((fit_lag(&sizes(1e-4)).a_s2 / 1e-4 - 1.0).abs() < 0.05);
    }
}
