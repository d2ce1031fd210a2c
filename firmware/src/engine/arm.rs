//! An arm's correction in the tick: from the programmed places of the last ticks to an offset by joint.
//!
//! The derivatives of the path are backward differences over five programmed places [`STRIDE_S`] apart, whole nanometres taken
//! exactly: no tick needs to know which curve it is on, and nothing is late. On a circle at 7 rad/s rate and acceleration are good
//! to 1e-5 and 2e-4 of themselves, the third derivative to 1 %, the fourth to 11 %; the last two make a tenth of the correction there.
//!
//! The law runs at [`RATE_HZ`] at most. Where the tick is faster, the offset goes from one of its values to the next in even steps, a
//! period of the law late.
//!
//! Where the law changes (another zone, another table, none), the offset that goes out fades from the one to the other in the time in
//! which a correction is engaged. Nothing jumps, whatever the places do.
use super::ramp::{Clock, POLYNOMIAL, clock_step, shapes};
use giotto_shared::kinematics::path;
use giotto_shared::law::{ArmLaw, JointSides};

/// Distance of the places that derivatives are made from, s.
const STRIDE_S: f32 = 8e-3;
/// Highest rate of the law, Hz.
pub(crate) const RATE_HZ: u32 = 1000;
/// Places kept, a power of two: four strides at the highest rate.
const PLACES: usize = 64;
const MASK: usize = PLACES - 1;

/// What a segment asks for: a law and its number. Two segments with the same number have the same law; 0 is none.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct ArmPlan {
    pub(crate) number: u16,
    pub(crate) law: Option<ArmLaw<f32>>,
    /// Ticks from one value of the law to the next, and ticks in which laws are exchanged.
    pub(crate) every: u32,
    pub(crate) engage_ticks: u32,
    /// Time from one value of the law to the next, s.
    pub(crate) period_s: f32,
}

impl ArmPlan {
    /// Times of a tick at a rate.
    pub(crate) fn paced(rate_hz: f32, engage_ticks: u32) -> Self {
        // Positive and small; a cast saturates.
        let every = ((rate_hz / RATE_HZ as f32 + 0.99) as u32).max(1);
        Self {
            every,
            engage_ticks,
            period_s: every as f32 / rate_hz,
            ..Self::default()
        }
    }

    /// Becomes another one, as far as that one says anything.
    pub(crate) fn copy(&mut self, from: &Self) {
        self.number = from.number;
        (self.every, self.engage_ticks, self.period_s) =
            (from.every, from.engage_ticks, from.period_s);
        if from.law.is_some() {
            self.law = from.law;
        }
    }
}

/// The arm between ticks.
#[derive(Clone, Debug)]
pub(crate) struct Arm {
    places: [[i32; 3]; PLACES],
    newest: usize,
    stride: usize,
    of_stride_s: f32,
    /// The law in force and its number.
    law: Option<ArmLaw<f32>>,
    number: u16,
    sides: JointSides<f32>,
    /// Ticks until the next value of the law, and in how many parts a step goes out.
    left: u32,
    every: u32,
    /// Values of the law, nm: the one that went out, and the one on its way.
    from_nm: [i32; 3],
    to_nm: [i32; 3],
    /// Offset when the law changed, nm; how much of it is gone.
    before_nm: [i32; 3],
    clock: Clock,
    fading: bool,
    out_nm: [i32; 3],
}

impl Arm {
    /// Without a law.
    pub(crate) fn new() -> Self {
        Self {
            places: [[0; 3]; PLACES],
            newest: 0,
            stride: 1,
            of_stride_s: 1.0,
            law: None,
            number: 0,
            sides: JointSides::default(),
            left: 0,
            every: 1,
            from_nm: [0; 3],
            to_nm: [0; 3],
            before_nm: [0; 3],
            clock: Clock::default(),
            fading: false,
            out_nm: [0; 3],
        }
    }

    /// A law is in force, or what one has left is on its way out.
    #[inline(always)]
    pub(crate) const fn acts(&self) -> bool {
        self.number != 0 || self.fading
    }

    /// No law, and nothing left of one.
    pub(crate) fn forget(&mut self) {
        (self.number, self.fading, self.out_nm) = (0, false, [0; 3]);
    }

    /// On the way from one law to another.
    pub(crate) const fn fading(&self) -> bool {
        self.fading
    }

    /// Has always stood at a place.
    pub(crate) fn stand(&mut self, place_nm: [i32; 3]) {
        self.places = [place_nm; PLACES];
    }

