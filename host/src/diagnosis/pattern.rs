//! Patterns without a name: what the search may find that is in no list.
//!
//! They compete with the causes on the same evidence, so that an effect outside the list is not bent into
//! it: a third harmonic that flips with direction explains such data better than any listed cause could.
use super::survey::Prepared;
use serde::Serialize;

/// How a pattern depends on feed and radius: f^a·R^b, scaled to about 1 over the campaign.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Law {
    /// Exponent of the feed.
    pub feed: f64,
    /// Exponent of the radius.
    pub radius: f64,
}

impl Law {
    const fn new(feed: f64, radius: f64) -> Self {
        Self { feed, radius }
    }

    fn at(self, run: &Prepared) -> f64 {
        // Reference 0.3 m/s and 0.15 m: only a scale.
        (run.view.feed_m_s / 0.3).powf(self.feed) * (run.view.radius_m / 0.15).powf(self.radius)
    }
}

const LAWS: [Law; 8] = [
    Law::new(0.0, 0.0),
    Law::new(1.0, 0.0),
    Law::new(2.0, -1.0),
    Law::new(0.0, 1.0),
    Law::new(0.0, 2.0),
    Law::new(2.0, 0.0),
    Law::new(1.0, -1.0),
    Law::new(1.0, 1.0),
];

/// A pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// Mean radius.
    Size {
        /// Flips with the direction.
        odd: bool,
        /// Dependence on f and R.
        law: Law,
    },
    /// Mean radius over campaign time: slope (`step` `None`) or a step after a share of the campaign.
    Time {
        /// Share of the campaign at the step.
        step: Option<f64>,
        /// Dependence on f and R.
        law: Law,
    },
    /// A harmonic, cosine and sine.
    Harmonic {
        /// Waves a turn.
        order: usize,
        /// Flips with the direction.
        odd: bool,
        /// Follows the machine (true) or the clock (false): whether the lag turns it.
        machine: bool,
        /// Dependence on f and R.
        law: Law,
    },
    /// A bump at one place.
    Bump {
        /// Polar angle, rad.
        centre_rad: f64,
        /// Standard width, rad.
        width_rad: f64,
        /// Flips with the direction.
        odd: bool,
        /// Dependence on f and R.
        law: Law,
    },
}

impl Pattern {
    /// Number of linear columns.
    pub fn columns(&self) -> usize {
        if matches!(self, Self::Harmonic { .. }) { 2 } else { 1 }
    }

    /// Size of the pattern in a run, by its law, without parity (any scale).
    pub fn size(&self, run: &Prepared) -> f64 {
        match self {
            Self::Size { law, .. }
            | Self::Time { law, .. }
            | Self::Harmonic { law, .. }
            | Self::Bump { law, .. } => law.at(run),
        }
    }

    /// Values at each sample of a run (any scale).
    pub fn samples(&self, column: usize, run: &Prepared, out: &mut [f64]) {
        const SCALE: f64 = 1e-6;
        let parity = |odd: bool| if odd { run.view.sign } else { 1.0 };
        match *self {
            Self::Size { odd, law } => out.fill(SCALE * parity(odd) * law.at(run)),
            Self::Time { step, law } => {
                let share = run.view.elapsed;
                out.fill(SCALE * law.at(run) * step.map_or(share, |at| f64::from(share > at)));
            }
            Self::Harmonic { order, odd, machine, law } => {
                let size = SCALE * parity(odd) * law.at(run);
                let turn = if machine { 0.0 } else { run.turned_rad };
                for (out, psi) in out.iter_mut().zip(&run.view.psi_rad) {
                    let (sin, cos) = (order as f64 * (psi + turn)).sin_cos();
                    *out = size * if column == 0 { cos } else { sin };
                }
            }
            Self::Bump { centre_rad, width_rad, odd, law } => {
                let size = SCALE * parity(odd) * law.at(run);
                for (out, psi) in out.iter_mut().zip(&run.view.psi_rad) {
                    let turn = std::f64::consts::TAU;
                    let off = (psi - centre_rad + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
                    *out = size * (-0.5 * (off / width_rad).powi(2)).exp();
                }
            }
        }
    }

    /// Patterns of the mean radius that no cause covers.
    pub fn sizes() -> Vec<Self> {
        let mut out = Vec::new();
        for law in LAWS {
            let (f, r) = (law.feed, law.radius);
            // Covered: offset, scale, the servo's own f²/R; lateral play and joint lag for the odd ones.
            if !matches!((f, r), (0.0, 0.0) | (0.0, 1.0) | (2.0, -1.0)) {
                out.push(Self::Size { odd: false, law });
            }
            if !matches!((f, r), (1.0, 0.0)) {
                out.push(Self::Size { odd: true, law });
            }
        }
        for law in [Law::new(0.0, 0.0), Law::new(1.0, 0.0)] {
            out.push(Self::Time { step: None, law });
        }
        for tenth in 1..10 {
            for law in [Law::new(0.0, 0.0), Law::new(0.0, 1.0)] {
                out.push(Self::Time { step: Some(f64::from(tenth) / 10.0), law });
            }
        }
        out
    }

    /// Harmonics that no cause covers, of orders up to `highest`.
    pub fn harmonics(highest: usize) -> Vec<Self> {
        let mut out = Vec::new();
        for order in 2..=highest {
            for law in LAWS {
                for odd in [false, true] {
                    let covered = matches!(
                        (order, law.feed, law.radius, odd),
                        (2, 0.0, 1.0, false)
                            | (2, 2.0, -1.0, false)
                            | (2, 1.0, 0.0, true)
                            | (3, 0.0, 2.0, false)
                    );
                    if !covered {
                        out.extend([true, false].map(|machine| Self::Harmonic { order, odd, machine, law }));
                    }
                }
            }
        }
        out
    }

    /// Bumps all around the circle.
    pub fn bumps() -> Vec<Self> {
        let mut out = Vec::new();
        for (places, width_deg) in [(72, 3.0), (36, 8.0), (18, 16.0)] {
            for place in 0..places {
                let centre_rad = std::f64::consts::TAU * f64::from(place) / f64::from(places);
                for odd in [false, true] {
                    for law in [Law::new(0.0, 0.0), Law::new(1.0, 0.0), Law::new(0.0, 1.0)] {
                        out.push(Self::Bump { centre_rad, width_rad: f64::to_radians(width_deg), odd, law });
                    }
                }
            }
        }
        out
    }
}
