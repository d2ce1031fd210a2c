//! What a board tells of the tick on lines of its own.
use super::job::Job;
use super::ports::{Receiver, Sender};
use super::shared::Shared;
use super::tick::Tick;
use crate::engine::{Output, flag};
use crate::server::TimedSetPoint;
use core::ops::Deref;

/// Levels of the lines beside the set-points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lines {
    /// Set-points are meant for drives: it is known where the machine stands.
    pub enable: bool,
    /// Nothing moves, and nothing is on its way.
    pub in_position: bool,
    /// In fault, or coming to rest in one.
    pub fault: bool,
}

impl<S, I, O> Tick<S, I, O>
where
    S: Deref<Target = Shared>,
    I: Receiver<Job>,
    O: Sender<TimedSetPoint>,
{
    /// The lines after a tick with this output.
    pub fn lines(&self, output: &Output) -> Lines {
        Lines {
            enable: self.shared().known(),
            in_position: self.at_rest() && output.flags & flag::MOVING == 0,
            fault: self.faulty(),
        }
    }
}
