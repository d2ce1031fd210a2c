//! giotto on the host: measure, fit, explain, deploy, prove. The binary is a thin face over this library.
#![forbid(unsafe_code)]

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