    /// Before a segment that begins at rest at a place.
    pub(crate) fn begin(&mut self, plan: &ArmPlan, place_nm: [i32; 3]) {
        if plan.number == self.number {
            return;
        }
        if plan.number != 0 {
            self.law = plan.law;
            self.stand(place_nm);
            self.sides = JointSides::default();
            // Positive and small; a cast saturates.
            self.stride = ((STRIDE_S / plan.period_s + 0.5) as usize).clamp(1, MASK / 4);
            self.of_stride_s = 1.0 / (self.stride as f32 * plan.period_s);
            (self.left, self.every) = (0, plan.every.max(1));
            (self.from_nm, self.to_nm) = ([0; 3], [0; 3]);
        }
        self.number = plan.number;
        self.before_nm = self.out_nm;
        self.clock = Clock::rising(clock_step(plan.engage_ticks));
        self.fading = true;
    }

    /// One tick at a programmed place: the offset, nm.
    #[inline(never)]
    pub(crate) fn tick(&mut self, place_nm: [i32; 3]) -> [i32; 3] {
        let wanted = if self.number == 0 {
            [0; 3]
        } else {
            self.by_law(place_nm)
        };
        self.out_nm = if self.fading {
            self.faded(wanted)
        } else {
            wanted
        };
        self.out_nm
    }

    fn by_law(&mut self, place_nm: [i32; 3]) -> [i32; 3] {
        if self.left == 0 {
            self.left = self.every;
            self.newest = self.newest.wrapping_add(1);
            if let Some(place) = self.places.get_mut(self.newest & MASK) {
                *place = place_nm;
            }
            self.from_nm = self.to_nm;
            // Where the arm cannot stand the last value is held: the planner has refused such places.
            let path = path(&self.derivatives());
            if let Some(Ok(offset_m)) = self
                .law
                .as_ref()
                .map(|law| law.offset(&path, &mut self.sides))
            {
                self.to_nm = offset_m.map(|m| (m * 1e9) as i32);
            }
        }
        self.left = self.left.wrapping_sub(1);
        if self.every == 1 {
            return self.to_nm;
        }
        // The value that was made in this period is reached at its end.
        let share = (self.every.wrapping_sub(self.left)) as f32 / self.every as f32;
        let mut out = self.from_nm;
        for (out, to) in out.iter_mut().zip(self.to_nm) {
            let way = to.wrapping_sub(*out) as f32;
            *out = out.wrapping_add((way * share) as i32);
        }
        out
    }

    /// The place and its first four derivatives, SI.
    fn derivatives(&self) -> [[f32; 3]; 5] {
        let at = |strides: usize| {
            let back = self.newest.wrapping_sub(strides.wrapping_mul(self.stride));
            self.places.get(back & MASK).copied().unwrap_or_default()
        };
        let places = [at(0), at(1), at(2), at(3), at(4)];
        let per_s = self.of_stride_s;
        let mut out = [[0.0; 3]; 5];
        let [o0, o1, o2, o3, o4] = &mut out;
        let orders = o0.iter_mut().zip(o1).zip(o2).zip(o3.iter_mut().zip(o4));
        for (axis, (((p, v), a), (j, s))) in orders.enumerate() {
            let of = |place: &[i32; 3]| place.get(axis).copied().unwrap_or(0);
            let [p0, p1, p2, p3, p4] = places.each_ref().map(of);
            let [d1, d2, d3, d4] = [
                p0.wrapping_sub(p1),
                p1.wrapping_sub(p2),
                p2.wrapping_sub(p3),
                p3.wrapping_sub(p4),
            ];
            let [e1, e2, e3] = [
                d1.wrapping_sub(d2),
                d2.wrapping_sub(d3),
                d3.wrapping_sub(d4),
            ];
            let (f1, f2) = (e1.wrapping_sub(e2), e2.wrapping_sub(e3));
            let n1 = d1 as f32 * 1e-9 * per_s;
            let n2 = e1 as f32 * 1e-9 * per_s;
            let n3 = f1 as f32 * 1e-9 * per_s;
            let n4 = f1.wrapping_sub(f2) as f32 * 1e-9 * per_s;
            // Newton's backward differences of the value here.
            *p = p0 as f32 * 1e-9;
            *v = n1 + n2 / 2.0 + n3 / 3.0 + n4 / 4.0;
            *a = (n2 + n3 + n4 * (11.0 / 12.0)) * per_s;
            *j = (n3 + n4 * 1.5) * per_s * per_s;
            *s = n4 * per_s * per_s * per_s;
        }
        out
    }

    fn faded(&mut self, wanted: [i32; 3]) -> [i32; 3] {
        let (x, end) = self.clock.rise();
        if end {
            self.fading = false;
            return wanted;
        }
        let share = shapes(&POLYNOMIAL, x).s_q31 as f32 * (1.0 / 2_147_483_648.0);
        let mut out = self.before_nm;
        for (out, wanted) in out.iter_mut().zip(wanted) {
            let way = wanted.wrapping_sub(*out) as f32;
            *out = out.wrapping_add((way * share) as i32);
        }
        out
    }
}
