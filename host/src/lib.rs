//! giotto on the host: measure, fit, explain, deploy, prove. The binary (`host/cli`) is a thin face over this library, which
//! knows no terminal and no port.
//!
//! # A tour along the ring
//!
//! A campaign is measured (here: simulated), analysed, fitted and diagnosed; what is found becomes a model, and the model
//! the table that a controller corrects with:
//!
//! ```
//! use giotto::fit::{Observation, RadiusFit};
//! use giotto::simulation::{self, Plan};
//! use giotto::{analysis, diagnosis, table_from_model::table_from_model};
//! use std::path::Path;
//!
//! // A machine whose Y axis loses 12 µm at each reversal, and the circles to run on it.
//! let plan = Plan::parse(
//!     "[machine]\nboth = { kv_per_s = 50.0 }\ny = { backlash_um = 12.0 }\n\
//!      [grid]\nradii_mm = [50.0, 100.0, 150.0]\nfeeds_mm_s = [20.0, 100.0, 300.0]",
//!     Path::new("plan.toml"),
//! )?;
//! let campaign = simulation::campaign(&plan, 1);
//!
//! // What each run shows by itself: its size, its roundness, ISO 230-4.
//! let report = analysis::of_campaign(&campaign).map_err(|(_, error)| error)?;
//! let largest = report.runs.iter().map(|run| run.out_of_roundness_m).fold(0.0, f64::max);
//! assert!(largest > 12e-6);
//!
//! // The paper's law of the size: a lag of 20 ms has β1 = −τ²/2 = −200e-6 s².
//! let sizes: Vec<Observation> = report.runs.iter().map(|run| Observation {
//!     radius_m: run.radius_m,
//!     feed_m_s: run.feed_m_s,
//!     radius_error_m: run.radius_error_m,
//!     out_of_roundness_m: Some(run.out_of_roundness_m),
//! }).collect();
//! let fit = RadiusFit::new(&sizes, Default::default())?;
//! assert!((fit.model.beta1_s2 + 200e-6).abs() < 10e-6);
//!
//! // What is wrong beside that law, how large, and how sure.
//! let diagnosis = diagnosis::diagnose(&campaign, &Default::default())?;
//! let first = &diagnosis.findings[0];
//! assert_eq!((first.cause.id(), first.place().as_str()), ("backlash", "y"));
//! assert!((first.estimate.value - 0.012).abs() < 0.001 && first.estimate.unit == "mm");
//!
//! // The extended model as a controller's table.
//! let made = table_from_model(&diagnosis.model)?;
//! assert_eq!(made.table.zones[0].terms.len(), diagnosis.findings.len() - made.left_out.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Rooms
//!
//! | module | holds |
//! |---|---|
//! | [`campaign`] | measured circles: reading with checks, writing, editing, foreign files |
//! | [`analysis`] | each run by itself, pairs by ISO 230-4, uncertainty |
//! | [`fit`] | least squares, stepwise selection, the radius model of the paper |
//! | [`causes`] | what can be wrong with a machine, one file each |
//! | [`diagnosis`] | which of them it is, how sure, and what a correction gains |
//! | [`planning`] | the next runs that would tell most |
//! | [`simulation`] | the machine in the time domain, and its ballbar |
//! | [`model_file`], [`table_from_model`] | `MODEL.toml`, and the controller's table |
//! | [`summary`], [`comparison`], [`history`] | campaigns set side by side |
//! | [`units`], [`toml_file`], [`whole_file`] | numbers for people, TOML with places, files written whole |
//!
//! Distances are metres, times seconds and angles radians inside; a name says where it is otherwise (`_um`, `_mm`, `_deg`).
//! Errors are typed and name file, line and column. Nothing is random without a seed.
//! Programs of machines are rewritten by `giotto-nc`, controllers are spoken to by `giotto-link`, reports are made by
//! `giotto-report`.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod analysis;
pub mod campaign;
pub mod causes;
pub mod comparison;
pub mod diagnosis;
pub mod fit;
pub mod history;
pub mod kinematics;
pub mod model_file;
pub mod planning;
pub mod simulation;
pub mod summary;
pub mod table_from_model;
pub mod toml_file;
pub mod units;
pub mod whole_file;

// The guide, page by page; its sources are `guide/*.md`.
#[cfg(doc)]
include!(concat!(env!("OUT_DIR"), "/guide.rs"));
