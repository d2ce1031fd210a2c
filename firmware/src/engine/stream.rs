//! Stream mode: programmed set-points in at the tick's rate, corrected set-points out.
//!
//! The differentiator is one symmetric FIR for the whole correction A·p″ + B·p⁗: five set-points `h` apart (the stride,
//! in ticks), with weights such that its second and fourth moments are exactly those of the operator. Its error is of
//! order (h·d/dt)⁶. Rounding of the set-points (white, 0.29 nm) comes through it [`StreamPlan::noise_gain`] times. Latency is
//! [`StreamPlan::latency`], two strides, for nominal and corrected position alike; nominal is the input of so many ticks
//! before, bit for bit, and so is corrected while the correction is disengaged.
//!
//! A set-point that is missing, late or further from the one before than the feed allows is replaced by carrying on
//! at the last velocity and acceleration, for [`StreamPlan::hold_ticks`] at most ("hold"). Two set-points in a row that come in that
//! time say where the path is and how fast: it is joined without a step of either, near the end of the coordinates only if there
//! is room to stop on the way. After that the path comes to rest along its last curvature, within acceleration and jerk, while
//! the correction is ramped out, and [`StreamState::Fault`] is latched. Nothing jumps at any time.
mod brake;
mod join;
mod plan;

use super::arm::{Arm, ArmPlan};
use super::engage::Engage;
use super::guard::Guard;
use super::{Counters, Output, flag};
use brake::{Before, Brake};
use core::sync::atomic::{Ordering, compiler_fence};
use join::Join;

pub(crate) use brake::farthest_nm;
pub(super) use plan::StreamNeeds;
pub use plan::StreamPlan;

/// Places of a [`Stream`] that is told nothing else.
pub const PLACES: usize = 32;
/// Farthest coordinate that a brake may lead to, nm: with the largest offset of an image it is still a place.
pub(crate) const FARTHEST_NM: i32 = 2_126_000_000;
/// Set-points in a row that are carried over after a gap, until they say how fast they go.
pub(crate) const SEEN_TICKS: u32 = 2;

/// One programmed set-point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamSample {
    /// Counts up by one each tick; what was lost or comes late is seen by it.
    pub sequence: u16,
    /// Position, nm.
    pub position_nm: [i32; 3],
}

/// What the stream does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamState {
    /// Set-points come as they should.
    Running,
    /// One or more are missing; carries on at the last velocity and acceleration.
    Holding,
    /// Coming to rest, correction being ramped out.
    Stopping,
    /// At rest after set-points failed to come. Only a new stream leaves this state.
    Fault,
    /// The sender said that there is no more; at rest.
    Ended,
}

/// Not the number of any set-point: the next one is taken with care.
const CARE: u32 = u32::MAX;

/// What is kept of a tick and of those that were whole strides before it, nm.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
struct Kept {
    /// The offset of the tick, behind a word that makes the size a power of two: to the very first word the compiler finds a
    /// second way, which costs the tick a register.
    offset: [i32; 4],
    /// By axis: the set-point of the tick, and those 1, 2 and 3 strides before it.
    axes: [[i32; 4]; 3],
}

/// The stream's tick, with memory for a stride of `N` ticks, a power of two. What each tick needs comes first: there one
/// load reaches two words.
#[repr(C)]
#[derive(Clone, Debug)]
pub struct Stream<const N: usize = PLACES> {
    plan: StreamPlan,
    guard: Guard,
    /// Place of the newest set-point in `kept`.
    place: u32,
    /// Number of the set-point that may be taken as it is, or [`CARE`].
    regular: u32,
    /// By the tick's place in a stride.
    kept: [Kept; N],
    /// Velocity per tick and its change per tick where regular set-points ended; meant only while care is needed.
    velocity: [i32; 3],
    change: [i32; 3],
    state: StreamState,
    sequence: u16,
    /// Ticks that were carried on.
    carried: u32,
    /// Ticks until everything is at rest.
    settling: u32,
    /// After a gap: the set-point that came in the tick before, and the way to it.
    came_nm: Option<[i32; 3]>,
    join: Option<Join>,
    brake: Brake,
    engage: Engage,
    arm: Arm,
    counters: StreamCounters,
}

