//! Numbers that the robot counts its datagrams with: what is new, lost, late, out of order.
use std::time::Duration;

/// So many old numbers in a row are a robot that has begun to count anew.
const ANEW: u32 = 10;
/// Datagrams over which the robot's cycle is measured.
const MEASURED: u32 = 20;
/// What a clock may run off another one, share.
const DRIFT: f64 = 2e-4;

/// Counts of one session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Datagrams that came.
    pub received: u64,
    /// Datagrams that were answered.
    pub answered: u64,
    /// Numbers that never came.
    pub lost: u64,
    /// Datagrams that came more than a cycle after their time: they are answered, but the robot has gone on.
    pub late: u64,
    /// Datagrams that came after a newer one, or twice: they are not answered.
    pub reordered: u64,
    /// Cycles in which the robot had no new answer and held the last one.
    pub held: u64,
    /// Answers in which a bound was reached: of the table, of the door, of the robot.
    pub limited: u64,
    /// Datagrams that could not be read.
    pub malformed: u64,
}

/// Where a datagram stands among the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// The first, or the first after the robot began to count anew.
    First,
    /// So many cycles after the last one.
    After(u32),
    /// Older than one that was answered, or the same.
    Old,
    /// Between two cycles: so far from the last one.
    Between(u32),
}

/// The numbers seen so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sequence {
    /// What a cycle adds to the number.
    step: u32,
    cycle_s: f64,
    last: Option<u32>,
    old_in_a_row: u32,
    /// Earliest arrival beside its time by the number, s.
    earliest_s: f64,
    /// Time by the number since the first, s.
    told_s: f64,
    /// Time stamps of the robot: the last, their sum over single cycles, how many.
    stamp_ms: Option<u32>,
    stamps_ms: u64,
    stamps: u32,
}

impl Sequence {
    pub(crate) const fn new(step: u32, cycle_s: f64) -> Self {
        Self {
            step,
            cycle_s,
            last: None,
            old_in_a_row: 0,
            earliest_s: f64::INFINITY,
            told_s: 0.0,
            stamp_ms: None,
            stamps_ms: 0,
            stamps: 0,
        }
    }

    /// Takes the number of a datagram that came at `now`, with the robot's time stamp.
    pub(crate) fn take(
        &mut self,
        number: u32,
        stamp_ms: Option<u32>,
        now: Duration,
        counters: &mut Counters,
    ) -> Order {
        let Some(last) = self.last else {
            self.begin(number, stamp_ms, now);
            return Order::First;
        };
        let ahead = number.wrapping_sub(last);
        if ahead == 0 || ahead > u32::MAX / 2 {
            counters.reordered += 1;
            // It was counted as lost when its successor came.
            counters.lost = counters.lost.saturating_sub(u64::from(ahead != 0));
            self.old_in_a_row += 1;
            if self.old_in_a_row < ANEW {
                return Order::Old;
            }
            self.begin(number, stamp_ms, now);
            return Order::First;
        }
        self.old_in_a_row = 0;
        if !ahead.is_multiple_of(self.step) {
            return Order::Between(ahead);
        }
        let cycles = ahead / self.step;
        self.last = Some(number);
        counters.lost += u64::from(cycles - 1);
        counters.held += u64::from(cycles - 1);
        self.told_s += f64::from(cycles) * self.cycle_s;
        let beside_s = now.as_secs_f64() - self.told_s;
        self.earliest_s += DRIFT * f64::from(cycles) * self.cycle_s;
        counters.late += u64::from(beside_s > self.earliest_s + self.cycle_s);
        self.earliest_s = self.earliest_s.min(beside_s);
        self.measure(stamp_ms, cycles);
        Order::After(cycles)
    }

    fn begin(&mut self, number: u32, stamp_ms: Option<u32>, now: Duration) {
        let told_s = match self.last {
            Some(_) => self.told_s + self.cycle_s,
            None => 0.0,
        };
        *self = Self {
            last: Some(number),
            earliest_s: now.as_secs_f64() - told_s,
            told_s,
            stamp_ms,
            ..Self::new(self.step, self.cycle_s)
        };
    }

    fn measure(&mut self, stamp_ms: Option<u32>, cycles: u32) {
        if let (Some(last), Some(now)) = (self.stamp_ms, stamp_ms)
            && cycles == 1
            && self.stamps < MEASURED
        {
            self.stamps_ms += u64::from(now.wrapping_sub(last));
            self.stamps += 1;
        }
        self.stamp_ms = stamp_ms;
    }

    /// Time since the first datagram by the robot's numbers.
    pub(crate) fn told(&self) -> Duration {
        Duration::from_secs_f64(self.told_s)
    }

    /// The robot's cycle by its own time stamps, ms, where it is clearly another than was said.
    pub(crate) fn other_cycle_ms(&self) -> Option<f64> {
        if self.stamps < MEASURED || self.stamps_ms == 0 {
            return None;
        }
        let measured = self.stamps_ms as f64 / f64::from(self.stamps);
        let said = 1e3 * self.cycle_s;
        ((measured - said).abs() > 0.25 * said).then_some(measured)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: f64) -> Duration {
        Duration::from_secs_f64(ms * 1e-3)
    }

    #[test]
    fn what_is_new_lost_late_and_out_of_order() {
        let mut counters = Counters::default();
        let mut sequence = Sequence::new(4, 4e-3);
        let start = u32::MAX - 5;
        let mut take = |number: u32, ms: f64, counters: &mut Counters| {
            sequence.take(start.wrapping_add(number), None, at(100.0 + ms), counters)
        };
        assert_eq!(take(0, 0.0, &mut counters), Order::First);
        // The number wraps.
        assert_eq!(take(4, 4.0, &mut counters), Order::After(1));
        assert_eq!(take(16, 16.0, &mut counters), Order::After(3));
        assert_eq!((counters.lost, counters.held), (2, 2));
        assert_eq!(take(12, 17.0, &mut counters), Order::Old);
        assert_eq!(take(16, 17.0, &mut counters), Order::Old);
        assert_eq!((counters.lost, counters.reordered), (1, 2));
        assert_eq!(take(20, 23.9, &mut counters), Order::After(1));
        assert_eq!(counters.late, 0);
        assert_eq!(take(24, 29.0, &mut counters), Order::After(1));
        assert_eq!(counters.late, 1);
        assert_eq!(take(30, 30.0, &mut counters), Order::Between(6));
    }

    #[test]
    fn a_robot_that_counts_anew_is_followed() {
        let mut counters = Counters::default();
        let mut sequence = Sequence::new(1, 4e-3);
        assert_eq!(
            sequence.take(5000, None, at(0.0), &mut counters),
            Order::First
        );
        let orders: Vec<Order> = (1..=11)
            .map(|k| sequence.take(k, None, at(4.0), &mut counters))
            .collect();
        assert_eq!(orders.iter().filter(|o| **o == Order::Old).count(), 9);
        assert_eq!(orders[9..], [Order::First, Order::After(1)]);
    }

    #[test]
    fn a_cycle_that_is_another_than_was_said_is_noticed() {
        for (cycle_ms, expected) in [(4, None), (12, Some(12.0)), (0, None)] {
            let mut counters = Counters::default();
            let mut sequence = Sequence::new(1, 4e-3);
            for k in 0..30 {
                sequence.take(k, Some(k * cycle_ms), at(f64::from(k)), &mut counters);
            }
            assert_eq!(sequence.other_cycle_ms(), expected);
        }
    }
}
