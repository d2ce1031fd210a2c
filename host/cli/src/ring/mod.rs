//! The whole ring on a bundled campaign: measured circles → analysis → fit → diagnosis → table → controller →
//! compensated circles → machine → measured circles. The machine is simulated; the controller is the firmware.
//!
//! | file | holds |
//! |---|---|
//! | `campaign.toml` | the machine, the instrument and the runs of the campaign |
//! | `learn` | from the campaign to a table |
//! | `prove` | unseen circles through the controller into the machine, with and without correction |
//! | `picture` | the largest of them before and after, as SVG |
mod learn;
mod picture;
mod prove;

pub(crate) use learn::image;
pub use learn::{Learned, learn};
pub use picture::picture;
pub(crate) use prove::record;
pub use prove::{CIRCLES, Measured, Pair, Proof, Size, prove};

use giotto::diagnosis::DiagnosisError;
use giotto::fit::FitError;
use giotto::simulation::Plan;
use giotto::table_from_model::ModelTableError;
use giotto::toml_file::TomlFileError;
use giotto_link::ControllerError;
use giotto_shared::circle::CircleError;
use giotto_shared::table::TableError;
use std::path::Path;

/// Least reduction of the radius size error, %, …
pub const REDUCTION_PERCENT: f64 = 99.0;
/// … or what may be left of it, m rms.
pub const LEFT_M: f64 = 0.5e-6;

const CAMPAIGN: &str = include_str!("campaign.toml");

/// Why the ring did not close.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// The bundled plan.
    #[error(transparent)]
    Plan(#[from] TomlFileError),
    /// No circle goes through a run.
    #[error("a run holds no circle: {0}")]
    Circle(#[from] CircleError),
    /// The radius model.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The diagnosis.
    #[error(transparent)]
    Diagnosis(#[from] DiagnosisError),
    /// The runs left out do not prove the extended model.
    #[error("the extended model is not proven on runs left out: nothing is flashed")]
    NotProven,
    /// The extended model has no table.
    #[error(transparent)]
    Model(#[from] ModelTableError),
    /// The table has no image.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The set-points of a circle hold no steady turn.
    #[error(
        "the set-points of R {radius_mm} mm at {feed_mm_s} mm/s hold no whole turn at constant rate"
    )]
    NoSteadyTurn {
        /// Programmed radius, mm.
        radius_mm: f64,
        /// Programmed feed, mm/s.
        feed_mm_s: f64,
    },
    /// The controller.
    #[error(transparent)]
    Controller(#[from] ControllerError),
}

/// The bundled plan.
///
/// # Errors
/// None in a build whose tests pass.
pub fn bundled() -> Result<Plan, DemoError> {
    Ok(Plan::parse(
        CAMPAIGN,
        Path::new("the demo's campaign.toml"),
    )?)
}
