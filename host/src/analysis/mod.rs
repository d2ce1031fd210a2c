//! What each run shows by itself: circle, size, form, noise, feed; and pairs of directions by ISO 230-4.
//!
//! | file | holds |
//! |---|---|
//! | `points` | polar samples as points of the plane, walked in parallel |
//! | `run` | one run: least-squares circle, harmonics, noise |
//! | `size` | the size of a circle that was not seen evenly |
//! | `harmonics` | least-squares Fourier coefficients at any spacing |
//! | `iso230` | G, G(b), F, D of a pair of runs |
//! | `parity` | even and odd part of a pair |
//! | `report` | whole campaigns, in memory or from files |
//! | `counterparts` | figures in the terms of ballbar software |
//! | `uncertainty` | expanded uncertainty of the figures, with its budget |
//! | `tolerance` | pass or fail of each figure, the largest feed that holds |
//! | `json` | the contract's document |
mod counterparts;
mod harmonics;
mod iso230;
mod json;
mod parity;
mod points;
mod report;
mod run;
mod size;
#[cfg(test)]
mod tests;
pub mod tolerance;
pub mod uncertainty;

pub use counterparts::{Counterparts, counterparts};
pub use harmonics::{HIGHEST_ORDER, Harmonic};
pub use iso230::{Iso230, pairs};
pub use json::{Assessment, Document};
pub use parity::{EvenOdd, even_odd, profile};
pub use points::Polar;
pub use report::{Report, of_campaign, of_files};
pub use run::{RunAnalysis, of_run};
