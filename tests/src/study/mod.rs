//! The power study: many hidden campaigns, what `diagnose` said of each, and how often it was right.
pub mod bars;
pub mod group;
pub mod groups;
pub mod outcome;
pub mod recipe;
pub mod schedule;
pub mod seeds;
pub mod sheet;
pub mod verdict;

pub use group::Group;
pub use outcome::{Finding, Outcome};
pub use recipe::{Recipe, Scatter};
pub use schedule::{Job, Order, schedule};
pub use verdict::{Verdict, judge};
