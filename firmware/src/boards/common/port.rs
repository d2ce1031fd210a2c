//! A serial port that does not take what it is given must not keep the background from its work.
use embedded_io::{Error, ErrorKind};

/// The port did not take a byte in time; what was being sent is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stuck;

impl core::fmt::Display for Stuck {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the port takes nothing")
    }
}

impl core::error::Error for Stuck {}

impl Error for Stuck {
    fn kind(&self) -> ErrorKind {
        ErrorKind::TimedOut
    }
}

/// How long a port is waited for.
pub struct Patience {
    polls: u32,
    stuck: bool,
}

impl Patience {
    /// So many looks at the port for each byte; once it was stuck, one, until it takes a byte again.
    pub const fn new(polls: u32) -> Self {
        Self { polls, stuck: false }
    }

    /// Waits until the port is ready.
    pub fn wait(&mut self, ready: impl Fn() -> bool) -> Result<(), Stuck> {
        let polls = if self.stuck { 1 } else { self.polls };
        self.stuck = !(0..polls).any(|_| ready());
        if self.stuck { Err(Stuck) } else { Ok(()) }
    }
}
