//! The queue, as executor and stream want it.
use super::job::Job;
use super::ports::Receiver;
use crate::engine::{Inbox, Planned, StreamPlan, StreamSample};

/// The receiving end.
pub(super) struct Jobs<I> {
    queue: I,
    /// What waits is thrown away.
    closed: bool,
    /// A stream that waits may begin.
    go: bool,
    epoch: u8,
    dropped: u32,
    /// A stream whose set-points are waited for, if so.
    stream: StreamPlan,
    waits: bool,
}

/// What is at the head of the queue.
enum Head {
    Segment,
    Stream,
    Points,
}

impl<I> Jobs<I> {
    pub(super) fn new(queue: I) -> Self {
        Self {
            queue,
            closed: false,
            go: false,
            epoch: 0,
            dropped: 0,
            stream: StreamPlan::default(),
            waits: false,
        }
    }

    /// What holds in this tick.
    #[inline]
    pub(super) fn look_at(&mut self, closed: bool, go: bool, epoch: u8) {
        (self.closed, self.go, self.epoch) = (closed, go, epoch);
    }

    /// The stream that may begin now.
    #[inline]
    pub(super) fn begins(&mut self) -> Option<&StreamPlan> {
        if !self.waits {
            return None;
        }
        let over = self.closed || self.stream.epoch() != self.epoch;
        self.waits = !(over || self.go);
        (self.go && !over).then_some(&self.stream)
    }

    /// Jobs thrown away.
    pub(super) const fn dropped(&self) -> u32 {
        self.dropped
    }
}

impl<I: Receiver<Job>> Jobs<I> {
    pub(super) fn waiting(&self) -> usize {
        self.queue.waiting()
    }

    /// The set-point with this number, if it has come; whether it was the last one; how many came too late for theirs.
    #[inline]
    pub(super) fn point(&mut self, expected: u16) -> (Option<StreamSample>, bool, u32) {
        let found = self.queue.look(|job| {
            let Job::Points(points) = job else {
                return (None, true, false, 0);
            };
            let (at, count) = (expected.wrapping_sub(points.first), u16::from(points.count));
            let sample = points.place_nm.get(usize::from(at)).filter(|_| at < count);
            let sample = sample.map(|&position_nm| StreamSample {
                sequence: expected,
                position_nm,
            });
            // A batch is done with its last set-point, or when all of them are too late.
            let done = at.wrapping_add(1) >= count;
            let late = if at < count { 0 } else { u32::from(count) };
            (sample, done, done && points.last, late)
        });
        let Some((sample, done, last, late)) = found else {
            return (None, false, 0);
        };
        if done {
            self.queue.discard();
        }
        (sample, last, late)
    }
}

impl<I: Receiver<Job>> Inbox for Jobs<I> {
    #[inline]
    fn take(&mut self, place: &mut Planned) -> bool {
        let (closed, stream) = (self.closed, &mut self.stream);
        let head = self.queue.look(|job| match job {
            Job::Segment(planned) => {
                if !closed {
                    place.copy(planned);
                }
                Head::Segment
            }
            Job::Stream(plan) => {
                if !closed {
                    stream.copy(plan);
                }
                Head::Stream
            }
            Job::Points(_) => Head::Points,
        });
        match head {
            None => return false,
            Some(Head::Segment) if !closed => {
                self.queue.discard();
                return true;
            }
            Some(Head::Stream) if !closed => {
                self.queue.discard();
                self.waits = true;
                return false;
            }
            Some(Head::Points) if self.waits => return false,
            // Of a stream that is over, or of a program that was stopped.
            Some(_) => {}
        }
        self.queue.discard();
        self.dropped = self.dropped.wrapping_add(1);
        false
    }
}
