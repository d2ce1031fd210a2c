//! Stream mode: programmed set-points in at the tick's rate, corrected set-points out.
//!
//! The differentiator is one symmetric FIR for the whole correction A·p″ + B·p⁗: means over `M` samples (odd), taken
//! at five places `M` samples apart, with weights such that its second and fourth moments are exactly those of the
//! operator. Its error is of order (h·d/dt)⁶ with h = M ticks. Latency is [`StreamPlan::latency`] = 2M + (M − 1)/2
//! ticks for nominal and corrected position alike; nominal is the input of so many ticks before, bit for bit, and so
//! is corrected while the correction is disengaged.
//!
//! A set-point that is missing, late or further from the one before than the feed allows is replaced by carrying on
//! at the last velocity, for [`StreamPlan::hold_ticks`] at most ("hold"); a set-point that comes in that time is
//! joined without a step. After that the path comes to rest along its tangent within the acceleration limit while
//! the correction is ramped out, and [`StreamState::Fault`] is latched. Nothing jumps at any time.
use super::engage::Engage;
use super::guard::Guard;
use super::ramp::{Clock, POLYNOMIAL, clock_step, shapes};
use super::{Counters, Output, flag};
use giotto_shared::fixed::to_fixed;
use giotto_shared::law::Operator;

/// Samples kept; a power of two.
const RING: usize = 128;
/// Longest mean, samples.
pub const MAX_STRIDE: u32 = 31;
/// Ticks over which a set-point that comes after a gap is joined.
const JOIN_TICKS: u32 = 32;

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
    /// One or more are missing; carries on at the last velocity.
    Holding,
    /// Coming to rest, correction being ramped out.
    Stopping,
    /// At rest after set-points failed to come. Only a new stream leaves this state.
    Fault,
    /// The sender said that there is no more; at rest.
    Ended,
}

/// A stream in the form that the tick runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamPlan {
    /// Samples per mean, and ticks between the places: odd.
    stride: u32,
    /// Weights of the inner and outer second difference, Q28.
    inner: i32,
    outer: i32,
    /// Largest step of a set-point on one axis, nm.
    step_nm: u32,
    hold_ticks: u32,
    /// Velocity falls by 2⁻ᵏ of itself each tick when coming to rest.
    brake_shift: u32,
    engage_ticks: u32,
    offset_nm: i32,
    slew_nm: i32,
    corrected: bool,
}

/// Where in the ring the filter looks: the places of the means, and the middle of them all.
struct Places {
    now: usize,
    one: usize,
    two: usize,
    three: usize,
    four: usize,
    centre: usize,
}

/// Fraction bits of the weights: they may reach 8 in size.
const WEIGHT_BITS: u32 = 28;

/// What a plan is made from.
pub(crate) struct StreamNeeds {
    pub(crate) operator: Option<Operator<f64>>,
    pub(crate) tick_s: f64,
    /// Width of the mean wanted, s.
    pub(crate) window_s: f64,
    pub(crate) feed_m_s: f64,
    pub(crate) acceleration_m_s2: f64,
    pub(crate) hold_ticks: u32,
    pub(crate) engage_ticks: u32,
    pub(crate) offset_nm: i32,
    pub(crate) slew_nm: i32,
}

