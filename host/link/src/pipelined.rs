//! Requests of which several are on their way at once: the pieces of a table, out and back.
//!
//! The controller remembers the last request only: one that was passed by a newer one is dropped when it comes late, so
//! it cannot be sent again under its number. What is lost is asked for anew, with what followed it and under new
//! numbers (go back n). That takes requests that may happen more than once without harm: reading, and pieces of a
//! table, which the controller takes in order and refuses otherwise. All others are sent alone, and happen once.
//!
//! A serial line does not say when its receiver is full. What is on its way never exceeds [`IN_FLIGHT`] bytes, which
//! every controller has room for.
use super::client::{Arrival, Controller, GIVE_UP_AFTER, REPEAT_AFTER};
use super::error::ControllerError;
use giotto_shared::wire::{Command, IN_FLIGHT, Refusal, Reply};
use std::time::Duration;

/// Most requests of a series, repetitions included: so that no number comes round while an answer to it may be due.
const MOST: usize = 0x4000;

/// Most patience with a slow line.
const MOST_PATIENCE: Duration = Duration::from_millis(1200);

/// A request that was sent.
struct Sent {
    /// Which of the series.
    index: usize,
    bytes: usize,
    when: Duration,
}

/// What is known of a series.
struct Series {
    /// Number of the first request sent.
    first: u16,
    sent: Vec<Sent>,
    /// So many of the sent have been answered or passed by an answer, or are given up.
    settled: usize,
    /// The first sent since the series last went back.
    fresh: usize,
    /// So many of the series are done.
    done: usize,
    /// The next one to send, and the farthest one ever sent.
    next: usize,
    farthest: usize,
    /// Nothing was heard for a while: one request at a time until the line answers to what was sent since.
    silent: bool,
    /// How long silence is borne: longer on a line that is slow to answer.
    patience: Duration,
}

impl Series {
    const fn new(first: u16) -> Self {
        let sent = Vec::new();
        Self {
            first,
            sent,
            settled: 0,
            fresh: 0,
            done: 0,
            next: 0,
            farthest: 0,
            silent: false,
            patience: REPEAT_AFTER,
        }
    }

    fn on_the_way(&self) -> usize {
        self.sent
            .iter()
            .skip(self.settled)
            .map(|sent| sent.bytes)
            .sum()
    }

    /// Whether a frame of so many bytes may be sent now.
    fn has_room(&self, bytes: usize) -> bool {
        let on_the_way = self.on_the_way();
        // A zero goes before each.
        on_the_way == 0 || !self.silent && on_the_way + bytes < IN_FLIGHT
    }

    /// Sends what is not done yet once more.
    fn go_back(&mut self) {
        (self.fresh, self.next) = (self.sent.len(), self.done);
    }
}

impl Controller {
    /// Sends `count` requests, several at a time, until each is done. `settle` is told what was answered to which, and
    /// says how many from the first on are done by that: an answer can stand for those before it as well.
    ///
    /// # Errors
    /// Those of `settle` and of the link.
    pub(super) fn series(
        &mut self,
        count: usize,
        request: &dyn Fn(usize) -> Result<Command, ControllerError>,
        settle: &mut dyn FnMut(usize, Result<Reply, Refusal>) -> Result<usize, ControllerError>,
    ) -> Result<(), ControllerError> {
        let mut series = Series::new(self.next_seq());
        let mut give_up_at = self.now() + GIVE_UP_AFTER;
        while series.done < count {
            if self.now() >= give_up_at || series.sent.len() >= MOST {
                return Err(self.no_answer(GIVE_UP_AFTER));
            }
            self.send_some(&mut series, count, request)?;
            let until = give_up_at.min(self.now() + series.patience);
            match self.arrival(until)? {
                Some(Arrival::Reply(seq, reply)) => {
                    let at = usize::from(seq.wrapping_sub(series.first));
                    let Some(&Sent { index, when, .. }) = series.sent.get(at) else {
                        continue;
                    };
                    series.patience = (2 * (self.now() - when)).clamp(REPEAT_AFTER, MOST_PATIENCE);
                    // Answers come in the order of the requests.
                    series.settled = series.settled.max(at + 1);
                    let done = settle(index, reply)?;
                    if done > series.done {
                        series.done = done;
                        series.next = series.next.max(done);
                        give_up_at = self.now() + GIVE_UP_AFTER;
                    }
                    if at >= series.fresh {
                        series.silent = false;
                        if series.done <= index {
                            // Something before it was lost.
                            series.go_back();
                        }
                    }
                }
                Some(Arrival::SetPoints) => {}
                None => {
                    series.settled = series.sent.len();
                    series.silent = true;
                    series.go_back();
                }
            }
        }
        Ok(())
    }

    fn send_some(
        &mut self,
        series: &mut Series,
        count: usize,
        request: &dyn Fn(usize) -> Result<Command, ControllerError>,
    ) -> Result<(), ControllerError> {
        while series.next < count {
            let index = series.next;
            let (seq, frame) = self.next_frame(request(index)?)?;
            if !series.has_room(frame.len()) {
                break;
            }
            self.send_frame(seq, &frame, index < series.farthest)?;
            series.sent.push(Sent {
                index,
                bytes: frame.len() + 1,
                when: self.now(),
            });
            series.next = index + 1;
            series.farthest = series.farthest.max(series.next);
        }
        Ok(())
    }
}
