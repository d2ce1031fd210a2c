//! What has happened, in memory, for the host's log.
use super::Snapshot;
use giotto_shared::wire::{EVENTS, Event, MotionState, ResetCause, What};

/// Events kept, at most: the oldest goes.
const KEPT: usize = 24;

/// The events, and what the motion looked like when it was looked at last.
#[derive(Debug)]
pub(super) struct Events {
    kept: heapless::Deque<Event, KEPT>,
    /// Number of the oldest one kept.
    first: u32,
    state: MotionState,
    stop_input: bool,
}

impl Events {
    pub(super) const fn new() -> Self {
        Self {
            kept: heapless::Deque::new(),
            first: 0,
            state: MotionState::Idle,
            stop_input: false,
        }
    }

    pub(super) fn add(&mut self, tick: u32, what: What) {
        if self.kept.is_full() {
            self.kept.pop_front();
            self.first = self.first.wrapping_add(1);
        }
        // There is room now.
        let _ = self.kept.push_back(Event { tick, what });
    }

    pub(super) fn booted(&mut self, cause: ResetCause, slot: Option<u8>) {
        self.add(0, What::Booted { cause, slot });
    }

    /// Adds what the motion has come to since it was looked at last.
    pub(super) fn look(&mut self, now: &Snapshot) {
        if now.stop_input != self.stop_input {
            self.stop_input = now.stop_input;
            let active = now.stop_input;
            self.add(now.tick, What::StopInput { active });
        }
        let (was, is) = (self.state, now.state);
        if was == is {
            return;
        }
        self.state = is;
        match (was.is_run(), is.is_run()) {
            (false, true) => self.add(now.tick, What::Started),
            (true, false) => self.add(now.tick, What::Rested),
            _ => {}
        }
        match now.fault {
            Some(cause) if is == MotionState::Fault => self.add(now.tick, What::Faulted(cause)),
            _ if was == MotionState::Fault => self.add(now.tick, What::Cleared),
            _ => {}
        }
    }

    /// Number of the next one.
    #[inline]
    pub(super) fn next(&self) -> u32 {
        self.first.wrapping_add(self.kept.len() as u32)
    }

    /// From a number on, as many as a message takes; with the number of the first.
    pub(super) fn from(&self, from: u32) -> (u32, heapless::Vec<Event, EVENTS>) {
        let ahead = from.wrapping_sub(self.first);
        // What is older than the memory begins with the oldest.
        let skip = if (ahead as i32) < 0 { 0 } else { ahead };
        // One by one: the queue's iterator carries a bounds check into the image.
        let mut events = heapless::Vec::new();
        while let Some(&event) = self.kept.get((skip as usize).saturating_add(events.len())) {
            if events.push(event).is_err() {
                break;
            }
        }
        (self.first.wrapping_add(skip), events)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_go_and_a_reader_is_told_which_came_first() {
        let mut events = Events::new();
        assert_eq!(events.from(0), (0, heapless::Vec::new()));
        for tick in 0..100 {
            events.add(tick, What::Stopped);
        }
        let (first, some) = events.from(0);
        assert_eq!((first, some.len()), (100 - KEPT as u32, EVENTS));
        assert!(
            some.iter()
                .zip(first..)
                .all(|(event, tick)| event.tick == tick)
        );
        assert_eq!(events.next(), 100);
        let (first, some) = events.from(98);
        assert_eq!((first, some.len()), (98, 2));
        assert_eq!(events.from(100), (100, heapless::Vec::new()));
    }
}
