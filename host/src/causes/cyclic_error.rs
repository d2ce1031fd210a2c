//! Periodic error of screw or gear: `r = A·cosψ·sin(2πR·cosψ/P + φ)` for X, with sin for Y: a chirp over the circle.
use super::view::axes_of;
use super::{Bend, Cause, CauseModel, EACH_AXIS, Effect, RunView, Words};
use crate::simulation::machine::Cyclic;
use crate::simulation::machine::Machine;
use giotto_shared::Axis;
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
    never_told_from: &[],
    next: "a slow line along the axis over a few pitches",
    not_compensable: None,
};

/// Waves a metre of the shortest pitch that is looked for: 300 to the diameter of the largest circle, 1 mm at least.
pub fn finest_wave_per_m(views: &[RunView]) -> f64 {
    let travel = 2.0 * views.iter().map(|view| view.radius_m).fold(0.0, f64::max);
    1.0 / (travel / 300.0).max(1e-3)
}

/// Pitches of screws, racks, belts and gears as they are built, m. A longer period within the travel is a bend of the axis.
const PITCH_M: [f64; 2] = [2e-4, 0.12];

impl CauseModel for CyclicError {
    fn cause(&self) -> Cause {
        Cause::CyclicError
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn axes(&self) -> &'static [Option<Axis>] {
        EACH_AXIS
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["pitch_m"]
    }

    /// Pitches so close that neighbours stay in step over the diameter of the largest circle.
    fn shapes(&self, views: &[RunView]) -> Vec<Vec<f64>> {
        let travel = 2.0 * views.iter().map(|view| view.radius_m).fold(0.0, f64::max);
        let mut shapes = Vec::new();
        let mut wave_per_m = 1.0 / (0.5 * travel).max(1e-3);
        while wave_per_m <= finest_wave_per_m(views) && travel > 0.0 {
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
        shape.iter_mut().for_each(|pitch_m| *pitch_m = pitch_m.abs().clamp(PITCH_M[0], PITCH_M[1]));
    }

    fn columns(&self) -> usize {
        2
    }

    fn signature(
        &self,
        axis: Option<Axis>,
        shape: &[f64],
        column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let Some(pitch_m) = shape.first() else { return };
        let wave = std::f64::consts::TAU * view.radius_m / pitch_m;
        let at = usize::from(axis == Some(Axis::Y));
        for (out, direction) in out.iter_mut().zip(view.direction.iter()) {
            let along = direction[at];
            *out = 1e-6
                * along
                * if column == 0 {
                    (wave * along).sin()
                } else {
                    (wave * along).cos()
                };
        }
    }

    /// Sine and cosine together, four samples at a time.
    fn signatures(
        &self,
        axis: Option<Axis>,
        shape: &[f64],
        view: &RunView,
        out: &mut [&mut [f64]],
    ) {
        let (Some(pitch_m), [sines, cosines]) = (shape.first(), out) else {
            return;
        };
        let wave = std::f64::consts::TAU * view.radius_m / pitch_m;
        let at = usize::from(axis == Some(Axis::Y));
        let outs = sines.chunks_mut(4).zip(cosines.chunks_mut(4));
        for ((sines, cosines), part) in outs.zip(view.direction.chunks(4)) {
            let along = f64x4::from(std::array::from_fn(|k| {
                part.get(k).map_or(0.0, |direction| direction[at])
            }));
            let (sin, cos) = (along * wave).sin_cos();
            let scaled = along * 1e-6;
            for (k, (sine, cosine)) in sines.iter_mut().zip(cosines).enumerate() {
                (*sine, *cosine) = ((scaled * sin).as_array()[k], (scaled * cos).as_array()[k]);
            }
        }
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        for axis in axes_of(effect) {
            machine.cyclic[axis.index()] = Some(Cyclic {
                amplitude_m: effect.value * 1e-6,
                pitch_m: effect.param("pitch_mm", 10.0) * 1e-3,
                phase_rad: effect.param("phase_rad", 0.0),
            });
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::Cyclic {
            axis: effect.axis?,
            amplitude_m: effect.value * 1e-6,
            pitch_m: effect.param("pitch_mm", 10.0) * 1e-3,
            phase_rad: effect.param("phase_rad", 0.0),
        })
    }
}
