//! What a door has to be able to: read what the robot says, write what it is to do.
use crate::Place;

/// The doors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// ABB's EGM position guidance.
    Egm,
    /// ABB's EGM path correction.
    EgmPath,
    /// KUKA's RSI.
    Rsi,
    /// FANUC's stream motion (J519).
    J519,
}

impl Kind {
    /// Time between two datagrams of a robot that was not set otherwise, ms.
    pub const fn usual_cycle_ms(self) -> f64 {
        match self {
            Self::Egm | Self::Rsi => 4.0,
            Self::EgmPath => 48.0,
            Self::J519 => 8.0,
        }
    }

    /// Port that the robot sends to, or with stream motion is asked at.
    pub const fn usual_port(self) -> u16 {
        match self {
            Self::Egm | Self::EgmPath => 6510,
            Self::Rsi => 59152,
            Self::J519 => 60015,
        }
    }
}

/// What the robot does with a correction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// It replaces the one before.
    #[default]
    Absolute,
    /// It is added to those before.
    Relative,
}

/// One datagram of the robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Told {
    pub(crate) number: u32,
    /// Robot's time, ms.
    pub(crate) stamp_ms: Option<u32>,
    /// Where its own path is.
    pub(crate) planned: Option<Place>,
    /// Where it is.
    pub(crate) measured: Option<Place>,
    /// Why it cannot be guided now, in words.
    pub(crate) not_ready: Option<&'static str>,
    /// It is guided, and wants no answer in this cycle.
    pub(crate) idle: bool,
    /// Answers that it has counted as late or missing.
    pub(crate) missed: Option<u64>,
}

/// What a datagram is.
pub(crate) enum Heard {
    /// The robot's place and state, to be answered.
    Told(Told),
    /// Something that needs no answer.
    Aside,
    /// Not what this robot sends: why, in words.
    Malformed(&'static str),
}

/// What is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Answer {
    /// Number of the cycle that is answered.
    pub(crate) number: u32,
    /// Where to go.
    pub(crate) target: Place,
    /// What to add to the robot's own path, at its place `lead_s` from now.
    pub(crate) offset: Place,
    /// Nothing comes after it.
    pub(crate) last: bool,
}

/// One door.
pub(crate) trait Protocol {
    /// What a cycle adds to the number of a datagram.
    fn step(&self) -> u32 {
        1
    }
    /// Each number has to be answered, also one whose datagram was lost.
    fn answers_each(&self) -> bool {
        false
    }
    /// Reads a datagram. What has to come back to the letter is kept for [`Self::write`].
    fn read(&mut self, datagram: &[u8]) -> Heard;
    /// `cycles` have gone by since the last datagram that was taken; called for each that is taken, before it is answered.
    fn taken(&mut self, _told: &Told, _cycles: u32) {}
    /// Writes an answer to the datagram that was read last.
    fn write(&mut self, answer: &Answer) -> Vec<u8>;
    /// What is sent until the robot is heard.
    fn greeting(&self) -> Vec<Vec<u8>> {
        Vec::new()
    }
    /// What is sent at the end.
    fn farewell(&self) -> Vec<Vec<u8>> {
        Vec::new()
    }
}
