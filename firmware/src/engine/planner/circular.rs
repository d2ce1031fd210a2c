//! What circles, arcs and helices have in common: the law on them, and ramps long enough for it.
use super::demand::Bounds;
use super::demand::Demand;
use super::law::ArcLaw;
use super::numbers::{arm, length, seen_from, to_m};
use super::timing::{Motion, end_term};
use super::worst::{self, Worst};
use super::{Planner, Refused, joints, terms};
use crate::engine::descent::Slowing;
use crate::engine::planned::{Axis, Kind, Planned, Timing};
use crate::engine::ramp::FIRST;
use crate::engine::zones::{Asked, Built};
use core::f32::consts::TAU;
use giotto_shared::fixed::single_to_fixed;
use giotto_shared::path::{MAX_POSITION_M, Quantity};

/// Most share of the radius by which the fixed-point law can move a circle.
pub(super) const MAX_GAIN: f32 = 0.12;
/// Stops that are tried out, each slower than the one before.
const STOP_TRIES: u8 = 12;
/// A ramp without end, s: what is left of the law is that of constant rate.
const ENDLESS_S: f32 = 1e6;

/// A circle or arc in its plane.
pub(super) struct Round {
    pub(super) centre_nm: [i32; 3],
    /// Vectors of the plane, nm·2.
    pub(super) u: [i32; 3],
    pub(super) v: [i32; 3],
    /// nm per turn.
    pub(super) rise_nm: [i32; 3],
    pub(super) radius_m: f32,
    pub(super) feed_m_s: f32,
    /// Sense seen from the positive side of the nearest coordinate plane.
    pub(super) ccw: bool,
    /// Length along a helix, of that in the plane.
    pub(super) steep: f32,
}

impl Round {
    /// Axes that it leads along.
    fn moved(&self) -> [bool; 3] {
        let [[ux, uy, uz], [vx, vy, vz], [rx, ry, rz]] = [self.u, self.v, self.rise_nm];
        [ux | vx | rx, uy | vy | ry, uz | vz | rz].map(|bits| bits != 0)
    }

    /// The centre seen from where position errors of a zone are counted from.
    fn seen(&self, zone: &Built) -> [f32; 3] {
        let centre = to_m(self.centre_nm);
        seen_from(centre, zone.reference_m.unwrap_or(centre))
    }
}

/// The axes of a segment on a circle, or a helix.
fn lay(segment: &mut Planned, round: &Round) {
    segment.kind = if round.rise_nm == [0; 3] {
        Kind::Arc
    } else {
        Kind::Helix
    };
    segment.rise_nm = round.rise_nm;
    let vectors = round.centre_nm.into_iter().zip(round.u).zip(round.v);
    for (axis, ((base, u), v)) in segment.axes.iter_mut().zip(vectors) {
        *axis = Axis {
            base,
            u,
            v,
            a: 0,
            b: 0,
        };
    }
}

impl Planner {
    /// All but where it starts and ends, with the shortest ramp in which acceleration, offset and slew keep their bounds; `timing` makes it from a factor on
    /// the quickest. Where constant rate alone is beyond the bounds of the table, no ramp can help: the tick cuts and counts.
    pub(super) fn round(
        &self,
        round: &Round,
        limit_m_s2: f32,
        timing: &dyn Fn(f32) -> Result<Timing, Refused>,
        segment: &mut Planned,
    ) -> Result<(), Refused> {
        let place_m = to_m(round.centre_nm);
        self.check_reach(place_m, round.radius_m)?;
        let radius_m = Some(round.radius_m);
        let on_circle = joints::on_circle(place_m, arm(round.u), arm(round.v));
        let asked = Asked {
            path_m: &on_circle,
            place_m,
            radius_m,
            feed_m_s: round.feed_m_s,
            ccw: Some(round.ccw),
        };
        // Out of the numbers of the law at constant rate: not corrected, and counted so.
        let endless = Motion {
            ramp_s: ENDLESS_S,
            ..self.around(&timing(1.0)?)
        };
        let zone = self.zones.choose(&asked);
        let zone = zone.as_ref().filter(|zone| {
            let law = ArcLaw::new(zone, &endless);
            law.load() <= 1.0 && law.steady().abs() <= MAX_GAIN
        });
        let bounds = self.bounds(zone.is_some());
        let law = zone.map(|zone| ArcLaw::new(zone, &endless));
        let steady = demand(
            round,
            zone,
            &endless,
            &worst::on_arc(law.as_ref(), &endless),
        );
        let curable = steady.correction(&bounds, round.moved()) <= 1.0;
        let mut stretch = 1.0;
        let (timing, motion, law) = loop {
            let timing = timing(stretch)?;
            let motion = self.around(&timing);
            let law = zone.map(|zone| ArcLaw::new(zone, &motion));
            let worst = worst::on_arc(law.as_ref(), &motion);
            let demand = demand(round, zone, &motion, &worst);
            let numbers = law
                .as_ref()
                .map_or(0.0, |law| law.load().max(worst.gain / MAX_GAIN));
            let correction = demand.correction(&bounds, round.moved());
            let over = if curable {
                correction.max(numbers)
            } else {
                numbers
            };
            match super::demand::longer(stretch, over.max(demand.acceleration(limit_m_s2))) {
                Some(longer) => stretch = longer,
                None => {
                    break (timing, motion, law.filter(|_| numbers <= 1.0));
                }
            }
        };
        self.blank(segment);
        lay(segment, round);
        segment.timing = timing;
        let bounds_kept = curable.then_some(&bounds);
        let stop = (law.as_ref(), limit_m_s2, bounds_kept);
        segment.slowing = self.slowing(round, zone, &motion, stop);
        if let (Some(zone), Some(law)) = (zone, law) {
            self.bound(segment, &bounds);
            segment.rise = law.rounded();
            correct(segment, round, zone, &motion, law.steady())?;
            self.joints(Some(zone), segment);
        }
        segment.rise.end_term_q1 = end_term(&timing);
        Ok(())
    }

