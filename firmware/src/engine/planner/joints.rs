//! An arm: what a segment asks of its joints.
use super::Planner;
use super::numbers::to_m;
use crate::engine::arm::ArmPlan;
use crate::engine::planned::Planned;
use crate::engine::zones::Built;
use core::f32::consts::TAU;
use giotto_shared::law::{ArmLaw, Pace};

/// Places of a circle that are looked at for the arm's reach.
pub(super) const ROUND: usize = 8;

/// Places on a circle about a centre, m, from its two vectors, m.
pub(super) fn on_circle(centre: [f32; 3], u: [f32; 3], v: [f32; 3]) -> [[f32; 3]; ROUND] {
    let mut out = [centre; ROUND];
    for (k, place) in out.iter_mut().enumerate() {
        let (sin, cos) = libm::sincosf(k as f32 * (TAU / ROUND as f32));
        for ((place, u), v) in place.iter_mut().zip(u).zip(v) {
            *place += u * cos + v * sin;
        }
    }
    out
}

impl Planner {
    /// The law of the zone for the joints, if the table knows the arm.
    pub(super) fn joints(&self, zone: Option<&Built>, segment: &mut Planned) {
        segment.arm = self.arm_plan(zone);
    }

    /// See [`Self::joints`].
    pub(super) fn arm_plan(&self, zone: Option<&Built>) -> ArmPlan {
        let plan = ArmPlan::paced(self.machine.rate_hz, self.machine.engage_ticks);
        let (Some(zone), Some(arm)) = (zone, self.zones.arm()) else {
            return plan;
        };
        let pace = Pace {
            tick_s: plan.period_s,
            turn_s: self.machine.take_up_ticks as f32 * self.machine.tick_s,
        };
        let errors = zone.profile.map(|profile| profile.arm).unwrap_or_default();
        // Whether it stands there was asked when the table was loaded.
        let law = ArmLaw::new(arm.kinematics, zone.common, errors, arm.home_m, &pace).ok();
        ArmPlan {
            number: law.map_or(0, |_| zone.number),
            law,
            ..plan
        }
    }

    /// A place of the machine, as an arm has to reach it.
    pub(super) fn here_m(&self) -> [f32; 3] {
        to_m(self.position_nm)
    }
}
