//! Periodic error of a joint's gear: `δq = A·sin(w·q + φ)`, seen as `n̂ᵀJe·δq`: a chirp over the circle that does not depend on
//! the speed. w is the number of waves to one turn of the joint: its gear's ratio, or twice that.
use super::{
    ArmChain, Bend, Cause, CauseModel, Effect, Fitted, Parameter, RunView, Seat, Site, Words,
};
use crate::simulation::arm::Gear;
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use std::f64::consts::TAU;

/// See the module.
pub struct JointCyclicError;

const WORDS: Words = Words {
    id: "joint_cyclic_error",
    name: "joint cyclic error",
    unit: "mrad",
    what: "a ripple with a fixed period in a joint's angle: dense where the joint is fast, stretched where it turns back",
    usual: "transmission error of the joint's gear: once or twice a turn of its input",
    adjust: "map the joint over one turn of its gear's input, or have the gear overhauled",
    positive: "the gear of {a} is off by up to {size} within each turn of its input: map it, or have it overhauled",
    negative: "the gear of {a} is off by up to {size} within each turn of its input: map it, or have it overhauled",
    elsewhere: None,
    never_told_from: &[],
    next: "a slow turn of the joint alone over a few waves, with an encoder or a tracker at the tool",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [0.0, 20.0], "mrad of amplitude");

/// Waves of a joint's turn.
const RATIO: Parameter = Parameter::needed(
    "ratio",
    [1.0, 2000.0],
    "waves to one turn of the joint: the gear's ratio, or twice that",
);
/// Phase at angle 0.
const PHASE_RAD: Parameter = Parameter::needed(
    "phase_rad",
    [-6.3, 6.3],
    "phase at the joint's zero, one turn to either side",
);

/// Ratios of robot gears, and twice that: from a belt and one stage to a cycloid of high ratio.
pub const RATIOS: [f64; 2] = [10.0, 700.0];
/// Fewest waves over the joint's largest swing: less is a bend of something else.
const FEWEST_WAVES: f64 = 1.5;
/// Largest step of the phase from sample to sample, rad.
const LARGEST_STEP_RAD: f64 = 2.4;
/// Distance of the shapes that are tried, in waves over the largest swing.
const BESIDE: f64 = 0.35;

/// Largest swing of a joint on any circle, rad; 0: it is not of an arm.
fn swing_rad(views: &[RunView], joint: usize) -> f64 {
    let arms = views.iter().filter_map(|view| view.arm.as_ref());
    arms.map(|arm| {
        let [low, high] = arm.orbit.range_rad(joint);
        high - low
    })
    .fold(0.0, f64::max)
}

/// Lowest and highest number of waves a turn that these runs can tell of a joint; `None`: none at all.
fn waves_of(views: &[RunView], joint: usize) -> Option<[f64; 2]> {
    let swing = swing_rad(views, joint);
    let lowest = RATIOS[0].max(FEWEST_WAVES * TAU / swing.max(1e-9));
    // The circle on which the joint is slowest shows the highest; on others a wave may fall between two samples.
    let highest = views
        .iter()
        .filter_map(|view| {
            let samples = view.psi_rad.len().max(1) as f64;
            let fastest = view.arm.as_ref()?.orbit.fastest(joint);
            Some(LARGEST_STEP_RAD * samples / (TAU * fastest.max(1e-9)))
        })
        .fold(0.0, f64::max)
        .min(RATIOS[1]);
    (highest > lowest).then_some([lowest, highest])
}

impl CauseModel for JointCyclicError {
    fn cause(&self) -> Cause {
        Cause::JointCyclicError
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

    fn sites(&self, views: &[RunView]) -> Vec<Site> {
        let mut sites = self.seat().sites(views);
        sites.retain(|site| match site {
            Site::One(joint) => waves_of(views, joint.index()).is_some(),
            _ => false,
        });
        sites
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&RATIO, &PHASE_RAD]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        let ratio = fit.shape.first().copied().unwrap_or(f64::NAN);
        let phase_rad = match fit.amounts {
            [sine, cosine] => cosine.atan2(*sine),
            _ => f64::NAN,
        };
        vec![(&RATIO, ratio), (&PHASE_RAD, phase_rad)]
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["ratio"]
    }

    /// Ratios so close that neighbours stay in step over the largest swing.
    fn shapes(&self, views: &[RunView]) -> Vec<Vec<f64>> {
        let widest = (0..6)
            .max_by(|a, b| swing_rad(views, *a).total_cmp(&swing_rad(views, *b)))
            .unwrap_or(0);
        let swing = swing_rad(views, widest);
        let Some([mut ratio, highest]) = waves_of(views, widest) else {
            return vec![vec![RATIOS[0]]];
        };
        let mut shapes = Vec::new();
        while ratio <= highest {
            shapes.push(vec![ratio]);
            ratio += BESIDE * TAU / swing;
        }
        shapes
    }

    /// In waves a turn here, since a joint's place is an angle.
    fn finest_wave_per_m(&self, _views: &[RunView]) -> Option<f64> {
        Some(RATIOS[1])
    }

    /// About a hundredth of a wave over a swing of half a radian.
    fn bend(&self, _which: usize, _ratio: f64, _travel_m: f64) -> Bend {
        Bend::Amount(0.1)
    }

    fn tidy(&self, shape: &mut [f64]) {
        shape
            .iter_mut()
            .for_each(|ratio| *ratio = ratio.abs().clamp(RATIOS[0], RATIOS[1]));
    }

    fn columns(&self) -> usize {
        2
    }

    fn signature(&self, site: Site, shape: &[f64], column: usize, view: &RunView, out: &mut [f64]) {
        let (Some(ratio), Site::One(joint), Some(arm)) = (shape.first(), site, &view.arm) else {
            return;
        };
        for (out, psi) in out.iter_mut().zip(view.psi_rad.iter()) {
            let [q, _, lever] = arm.orbit.at(joint.index(), *psi);
            let (sin, cos) = (ratio * q).sin_cos();
            *out = 1e-3 * lever * if column == 0 { sin } else { cos };
        }
    }

    /// Sine and cosine together.
    fn signatures(&self, site: Site, shape: &[f64], view: &RunView, out: &mut [&mut [f64]]) {
        let (Some(ratio), Site::One(joint), Some(arm), [sines, cosines]) =
            (shape.first(), site, &view.arm, out)
        else {
            return;
        };
        let outs = sines.iter_mut().zip(cosines.iter_mut());
        for ((sine, cosine), psi) in outs.zip(view.psi_rad.iter()) {
            let [q, _, lever] = arm.orbit.at(joint.index(), *psi);
            let (sin, cos) = (ratio * q).sin_cos();
            (*sine, *cosine) = (1e-3 * lever * sin, 1e-3 * lever * cos);
        }
    }

    fn ratios(&self, views: &[RunView], joint: usize) -> Option<[f64; 2]> {
        waves_of(views, joint)
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let (Site::One(joint), Some(arm)) = (effect.site(), &mut machine.arm) {
            arm.joints[joint.index()].gear = Some(Gear {
                amplitude_rad: effect.value() * 1e-3,
                waves: effect.get(&RATIO),
                phase_rad: effect.get(&PHASE_RAD),
            });
        }
    }

    fn joint_term(&self, effect: &Effect, _arm: &ArmChain) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        Some(Term::JointCyclic {
            actuator,
            amplitude_rad: effect.value() * 1e-3,
            waves: effect.get(&RATIO),
            phase_rad: effect.get(&PHASE_RAD),
        })
    }
}