/// Counts of all streams since it was made; they wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct StreamCounters {
    /// Ticks without a usable set-point.
    pub missing: u32,
    /// Set-points that came after their tick.
    pub late: u32,
    /// Set-points further from the one before than the feed allows.
    pub rejected: u32,
    /// Bounds, as in the engine's [`Counters`].
    pub bounds: Counters,
}

impl<const N: usize> Stream<N> {
    /// Bits of a place; no other `N` compiles.
    const MASK: usize = {
        assert!(N.is_power_of_two(), "places are found by masking");
        N - 1
    };

    /// At rest at the origin, over before it began.
    pub fn idle() -> Self {
        Self {
            plan: StreamPlan::default(),
            kept: [Kept {
                axes: [[0; 4]; 3],
                offset: [0; 4],
            }; N],
            place: 0,
            regular: CARE,
            velocity: [0; 3],
            change: [0; 3],
            state: StreamState::Ended,
            sequence: 0,
            carried: 0,
            settling: 0,
            came_nm: None,
            join: None,
            brake: Brake::default(),
            guard: Guard::new(0, [0; 3]),
            engage: Engage::new(1, false),
            arm: Arm::new(),
            counters: StreamCounters::default(),
        }
    }

    /// At rest at a position; the first set-point expected is number `sequence`, there. The plan has to be made for as many
    /// places as there are.
    pub fn new(plan: &StreamPlan, position_nm: [i32; 3], sequence: u16, bypass: bool) -> Self {
        let mut stream = Self::idle();
        stream.start(plan, position_nm, sequence, bypass);
        stream
    }

    /// As [`Stream::new`], in place; the counts go on.
    #[inline(never)]
    pub fn start(&mut self, plan: &StreamPlan, position_nm: [i32; 3], sequence: u16, bypass: bool) {
        let [x, y, z] = position_nm;
        self.plan.copy(plan);
        for kept in &mut self.kept {
            *kept = Kept {
                axes: [[x; 4], [y; 4], [z; 4]],
                offset: [0; 4],
            };
        }
        self.engage = Engage::new(plan.engage_ticks, !bypass);
        self.guard = Guard::new(plan.offset_nm, plan.slew_nm);
        self.arm.forget();
        self.arm.begin(&plan.arm, position_nm);
        self.watch();
        (self.place, self.regular, self.sequence) = (0, u32::from(sequence), sequence);
        (self.velocity, self.change) = ([0; 3], [0; 3]);
        (self.carried, self.settling) = (0, 0);
        (self.came_nm, self.join) = (None, None);
        self.state = StreamState::Running;
    }

    /// Number of the set-point that the next tick is for.
    pub const fn expected(&self) -> u16 {
        if self.regular == CARE {
            self.sequence
        } else {
            self.regular as u16
        }
    }

    /// Set-points are taken.
    pub const fn takes(&self) -> bool {
        matches!(self.state, StreamState::Running | StreamState::Holding)
    }

    /// At rest for good: where it was led, with nothing of the correction left.
    pub const fn over(&self) -> bool {
        !self.takes() && self.settling == 0
    }

    /// Counts set-points that came after their ticks had passed.
    pub fn count_late(&mut self, count: u32) {
        self.counters.late = self.counters.late.wrapping_add(count);
    }

    /// What it does.
    pub const fn state(&self) -> StreamState {
        self.state
    }

    /// Counts.
    pub const fn counters(&self) -> &StreamCounters {
        &self.counters
    }

    /// Disengages (`true`) or engages (`false`) the correction, without a step.
    pub fn set_bypass(&mut self, bypass: bool) {
        self.engage.set(!bypass);
        self.watch();
    }

