//! The drives of a machine, by name: three slides, or the joints of an arm.
use core::fmt;
use serde::{Deserialize, Serialize};

/// One drive of a machine. Coordinates of slides are metres, those of joints radians (of a SCARA's third joint, a
/// slide along Z, metres).
///
/// ```
/// use giotto_shared::Actuator;
///
/// // Places in the coordinates of a machine: Z is the third slide, and the third joint shares its place in an arm.
/// assert_eq!(Actuator::Z.index(), 2);
/// assert_eq!(Actuator::Joint3.index(), 2);
/// assert_eq!(Actuator::Joint3.to_string(), "joint3");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(rename_all = "lowercase")]
pub enum Actuator {
    /// Slide along the machine's X.
    X,
    /// Slide along the machine's Y.
    Y,
    /// Slide along the machine's Z.
    Z,
    /// First joint, at the base.
    Joint1,
    /// Second joint.
    Joint2,
    /// Third joint.
    Joint3,
    /// Fourth joint.
    Joint4,
    /// Fifth joint.
    Joint5,
    /// Sixth joint, at the flange.
    Joint6,
}

impl Actuator {
    /// The three slides, in order.
    pub const SLIDES: [Self; 3] = [Self::X, Self::Y, Self::Z];
    /// The six joints, from the base on.
    pub const JOINTS: [Self; 6] = [
        Self::Joint1,
        Self::Joint2,
        Self::Joint3,
        Self::Joint4,
        Self::Joint5,
        Self::Joint6,
    ];

    /// Place in the coordinates of its machine: 0 for X and for joint 1.
    pub const fn index(self) -> usize {
        match self {
            Self::X | Self::Joint1 => 0,
            Self::Y | Self::Joint2 => 1,
            Self::Z | Self::Joint3 => 2,
            Self::Joint4 => 3,
            Self::Joint5 => 4,
            Self::Joint6 => 5,
        }
    }

    /// Whether it is one of the three slides.
    pub const fn is_slide(self) -> bool {
        matches!(self, Self::X | Self::Y | Self::Z)
    }

    /// Name in files and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Joint1 => "joint1",
            Self::Joint2 => "joint2",
            Self::Joint3 => "joint3",
            Self::Joint4 => "joint4",
            Self::Joint5 => "joint5",
            Self::Joint6 => "joint6",
        }
    }
}

impl fmt::Display for Actuator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_actuator_has_its_place_and_the_name_that_files_know() {
        for set in [&Actuator::SLIDES[..], &Actuator::JOINTS[..]] {
            for (index, actuator) in set.iter().enumerate() {
                assert_eq!(actuator.index(), index);
                assert_eq!(actuator.is_slide(), set.len() == 3);
            }
        }
        assert_eq!(Actuator::Joint4.name(), "joint4");
    }
}
