//! The power study: many hidden campaigns, what `diagnose` said of each, and how often it was right.
pub mod bars;
pub mod outcome;
pub mod schedule;
pub mod sheet;
pub mod verdict;

pub use outcome::{Finding, Outcome};
pub use schedule::{Group, Job, schedule};
pub use verdict::{Verdict, judge};
