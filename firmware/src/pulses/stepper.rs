//! Set-points into levels of lines.
use super::Scale;

/// Slots in a tick: at 1 kHz and 168 MHz each is 1400 cycles of a timer, 8.3 µs, without a rest.
pub const SLOTS: usize = 120;

/// The levels of all lines in each slot of a tick: bit 2k is the step of axis k, bit 2k + 1 its direction (high: upward).
pub type Pattern = [u8; SLOTS];

/// What drives ask of the lines, in slots. Each at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Widths {
    /// A step is high for so long …
    pub high: u8,
    /// … and low for so long, before the next one.
    pub low: u8,
    /// The direction is there so long before a step.
    pub set_up: u8,
    /// It stays so long after a step has risen.
    pub hold: u8,
}

impl Widths {
    /// One slot of everything: 8.3 µs, which most drives take (5 µs of direction, 2.5 µs of step).
    pub const SHORTEST: Self = Self {
        high: 1,
        low: 1,
        set_up: 1,
        hold: 1,
    };

    /// Slots from one step to the next, in the same direction.
    const fn apart(&self) -> u16 {
        self.high as u16 + self.low as u16
    }

    /// Most steps of an axis in a tick.
    pub const fn most_per_tick(&self) -> u32 {
        match (SLOTS as u32).checked_div(self.apart() as u32) {
            Some(steps) => steps,
            // Widths of none at all.
            None => 0,
        }
    }
}

/// The way of a tick needs more steps than fit into it; nothing of it was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooFast {
    /// 0 is X.
    pub axis: u8,
}

/// One axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    scale: Scale,
    /// Steps made, from the machine's origin.
    made: i64,
    place_nm: i32,
    upward: bool,
    /// Slots since the last step rose, and since the direction is what it is; they saturate.
    since: u16,
    settled: u16,
}

/// Makes the pulses of three axes.
#[derive(Clone, Copy, Debug)]
pub struct Stepper {
    axes: [Axis; 3],
    widths: Widths,
}

/// A step is made once the path is so many eighths beyond the last one: half a step, and an eighth so that a place that rests
/// on the edge between two steps does not make one each tick.
const EDGE: i64 = 5;

impl Stepper {
    /// At rest at a place; the steps made so far are the nearest ones to it.
    pub fn new(scales: [Scale; 3], widths: Widths, place_nm: [i32; 3]) -> Self {
        let [x, y, z] = scales;
        let [px, py, pz] = place_nm;
        let axis = |scale: Scale, place_nm: i32| Axis {
            scale,
            made: scale.nearest(place_nm),
            place_nm,
            upward: true,
            since: u16::MAX,
            settled: u16::MAX,
        };
        Self {
            axes: [axis(x, px), axis(y, py), axis(z, pz)],
            widths,
        }
    }

    /// Whether an axis may be as fast as this, nm per tick, without ever a [`TooFast`]: to be asked of the limits of the machine
    /// before anything moves.
    pub fn allows(&self, nm_per_tick: u32) -> bool {
        // A step less: one that waits for its direction comes on top.
        let most = self.widths.most_per_tick().saturating_sub(1);
        self.axes
            .iter()
            .all(|axis| axis.scale.allows(nm_per_tick, most))
    }

    /// Steps made, from the machine's origin.
    pub fn made(&self) -> [i64; 3] {
        self.axes.map(|axis| axis.made)
    }

    /// The tick's pattern on the way to a set-point.
    ///
    /// # Errors
    /// [`TooFast`]: nothing has been made, and the stepper stands where it stood.
    pub fn tick(&mut self, to_nm: [i32; 3], pattern: &mut Pattern) -> Result<(), TooFast> {
        let most = self.widths.most_per_tick();
        for (number, (axis, to_nm)) in (0u8..).zip(self.axes.iter().zip(to_nm)) {
            if !axis.scale.allows(to_nm.abs_diff(axis.place_nm), most) {
                return Err(TooFast { axis: number });
            }
        }
        pattern.fill(0);
        for (number, (axis, to_nm)) in (0u8..).zip(self.axes.iter_mut().zip(to_nm)) {
            axis.tick(to_nm, self.widths, number.wrapping_mul(2), pattern);
        }
        Ok(())
    }
}

impl Axis {
    /// One slot after the other: some 4000 instructions a tick for three axes, which a part of 168 MHz does not feel.
    fn tick(&mut self, to_nm: i32, widths: Widths, bit: u8, pattern: &mut Pattern) {
        let (from, to) = (self.scale.fine(self.place_nm), self.scale.fine(to_nm));
        self.place_nm = to_nm;
        // Everything times the number of slots, so that the way in a slot is a whole number.
        let slots = SLOTS as i64;
        let (way, edge) = (
            to.wrapping_sub(from),
            self.scale.eighth().wrapping_mul(EDGE * slots),
        );
        let step = self.scale.eighth().wrapping_mul(8 * slots);
        let mut beyond = from
            .wrapping_mul(slots)
            .wrapping_sub(self.made.wrapping_mul(step));
        for levels in pattern {
            let due = (beyond.unsigned_abs() >= edge as u64).then_some(beyond > 0);
            if let Some(upward) = due {
                self.turn(upward, widths);
                if self.free(widths) && self.upward == upward {
                    let one = if upward { 1 } else { -1 };
                    self.made = self.made.wrapping_add(one);
                    beyond = beyond.wrapping_sub(step.wrapping_mul(one));
                    self.since = 0;
                }
            }
            let high = self.since < u16::from(widths.high);
            *levels |= (u8::from(high) | u8::from(self.upward) << 1) << bit;
            self.since = self.since.saturating_add(1);
            self.settled = self.settled.saturating_add(1);
            beyond = beyond.wrapping_add(way);
        }
    }

    /// Turns the direction if the last one has held for long enough.
    fn turn(&mut self, upward: bool, widths: Widths) {
        if upward != self.upward && self.since >= u16::from(widths.hold) {
            (self.upward, self.settled) = (upward, 0);
        }
    }

    /// A step may rise in this slot.
    fn free(&self, widths: Widths) -> bool {
        self.since >= widths.apart() && self.settled >= u16::from(widths.set_up)
    }
}
