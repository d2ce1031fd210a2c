//! The circles that may be run.
use crate::campaign::{Campaign, Direction, Plane, Run};
use giotto_shared::Frame;

/// What machine and instrument allow; what is not said follows from the campaign.
#[derive(Clone, Debug, Default)]
pub struct Limits {
    /// Radii that the instrument has, m; empty: those of the campaign and the lengths of usual bars.
    pub radii_m: Vec<f64>,
    /// Largest radius, m; else the largest of the campaign: nobody has said that the machine may go further.
    pub largest_radius_m: Option<f64>,
    /// Highest feed, m/s; else the highest of the campaign.
    pub highest_feed_m_s: Option<f64>,
    /// Highest centripetal acceleration, m/s²; else the highest of the campaign.
    pub highest_acceleration_m_s2: Option<f64>,
}

/// A circle that may be run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Radius, m.
    pub radius_m: f64,
    /// Feed, m/s.
    pub feed_m_s: f64,
    /// Direction.
    pub direction: Direction,
    /// Plane.
    pub plane: Plane,
}

/// Lengths that ballbars come in, alone and with their extensions, m.
const BARS_M: [f64; 9] = [0.05, 0.1, 0.15, 0.25, 0.3, 0.4, 0.45, 0.55, 0.6];
/// Feeds as shares of the highest.
const SHARES: [f64; 7] = [0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
/// A turn should not last longer, s.
const LONGEST_TURN_S: f64 = 180.0;

/// Two significant digits: what a person would program.
fn round(value: f64) -> f64 {
    let unit = 10f64.powf(value.abs().max(1e-9).log10().floor() - 1.0);
    // Through a decimal fraction of a micrometre, so that 0.1 m stays 100 mm.
    ((value / unit).round() * unit * 1e6).round() / 1e6
}

/// The coordinate plane nearest to that of a run.
pub fn plane_of(run: &Run) -> Plane {
    let normal = run.frame.normal();
    let along = |plane: &Plane| {
        let other = Frame::of(*plane).normal();
        normal.iter().zip(other).map(|(a, b)| a * b).sum::<f64>()
    };
    Plane::ALL
        .into_iter()
        .max_by(|a, b| along(a).total_cmp(&along(b)))
        .unwrap_or_default()
}

/// Every circle within the limits.
pub fn circles(campaign: &Campaign, limits: &Limits) -> Vec<Circle> {
    let runs = || campaign.runs.iter();
    let feed = limits
        .highest_feed_m_s
        .unwrap_or_else(|| runs().map(|r| r.feed_m_s).fold(0.0, f64::max));
    let acceleration = limits.highest_acceleration_m_s2.unwrap_or_else(|| {
        runs()
            .map(|r| r.feed_m_s.powi(2) / r.radius_m)
            .fold(0.0, f64::max)
    });
    let mut radii = limits.radii_m.clone();
    if radii.is_empty() {
        let seen: Vec<f64> = runs().map(|r| r.radius_m).collect();
        let high = seen.iter().copied().fold(0.0, f64::max);
        let largest = limits.largest_radius_m.unwrap_or(high) * (1.0 + 1e-9);
        radii = seen;
        radii.extend(BARS_M.iter().filter(|r| **r <= largest));
    }
    if let Some(largest) = limits.largest_radius_m {
        radii.retain(|r| *r <= largest * (1.0 + 1e-9));
    }
    let mut feeds: Vec<f64> = SHARES.iter().map(|k| round(k * feed)).collect();
    feeds.extend(runs().map(|r| r.feed_m_s).filter(|f| *f <= feed));
    for list in [&mut radii, &mut feeds] {
        list.sort_by(f64::total_cmp);
        list.dedup_by(|a, b| (*a - *b).abs() < 0.03 * b.abs());
    }
    // An operator goes on in the planes that were measured.
    let mut planes: Vec<Plane> = runs().map(plane_of).collect();
    planes.sort_unstable();
    planes.dedup();
    let mut out = Vec::new();
    for &radius_m in &radii {
        for &feed_m_s in &feeds {
            let within = feed_m_s * feed_m_s / radius_m <= acceleration * (1.0 + 1e-9);
            if within && std::f64::consts::TAU * radius_m / feed_m_s <= LONGEST_TURN_S {
                for &plane in &planes {
                    for direction in [Direction::Ccw, Direction::Cw] {
                        out.push(Circle {
                            radius_m,
                            feed_m_s,
                            direction,
                            plane,
                        });
                    }
                }
            }
        }
    }
    out
}
