//! Soft limits: whether a path stays within them, looked at before anything moves.
use super::numbers::arm;
use super::{Planner, Refused};
use core::f32::consts::{PI, TAU};
use giotto_shared::Actuator;
use giotto_shared::path::{ExactArc, ExactCircle};

/// What rounding of vectors and single precision may carry an arc over a limit that it was meant to touch, m.
const SLACK_M: f32 = 2e-7;
const TURNS_PER_UNIT: f32 = super::timing::TURNS_PER_UNIT;

impl Planner {
    /// A place within all limits; the first axis that is not, otherwise.
    pub fn soft_place(&self, place_nm: &[i32; 3]) -> Result<(), Refused> {
        let outside = |(nm, [least, most]): (&i32, &[i32; 2])| nm < least || nm > most;
        let mut axes = place_nm.iter().zip(&self.machine.soft_nm);
        match axes.position(outside) {
            None => Ok(()),
            Some(axis) => Err(Refused::SoftLimit(axis as u8)),
        }
    }

    /// From least to most on an axis, m.
    fn soft_span(&self, axis: usize, span_m: [f32; 2]) -> Result<(), Refused> {
        let Some(limits) = self.machine.soft_nm.get(axis) else {
            return Ok(());
        };
        let ([least, most], [from, to]) = (limits.map(|nm| nm as f32 * 1e-9), span_m);
        if from < least - SLACK_M || to > most + SLACK_M {
            return Err(Refused::SoftLimit(axis as u8));
        }
        Ok(())
    }

    /// Circles in a plane of two axes: the third does not move from where the centre is.
    pub fn soft_circle(&self, run: &ExactCircle) -> Result<(), Refused> {
        let radius_m = run.radius_half_nm as f32 * 0.5e-9;
        let turning = run.plane.axes();
        for (axis, (nm, slide)) in run.centre_nm.iter().zip(Actuator::SLIDES).enumerate() {
            let reach = if turning.contains(&slide) {
                radius_m
            } else {
                0.0
            };
            let centre_m = *nm as f32 * 1e-9;
            self.soft_span(axis, [centre_m - reach, centre_m + reach])?;
        }
        Ok(())
    }

    /// An arc or helix, where it is farthest on each axis.
    pub(super) fn soft_arc(&self, arc: &ExactArc) -> Result<(), Refused> {
        let turns = arc.turns as f32 + arc.fraction as f32 * TURNS_PER_UNIT;
        let sweep = TAU * turns;
        let (u, v) = (arm(arc.u_half_nm), arm(arc.v_half_nm));
        for axis in 0..3 {
            let part = |vector: &[f32; 3]| vector.get(axis).copied().unwrap_or(0.0);
            let nm = |vector: &[i32; 3]| vector.get(axis).copied().unwrap_or(0) as f32 * 1e-9;
            let (u, v) = (part(&u), part(&v));
            let (centre, rise) = (nm(&arc.centre_nm), nm(&arc.rise_nm) * turns);
            let at = |angle: f32| u * libm::cosf(angle) + v * libm::sinf(angle);
            // Start and end, and the two turning points if the sweep passes them; a helix moves along meanwhile.
            let (mut least, mut most) = (u.min(at(sweep)), u.max(at(sweep)));
            let top = libm::atan2f(v, u);
            for (angle, size) in [(top, 1.0), (top + PI, -1.0)] {
                let first = if angle < 0.0 { angle + TAU } else { angle };
                if first <= sweep {
                    let reach = size * libm::sqrtf(u * u + v * v);
                    (least, most) = (least.min(reach), most.max(reach));
                }
            }
            let span = [
                centre + least + rise.min(0.0),
                centre + most + rise.max(0.0),
            ];
            self.soft_span(axis, span)?;
        }
        Ok(())
    }
}
