//! The joints of an arm in each run, where the campaign gives its kinematics.
//!
//! The baseline knows the joints: every joint answers with the common response, and the path follows by the kinematics. To first
//! order in the rate of turn equal joints only delay the circle; beyond, the curvature of the kinematics leaves a pattern that
//! slides do not have. It belongs to the simulation, not to the findings.
use super::baseline::{Size, fit_lag};
use super::finding::Finding;
use super::statement;
use super::survey::{Response, believed_feed_m_s};
use crate::campaign::Campaign;
use crate::causes::Harmonics;
use crate::causes::arm::{ArmView, harmonics};
use crate::kinematics::{Kinematics, Orbit, WAVES};
use giotto_shared::{Actuator, Frame};
use rustfft::num_complex::Complex;
use std::sync::Arc;

/// The circles of a campaign as the joints see them.
#[derive(Clone, Debug, Default)]
pub struct Arms {
    /// One a run; empty: slides.
    orbits: Vec<Arc<Orbit>>,
    /// Distance of the tool from each joint's axis at the first circle, m.
    arms_m: [f64; 6],
}

/// Square of 1/|G| that is taken at least.
const LEAST_SQUARE: f64 = 0.25;
/// Share of κ2 and of b by which the baseline is moved for its slopes.
const STEP: f64 = 1e-3;
/// The least of it, s² and s⁴.
const LEAST_STEPS: [f64; 2] = [1e-8, 1e-13];

impl Arms {
    /// Follows each circle once. A campaign whose arm cannot stand on one of its circles is one of slides; the reader
    /// refuses it before.
    pub fn new(campaign: &Campaign) -> Self {
        let Some(kinematics) = &campaign.kinematics else {
            return Self::default();
        };
        /// Centre, frame and radius, m.
        type Circle = ([f64; 3], Frame, f64);
        let mut known: Vec<(Circle, Arc<Orbit>)> = Vec::new();
        let mut orbits = Vec::with_capacity(campaign.runs.len());
        for run in &campaign.runs {
            let centre_m = run.centre_m.unwrap_or_default();
            let circle = (centre_m, run.frame, run.radius_m);
            let orbit = match known.iter().find(|(other, _)| *other == circle) {
                Some((_, orbit)) => Arc::clone(orbit),
                None => {
                    let Ok(orbit) = Orbit::new(kinematics, centre_m, run.frame, run.radius_m)
                    else {
                        return Self::default();
                    };
                    let orbit = Arc::new(orbit);
                    known.push((circle, Arc::clone(&orbit)));
                    orbit
                }
            };
            orbits.push(orbit);
        }
        let arms_m = orbits.first().map_or([0.0; 6], |orbit| {
            std::array::from_fn(|joint| orbit.arm_m(joint))
        });
        Self { orbits, arms_m }
    }

    /// The joints in a run under a response; `None`: slides.
    pub fn view(
        &self,
        run: usize,
        response: &Response,
        omega_rad_s: f64,
        sign: f64,
    ) -> Option<Arc<ArmView>> {
        let orbit = self.orbits.get(run)?;
        let common = |response: Response| {
            let (_, answers) = answers(&response, omega_rad_s, sign);
            harmonics(&orbit.common(&answers))
        };
        let (a, b) = (response.a_s2, response.b_s4);
        let da = (STEP * a.abs()).max(LEAST_STEPS[0]);
        let db = (STEP * b.abs().max(a * a)).max(LEAST_STEPS[1]);
        let here = common(*response);
        let (chain, answers) = answers(response, omega_rad_s, sign);
        let slope = |a_s2: f64, b_s4: f64, factor: f64| -> Harmonics {
            common(Response { a_s2, b_s4 }).minus(&here).times(factor)
        };
        Some(Arc::new(ArmView {
            per_kappa2: slope(a + da, b, 1.0 / da),
            // β2 beyond the lag's own is −b/2.
            per_beta2: slope(a, b + db, -2.0 / db),
            orbit: Arc::clone(orbit),
            chain,
            answers,
            common: here,
            arms_m: self.arms_m,
        }))
    }
}

/// G(jn·dω) for each wave, and the same with the lag of the first taken off.
fn answers(
    response: &Response,
    omega_rad_s: f64,
    sign: f64,
) -> ([Complex<f64>; WAVES], [Complex<f64>; WAVES]) {
    let chain: [Complex<f64>; WAVES] = std::array::from_fn(|n| {
        let forward = answer(response, n as f64 * omega_rad_s);
        if sign < 0.0 { forward.conj() } else { forward }
    });
    let lag = chain[1].arg();
    let answers = std::array::from_fn(|n| chain[n] * Complex::cis(-(n as f64) * lag));
    (chain, answers)
}

/// G(jω) of the simplest chain with a response: one lag for b ≤ 0, else a second-order element. Beyond the rates of the
/// circles themselves, where a fitted b < 0 would blow up, the gain is held at 2.
fn answer(response: &Response, omega_rad_s: f64) -> Complex<f64> {
    let (a, b) = (response.a_s2, response.b_s4);
    let w2 = omega_rad_s * omega_rad_s;
    let gain = (1.0 + a * w2 + b * w2 * w2)
        .max(LEAST_SQUARE)
        .sqrt()
        .recip();
    let lag_rad = if b > 0.0 {
        let omega_n = b.powf(-0.25);
        let zeta = (0.5 + 0.25 * a * omega_n * omega_n).max(0.0).sqrt();
        let r = omega_rad_s / omega_n;
        (2.0 * zeta * r).atan2(1.0 - r * r)
    } else {
        (a.max(0.0).sqrt() * omega_rad_s).atan()
    };
    Complex::from_polar(gain, -lag_rad)
}

/// The lag that fits the sizes of a campaign, of an arm or of slides.
pub fn fit_lag_of(campaign: &Campaign) -> Response {
    let sizes: Vec<Size> = campaign
        .runs
        .iter()
        .map(|run| Size::of(run, believed_feed_m_s(run)))
        .collect();
    let first = fit_lag(&sizes);
    let arms = Arms::new(campaign);
    if arms.orbits.is_empty() {
        return first;
    }
    let corrected: Vec<Size> = sizes
        .iter()
        .enumerate()
        .map(|(run, size)| {
            let sign = campaign.runs[run].sign();
            let arm = arms.view(run, &first, size.omega_rad_s, sign);
            let extra_m = arm.map_or(0.0, |arm| beyond_slides_m(&arm, &first, size));
            Size {
                error_m: size.error_m - extra_m,
                ..*size
            }
        })
        .collect();
    fit_lag(&corrected)
}

/// Mean radius error of an arm beyond that of slides with the same response, m.
pub fn beyond_slides_m(arm: &ArmView, response: &Response, size: &Size) -> f64 {
    arm.common.0[0][0] - size.radius_m * (response.gain(size.omega_rad_s) - 1.0)
}

/// What belongs to two joints alone is the other's as well: circles cannot tell which of the two differs.
pub fn name_both(findings: &mut [Finding], kinematics: Option<&Kinematics>) {
    if kinematics.is_none_or(|kinematics| kinematics.turning() != 2) {
        return;
    }
    for finding in findings {
        if finding.cause.model().is_mutual() && finding.axis == Some(Actuator::Joint1) {
            finding.actuators = vec![Actuator::Joint1, Actuator::Joint2];
            finding.remedy =
                statement::remedy(finding.cause, &finding.actuators, finding.estimate.value);
        }
    }
}