    /// The sender has no more: comes to rest and ends.
    pub fn finish(&mut self) {
        if self.takes() {
            if self.regular != CARE {
                self.sequence = self.regular as u16;
            }
            self.begin_rest(StreamState::Ended);
        }
    }

    /// Stops within the limits, beginning with the next tick; the correction stays.
    pub fn stop(&mut self) {
        self.finish();
    }

    /// One tick with the set-point that came for it, if any.
    #[inline]
    pub fn tick(&mut self, sample: Option<StreamSample>) -> Output {
        if let Some(StreamSample {
            sequence,
            position_nm: [x, y, z],
        }) = sample
            && u32::from(sequence) == self.regular
        {
            let last = &self.kept[self.place as usize & Self::MASK].axes;
            let most = self.plan.step_nm;
            let near = |now: i32, last: i32| {
                (now.wrapping_sub(last) as u32).wrapping_add(most) <= most.wrapping_mul(2)
            };
            if near(x, last[0][0]) && near(y, last[1][0]) && near(z, last[2][0]) {
                self.regular = u32::from(sequence.wrapping_add(1));
                return self.filter(x, y, z);
            }
        }
        self.careful_tick(sample)
    }

    #[inline(never)]
    fn careful_tick(&mut self, sample: Option<StreamSample>) -> Output {
        if self.regular != CARE {
            self.sequence = self.regular as u16;
            self.look_back();
        }
        let [x, y, z] = self.irregular(sample);
        let regular = self.state == StreamState::Running && self.join.is_none();
        self.regular = if regular {
            u32::from(self.sequence)
        } else {
            CARE
        };
        self.filter(x, y, z)
    }

    /// Nominal and corrected position of `latency` ticks ago.
    #[inline(always)]
    fn filter(&mut self, x: i32, y: i32, z: i32) -> Output {
        let before = self.place;
        let next = before.wrapping_add(1);
        let place = if next == self.plan.stride { 0 } else { next };
        self.place = place;
        compiler_fence(Ordering::AcqRel);
        let Kept {
            axes: [kx, ky, kz],
            offset,
        } = &mut self.kept[place as usize & Self::MASK];
        // One axis after the other and its result put away: all at once they do not fit into the registers.
        let wx = self.plan.axis(kx, x);
        offset[1] = wx;
        compiler_fence(Ordering::AcqRel);
        let wy = self.plan.axis(ky, y);
        offset[2] = wy;
        compiler_fence(Ordering::AcqRel);
        let wz = self.plan.axis(kz, z);
        offset[3] = wz;
        compiler_fence(Ordering::AcqRel);
        // The set-points of two strides ago have moved up one place.
        let nominal = [kx[2], ky[2], kz[2]];
        let [_, lx, ly, lz] = self.kept[before as usize & Self::MASK].offset;
        let weights = Guard::weigh(wz, lz, Guard::weigh(wy, ly, Guard::weigh(wx, lx, (0, 0))));
        if self.guard.easy(weights) {
            return Output::new(nominal, [wx, wy, wz], flag::MOVING);
        }
        self.with_care([lx, ly, lz])
    }

    /// Nothing passes easily while the correction is on its way in or out, or goes through the joints of an arm.
    fn watch(&mut self) {
        self.guard.watch(!self.engage.full() || self.arm.acts());
    }

    /// The newest set-point, nm.
    pub(crate) fn last_nm(&self) -> [i32; 3] {
        self.back(0)
    }

    /// The set-point of so many ticks ago, three strides at most, nm.
    fn back(&self, ticks: u32) -> [i32; 3] {
        let (mut place, mut strides) = (self.place, 0);
        for _ in 0..ticks {
            place = place
                .checked_sub(1)
                .unwrap_or(self.plan.stride.wrapping_sub(1));
            strides += usize::from(place == self.place);
        }
        let [x, y, z] = &self.kept[place as usize & Self::MASK].axes;
        [x[strides & 3], y[strides & 3], z[strides & 3]]
    }

