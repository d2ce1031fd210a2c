//! How far and how fast the circles of a calibration go, and which ones they are.
use super::Args;
use super::machine::Behind;
use crate::Failure;
use giotto_link::Controller;
use giotto_link::linuxcnc::drive;
use std::f64::consts::TAU;

/// Radius if nothing else is said, mm.
const USUAL_RADIUS_MM: f64 = 150.0;
/// The least of them, mm, however slow a machine is.
const LEAST_USUAL_MM: f64 = 10.0;
/// Of the controller's room and feed so much is used: the correction needs some of them.
const SHARE: f64 = 0.8;
/// Of its acceleration so much is asked for across the path. Nearer to what the axes can do a machine turns so fast that its
/// radius error follows no longer from two cumulants: a lag of 20 ms with an average of 40 ms shrank circles of 24 mm by 8 %
/// at 18 rad/s, and nothing could be told from them.
const CENTRIPETAL: f64 = 0.2;
/// Radii and speeds of the plan, shares of the largest each; of every radius its own highest feed counts.
const RADII: [f64; 3] = [1.0, 0.6, 0.4];
const FEEDS: [f64; 4] = [0.1, 0.4, 0.7, 1.0];
/// Those of the circles that prove it: none of them is in the plan.
const PROOF: [[f64; 2]; 3] = [[0.9, 0.85], [0.7, 0.95], [0.5, 0.6]];
/// Turns and ramps of one circle on a controller of giotto and in LinuxCNC, turns; way to it and rest, s.
const TURNS: f64 = 3.0;
const LINUXCNC_TURNS: f64 = 1.75;
const REST_S: f64 = 1.0;
/// No circle of a machine that is there takes longer, s: with feeds of hobby machines a tenth of the highest one would be
/// minutes.
const LONGEST_S: f64 = 15.5;
/// How far and how fast the plan may go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) radius_mm: f64,
    pub(super) feed_mm_s: f64,
    pub(super) acceleration_mm_s2: f64,
    /// Turns and ramps of one circle.
    turns: f64,
    /// Longest circle, s.
    longest_s: f64,
}

/// To a tenth, as a person programs it.
fn tenths(value: f64) -> f64 {
    (value * 10.0).floor() / 10.0
}

impl Limits {
    pub(super) fn of(
        args: &Args,
        machine: &Behind,
        controller: &mut Controller,
    ) -> Result<Self, Failure> {
        let (room_mm, feed_mm_s, acceleration_mm_s2) = if machine.is_simulated() {
            let (config, _) = controller.config()?;
            // Circles lie about the origin of the first two slides.
            let soft = config.soft_nm.iter().take(2).flatten();
            let room_mm = soft.fold(f64::INFINITY, |room, nm| {
                room.min(f64::from(*nm).abs() * 1e-6)
            });
            let [feed, acceleration] = [config.feed_m_s, config.acceleration_m_s2];
            (
                room_mm,
                1e3 * f64::from(feed),
                1e3 * f64::from(acceleration),
            )
        } else {
            let of = drive::limits()?;
            (of.room_mm, of.feed_mm_s, of.acceleration_mm_s2)
        };
        let least = |given: Option<f64>, limit: f64| given.unwrap_or(limit).min(limit);
        let feed_mm_s = least(args.max_feed, SHARE * feed_mm_s);
        let acceleration_mm_s2 = least(args.max_acceleration, CENTRIPETAL * acceleration_mm_s2);
        // On a larger one the highest feed turns slower: it takes longer and shows less.
        let useful_mm = feed_mm_s * feed_mm_s / acceleration_mm_s2;
        let usual_mm = USUAL_RADIUS_MM.min(useful_mm.max(LEAST_USUAL_MM));
        let (turns, longest_s) = if machine.is_simulated() {
            (TURNS, f64::INFINITY)
        } else {
            (LINUXCNC_TURNS, LONGEST_S)
        };
        let limits = Self {
            radius_mm: args.max_radius.unwrap_or(usual_mm).min(SHARE * room_mm),
            feed_mm_s,
            acceleration_mm_s2,
            turns,
            longest_s,
        };
        if limits.radius_mm < 1.0 {
            return Err(Failure::controller(format_args!(
                "the soft limits leave {room_mm:.1} mm about the origin: no room for a circle"
            )));
        }
        Ok(limits)
    }

    /// How long circles take both ways, s.
    pub(super) fn duration_s(&self, circles: &[(f64, f64)]) -> f64 {
        let both_ways =
            |(radius, feed): &(f64, f64)| 2.0 * (self.turns * TAU * radius / feed + REST_S);
        circles.iter().map(both_ways).sum()
    }

    /// Smallest radius of the plan, mm.
    pub(super) fn least_radius_mm(&self) -> f64 {
        RADII.iter().fold(f64::INFINITY, |a, b| a.min(*b)) * self.radius_mm
    }

    /// Highest feed on a radius, mm/s.
    fn highest(&self, radius_mm: f64) -> f64 {
        self.feed_mm_s
            .min((self.acceleration_mm_s2 * radius_mm).sqrt())
    }

    fn at(&self, [radius, feed]: [f64; 2]) -> (f64, f64) {
        let radius_mm = tenths(radius * self.radius_mm);
        let highest = self.highest(radius_mm);
        let slowest = (self.turns * TAU * radius_mm / self.longest_s).min(highest);
        (radius_mm, tenths((feed * highest).max(slowest)))
    }

    /// Radius, mm, and feed, mm/s, of the circles to be measured, each both ways.
    pub(super) fn circles(&self) -> Vec<(f64, f64)> {
        let pairs = RADII.iter().flat_map(|r| FEEDS.map(|f| [*r, f]));
        pairs.map(|pair| self.at(pair)).collect()
    }

    pub(super) fn proof(&self) -> [(f64, f64); 3] {
        PROOF.map(|pair| self.at(pair))
    }
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may fail where it stands"
)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_keeps_its_limits_and_the_proof_is_none_of_it() {
        let limits = Limits {
            radius_mm: 150.0,
            feed_mm_s: 800.0,
            acceleration_mm_s2: 4000.0,
            turns: TURNS,
            longest_s: f64::INFINITY,
        };
        let circles = limits.circles();
        assert_eq!(circles.len(), 12);
        for (radius, feed) in circles.iter().chain(&limits.proof()) {
            assert!(*radius <= 150.0 && *feed <= 800.0 && feed * feed / radius <= 4000.0);
        }
        for (radius, feed) in limits.proof() {
            assert!(circles.iter().all(|(r, f)| *r != radius && *f != feed));
        }
        let [slow, ..] = circles[..] else { panic!() };
        assert!(
            (limits.duration_s(&[slow]) - 2.0 * (3.0 * TAU * slow.0 / slow.1 + 1.0)).abs() < 1e-9
        );
    }

    /// LinuxCNC's own simulated machine: 53 mm/s and 508 mm/s², both of a hobby mill.
    #[test]
    fn a_slow_machine_is_done_in_five_minutes() {
        let limits = Limits {
            radius_mm: 18.0,
            feed_mm_s: 42.7,
            acceleration_mm_s2: 101.6,
            turns: LINUXCNC_TURNS,
            longest_s: LONGEST_S,
        };
        let whole_s =
            limits.duration_s(&limits.circles()) + 2.0 * limits.duration_s(&limits.proof());
        assert!(whole_s < 300.0, "{whole_s}");
        for (radius, feed) in limits.circles() {
            assert!(LINUXCNC_TURNS * TAU * radius / feed < LONGEST_S + 1.0);
        }
    }
}