impl StreamPlan {
    /// `None` if the operator is too strong for so short a window.
    pub(crate) fn build(n: &StreamNeeds) -> Option<Self> {
        let stride = (libm::round(n.window_s / n.tick_s) as u32).clamp(1, MAX_STRIDE) | 1;
        let (m, h) = (f64::from(stride), f64::from(stride) * n.tick_s);
        let operator = n.operator.unwrap_or_default();
        // Means: 1 + v s²/2 + …; differences: s²h² + s⁴h⁴/12 + … and 4 s²h² + 16 s⁴h⁴/12 + …
        let variance = (m * m - 1.0) / 12.0 * n.tick_s * n.tick_s;
        let second = operator.second_s2 / (m * h * h);
        let fourth = 12.0 * (operator.fourth_s4 - operator.second_s2 * variance / 2.0) / (m * h * h * h * h);
        let outer = (fourth - second) / 12.0;
        let inner = second - 4.0 * outer;
        let most = 0.99 * f64::from(1u32 << (31 - WEIGHT_BITS));
        if !(libm::fabs(inner) < most && libm::fabs(outer) < most) {
            return None;
        }
        // v/2ᵏ per tick must be within the acceleration: 2ᵏ ≥ v/(a·T).
        let ratio = n.feed_m_s / (n.acceleration_m_s2 * n.tick_s);
        let brake_shift = libm::ceil(libm::log2(ratio.max(1.0))) as u32;
        Some(Self {
            stride,
            inner: to_fixed(inner, WEIGHT_BITS),
            outer: to_fixed(outer, WEIGHT_BITS),
            step_nm: to_fixed(n.feed_m_s * n.tick_s * 1.05e9, 0) as u32,
            hold_ticks: n.hold_ticks,
            brake_shift: brake_shift.min(20),
            engage_ticks: n.engage_ticks,
            offset_nm: n.offset_nm,
            slew_nm: n.slew_nm,
            corrected: n.operator.is_some(),
        })
    }

    /// Takes one axis' set-point in; nominal position and correction, nm.
    #[inline(always)]
    fn axis(
        &self,
        position: &mut [i32; RING],
        sum: &mut [i32; RING],
        total: &mut i32,
        input: i32,
        at: &Places,
    ) -> (i32, i32) {
        let newest = total.wrapping_add(input).wrapping_sub(position[at.one]);
        *total = newest;
        position[at.now] = input;
        sum[at.now] = newest;
        let twice = sum[at.two].wrapping_mul(2);
        let inner = sum[at.one].wrapping_add(sum[at.three]).wrapping_sub(twice);
        let outer = newest.wrapping_add(sum[at.four]).wrapping_sub(twice);
        let inner = i64::from(inner).wrapping_mul(i64::from(self.inner));
        let outer = i64::from(outer).wrapping_mul(i64::from(self.outer));
        // Half a nm of rounding is not worth its instructions.
        (position[at.centre], (inner.wrapping_add(outer) >> WEIGHT_BITS) as i32)
    }

    /// Ticks from a set-point in to the same one out.
    pub const fn latency(&self) -> u32 {
        2 * self.stride + (self.stride - 1) / 2
    }

    /// Ticks that a missing set-point is bridged.
    pub const fn hold_ticks(&self) -> u32 {
        self.hold_ticks
    }

    /// Whether a zone of the table applies.
    pub const fn corrected(&self) -> bool {
        self.corrected
    }
}

/// The stream's tick.
#[derive(Clone, Debug)]
pub struct Stream {
    plan: StreamPlan,
    /// By axis: positions and running sums over `stride` of them (sums wrap; only differences matter), newest at
    /// `head`. One index serves all axes.
    position: [[i32; RING]; 3],
    sum: [[i32; RING]; 3],
    total: [i32; 3],
    head: u32,
    /// Taken as the input before, and its velocity per tick.
    last_nm: [i32; 3],
    velocity: [i32; 3],
    state: StreamState,
    sequence: u16,
    missing: u32,
    /// Ticks until everything is at rest.
    settling: u32,
    /// Distance from what came to what is taken, after a gap, and how much of it is left.
    bias_nm: [i32; 3],
    joining: bool,
    join: Clock,
    guard: Guard,
    engage: Engage,
    counters: StreamCounters,
}

/// Counts since the stream began; they wrap.
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

impl Stream {
    /// At rest at a position; the first set-point expected is number `sequence`, there.
    pub fn new(plan: &StreamPlan, position_nm: [i32; 3], sequence: u16, bypass: bool) -> Self {
        let total = position_nm.map(|p| p.wrapping_mul(plan.stride as i32));
        let engage = Engage::new(plan.engage_ticks, !bypass);
        let mut guard = Guard::new(plan.offset_nm, plan.slew_nm);
        guard.watch(bypass);
        Self {
            plan: *plan,
            position: position_nm.map(|p| [p; RING]),
            sum: total.map(|t| [t; RING]),
            total,
            head: 0,
            last_nm: position_nm,
            velocity: [0; 3],
            state: StreamState::Running,
            sequence,
            missing: 0,
            settling: 0,
            bias_nm: [0; 3],
            joining: false,
            join: Clock::default(),
            guard,
            engage,
            counters: StreamCounters::default(),
        }
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
        self.guard.watch(!self.engage.full());
    }

