//! Sense of rotation.
use serde::{Deserialize, Serialize};

/// Sense in which a circle is travelled, seen from +Z.
///
/// ```
/// use giotto_shared::Direction;
///
/// assert_eq!(Direction::Ccw.sign(), 1);
/// assert_eq!(Direction::Ccw.reversed(), Direction::Cw);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Counter-clockwise (G3): the polar angle grows.
    Ccw,
    /// Clockwise (G2): the polar angle falls.
    Cw,
}

impl Direction {
    /// `d` of the formulas: +1 counter-clockwise, −1 clockwise.
    pub const fn sign(self) -> i8 {
        match self {
            Self::Ccw => 1,
            Self::Cw => -1,
        }
    }

    /// The opposite sense.
    pub const fn reversed(self) -> Self {
        match self {
            Self::Ccw => Self::Cw,
            Self::Cw => Self::Ccw,
        }
    }
}
