//! Periodic error of screw or gear: `r = A·cosψ·sin(2πR·cosψ/P + φ)` for X, with sin for Y: a chirp over the circle.
use super::{Bend, Cause, CauseModel, Effect, Fitted, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Cyclic;
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use wide::f64x4;

/// See the module.
pub struct CyclicError;

const WORDS: Words = Words {
    id: "cyclic_error",
    name: "cyclic error",
    unit: "um",
    what: "a ripple with a fixed period along one axis: dense where the axis is fast, stretched where it turns round",
    usual: "pitch error of the screw, gear or resolver",
    adjust: "map the axis over one pitch and enter it in the pitch compensation",
    positive: "{a} is off by up to {size} within each pitch: map it, or look at the alignment of screw and scale",
    negative: "{a} is off by up to {size} within each pitch: map it, or look at the alignment of screw and scale",
    elsewhere: None,
    never_told_from: &[],
    next: "a slow line along the axis over a few pitches",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed(
    "value",
    [0.0, 1e3],
    "µm of amplitude: beyond a millimetre it is no error of a pitch",
);

/// Period of the error.
const PITCH_MM: Parameter = Parameter::needed(
    "pitch_mm",
    [0.1, 1e4],
    "period along the axis; a table takes 0.1 mm to 10 m",
);
/// Phase at machine position 0.
const PHASE_RAD: Parameter = Parameter::needed(
    "phase_rad",
    [-6.3, 6.3],
    "phase at machine position 0, one turn to either side",
);

/// Pitches of screws, racks, belts and gears as they are built, m. A longer period within the travel is a bend of the axis.
const PITCH_M: [f64; 2] = [2e-4, 0.12];

impl CauseModel for CyclicError {
    fn cause(&self) -> Cause {
        Cause::CyclicError
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::One
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&PITCH_MM, &PHASE_RAD]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        let pitch_m = fit.shape.first().copied().unwrap_or(f64::NAN);
        let phase_rad = match fit.amounts {
            [sine, cosine] => cosine.atan2(*sine),
            _ => f64::NAN,
        };
        vec![(&PITCH_MM, pitch_m * 1e3), (&PHASE_RAD, phase_rad)]
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["pitch_m"]
    }

    /// Pitches so close that neighbours stay in step over the diameter of the largest circle.
    fn shapes(&self, views: &[RunView]) -> Vec<Vec<f64>> {
        let travel = 2.0 * views.iter().map(|view| view.radius_m).fold(0.0, f64::max);
        let mut shapes = Vec::new();
        let finest = self.finest_wave_per_m(views).unwrap_or(0.0);
        let mut wave_per_m = 1.0 / (0.5 * travel).max(1e-3);
        while wave_per_m <= finest && travel > 0.0 {
            shapes.push(vec![1.0 / wave_per_m]);
            wave_per_m += 0.35 / travel;
        }
        shapes
    }

    /// A hundredth of a wave over the travel.
    fn bend(&self, _which: usize, pitch_m: f64, travel_m: f64) -> Bend {
        Bend::Amount(0.01 * pitch_m * pitch_m / travel_m)
    }

    fn tidy(&self, shape: &mut [f64]) {
        shape
            .iter_mut()
            .for_each(|pitch_m| *pitch_m = pitch_m.abs().clamp(PITCH_M[0], PITCH_M[1]));
    }

    fn columns(&self) -> usize {
        2
    }

    fn signature(&self, site: Site, shape: &[f64], column: usize, view: &RunView, out: &mut [f64]) {
        let (Some(pitch_m), Site::One(axis)) = (shape.first(), site) else {
            return;
        };
        let wave = std::f64::consts::TAU * view.radius_m / pitch_m;
        let from = std::f64::consts::TAU * view.centre_m[axis.index()] / pitch_m;
        for (out, direction) in out.iter_mut().zip(view.direction.iter()) {
            let along = direction[axis.index()];
            let (sin, cos) = (from + wave * along).sin_cos();
            *out = 1e-6 * along * if column == 0 { sin } else { cos };
        }
    }

    /// Sine and cosine together, four samples at a time.
    fn signatures(&self, site: Site, shape: &[f64], view: &RunView, out: &mut [&mut [f64]]) {
        let (Some(pitch_m), Site::One(axis), [sines, cosines]) = (shape.first(), site, out) else {
            return;
        };
        let at = axis.index();
        let wave = std::f64::consts::TAU * view.radius_m / pitch_m;
        let from = f64x4::splat(std::f64::consts::TAU * view.centre_m[at] / pitch_m);
        let outs = sines.chunks_mut(4).zip(cosines.chunks_mut(4));
        for ((sines, cosines), part) in outs.zip(view.direction.chunks(4)) {
            let along = f64x4::from(std::array::from_fn(|k| {
                part.get(k).map_or(0.0, |direction| direction[at])
            }));
            let (sin, cos) = (along * wave + from).sin_cos();
            let scaled = along * 1e-6;
            for (k, (sine, cosine)) in sines.iter_mut().zip(cosines).enumerate() {
                (*sine, *cosine) = ((scaled * sin).as_array()[k], (scaled * cos).as_array()[k]);
            }
        }
    }

    /// Waves a metre of the shortest pitch that is looked for: 300 to the diameter of the largest circle, 1 mm at least.
    fn finest_wave_per_m(&self, views: &[RunView]) -> Option<f64> {
        let travel = 2.0 * views.iter().map(|view| view.radius_m).fold(0.0, f64::max);
        Some(1.0 / (travel / 300.0).max(1e-3))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let Site::One(axis) = effect.site() {
            machine.cyclic[axis.index()] = Some(Cyclic {
                amplitude_m: effect.value() * 1e-6,
                pitch_m: effect.get(&PITCH_MM) * 1e-3,
                phase_rad: effect.get(&PHASE_RAD),
            });
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        Some(Term::Cyclic {
            actuator,
            amplitude_m: effect.value() * 1e-6,
            pitch_m: effect.get(&PITCH_MM) * 1e-3,
            phase_rad: effect.get(&PHASE_RAD),
        })
    }
}