    /// The sender has no more: comes to rest and ends.
    pub fn finish(&mut self) {
        if matches!(self.state, StreamState::Running | StreamState::Holding) {
            self.begin_rest(StreamState::Ended);
        }
    }

    /// Stops within the acceleration limit, beginning with the next tick; the correction stays.
    pub fn stop(&mut self) {
        self.finish();
    }

    /// One tick with the set-point that came for it, if any.
    #[inline]
    pub fn tick(&mut self, sample: Option<StreamSample>) -> Output {
        let taken = match sample {
            Some(s) if self.regular(&s) => {
                self.sequence = self.sequence.wrapping_add(1);
                let ([x, y, z], [lx, ly, lz]) = (s.position_nm, self.last_nm);
                self.velocity = [x.wrapping_sub(lx), y.wrapping_sub(ly), z.wrapping_sub(lz)];
                s.position_nm
            }
            other => self.irregular(other),
        };
        self.last_nm = taken;
        self.filter(taken)
    }

    /// The case of every tick when all is well.
    #[inline(always)]
    fn regular(&self, s: &StreamSample) -> bool {
        let ([x, y, z], [lx, ly, lz]) = (s.position_nm, self.last_nm);
        let most = self.plan.step_nm;
        let near =
            |now: i32, last: i32| (now.wrapping_sub(last) as u32).wrapping_add(most) <= most.wrapping_mul(2);
        self.state == StreamState::Running
            && !self.joining
            && s.sequence == self.sequence
            && near(x, lx)
            && near(y, ly)
            && near(z, lz)
    }

    /// Nominal and corrected position of `latency` ticks ago.
    #[inline(always)]
    fn filter(&mut self, [x, y, z]: [i32; 3]) -> Output {
        const MASK: u32 = RING as u32 - 1;
        let (stride, head) = (self.plan.stride, self.head.wrapping_add(1));
        self.head = head;
        let back = |ticks: u32| (head.wrapping_sub(ticks) & MASK) as usize;
        let at = Places {
            now: back(0),
            one: back(stride),
            two: back(stride.wrapping_mul(2)),
            three: back(stride.wrapping_mul(3)),
            four: back(stride.wrapping_mul(4)),
            centre: back(stride.wrapping_mul(2).wrapping_add(stride >> 1)),
        };
        let ([px, py, pz], [sx, sy, sz], [tx, ty, tz]) = (&mut self.position, &mut self.sum, &mut self.total);
        let (nx, wx) = self.plan.axis(px, sx, tx, x, &at);
        let (ny, wy) = self.plan.axis(py, sy, ty, y, &at);
        let (nz, wz) = self.plan.axis(pz, sz, tz, z, &at);
        let (nominal, wanted) = ([nx, ny, nz], [wx, wy, wz]);
        if self.guard.pass_easily(wanted) {
            return Output::new(nominal, wanted, flag::MOVING);
        }
        self.with_care(nominal, wanted)
    }

    #[inline(never)]
    fn with_care(&mut self, nominal: [i32; 3], wanted: [i32; 3]) -> Output {
        let wanted = self.engage.apply(wanted);
        self.guard.watch(!self.engage.full());
        let (offset, verdict) = self.guard.pass(wanted);
        let bounds = &mut self.counters.bounds;
        bounds.offset_cuts = bounds.offset_cuts.wrapping_add(u32::from(verdict.offset_cut));
        bounds.slew_cuts = bounds.slew_cuts.wrapping_add(u32::from(verdict.slew_cut));
        let cut = if verdict.offset_cut | verdict.slew_cut { flag::CUT } else { 0 };
        Output::new(nominal, offset, flag::MOVING | cut)
    }

