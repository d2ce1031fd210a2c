//! From a model to the table that a controller corrects with: one zone, where the model was fitted.
use crate::causes::{Cause, Effect};
use crate::model_file::{ModelFile, Servo};
use giotto_shared::Axis;
use giotto_shared::model::{Cumulants, RadiusModel};
use giotto_shared::table::{self, Limits, Table, TableError, Travel, Zone, bounds};
use giotto_shared::term::Term;

/// Room that the limits of the table leave above the largest correction inside its zone.
const HEADROOM: f64 = 2.0;
/// Widening of a range, so that its ends stay inside in single precision.
const MARGIN: f64 = 1e-6;

/// Why a model has no table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelTableError {
    /// A compensable effect without a number that its term needs.
    #[error("effect {cause:?}: `{name}` is missing")]
    MissingParameter {
        /// The effect.
        cause: Cause,
        /// The parameter's name in the file.
        name: &'static str,
    },
    /// More terms than a zone holds.
    #[error("{count} compensable effects, a table holds {}", table::MAX_TERMS)]
    TooManyTerms {
        /// Terms of the model.
        count: usize,
    },
    /// A number of the model is beyond what a controller accepts.
    #[error("the model's table is out of bounds: {0}")]
    Table(#[from] TableError),
}

/// What became of a model's effects.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelTable {
    /// The table.
    pub table: Table,
    /// Effects that no controller can correct: random, drifting, faster than the loop, or not of this machine's axes.
    pub left_out: Vec<Cause>,
}

/// κ2 and κ4 of the servo law.
fn cumulants(servo: &Servo) -> Cumulants<f64> {
    match *servo {
        Servo::Beta { beta1_s2, beta2_s4, .. } => {
            // ln(1 + β1ω² + β2ω⁴) = β1ω² + (β2 − β1²/2)ω⁴ + …, against −κ2ω²/2 + κ4ω⁴/24.
            let beta = RadiusModel { beta1_s2, beta2_s4 };
            let kappa2_s2 = -2.0 * beta.beta1_s2;
            Cumulants { kappa2_s2, kappa4_s4: 24.0 * beta.beta2_s4 - 3.0 * kappa2_s2 * kappa2_s2 }
        }
        Servo::Lag { kv_per_s } => {
            let kappa2_s2 = 1.0 / (kv_per_s * kv_per_s);
            Cumulants { kappa2_s2, kappa4_s4: 6.0 * kappa2_s2 * kappa2_s2 }
        }
        Servo::SecondOrder { omega_n_rad_s, zeta } => {
            let (w2, z2) = (omega_n_rad_s * omega_n_rad_s, zeta * zeta);
            Cumulants {
                kappa2_s2: -2.0 * (1.0 - 2.0 * z2) / w2,
                kappa4_s4: 12.0 * (8.0 * z2 * z2 - 8.0 * z2 + 1.0) / (w2 * w2),
            }
        }
    }
}

/// What an effect is to a controller.
enum Share {
    Term(Term<f64>),
    Kappa4(f64),
    Nothing,
}

fn share(effect: &Effect) -> Result<Share, ModelTableError> {
    let Effect { cause, value, .. } = *effect;
    let missing = |name| ModelTableError::MissingParameter { cause, name };
    let axis = || effect.axis.ok_or(missing("axis"));
    let param = |name: &'static str| effect.params.get(name).copied().ok_or(missing(name));
    let (micro, milli) = (value * 1e-6, value * 1e-3);
    Ok(Share::Term(match cause {
        Cause::HigherOrderDynamics => return Ok(Share::Kappa4(24.0 * value)),
        Cause::RadiusOffset => Term::RadiusOffset { offset_m: milli },
        Cause::ScaleError => Term::ScaleError { relative: micro },
        Cause::ScaleMismatch => Term::ScaleMismatch { relative: micro },
        Cause::Squareness => Term::Squareness { shear_rad: micro },
        Cause::ServoMismatch => Term::ServoMismatch { delta_tau_s: value },
        Cause::BandwidthMismatch => Term::BandwidthMismatch { delta_kappa2_s2: value },
        Cause::Backlash => Term::Backlash { axis: axis()?, step_m: milli },
        Cause::LateralPlay => Term::LateralPlay { axis: axis()?, shift_m: milli },
        Cause::ReversalSpike => {
            Term::ReversalSpike { axis: axis()?, peak_m: micro, decay_s: param("decay_s")? }
        }
        Cause::CyclicError => Term::Cyclic {
            axis: axis()?,
            amplitude_m: micro,
            pitch_m: param("pitch_mm")? * 1e-3,
            phase_rad: param("phase_rad")?,
        },
        Cause::Straightness => {
            // The bow is over ±R of the largest circle seen.
            let radius_m = param("radius_mm")? * 1e-3;
            Term::Straightness { axis: axis()?, curvature_per_m: micro / (radius_m * radius_m) }
        }
        Cause::Vibration
        | Cause::InterpolationChord
        | Cause::FeedClamp
        | Cause::ThermalDrift
        | Cause::StickSlip
        | Cause::JointLagMismatch
        | Cause::JointReversal => return Ok(Share::Nothing),
    }))
}

/// Largest offset that a term asks for on circles up to `radius` and feeds up to `feed`, m.
fn reach(term: &Term<f64>, radius: f64, feed: f64, omega: f64) -> f64 {
    let offset = match *term {
        Term::RadiusOffset { offset_m } => offset_m,
        Term::ScaleError { relative } => relative * radius,
        Term::ScaleMismatch { relative } => 0.5 * relative * radius,
        Term::Squareness { shear_rad } => 0.5 * shear_rad * radius,
        Term::ServoMismatch { delta_tau_s } => 0.5 * feed * delta_tau_s,
        Term::BandwidthMismatch { delta_kappa2_s2 } => 0.25 * delta_kappa2_s2 * feed * omega,
        Term::Backlash { step_m, .. } => step_m,
        Term::LateralPlay { shift_m, .. } => shift_m,
        Term::ReversalSpike { peak_m, .. } => peak_m,
        Term::Cyclic { amplitude_m, .. } => amplitude_m,
        Term::Straightness { curvature_per_m, .. } => curvature_per_m * radius * radius,
        _ => 0.0,
    };
    offset.abs()
}

fn single(axis: Axis, term: Term<f64>) -> Term<f32> {
    let _ = axis;
    match term {
        Term::RadiusOffset { offset_m } => Term::RadiusOffset { offset_m: offset_m as f32 },
        _ => Term::RadiusOffset { offset_m: 0.0 },
    }
}
