//! What a program asks for in the engine's own numbers: whole nanometres, half nanometres on the arms of a circle, turns as
//! integers. This is what the wire carries and the planner takes; a controller needs no double precision for it.
//!
//! `convert` makes these from SI. Where a segment ends is said here once, so that a host knows to the nanometre where the
//! controller will stand: the next arc starts there.
use crate::angle::sincos;
use crate::fixed::mulh_add;
use crate::{Direction, Plane};
use serde::{Deserialize, Serialize};

/// Farthest coordinate, m: positions are `i32` nanometres, ±2.147 m.
pub const MAX_POSITION_M: f64 = 2.1;
/// Largest radius, m: vectors of a circle are `i32` half nanometres.
pub const MAX_RADIUS_M: f64 = 1.05;
/// Smallest radius of an arc, m.
pub const MIN_RADIUS_M: f64 = 1e-6;
/// Most whole turns of an arc or a run.
pub const MAX_TURNS: u32 = 1_000_000;
/// Smallest part of a turn that an arc may sweep, in units of 2⁻⁶⁴: 1e-9 rad.
pub const MIN_FRACTION: u64 = 2_935_890_503;

/// Full circles as [`CircleRun`](super::CircleRun) asks for them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExactCircle {
    /// Centre, nm.
    pub centre_nm: [i32; 3],
    /// Radius, nm·2.
    pub radius_half_nm: i32,
    /// Feed, m/s.
    pub feed_m_s: f32,
    /// Plane.
    pub plane: Plane,
    /// Sense.
    pub direction: Direction,
    /// Whole turns at constant feed.
    pub laps: u32,
    /// Polar angle at which they begin; 2³² is a turn.
    pub start: u32,
}

/// An arc or helix: centre + u·cosφ + v·sinφ + rise·φ/2π, φ from 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExactArc {
    /// Foot of the start on the axis, nm.
    pub centre_nm: [i32; 3],
    /// From the centre to the start, nm·2.
    pub u_half_nm: [i32; 3],
    /// Square to it in the sense of travel, as long, nm·2.
    pub v_half_nm: [i32; 3],
    /// Travel along the axis in a turn, nm.
    pub rise_nm: [i32; 3],
    /// Whole turns.
    pub turns: u32,
    /// What is swept beyond them, in units of 2⁻⁶⁴ turn.
    pub fraction: u64,
    /// Feed in the plane, m/s.
    pub feed_m_s: f32,
}

/// One piece of a path, as [`Segment`](super::Segment).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ExactSegment {
    /// Straight to a point.
    Line {
        /// End, nm.
        to_nm: [i32; 3],
        /// Feed, m/s.
        feed_m_s: f32,
    },
    /// About a centre.
    Arc(ExactArc),
    /// Stands still.
    Dwell {
        /// Time, s.
        time_s: f32,
    },
}

/// One coordinate of a place on an arc, nm (rounded down), at cosine and sine in Q31.
#[inline(always)]
pub const fn on_arc([base_nm, u_half_nm, v_half_nm]: [i32; 3], c: i32, s: i32) -> i32 {
    mulh_add(mulh_add(base_nm, u_half_nm, c), v_half_nm, s)
}

/// Travel along the axis, nm, after so many turns (whole, and their fraction).
#[inline(always)]
pub fn risen(per_turn_nm: [i32; 3], turns: i32, fraction_q32: u32) -> [i32; 3] {
    // The fraction as a signed number, so that a product is one instruction: from a half on it is one turn less.
    let signed = fraction_q32 as i32;
    let turns = turns.wrapping_sub(signed >> 31);
    let along = |rise: i32| mulh_add(rise.wrapping_mul(turns), rise, signed);
    let [x, y, z] = per_turn_nm;
    [along(x), along(y), along(z)]
}

impl ExactArc {
    /// The place at a phase (2³² a turn), nm, rise not counted.
    fn at(&self, phase: u32) -> [i32; 3] {
        let (c, s) = sincos(phase);
        let ([bx, by, bz], [ux, uy, uz], [vx, vy, vz]) =
            (self.centre_nm, self.u_half_nm, self.v_half_nm);
        [
            on_arc([bx, ux, vx], c, s),
            on_arc([by, uy, vy], c, s),
            on_arc([bz, uz, vz], c, s),
        ]
    }

    /// From its own start to the place it really starts at, nm: what rounding of centre and vectors leaves, 2 nm at most.
    pub fn gap_nm(&self, from_nm: [i32; 3]) -> [i32; 3] {
        sum(from_nm, self.at(0).map(i32::wrapping_neg))
    }

    /// Where it ends if it starts at a place, nm: that gap away from where it says.
    pub fn end_nm(&self, from_nm: [i32; 3]) -> [i32; 3] {
        let fraction = (self.fraction >> 32) as u32;
        let flat = sum(self.at(fraction), self.gap_nm(from_nm));
        sum(flat, risen(self.rise_nm, self.turns as i32, fraction))
    }
}

impl ExactSegment {
    /// Where it ends if it starts at a place, nm.
    pub fn end_nm(&self, from_nm: [i32; 3]) -> [i32; 3] {
        match self {
            Self::Line { to_nm, .. } => *to_nm,
            Self::Arc(arc) => arc.end_nm(from_nm),
            Self::Dwell { .. } => from_nm,
        }
    }
}

fn sum([a, b, c]: [i32; 3], [x, y, z]: [i32; 3]) -> [i32; 3] {
    [a.wrapping_add(x), b.wrapping_add(y), c.wrapping_add(z)]
}