    /// What a stop may take, so that centripetal acceleration, braking and what the correction makes of both keep to the limit, and
    /// offset and slew to their bounds.
    fn slowing(
        &self,
        round: &Round,
        zone: Option<&Built>,
        motion: &Motion,
        (law, limit_m_s2, bounds): (Option<&ArcLaw>, f32, Option<&Bounds>),
    ) -> Slowing {
        let (most, jerk) = (self.machine.acceleration_m_s2, self.machine.jerk_m_s3);
        let speed = motion.rate * round.radius_m * round.steep;
        let least = self.machine.least_braking(speed, motion.ramp_s);
        let mut braking = most;
        for _ in 0..STOP_TRIES {
            let slower = |of: f32| (of / braking).min(libm::sqrtf(4.0 * of / jerk));
            let as_ramp = Motion {
                ramp_s: FIRST * slower(speed),
                ..*motion
            };
            let worst = worst::on_stop(law, motion, [braking / speed, jerk / speed]);
            let demand = demand(round, zone, &as_ramp, &worst);
            let correction = bounds.map_or(0.0, |bounds| demand.correction(bounds, round.moved()));
            // Nothing between the places of this sweep is more.
            let over = (demand.acceleration_m_s2 / (0.998 * limit_m_s2)).max(correction);
            if over <= 1.0 || braking <= least {
                break;
            }
            // Of an acceleration that is mostly across, what is along has to give way by more.
            braking = (braking * (1.0 - 2.0 * (over - 1.0)).clamp(0.5, 0.98)).max(least);
        }
        self.machine.slowing(speed, braking)
    }

    /// Every point of a circle is one that the engine can hold.
    pub(super) fn check_reach(&self, centre_m: [f32; 3], radius_m: f32) -> Result<(), Refused> {
        let inside = radius_m + length(centre_m) <= MAX_POSITION_M as f32;
        if inside {
            Ok(())
        } else {
            Err(Refused::OutOfBounds(Quantity::Position))
        }
    }

    fn around(&self, timing: &Timing) -> Motion {
        self.motion(timing, TAU)
    }
}

/// Correction at constant rate, and the profile terms.
fn correct(
    segment: &mut Planned,
    round: &Round,
    zone: &Built,
    motion: &Motion,
    radial: f32,
) -> Result<(), Refused> {
    for axis in &mut segment.axes {
        let share = |vector: i32| single_to_fixed(radial * vector as f32, 0);
        (axis.a, axis.b) = (share(axis.u), share(axis.v));
    }
    let Some(profile) = &zone.profile else {
        return Ok(());
    };
    let extra = &mut segment.extra;
    let curve = terms::Curve {
        u: arm(round.u),
        v: arm(round.v),
        rise: to_m(round.rise_nm),
        centre: round.seen(zone),
    };
    terms::on_arc(profile, motion, &curve, extra);
    if !extra.within_numbers() {
        return Err(Refused::OutOfBounds(Quantity::Terms));
    }
    for (axis, linear) in segment.axes.iter_mut().zip(&extra.linear) {
        let (a, b) = linear.steady();
        (axis.a, axis.b) = (axis.a.saturating_add(a), axis.b.saturating_add(b));
    }
    segment.extended = true;
    Ok(())
}

/// What law and terms ask for together.
fn demand(round: &Round, zone: Option<&Built>, motion: &Motion, worst: &Worst) -> Demand {
    let terms = zone.and_then(|zone| Some((zone.profile.as_ref()?, round.seen(zone))));
    let [offset_m, slew_m_s] = terms.map_or([0.0; 2], |(profile, seen)| {
        terms::worst_on_arc(profile, motion, round.radius_m, seen)
    });
    Demand {
        offset_m: offset_m + round.radius_m * worst.gain,
        slew_m_s: slew_m_s + round.radius_m * worst.slew_per_s,
        acceleration_m_s2: round.steep * round.radius_m * worst.acceleration_per_s2,
    }
}
