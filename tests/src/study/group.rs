//! The groups of the study: each has a row of the page and a bar of its own.

/// Rows of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// One listed effect.
    Single,
    /// Two.
    Pair,
    /// Three.
    Triple,
    /// Nothing.
    Null,
    /// Something outside the list.
    Unlisted,
    /// Residuals dealt to other runs.
    Permuted,
    /// Listed effects by other laws, in a laboratory with other laws.
    Laws,
    /// Nothing, with scatter of every kind and 4 to 78 runs.
    Scatter,
    /// Waves of any order, parity and law.
    Wave,
    /// Centred exports, set-ups by radius, set-ups that move.
    Delay,
    /// Arcs of 180 to 359°.
    Arc,
    /// One run spoilt.
    Spoilt,
    /// A common override.
    Override,
    /// Recorded from rest to rest.
    Ramps,
    /// Scatter of a robot.
    Robot,
    /// Effects of Z, right angles and scales of three planes.
    Planes,
    /// Arms without a fault.
    ArmSound,
    /// One fault of a joint or link.
    ArmSingle,
    /// Zeros and lengths from four places.
    ArmPlaces,
    /// Two faults.
    ArmPair,
    /// An arm whose kinematics is not given.
    ArmAsSlides,
    /// Sessions of 2 to 10 runs.
    Small,
    /// The same sizes of session with nothing hidden.
    SmallNull,
}

impl Group {
    /// All of them, in the order of the page.
    pub const ALL: [Self; 23] = [
        Self::Single,
        Self::Pair,
        Self::Triple,
        Self::Null,
        Self::Unlisted,
        Self::Permuted,
        Self::Laws,
        Self::Scatter,
        Self::Wave,
        Self::Delay,
        Self::Arc,
        Self::Spoilt,
        Self::Override,
        Self::Ramps,
        Self::Robot,
        Self::Planes,
        Self::ArmSound,
        Self::ArmSingle,
        Self::ArmPlaces,
        Self::ArmPair,
        Self::ArmAsSlides,
        Self::Small,
        Self::SmallNull,
    ];

    /// What it is, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Single => "one listed effect, broad laboratories",
            Self::Pair => "two",
            Self::Triple => "three",
            Self::Null => "nothing hidden",
            Self::Unlisted => "effect outside the list",
            Self::Permuted => "residuals dealt to other runs",
            Self::Laws => {
                "other laws: two-mass friction, warm-up with a hump, scale by sense; AR noise, jitter"
            }
            Self::Scatter => "nothing hidden; six kinds of scatter, 4 to 78 runs",
            Self::Wave => "order 2–40, any parity, f^0…4, R^−2…2; strength in the loudest sixth",
            Self::Delay => "delay unknown: centred, per radius, moving",
            Self::Arc => "arcs of 180–359°",
            Self::Spoilt => "one spoilt run: bump, label, direction",
            Self::Override => "all feeds 1–2 % low",
            Self::Ramps => "recorded from rest to rest",
            Self::Robot => "scatter between runs 10–40 µm",
            Self::Planes => "Z in ZX, three planes, tilted; six parameters",
            Self::ArmSound => "arm without a fault",
            Self::ArmSingle => "arm, one fault",
            Self::ArmPlaces => "arm, zero or length from four places",
            Self::ArmPair => "arm, two faults",
            Self::ArmAsSlides => "arm without its kinematics",
            Self::Small => "2 to 10 runs, one effect",
            Self::SmallNull => "2 to 10 runs, nothing hidden",
        }
    }
}
