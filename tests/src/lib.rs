//! Machines and helpers for the cross-crate tests.
