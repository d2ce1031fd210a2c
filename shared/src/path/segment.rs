//! What a program asks for. SI, machine coordinates.
use crate::{Direction, Plane};

/// Full circles in a coordinate plane: an entry that gains speed along the circle, whole turns at constant feed,
/// an exit that loses it along the circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleRun {
    /// Centre, m.
    pub centre_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
    /// Feed, m/s.
    pub feed_m_s: f64,
    /// Plane; polar angles run from its first axis to its second.
    pub plane: Plane,
    /// Sense, as the angle grows or falls.
    pub direction: Direction,
    /// Whole turns at constant feed, at least 1.
    pub laps: u32,
    /// Polar angle at which the turns at constant feed begin, rad.
    pub start_rad: f64,
}

/// One piece of a path, starting where the one before it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// Straight to a point.
    Line {
        /// End, m.
        to_m: [f64; 3],
        /// Feed, m/s.
        feed_m_s: f64,
    },
    /// About a centre; the radius is the distance of the start from the axis. A rise makes it a helix.
    Arc {
        /// Centre, in the plane of the start, m.
        centre_m: [f64; 3],
        /// Axis of rotation, any length; the sweep is counter-clockwise about it.
        normal: [f64; 3],
        /// Angle travelled, rad; negative is clockwise about the normal.
        sweep_rad: f64,
        /// Travel along the normal over the whole sweep, m.
        rise_m: f64,
        /// Feed in the plane of the arc, m/s.
        feed_m_s: f64,
    },
    /// Stands still.
    Dwell {
        /// Time, s.
        time_s: f64,
    },
}

/// One piece of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The piece, from where the one before ends.
    pub segment: Segment,
    /// How far the path may leave the joint with the one before, m; 0: exact stop.
    pub tolerance_m: f64,
}
