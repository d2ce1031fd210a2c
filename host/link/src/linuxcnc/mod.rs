//! LinuxCNC as a board: the firmware's server in this process, before the real-time component in a LinuxCNC that runs here.
//!
//! The component corrects; this program only hands tables to it, through a page of memory that neither waits for
//! ([`handover`](giotto_corrector::handover)). Slots and confirmations are kept in a file beside the table that the
//! component was loaded with, and a confirmed table is written there, so that the next start of LinuxCNC loads it.
//!
//! | file | holds |
//! |---|---|
//! | `drive`, `drive.py` | LinuxCNC runs a program, and what the component sees of it |
//! | `page` | the page, read and written as a file |
//! | `motion` | what the server asks of an engine |
//! | `store` | the flash as a file |
pub mod drive;
mod motion;
mod page;
mod store;

use super::error::ControllerError;
use super::link::Link;
use super::virtual_controller::{Flash, LAYOUT};
use super::wires::Wires;
use giotto_firmware::server::{Board, Buffers, Server};
use giotto_shared::table::image::MachineId;
use giotto_shared::wire::{ClockSource, ResetCause};
use motion::PageMotion;
use page::Page;
use std::io;
use std::time::{Duration, Instant};
use store::Kept;

/// How often the server looks for requests.
const LOOK: Duration = Duration::from_millis(1);

/// The component of this computer's LinuxCNC.
pub struct LinuxCncLink {
    server: Box<Server<Flash, PageMotion, Box<Buffers>>>,
    kept: Kept,
    wires: Wires,
    started: Instant,
}

/// Whom tables are bound to: the computer, by the first half of its machine-id; zeros where it has none.
fn machine() -> MachineId {
    let text = std::fs::read_to_string("/etc/machine-id").unwrap_or_default();
    let digit = |at: usize| text.get(2 * at..2 * at + 2);
    std::array::from_fn(|at| {
        digit(at)
            .and_then(|two| u8::from_str_radix(two, 16).ok())
            .unwrap_or(0)
    })
}

impl LinuxCncLink {
    /// Finds the component.
    ///
    /// # Errors
    /// [`ControllerError::NoComponent`]: LinuxCNC does not run, has not loaded it, or its threads stand still.
    /// [`ControllerError::InUse`]: another giotto talks to it.
    pub fn open() -> Result<Self, ControllerError> {
        let page = Page::open()?;
        let period_ns = page.period_ns()?;
        let bypass = page.bypassed().map_err(|error| page::gone(&error))?;
        let (kept, flash) = Kept::open(&page).map_err(|error| page::gone(&error))?;
        let board = Board {
            name: "linuxcnc",
            build: env!("CARGO_PKG_VERSION"),
            tick_hz: (1_000_000_000 / period_ns.max(1)).max(1),
            clock: ClockSource::Crystal,
            reset: ResetCause::Power,
            // LinuxCNC's own joints keep their limits.
            machine: machine(),
            step: [[1, 1]; 3],
            bears: |_| Ok(()),
        };
        let motion = PageMotion::new(page);
        let mut server = Box::new(Server::boot(board, flash, LAYOUT, motion, Box::default()));
        server.keep_bypass(bypass);
        server.motion_mut().arm();
        Ok(Self {
            server,
            kept,
            wires: Wires::default(),
            started: Instant::now(),
        })
    }

    fn serve(&mut self) -> io::Result<()> {
        let Ok(()) = self.server.serve(&mut self.wires);
        let active = self.server.active();
        self.kept.keep(self.server.store_mut(), active)
    }
}

impl Link for LinuxCncLink {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.wires.to_controller.extend(bytes);
        self.serve()
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        loop {
            let count = self.wires.take(buffer);
            if count > 0 || self.now() >= until {
                return Ok(count);
            }
            self.server.motion_mut().alive()?;
            self.serve()?;
            if self.wires.to_host.is_empty() {
                std::thread::sleep(LOOK);
            }
        }
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }
}
