//! Pulses in, corrected pulses out.
use super::{Counted, Pattern, Scale, Stepper, TooFast, Widths};
use crate::control::STREAM_PLACES;
use crate::engine::{Output, Stream, StreamPlan, StreamSample};

/// Stream mode without a host: what a planner's pulses say is one set-point a tick.
///
/// From a pulse to the same one corrected it takes [`Relay::latency`] ticks, always.
#[derive(Debug)]
pub struct Relay {
    counted: Counted,
    stream: Stream<STREAM_PLACES>,
    stepper: Stepper,
    sequence: u16,
    latency: u32,
}

/// The feed of a relay's stream needs more steps a tick than there is room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeedTooHigh;

impl Relay {
    /// At rest at a place. `fastest` is the fastest that an axis gets, nm per tick: feed, and rate of the offset.
    ///
    /// # Errors
    /// [`FeedTooHigh`]: refused before anything moves.
    pub fn new(
        plan: &StreamPlan,
        (scales_in, counters): ([Scale; 3], [u16; 3]),
        (scales_out, widths): ([Scale; 3], Widths),
        place_nm: [i32; 3],
        fastest: u32,
    ) -> Result<Self, FeedTooHigh> {
        let stepper = Stepper::new(scales_out, widths, place_nm);
        if !stepper.allows(fastest) {
            return Err(FeedTooHigh);
        }
        let mut counted = Counted::new(scales_in, counters, place_nm);
        // Where the nearest steps are, which is where the stream begins.
        let begin_nm = counted.place_nm(counters);
        Ok(Self {
            counted,
            stream: Stream::new(plan, begin_nm, 0, false),
            stepper,
            sequence: 0,
            latency: plan.latency() + 1,
        })
    }

    /// Once a tick: what the counters show, into the pulses that follow.
    ///
    /// # Errors
    /// [`TooFast`]: the path was faster than the relay was made for. Nothing of the tick was made; the board stops.
    pub fn tick(&mut self, counters: [u16; 3], pattern: &mut Pattern) -> Result<Output, TooFast> {
        let sample = StreamSample {
            sequence: self.sequence,
            position_nm: self.counted.place_nm(counters),
        };
        self.sequence = self.sequence.wrapping_add(1);
        let output = self.stream.tick(Some(sample));
        self.stepper.tick(output.corrected_nm, pattern)?;
        Ok(output)
    }

    /// Ticks from a pulse in to the same one out: two strides of the differentiator, and the tick in which a pattern is played.
    pub const fn latency(&self) -> u32 {
        self.latency
    }

    /// Switches the correction off or on, smoothly.
    pub fn set_bypass(&mut self, bypass: bool) {
        self.stream.set_bypass(bypass);
    }

    /// Steps that have come in, from the machine's origin.
    pub const fn steps_in(&self) -> [i64; 3] {
        self.counted.steps()
    }

    /// Steps made, from the machine's origin.
    pub fn steps_out(&self) -> [i64; 3] {
        self.stepper.made()
    }
}
