//! Serial arm: friction spikes where a *joint* turns back, not where a slide would. The joint stays behind its new motion by
//! a pulse, `δq = −A·sgn(q̇)·p(t)`, seen as `n̂ᵀJe·δq`; friction and loop are those of [`ReversalSpike`](super::reversal_spike).
//!
//! The size is stated at the tool: A times the distance of the tool from the joint's axis at the first circle.
use super::reversal_spike::Pulse;
use super::{
    ArmChain, Bend, Cause, CauseModel, Effect, Fitted, Parameter, RunView, Seat, Site, Words,
};
use crate::simulation::machine::{Friction, Machine};
use giotto_shared::term::Term;
use std::f64::consts::TAU;

/// See the module.
pub struct JointReversal;

const WORDS: Words = Words {
    id: "joint_reversal",
    name: "joint reversal",
    unit: "um",
    what: "spikes where a joint of a serial arm turns round, not at the quadrants",
    usual: "friction of one joint",
    adjust: "friction compensation of that joint",
    positive: "{a} sticks where it turns back, {size} at the tool: raise its friction compensation, look at its gear",
    negative: "{a} is pushed too far where it turns back, {size} at the tool: lower its friction compensation",
    elsewhere: None,
    never_told_from: &[],
    next: "the same circle elsewhere: the spikes move with the joint angles",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-1e4, 1e4], "µm at the tool");

/// Time constant of the decay.
const DECAY_S: Parameter = Parameter::needed(
    "decay_s",
    [5e-4, 1.0],
    "time constant with which the loop takes the pulse away",
);
/// Time constant of the rise.
const RISE_S: Parameter = Parameter::optional(
    "rise_s",
    [0.0, 1.0],
    0.002,
    "time constant of the rise, shorter than the decay",
);
/// Turn over which friction changes its sign.
const PRESLIDING_MRAD: Parameter = Parameter::optional(
    "presliding_mrad",
    [0.0, 10.0],
    0.0,
    "turn of the joint over which friction changes its sign",
);
/// Distance from the axis for which the peak is stated.
const ARM_MM: Parameter = Parameter::needed(
    "arm_mm",
    [1.0, 1e4],
    "distance of the tool from the joint's axis for which the peak is stated",
);

/// Decay of the loop's answer, s.
const DECAYS_S: [f64; 2] = [5e-4, 0.4];
/// Shortest rise, s: the cycle of a fast position loop.
const SHORTEST_RISE_S: f64 = 5e-5;
/// Turn over which the friction of gears changes its sign, rad.
const PRESLIDINGS_RAD: [f64; 2] = [1e-8, 1e-3];

impl CauseModel for JointReversal {
    fn cause(&self) -> Cause {
        Cause::JointReversal
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::Joint
    }

    /// Joints that turn back on some circle.
    fn sites(&self, views: &[RunView]) -> Vec<Site> {
        let turns_back = |site: &Site| {
            let Site::One(joint) = site else { return false };
            let mut arms = views.iter().filter_map(|view| view.arm.as_ref());
            arms.any(|arm| !arm.orbit.reversals(joint.index()).is_empty())
        };
        let mut sites = self.seat().sites(views);
        sites.retain(turns_back);
        sites
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&DECAY_S, &RISE_S, &PRESLIDING_MRAD, &ARM_MM]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        let Site::One(joint) = fit.site else {
            return Vec::new();
        };
        match (fit.shape, &fit.first_view.arm) {
            (&[decay_s, rise_s, presliding_rad], Some(arm)) => vec![
                (&DECAY_S, decay_s),
                (&RISE_S, rise_s),
                (&PRESLIDING_MRAD, presliding_rad * 1e3),
                (&ARM_MM, arm.arms_m[joint.index()] * 1e3),
            ],
            _ => Vec::new(),
        }
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["decay_s", "rise_s", "presliding_rad"]
    }

    fn shapes(&self, _views: &[RunView]) -> Vec<Vec<f64>> {
        let mut shapes = Vec::new();
        for decay in [0.006, 0.015, 0.04, 0.1] {
            for rise in [0.1, 0.5] {
                for presliding in [2e-6, 2e-5] {
                    shapes.push(vec![decay, rise * decay, presliding]);
                }
            }
        }
        shapes
    }

    fn bend(&self, _which: usize, value: f64, _travel_m: f64) -> Bend {
        Bend::Amount(0.05 * value)
    }

    fn tidy(&self, shape: &mut [f64]) {
        let [decay_s, rise_s, presliding_rad] = shape else {
            return;
        };
        *decay_s = decay_s.abs().clamp(DECAYS_S[0], DECAYS_S[1]);
        *rise_s = rise_s.abs().clamp(SHORTEST_RISE_S, *decay_s);
        *presliding_rad = presliding_rad
            .abs()
            .clamp(PRESLIDINGS_RAD[0], PRESLIDINGS_RAD[1]);
    }

    // Friction opposes the new motion; the other way round it is another thing.
    fn allows(&self, peak_um: f64) -> bool {
        peak_um > 0.0
    }

    fn signature(
        &self,
        site: Site,
        shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let (&[decay_s, rise_s, presliding_rad], Site::One(joint), Some(arm)) =
            (shape, site, &view.arm)
        else {
            return;
        };
        let joint = joint.index();
        let omega = view.omega_rad_s;
        let size = 1e-6 / arm.arms_m[joint].max(1e-3);
        let turn_s = TAU / omega;
        let pulses: Vec<(f64, f64, Pulse)> = arm
            .orbit
            .reversals(joint)
            .iter()
            .map(|reversal| {
                let bend = reversal.bend.abs();
                let pulse = Pulse::alone([decay_s, rise_s, presliding_rad], bend, omega);
                (reversal.angle_rad, reversal.bend.signum(), pulse)
            })
            .collect();
        for (out, psi) in out.iter_mut().zip(view.psi_rad.iter()) {
            let mut behind = 0.0;
            for (angle_rad, side, pulse) in &pulses {
                let since_s = (view.sign * (psi - angle_rad)).rem_euclid(TAU) / omega;
                // That of the turn before, too, where it is not yet gone.
                behind += side * (pulse.at(since_s) + pulse.at(since_s + turn_s));
            }
            let [_, _, lever] = arm.orbit.at(joint, *psi);
            *out = -size * behind * lever;
        }
    }

    /// The height of a spike hangs on the shape of its rise, which differs from friction law to friction law.
    fn relative_doubt(&self) -> f64 {
        0.02
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        let (Site::One(joint), Some(arm)) = (effect.site(), &mut machine.arm) else {
            return;
        };
        let joint = &mut arm.joints[joint.index()];
        let mut friction = joint.friction.unwrap_or(Friction {
            peak_m: 0.0,
            ..Friction::default()
        });
        friction.peak_m += effect.value() * 1e-6 / (effect.get(&ARM_MM) * 1e-3);
        friction.decay_s = effect.get(&DECAY_S);
        friction.rise_s = effect.get(&RISE_S);
        friction.presliding_m = effect.get(&PRESLIDING_MRAD) * 1e-3;
        joint.friction = Some(friction);
    }

    fn joint_term(&self, effect: &Effect, _arm: &ArmChain) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        Some(Term::JointReversal {
            actuator,
            peak_rad: effect.value() * 1e-6 / (effect.get(&ARM_MM) * 1e-3),
            decay_s: effect.get(&DECAY_S),
            rise_s: effect.get(&RISE_S),
            presliding_rad: effect.get(&PRESLIDING_MRAD) * 1e-3,
        })
    }
}
