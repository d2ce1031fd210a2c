//! What crosses from the background to the tick. A batch of set-points takes the place that a segment has in the queue, so
//! that streams cost no memory of their own there.
use crate::engine::{Planned, StreamPlan};

/// Most set-points in a batch: those of a message, which have room where a segment has.
pub const BATCH: usize = giotto_shared::wire::POINTS;

/// A piece of work for the tick.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "all live in one queue")]
pub enum Job {
    /// To be run, from rest to rest.
    Segment(Planned),
    /// Set-points follow.
    Stream(StreamPlan),
    /// Some of them.
    Points(Points),
}

/// Consecutive set-points of a stream.
#[derive(Clone, Copy, Debug)]
pub struct Points {
    /// Number of the first.
    pub(super) first: u16,
    pub(super) count: u8,
    /// No more follow these.
    pub(super) last: bool,
    pub(super) place_nm: [[i32; 3]; BATCH],
}

impl Points {
    pub(super) const NONE: Self = Self {
        first: 0,
        count: 0,
        last: false,
        place_nm: [[0; 3]; BATCH],
    };
}

impl Job {
    /// A segment still to be planned.
    pub(super) fn blank() -> Self {
        Self::Segment(Planned::default())
    }

    /// Where to plan it.
    pub(super) fn planned(&mut self) -> Option<&mut Planned> {
        if let Self::Segment(planned) = self {
            Some(planned)
        } else {
            None
        }
    }
}

const _: () = assert!(
    size_of::<Points>() <= size_of::<Planned>(),
    "a batch costs the queue nothing"
);
