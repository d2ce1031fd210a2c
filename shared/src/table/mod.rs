//! The correction table that the controller keeps: its types here, its bytes in [`image`], its checks in
//! [`validate`], the bounds of the image in [`crate::bounds`].
pub mod image;
pub mod validate;

pub use crate::bounds;
pub use image::{
    FORMAT_VERSION, Header, MAX_IMAGE_BYTES, SCHEMA_HASH, check, decode, decode_into, encode, reads,
};
pub use validate::{Field, TableError};

use crate::kinematics::Kinematics;
use crate::model::Cumulants;
use crate::term::Term;
use serde::{Deserialize, Serialize};

/// Most zones in one table.
pub const MAX_ZONES: usize = 8;
/// Most profile terms in one zone.
pub const MAX_TERMS: usize = 8;

/// Profile terms of a zone.
pub type Terms = heapless::Vec<Term<f32>, MAX_TERMS>;
/// Name of a machine.
pub type Name = heapless::String<32>;

/// Directions of travel a zone holds for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Travel {
    /// Both.
    Both,
    /// Counter-clockwise only.
    Ccw,
    /// Clockwise only.
    Cw,
}

/// Where the coefficients were proven, and so where they may be used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    /// Circle centres, lower and upper corner in machine coordinates, m; `None`: anywhere.
    pub place_m: Option<[[f32; 3]; 2]>,
    /// Smallest and largest radius, m.
    pub radius_m: [f32; 2],
    /// Smallest and largest feed, m/s.
    pub feed_m_s: [f32; 2],
    /// Directions.
    pub travel: Travel,
    /// κ2, κ4 of the chain: the operator of `law`.
    pub cumulants: Cumulants<f32>,
    /// Profile terms.
    pub terms: Terms,
}

/// Bounds on what the table may do; the image holds harder ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Largest offset between programmed and corrected position, m.
    pub offset_m: f32,
    /// Largest rate of change of that offset, m/s.
    pub slew_m_s: f32,
}

/// The arm that a table corrects through its joints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arm {
    /// Its kinematics; never slides.
    pub kinematics: Kinematics<f32>,
    /// Place from which zeros and lengths are counted, m: there they move nothing. `None`: they are taken as they are.
    pub home_m: Option<[f32; 3]>,
}

/// A whole correction table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Name of the machine it was made for, as the campaign gives it (cut to fit).
    pub machine: Name,
    /// First zone that fits is used; none: no correction.
    pub zones: heapless::Vec<Zone, MAX_ZONES>,
    /// Bounds.
    pub limits: Limits,
    /// `None`: the machine has slides.
    pub arm: Option<Arm>,
}

impl Table {
    /// A table without zones, whose limits allow nothing: a place to decode into.
    pub const fn empty() -> Self {
        let limits = Limits {
            offset_m: 0.0,
            slew_m_s: 0.0,
        };
        Self {
            machine: heapless::String::new(),
            zones: heapless::Vec::new(),
            limits,
            arm: None,
        }
    }
}
