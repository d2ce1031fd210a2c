//! A carriage that shifts sideways with its direction of travel: `r = −d(L/2)|sinψ|` (X moves, Y shifts),
//! `−d(L/2)|cosψ|` (Y moves, X shifts). It moves the mean radius by −dL/π.
use super::{Cause, CauseModel, Effect, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Plane};

/// See the module.
pub struct LateralPlay;

const WORDS: Words = Words {
    id: "lateral_play",
    name: "lateral play",
    unit: "mm",
    what: "one axis shifts sideways when the other turns round, so that one direction draws larger circles than the other",
    usual: "play in the guides of one axis",
    adjust: "adjust the gibs or replace the guide blocks of that axis",
    positive: "{a} shifts sideways by {size} when it turns back: raise the preload of its guide until the {size} are gone",
    negative: "{a} shifts sideways by {size}, against its usual side, when it turns back: raise the preload of its guide until the \
                   {size} are gone",
    elsewhere: None,
    never_told_from: &[],
    next: "a line along the moving axis, forth and back, with an indicator square to it",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter =
    Parameter::needed("value", [-5.0, 5.0], "mm: as much as a table may correct");

impl CauseModel for LateralPlay {
    fn cause(&self) -> Cause {
        Cause::LateralPlay
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::Across
    }

    fn signature(
        &self,
        site: Site,
        _shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let Site::Across(moving, shifted) = site else {
            return;
        };
        let sense = sense_of(moving, shifted);
        let strokes = view.strokes_of(moving).iter().zip(view.direction.iter());
        for (out, (stroke, direction)) in out.iter_mut().zip(strokes) {
            // After a reversal the slide faces one way and travels the other.
            let travel = -(stroke.facing * direction[moving.index()]).signum();
            *out = 0.5e-3 * sense * travel * direction[shifted.index()];
        }
    }

    fn makes_steps(&self) -> bool {
        true
    }

    fn flexible(&self) -> bool {
        true
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let Site::Across(moving, shifted) = effect.site() {
            machine.lateral_play_m[moving.index()][shifted.index()] += effect.value() * 1e-3;
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::Across(actuator, across) = effect.site() else {
            return None;
        };
        Some(Term::LateralPlay {
            actuator,
            across,
            shift_m: effect.value() * 1e-3,
        })
    }
}

/// The shift is positive from the first axis of a plane to its second, negative the other way round.
fn sense_of(moving: Actuator, shifted: Actuator) -> f64 {
    match Plane::of(moving, shifted) {
        Some(plane) if plane.axes() == [moving, shifted] => 1.0,
        _ => -1.0,
    }
}