    /// What to take for the input when it is not what it should be, or not only that.
    #[inline(never)]
    fn irregular(&mut self, sample: Option<StreamSample>) -> [i32; 3] {
        match self.state {
            StreamState::Running | StreamState::Holding => {}
            StreamState::Stopping | StreamState::Ended => return self.brake(),
            StreamState::Fault => return self.last_nm,
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
        let Some(position) = usable else {
            self.counters.missing = self.counters.missing.wrapping_add(1);
            self.missing = self.missing.wrapping_add(1);
            self.state = StreamState::Holding;
            if self.missing > self.plan.hold_ticks {
                self.engage.set(false);
                self.guard.watch(true);
                self.begin_rest(StreamState::Stopping);
                return self.brake();
            }
            return self.carry_on();
        };
        if self.state == StreamState::Holding {
            let expected = self.carry_on();
            for ((b, e), p) in self.bias_nm.iter_mut().zip(expected).zip(position) {
                *b = e.wrapping_sub(p);
            }
            self.joining = true;
            self.join = Clock::rising(clock_step(JOIN_TICKS));
            (self.state, self.missing) = (StreamState::Running, 0);
            return expected;
        }
        self.joined(position)
    }

    /// A set-point on the way from where the gap was bridged to what comes in.
    fn joined(&mut self, position: [i32; 3]) -> [i32; 3] {
        let (x, end) = self.join.rise();
        self.joining = !end;
        let left = if end { 0 } else { i32::MAX - shapes(&POLYNOMIAL, x).s_q31 };
        let mut taken = position;
        for (t, b) in taken.iter_mut().zip(self.bias_nm) {
            *t = t.wrapping_add((i64::from(b).wrapping_mul(i64::from(left)) >> 31) as i32);
        }
        for ((v, t), last) in self.velocity.iter_mut().zip(taken).zip(self.last_nm) {
            *v = t.wrapping_sub(last);
        }
        taken
    }

    /// Near enough to where the path was going: as far as the feed allows, each tick of the gap.
    fn plausible(&self, s: &StreamSample) -> bool {
        let most = self.plan.step_nm.saturating_mul(self.missing.saturating_add(2));
        s.position_nm.iter().zip(self.last_nm).all(|(p, last)| p.wrapping_sub(last).unsigned_abs() <= most)
    }

    fn carry_on(&self) -> [i32; 3] {
        let ([x, y, z], [vx, vy, vz]) = (self.last_nm, self.velocity);
        [x.wrapping_add(vx), y.wrapping_add(vy), z.wrapping_add(vz)]
    }

    fn begin_rest(&mut self, then: StreamState) {
        // Finer from now on: the velocity fades by shares of itself.
        self.velocity = self.velocity.map(|v| v.wrapping_mul(1 << 8));
        self.bias_nm = [0; 3];
        self.state = then;
        // After ten time constants 5e-5 of the velocity are left; then the filter empties, the correction fades.
        self.settling = (10u32 << self.plan.brake_shift).saturating_add(self.emptying());
    }

    /// Velocity fades along the tangent.
    fn brake(&mut self) -> [i32; 3] {
        let mut taken = self.last_nm;
        for ((t, v), rest) in taken.iter_mut().zip(&mut self.velocity).zip(&mut self.bias_nm) {
            *v = v.wrapping_sub(*v >> self.plan.brake_shift);
            // `bias_nm` keeps what is below a nanometre.
            *rest = rest.wrapping_add(*v);
            *t = t.wrapping_add(*rest >> 8);
            *rest &= 0xff;
        }
        self.settling = self.settling.saturating_sub(1);
        if self.settling == 0 && self.state == StreamState::Stopping {
            self.state = StreamState::Fault;
        }
        if self.settling <= self.emptying() {
            self.velocity = [0; 3];
        }
        taken
    }

    fn emptying(&self) -> u32 {
        self.plan.stride.wrapping_mul(5).max(self.plan.engage_ticks)
    }
}

#[cfg(test)]
mod tests;