    /// Velocity and its change where regular set-points ended.
    fn look_back(&mut self) {
        let (now, before, first) = (self.back(0), self.back(1), self.back(2));
        for i in 0..3 {
            self.velocity[i] = now[i].wrapping_sub(before[i]);
            self.change[i] = self.velocity[i].wrapping_sub(before[i].wrapping_sub(first[i]));
        }
    }

    /// As [`Self::filter`] when bounds or engagement may change what goes out.
    #[inline(never)]
    fn with_care(&mut self, last: [i32; 3]) -> Output {
        let Kept {
            axes: [x, y, z],
            offset: [_, wx, wy, wz],
        } = self.kept[self.place as usize & Self::MASK];
        let (nominal, wanted) = ([x[2], y[2], z[2]], [wx, wy, wz]);
        let mut wanted = wanted;
        if self.arm.acts() {
            for (wanted, joints) in wanted.iter_mut().zip(self.arm.tick(nominal)) {
                *wanted = wanted.wrapping_add(joints);
            }
        }
        let wanted = self.engage.apply(wanted);
        self.watch();
        let (offset, verdict) = self.guard.pass_after(last, wanted);
        let [ox, oy, oz] = offset;
        self.kept[self.place as usize & Self::MASK].offset = [0, ox, oy, oz];
        let bounds = &mut self.counters.bounds;
        bounds.offset_cuts = bounds
            .offset_cuts
            .wrapping_add(u32::from(verdict.offset_cut));
        bounds.slew_cuts = bounds.slew_cuts.wrapping_add(u32::from(verdict.slew_cut));
        let cut = if verdict.offset_cut | verdict.slew_cut {
            flag::CUT
        } else {
            0
        };
        Output::new(nominal, offset, flag::MOVING | cut)
    }

    /// What to take for the input when it is not what it should be, or not only that.
    #[inline(never)]
    fn irregular(&mut self, sample: Option<StreamSample>) -> [i32; 3] {
        match self.state {
            StreamState::Running | StreamState::Holding => {}
            StreamState::Stopping | StreamState::Ended => return self.brake(),
            StreamState::Fault => return self.last_nm(),
        }
        let expected = self.sequence;
        self.sequence = expected.wrapping_add(1);
        let usable = match sample {
            Some(s) if s.sequence == expected && self.plausible(&s) => Some(s.position_nm),
            Some(s) => {
                let behind = expected.wrapping_sub(s.sequence);
                let late = behind != 0 && behind < 1 << 15;
                self.counters.late = self.counters.late.wrapping_add(u32::from(late));
                self.counters.rejected = self.counters.rejected.wrapping_add(u32::from(!late));
                None
            }
            None => None,
        };
        self.counters.missing = self
            .counters
            .missing
            .wrapping_add(u32::from(usable.is_none()));
        match usable {
            Some(position) if self.state == StreamState::Running => self.joined(position),
            _ => self.bridge(usable),
        }
    }

    /// A tick of a gap, or one in which set-points come again.
    fn bridge(&mut self, usable: Option<[i32; 3]>) -> [i32; 3] {
        self.state = StreamState::Holding;
        self.join = None;
        self.carried = self.carried.wrapping_add(1);
        let before = core::mem::replace(&mut self.came_nm, usable);
        let seen = if usable.is_some() { SEEN_TICKS } else { 0 };
        if self.carried > self.plan.hold_ticks.wrapping_add(seen) {
            return self.starve();
        }
        let taken = self.carry_on();
        if let (Some(before), Some(now)) = (before, usable) {
            let (mut apart, mut rate) = ([0; 3], self.velocity);
            for axis in 0..3 {
                apart[axis] = taken[axis].wrapping_sub(now[axis]);
                rate[axis] = rate[axis].wrapping_sub(now[axis].wrapping_sub(before[axis]));
            }
            self.join = Join::begin(apart, rate, self.plan.limits);
            if self.join.is_some() {
                (self.state, self.carried) = (StreamState::Running, 0);
            }
        }
        taken
    }

