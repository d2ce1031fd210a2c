//! The controller's stored limits, and what has happened on it.
use super::client::Controller;
use super::error::ControllerError;
use super::flash::active_table;
use giotto_shared::table::{self, Table};
use giotto_shared::wire::{Command, Event, MachineConfig, Reply};

impl Controller {
    /// The limits in use, and whether they are the ones that are stored.
    ///
    /// # Errors
    /// Those of the link.
    pub fn config(&mut self) -> Result<(MachineConfig, bool), ControllerError> {
        match self.ask(Command::Config)? {
            Reply::Config { config, stored } => Ok((config, stored)),
            _ => Err(ControllerError::WrongReply),
        }
    }

    /// All events from a number on, each with its number; those that the controller has forgotten are left out.
    ///
    /// # Errors
    /// Those of the link.
    pub fn events(&mut self, from: u32) -> Result<Vec<(u32, Event)>, ControllerError> {
        let (mut next, mut all) = (from, Vec::new());
        loop {
            let Reply::Events { first, events } = self.ask(Command::Events { from: next })? else {
                return Err(ControllerError::WrongReply);
            };
            if events.is_empty() {
                return Ok(all);
            }
            next = first.wrapping_add(events.len() as u32);
            all.extend((first..).zip(events));
        }
    }

    /// The table in use, read back from its slot; `None`: there is none.
    ///
    /// # Errors
    /// Those of the link; [`ControllerError::Table`] if this build cannot read it.
    pub fn table(&mut self) -> Result<Option<Table>, ControllerError> {
        let Some((slot, info)) = active_table(&self.status()?) else {
            return Ok(None);
        };
        let image = self.read_slot(slot, usize::from(info.length))?;
        Ok(Some(table::decode(&image)?))
    }
}
