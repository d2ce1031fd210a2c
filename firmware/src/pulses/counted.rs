//! Counts of hardware counters into places.
use super::Scale;

/// Three counters of 16 bits that count pulses up and down, as timers of a microcontroller do (step as clock, direction as
/// sense). Read once a tick they may wrap as often as they like, as long as no axis makes 2¹⁵ steps between two ticks.
#[derive(Clone, Copy, Debug)]
pub struct Counted {
    scales: [Scale; 3],
    last: [u16; 3],
    /// Steps from the machine's origin.
    steps: [i64; 3],
}

impl Counted {
    /// Now at a place, whatever the counters show.
    pub fn new(scales: [Scale; 3], counters: [u16; 3], place_nm: [i32; 3]) -> Self {
        let mut steps = [0; 3];
        for ((steps, scale), nm) in steps.iter_mut().zip(&scales).zip(place_nm) {
            *steps = scale.nearest(nm);
        }
        Self {
            scales,
            last: counters,
            steps,
        }
    }

    /// The place by what the counters show now, nm.
    pub fn place_nm(&mut self, counters: [u16; 3]) -> [i32; 3] {
        let mut place_nm = [0; 3];
        let axes = self.steps.iter_mut().zip(&mut self.last).zip(&self.scales);
        for (((steps, last), scale), (nm, now)) in axes.zip(place_nm.iter_mut().zip(counters)) {
            *steps = steps.saturating_add(i64::from(now.wrapping_sub(*last) as i16));
            *last = now;
            *nm = scale.place_nm(*steps);
        }
        place_nm
    }

    /// Steps from the machine's origin.
    pub const fn steps(&self) -> [i64; 3] {
        self.steps
    }
}
