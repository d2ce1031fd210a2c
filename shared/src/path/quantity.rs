//! The numbers of a path by their names: one list for whoever converts, plans or refuses.
use serde::{Deserialize, Serialize};

/// Which number of a path an error speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(
    missing_docs,
    reason = "the message of each variant is its documentation"
)]
pub enum Quantity {
    #[error("radius (m)")]
    Radius,
    #[error("feed (m/s)")]
    Feed,
    #[error("laps")]
    Laps,
    #[error("centre (m)")]
    Centre,
    #[error("start angle (rad)")]
    Start,
    #[error("centripetal acceleration (m/s^2)")]
    Acceleration,
    #[error("position (m)")]
    Position,
    #[error("normal of the plane")]
    Normal,
    #[error("the plane's two vectors")]
    Plane,
    #[error("sweep (rad)")]
    Sweep,
    #[error("rise (m)")]
    Rise,
    #[error("gap between the machine and the start (m)")]
    Gap,
    #[error("length (m)")]
    Length,
    #[error("time (s)")]
    Time,
    #[error("correction by profile terms (m)")]
    Terms,
    #[error("distance of the set-points (s)")]
    Window,
    #[error("override of the feed (%)")]
    Override,
}
