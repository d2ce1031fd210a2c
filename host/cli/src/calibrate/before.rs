//! What the controller corrected with before, and its return: nobody is left with a table that was not proven, or with a correction
//! that was switched off for a measurement.
use crate::Failure;
use crate::ring::{DemoError, image};
use giotto_link::flash::active_table;

use giotto_link::Controller;
use giotto_shared::model::Cumulants;
use giotto_shared::table::{Limits, Table, Terms, Travel, Zone};
use giotto_shared::wire::{Command, Status};

/// A table that corrects nothing: one zone, whose chain is none.
fn nothing() -> Table {
    let mut table = Table {
        limits: Limits {
            offset_m: LEAST_OFFSET_M,
            slew_m_s: LEAST_SLEW_M_S,
        },
        ..Table::empty()
    };
    // One zone fits, and so does the name.
    let _ = table.machine.push_str("no correction");
    let _ = table.zones.push(Zone {
        place_m: None,
        radius_m: [0.001, 1.0],
        feed_m_s: [0.001, 1.0],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 0.0,
            kappa4_s4: 0.0,
        },
        terms: Terms::new(),
    });
    table
}

/// Bounds of it: a table without any is refused.
const LEAST_OFFSET_M: f32 = 1e-6;
const LEAST_SLEW_M_S: f32 = 1e-4;

/// Table and bypass of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Before {
    bypass: bool,
    /// CRC of the table in use: a table that is returned to gets a generation of its own.
    table: Option<u32>,
}

impl Before {
    fn seen(status: &Status) -> Self {
        Self {
            bypass: status.bypass,
            table: active_table(status).map(|(_, info)| info.crc),
        }
    }

    pub(super) fn of(controller: &mut Controller) -> Result<Self, Failure> {
        Ok(Self::seen(&controller.status()?))
    }

    /// Takes a newer table back, and switches the correction as it was.
    pub(super) fn restore(self, controller: &mut Controller) -> Result<(), Failure> {
        self.try_restore(controller).map_err(|error| {
            Failure::controller(format_args!(
                "{}: not known to correct as it did before: {error}",
                controller.port()
            ))
            .help("look before the machine moves again: giotto status, then giotto rollback or giotto bypass")
        })
    }

    fn try_restore(self, controller: &mut Controller) -> Result<(), DemoError> {
        if Self::seen(&controller.status()?).table != self.table {
            if self.table.is_some() {
                controller.command(Command::Rollback)?;
            } else {
                // There is no table to return to, and bypass alone would end with the next start.
                let neutral = image(&nothing())?;
                controller.flash(&neutral, &mut |_| ())?;
            }
        }
        // Without a table there is nothing to switch on.
        let on = self.bypass || self.table.is_none();
        controller.command(Command::Bypass { on })?;
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
mod tests {
    use super::*;
    use crate::ring::{bundled, learn};
    use giotto_link::{OpenOptions, Port, open};

    #[test]
    fn what_was_before_comes_back() {
        let mut controller = open(&Port::Sim, &OpenOptions::default(), &mut |_| ()).unwrap();
        let plan = bundled().unwrap();
        let table = learn(&plan, 1).unwrap().table.table;
        let first = image(&table).unwrap();
        let mut other = table.clone();
        other.zones[0].radius_m[1] *= 1.01;
        let second = image(&other).unwrap();

        let empty = Before::of(&mut controller).unwrap();
        assert_eq!(empty.table, None);
        controller.flash(&first, &mut |_| ()).unwrap();
        assert_ne!(Before::of(&mut controller).unwrap(), empty);
        empty.restore(&mut controller).unwrap();
        let status = controller.status().unwrap();
        let neutral = image(&nothing()).unwrap();
        let (_, at_work) = active_table(&status).unwrap();
        assert!(status.bypass);
        assert_eq!(at_work.length as usize, neutral.len());
        assert!(neutral.len() < first.len());

        controller.flash(&first, &mut |_| ()).unwrap();
        controller.command(Command::Bypass { on: false }).unwrap();
        let before = Before::of(&mut controller).unwrap();
        controller.command(Command::Bypass { on: true }).unwrap();
        controller.flash(&second, &mut |_| ()).unwrap();
        before.restore(&mut controller).unwrap();
        assert_eq!(Before::of(&mut controller).unwrap(), before);
        // Nothing flashed: only the correction was switched off for a measurement.
        controller.command(Command::Bypass { on: true }).unwrap();
        before.restore(&mut controller).unwrap();
        assert_eq!(Before::of(&mut controller).unwrap(), before);
    }
}
