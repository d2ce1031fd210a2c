//! A joint of a serial arm that lags more than the others: `δq = −δτ·q̇`, seen as `n̂ᵀJe·δq`: a mean
//! `r = −½·f·d·(A12 − A21)`, A = J·diag(τ)·J⁻¹, with an oval that flips with the direction.
//!
//! Loops of unequal gain differ by −jωδτ·G², unequal dead times by −jωδτ·G; the shape parameter `turned` (1 or 0) is that
//! choice. A lag that all joints have alike only delays the circle, so the value is what this joint has more than the mean.
//! Without kinematics only the mean is known: the effective A12 − A21.
use super::{
    ArmChain, Bend, Cause, CauseModel, Effect, Fitted, Harmonics, Parameter, RunView, Seat, Site,
    Words,
};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct JointLagMismatch;

const WORDS: Words = Words {
    id: "joint_lag_mismatch",
    name: "joint lag mismatch",
    unit: "s",
    what: "one direction draws larger circles than the other, in proportion to the speed: the joints of a serial arm lag unequally",
    usual: "unequal position gains or dead times of the joints",
    adjust: "match the position gains of the joints that move in this plane",
    positive: "{a} follows {size} later than the joints on average: raise its gain",
    negative: "{a} follows {size} earlier than the joints on average: lower its gain, or raise that of the others",
    elsewhere: Some([
        "circles counter-clockwise come out smaller than clockwise, by {size} of lag between the joints: match the gains of the joints that move in this plane; with the kinematics given it is told which",
        "circles counter-clockwise come out larger than clockwise, by {size} of lag between the joints: match the gains of the joints that move in this plane; with the kinematics given it is told which",
    ]),
    never_told_from: &[],
    next: "the same circles at another place of the work space, where the Jacobian differs",
    not_compensable: Some(
        "its size changes with the place: with the kinematics given it is told which joint, and corrected there",
    ),
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-1.0, 1.0], "s: a lag of a second");

/// Whether the loops' gains differ (1) or their dead times (0).
const TURNED: Parameter = Parameter::optional(
    "turned",
    [0.0, 1.0],
    1.0,
    "1: unequal gains of the loops, 0: unequal dead times",
);

/// What a joint has more than the others for each second more than the mean of all.
fn beyond_others(turning: usize) -> f64 {
    let n = turning.max(2) as f64;
    n / (n - 1.0)
}

impl CauseModel for JointLagMismatch {
    fn cause(&self) -> Cause {
        Cause::JointLagMismatch
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::MachineOrJoint
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&TURNED]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        let turned = fit.shape.first().copied();
        turned.map(|turned| (&TURNED, turned)).into_iter().collect()
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["turned"]
    }

    fn shapes(&self, views: &[RunView]) -> Vec<Vec<f64>> {
        if views.iter().any(|view| view.arm.is_some()) {
            vec![vec![1.0], vec![0.0]]
        } else {
            vec![vec![1.0]]
        }
    }

    fn bend(&self, _which: usize, turned: f64, _travel_m: f64) -> Bend {
        Bend::Choice(1.0 - turned)
    }

    // The choice is between two forms that differ by a few percent: it bends nothing.
    fn flexible(&self) -> bool {
        false
    }

    fn harmonics(&self, site: Site, shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let (Site::One(joint), Some(arm)) = (site, &view.arm) else {
            return Some(Harmonics::mean(-0.5 * view.feed_m_s * view.sign));
        };
        let turned = shape.first().is_none_or(|turned| *turned > 0.5);
        let more_s = beyond_others(arm.orbit.kinematics().turning());
        let rates = arm.rates(view);
        let answers = std::array::from_fn(|n| {
            let again = if turned { arm.chain[n] } else { 1.0.into() };
            arm.answers[n] * again * rates[n] * -more_s
        });
        Some(arm.seen(joint.index(), &answers))
    }

    fn is_mutual(&self) -> bool {
        true
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        match (effect.site(), &mut machine.arm) {
            (Site::One(joint), Some(arm)) => {
                let more_s = effect.value() * beyond_others(arm.kinematics.turning());
                let joint = &mut arm.joints[joint.index()];
                if effect.get(&TURNED) > 0.5 {
                    joint.lag_s += more_s;
                } else {
                    joint.dead_time_s += more_s;
                }
            }
            (Site::Machine, _) => machine.cross_lag_s += effect.value(),
            _ => {}
        }
    }

    fn joint_term(&self, effect: &Effect, arm: &ArmChain) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        let delta_tau_s = effect.value() * beyond_others(arm.turning);
        // (τ + δ)² − τ²: a slower loop smooths more, too; a longer dead time does not.
        let delta_kappa2_s2 = if effect.get(&TURNED) > 0.5 {
            (2.0 * arm.lag_s + delta_tau_s) * delta_tau_s
        } else {
            0.0
        };
        Some(Term::JointLag {
            actuator,
            delta_tau_s,
            delta_kappa2_s2,
        })
    }
}
