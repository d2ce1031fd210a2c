//! What has happened, said in the log as it happens: the events that the link tells as well.
use core::ops::DerefMut;
use embedded_storage::nor_flash::NorFlash;
use giotto_firmware::server::{Buffers, Motion, Server};
use giotto_shared::wire::{Event, What};

/// The next event to be said.
pub struct Record {
    next: u32,
}

impl Record {
    /// From the first one on.
    pub const fn new() -> Self {
        Self { next: 0 }
    }

    /// Says what is new.
    #[inline]
    pub fn say<F: NorFlash, M: Motion, B: DerefMut<Target = Buffers>>(
        &mut self,
        server: &Server<F, M, B>,
    ) {
        while server.has_event(self.next) {
            let Some((number, event)) = server.event(self.next) else {
                return;
            };
            if number != self.next {
                defmt::warn!("{=u32} events not said", number.wrapping_sub(self.next));
            }
            say(&event);
            self.next = number.wrapping_add(1);
        }
    }
}

#[inline(never)]
fn say(event: &Event) {
    match event.what {
        What::Faulted(_) => defmt::error!("{}", event.what),
        What::Refused { .. } | What::LinkLost | What::Overdue | What::StopInput { .. } => {
            defmt::warn!("{}", event.what);
        }
        _ => defmt::info!("{}", event.what),
    }
}