    /// A set-point on the way from where the gap was bridged to what comes in.
    fn joined(&mut self, position: [i32; 3]) -> [i32; 3] {
        let last = self.last_nm();
        if !brake::has_room(self.plan.limits, last, self.velocity, self.change) {
            return self.starve();
        }
        let added = self.join.as_mut().and_then(Join::next_nm);
        if added.is_none() {
            self.join = None;
        }
        self.came_nm = self.join.as_ref().map(|_| position);
        let mut taken = position;
        for axis in 0..3 {
            taken[axis] = taken[axis].wrapping_add(added.map_or(0, |added| added[axis]));
            let velocity = taken[axis].wrapping_sub(last[axis]);
            self.change[axis] = velocity.wrapping_sub(self.velocity[axis]);
            self.velocity[axis] = velocity;
        }
        taken
    }

    /// Set-points stay away, or lead where no stop is within the coordinates.
    fn starve(&mut self) -> [i32; 3] {
        self.engage.set(false);
        self.watch();
        self.begin_rest(StreamState::Stopping);
        self.brake()
    }

    /// Near enough to the one before, or to where the path was going: as far as the feed allows, each tick of the gap. While a gap
    /// is bridged the path is not quite where the set-points are: a tick more.
    fn plausible(&self, s: &StreamSample) -> bool {
        let (from, ticks) = match self.came_nm {
            Some(came) => (came, 1),
            None if self.carried > 0 => (self.last_nm(), self.carried.saturating_add(2)),
            None => (self.last_nm(), 1),
        };
        let most = self.plan.step_nm.saturating_mul(ticks);
        s.position_nm
            .iter()
            .zip(from)
            .all(|(p, from)| p.wrapping_sub(from).unsigned_abs() <= most)
    }

    fn carry_on(&mut self) -> [i32; 3] {
        let mut next = self.last_nm();
        let most = i32::try_from(self.plan.step_nm).unwrap_or(i32::MAX);
        for ((n, v), c) in next.iter_mut().zip(&mut self.velocity).zip(self.change) {
            // Never faster than set-points may be.
            *v = v.saturating_add(c).clamp(most.wrapping_neg(), most);
            *n = n.saturating_add(*v);
        }
        next
    }

    fn begin_rest(&mut self, then: StreamState) {
        let place_nm = [0, 1, 2, 4, 8].map(|ticks| self.back(ticks));
        self.brake = Brake::begin(&Before { place_nm }, self.plan.limits);
        self.regular = CARE;
        self.state = then;
        // Then the filter empties, the correction fades.
        self.settling = self.brake.ticks().saturating_add(self.emptying());
    }

    /// Comes to rest. Whoever takes set-points sees to it that there is room for that; if not, it ends where the
    /// coordinates do.
    fn brake(&mut self) -> [i32; 3] {
        let mut taken = self.last_nm();
        if self.settling == self.emptying() {
            // What holds zeros and play goes last: where the stream ends nothing is left of it.
            let none = ArmPlan {
                engage_ticks: self.plan.engage_ticks,
                ..ArmPlan::default()
            };
            self.arm.begin(&none, taken);
        }
        if self.settling > self.emptying() {
            for (taken, step) in taken.iter_mut().zip(self.brake.step()) {
                let next = taken.saturating_add(step);
                *taken = next.clamp(FARTHEST_NM.wrapping_neg(), FARTHEST_NM);
            }
        }
        self.settling = self.settling.saturating_sub(1);
        if self.settling == 0 && self.state == StreamState::Stopping {
            self.state = StreamState::Fault;
        }
        taken
    }

    fn emptying(&self) -> u32 {
        self.plan.stride.wrapping_mul(5).max(self.plan.engage_ticks)
    }
}

#[cfg(test)]
mod brake_tests;
#[cfg(test)]
mod tests;
