//! Patterns without a name: what the search may find that is in no list.
//!
//! They compete with the causes on the same evidence, so that an effect outside the list is not bent into
//! it: a third harmonic that flips with direction explains such data better than any listed cause could.
use super::survey::Prepared;
use crate::causes::Harmonics;
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

    /// Size in a run.
    pub(super) fn at(self, run: &Prepared) -> f64 {
        // Reference 0.3 m/s and 0.15 m: only a scale.
        (run.view.feed_m_s / 0.3).powf(self.feed) * (run.view.radius_m / 0.15).powf(self.radius)
    }
}

/// Widths of a bump beyond which it is nothing.
const FAR: f64 = 9.0;
/// Of a pattern whose coefficient is 1, m.
const SCALE: f64 = 1e-6;

/// The laws that patterns go by.
pub(super) const LAWS: [Law; 8] = [
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
        if matches!(self, Self::Harmonic { .. }) {
            2
        } else {
            1
        }
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

    /// Whether it flips with the direction.
    pub const fn odd(&self) -> bool {
        match self {
            Self::Size { odd, .. } | Self::Harmonic { odd, .. } | Self::Bump { odd, .. } => *odd,
            Self::Time { .. } => false,
        }
    }

    /// Size in a run with the parity, m.
    fn amplitude_m(&self, run: &Prepared) -> f64 {
        SCALE * self.size(run) * if self.odd() { run.view.sign } else { 1.0 }
    }

    /// As waves of the machine angle (any scale); nothing for a bump.
    pub fn harmonics(&self, column: usize, run: &Prepared) -> Option<Harmonics> {
        let size = self.amplitude_m(run);
        match *self {
            Self::Size { .. } => Some(Harmonics::mean(size)),
            Self::Time { step, .. } => {
                let share = run.view.elapsed;
                Some(Harmonics::mean(
                    size * step.map_or(share, |at| f64::from(share > at)),
                ))
            }
            Self::Harmonic { order, machine, .. } => {
                let waves = Harmonics::wave(
                    order,
                    if column == 0 {
                        [size, 0.0]
                    } else {
                        [0.0, size]
                    },
                );
                // Waves of the clock are waves of the recorded angle.
                Some(if machine {
                    waves
                } else {
                    waves.seen_from(-run.turned_rad)
                })
            }
            Self::Bump { .. } => None,
        }
    }

    /// Values at each sample of a run (any scale); only bumps need them.
    pub fn samples(&self, run: &Prepared, out: &mut [f64]) {
        let Self::Bump {
            centre_rad,
            width_rad,
            ..
        } = *self
        else {
            return;
        };
        let size = self.amplitude_m(run);
        for (out, psi) in out.iter_mut().zip(run.view.psi_rad.iter()) {
            let turns = (psi - centre_rad) * (1.0 / std::f64::consts::TAU);
            let off = std::f64::consts::TAU * (turns - turns.round()) / width_rad;
            // Far out there is nothing left of it to the last bit.
            *out = if off.abs() < FAR {
                size * (-0.5 * off * off).exp()
            } else {
                0.0
            };
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
                out.push(Self::Time {
                    step: Some(f64::from(tenth) / 10.0),
                    law,
                });
            }
        }
        out
    }

    /// Harmonics that no cause covers, of orders up to `highest`.
    pub fn all_harmonics(highest: usize) -> Vec<Self> {
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
                        out.extend([true, false].map(|machine| Self::Harmonic {
                            order,
                            odd,
                            machine,
                            law,
                        }));
                    }
                }
            }
        }
        out
    }

    /// Centres and widths of the bumps all around the circle, rad.
    pub fn places_of_bumps() -> impl Iterator<Item = (f64, f64)> {
        [(72, 3.0_f64), (36, 8.0), (18, 16.0)]
            .into_iter()
            .flat_map(|(places, width_deg)| {
                let centre =
                    move |place: i32| std::f64::consts::TAU * f64::from(place) / f64::from(places);
                (0..places).map(move |place| (centre(place), width_deg.to_radians()))
            })
    }

    /// Laws of the bumps, and whether they flip with the direction.
    pub fn laws_of_bumps() -> impl Iterator<Item = (Law, bool)> {
        let laws = [Law::new(0.0, 0.0), Law::new(1.0, 0.0), Law::new(0.0, 1.0)];
        laws.into_iter()
            .flat_map(|law| [false, true].map(|odd| (law, odd)))
    }
}
