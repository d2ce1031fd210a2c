//! A stream in numbers: weights of the differentiator, bounds, and how it comes to rest.
use super::brake::Limits;
use crate::engine::arm::ArmPlan;
use giotto_shared::fixed::{mulh, mulh_add, single_to_fixed};
use giotto_shared::law::Operator;

/// A stream in the form that the tick runs.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct StreamPlan {
    /// Streams planned before a stop carry an older one.
    pub(crate) epoch: u8,
    /// Ticks between the places.
    pub(super) stride: u32,
    /// Weights of the inner and outer second difference, Q24.
    inner: i32,
    outer: i32,
    /// Largest step of a set-point on one axis, nm.
    pub(super) step_nm: u32,
    pub(super) hold_ticks: u32,
    /// When coming to rest.
    pub(super) limits: Limits,
    pub(super) engage_ticks: u32,
    pub(super) offset_nm: i32,
    pub(super) slew_nm: [i32; 3],
    pub(super) corrected: bool,
    /// What the joints of an arm ask for.
    pub(super) arm: ArmPlan,
}

/// Fraction bits of the weights: they may reach 128 in size.
const WEIGHT_BITS: u32 = 24;
/// What a product of a weight and a difference lacks.
const SCALE: i32 = 1 << (32 - WEIGHT_BITS);

/// Most of the acceleration that a brake leaves to the correction.
const ADDED_SHARE: f32 = 0.3;

/// What a plan is made from.
pub(crate) struct StreamNeeds {
    pub(crate) epoch: u8,
    pub(crate) arm: ArmPlan,
    pub(crate) operator: Option<Operator<f32>>,
    pub(crate) rate_hz: f32,
    /// Distance of the places wanted, s.
    pub(crate) window_s: f32,
    /// Longest distance of the places that the stream has memory for, ticks.
    pub(crate) longest: u32,
    pub(crate) feed_m_s: f32,
    pub(crate) acceleration_m_s2: f32,
    pub(crate) jerk_m_s3: f32,
    pub(crate) hold_ticks: u32,
    pub(crate) engage_ticks: u32,
    /// Of the offset, and of its change per tick.
    pub(crate) bounds_nm: (i32, [i32; 3]),
}

impl StreamPlan {
    /// `None` if the operator is too strong for so short a window.
    pub(crate) fn build(n: &StreamNeeds) -> Option<Self> {
        let stride = ((n.window_s * n.rate_hz + 0.5) as u32).clamp(1, n.longest);
        let h = stride as f32 / n.rate_hz;
        let operator = n.operator.unwrap_or_default();
        // p(−h) − 2p + p(h) is s²h² + s⁴h⁴/12 + …, with 2h it is 4 s²h² + 16 s⁴h⁴/12 + …
        let second = operator.second_s2 / (h * h);
        let fourth = 12.0 * operator.fourth_s4 / (h * h * h * h);
        let outer = (fourth - second) / 12.0;
        let inner = second - 4.0 * outer;
        let most = 0.99 * (1u32 << (31 - WEIGHT_BITS)) as f32;
        if !(inner.abs() < most && outer.abs() < most) {
            return None;
        }
        let tick_s = 1.0 / n.rate_hz;
        // Where the jerk of a brake changes the second derivative adds to the commanded acceleration what the differentiator
        // sees of that change, two thirds of it over a stride: the brake leaves room for it, a share of the limit at most. What
        // the fourth derivative adds there passes in two strides, and comes on top.
        let added_m_s2 = operator.second_s2.abs() / h * n.jerk_m_s3 * (2.0 / 3.0);
        let left_m_s2 = n.acceleration_m_s2 - added_m_s2.min(ADDED_SHARE * n.acceleration_m_s2);
        let acceleration = left_m_s2 * tick_s * tick_s * 1e9;
        let jerk = n.jerk_m_s3 * tick_s * tick_s * tick_s * 1e9;
        let (offset_nm, slew_nm) = n.bounds_nm;
        Some(Self {
            epoch: n.epoch,
            stride,
            inner: single_to_fixed(inner, WEIGHT_BITS),
            outer: single_to_fixed(outer, WEIGHT_BITS),
            step_nm: single_to_fixed(n.feed_m_s / n.rate_hz * 1.05e9, 0) as u32,
            hold_ticks: n.hold_ticks,
            limits: Limits {
                feed: n.feed_m_s * tick_s * 1e9,
                acceleration,
                jerk,
            },
            engage_ticks: n.engage_ticks,
            offset_nm,
            slew_nm,
            corrected: n.operator.is_some(),
            arm: n.arm,
        })
    }

    /// Takes one axis' set-point in, in place of the oldest of those that are whole strides old; its correction, nm.
    #[inline(always)]
    pub(super) fn axis(&self, kept: &mut [i32; 4], p0: i32) -> i32 {
        let [p1, p2, p3, p4] = *kept;
        *kept = [p0, p1, p2, p3];
        let twice = p2.wrapping_mul(2);
        // Differences beyond 8 mm wrap; the bounds catch what comes of it.
        let inner = p1.wrapping_add(p3).wrapping_sub(twice).wrapping_mul(SCALE);
        let outer = p0.wrapping_add(p4).wrapping_sub(twice).wrapping_mul(SCALE);
        mulh_add(mulh(outer, self.outer), inner, self.inner)
    }

    /// Becomes another one, as far as that one says anything: all at once it is a call of memcpy, most of it for an arm that
    /// most machines have not.
    pub(crate) fn copy(&mut self, from: &Self) {
        self.epoch = from.epoch;
        (self.stride, self.inner, self.outer) = (from.stride, from.inner, from.outer);
        (self.step_nm, self.hold_ticks) = (from.step_nm, from.hold_ticks);
        (self.limits, self.engage_ticks) = (from.limits, from.engage_ticks);
        (self.offset_nm, self.slew_nm) = (from.offset_nm, from.slew_nm);
        self.corrected = from.corrected;
        self.arm.copy(&from.arm);
    }

    /// Limits of acceleration and jerk, nm per tick² and per tick³.
    pub(crate) const fn limits(&self) -> [f32; 2] {
        [self.limits.acceleration, self.limits.jerk]
    }

    /// The epoch it was planned in.
    pub(crate) const fn epoch(&self) -> u8 {
        self.epoch
    }

    /// Ticks from a set-point in to the same one out.
    pub const fn latency(&self) -> u32 {
        2 * self.stride
    }

    /// White noise of the set-points, root mean square, comes out in the correction so many times.
    pub fn noise_gain(&self) -> f64 {
        let weight = |w: i32| f64::from(w) / f64::from(1u32 << WEIGHT_BITS);
        let (inner, outer) = (weight(self.inner), weight(self.outer));
        let middle = -2.0 * (inner + outer);
        libm::sqrt(2.0 * (inner * inner + outer * outer) + middle * middle)
    }

    /// Ticks that a missing set-point is bridged.
    pub const fn hold_ticks(&self) -> u32 {
        self.hold_ticks
    }

    /// Ticks that may be carried on at most, until set-points are joined or the brake begins.
    pub(crate) const fn longest_gap(&self) -> u32 {
        self.hold_ticks.saturating_add(super::SEEN_TICKS + 1)
    }

    /// Whether a zone of the table applies.
    pub const fn corrected(&self) -> bool {
        self.corrected
    }
}
