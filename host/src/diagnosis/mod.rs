//! What the simulation gets wrong, and why.
//!
//! A campaign is prepared ([`survey`]), its noise and its scatter between runs are measured ([`spread`]),
//! causes and nameless patterns compete for it ([`search`], [`explain`]), tones in time are looked for
//! ([`tone`]).
pub mod baseline;
pub mod basis;
pub mod explain;
pub mod ledger;
pub mod linear;
pub mod pattern;
pub mod roughness;
pub mod search;
pub mod shape;
pub mod spread;
pub mod survey;
pub mod tone;
