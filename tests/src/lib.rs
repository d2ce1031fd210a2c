//! Machines and helpers for the cross-crate tests.
//!
//! [`machine`] and [`arm`] move in the time domain and share nothing with the simulation under test; [`effects`]
//! hides known errors in them, scaled to a wanted misfit; [`nuisance`] does what real campaigns suffer from; [`files`] writes such campaigns with their truth;
//! [`command`] runs the real binary; [`study`] judges what `diagnose` makes of them. [`fuzz`] takes any bytes, [`noise`] makes
//! them. [`nc`] makes up programs for machines and judges what `giotto compensate` makes of them.
pub mod arm;
pub mod command;
pub mod effects;
pub mod files;
pub mod fuzz;
pub mod machine;
pub mod nc;
pub mod noise;
pub mod nuisance;
pub mod paper;
pub mod study;
pub mod terminal;
