//! From a model to the table that a controller corrects with: one zone, where the model was fitted.
use crate::causes::{ArmChain, Cause, Effect};
use crate::kinematics::Kinematics;
use crate::model_file::ModelFile;
use giotto_shared::law::Operator;
use giotto_shared::model::Cumulants;
use giotto_shared::table::{self, Arm, Limits, Table, TableError, Travel, Zone, bounds};
use giotto_shared::term::{Extent, Term};

/// Room that the limits of the table leave above the largest correction inside its zone.
const HEADROOM: f64 = 2.0;
/// Least limits: room to engage and disengage even a correction that is all but nothing.
const LEAST_OFFSET_M: f64 = 20e-6;
const LEAST_SLEW_M_S: f64 = 1e-3;

/// Why a model has no table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelTableError {
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

/// What an effect is to a controller.
enum Share {
    Term(Term<f64>),
    Kappa4(f64),
    Nothing,
}

fn share(effect: &Effect, arm: Option<&ArmChain>) -> Share {
    let model = effect.cause().model();
    let of_joint = || arm.and_then(|arm| model.joint_term(effect, arm));
    let term = model.term(effect).or_else(of_joint).map(Share::Term);
    term.or_else(|| model.kappa4_s4(effect).map(Share::Kappa4))
        .unwrap_or(Share::Nothing)
}

/// The table of a model.
///
/// # Errors
/// [`ModelTableError`]; a table that is returned passes [`Table::validate`].
///
/// ```
/// use giotto::model_file::ModelFile;
/// # use std::path::Path;
/// use giotto::table_from_model::table_from_model;
///
/// let model = ModelFile::parse(
///     "format = 2\ncampaign = \"lab\"\nmachine = \"mill\"\n\
///      [servo]\nkind = \"lag\"\nkv_per_s = 50.0\n\
///      [valid]\nradius_mm = [50.0, 150.0]\nfeed_mm_s = [20.0, 300.0]",
///     Path::new("model.toml"),
/// )?;
/// let made = table_from_model(&model)?;
/// let zone = &made.table.zones[0];
/// // κ2 of a lag is τ² = 4e-4 s²; the zone is where the model was fitted.
/// assert!((zone.cumulants.kappa2_s2 - 4e-4).abs() < 1e-9);
/// assert_eq!(zone.radius_m, [0.05, 0.15]);
/// assert!(made.left_out.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn table_from_model(model: &ModelFile) -> Result<ModelTable, ModelTableError> {
    let mut cumulants = model.servo.cumulants();
    let mut terms: Vec<Term<f64>> = Vec::new();
    let mut left_out = Vec::new();
    let chain = model.kinematics.map(|kinematics| ArmChain {
        turning: kinematics.turning(),
        lag_s: lag_s(&cumulants),
        placed: model.valid.centre_mm.is_some(),
    });
    for effect in &model.effects {
        match share(effect, chain.as_ref()) {
            Share::Term(term) => terms.push(term),
            Share::Kappa4(kappa4) => cumulants.kappa4_s4 += kappa4,
            Share::Nothing => left_out.push(effect.cause()),
        }
    }
    let count = terms.len();
    let single = terms.iter().map(|term| term.map(|value| value as f32));
    let radius_m = model.valid.radius_mm.map(|mm| mm * 1e-3);
    let feed_m_s = model.valid.feed_mm_s.map(|mm_s| mm_s * 1e-3);
    let mut zone = Zone {
        place_m: None,
        radius_m: radius_m.map(|r| r as f32),
        feed_m_s: feed_m_s.map(|f| f as f32),
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: cumulants.kappa2_s2 as f32,
            kappa4_s4: cumulants.kappa4_s4 as f32,
        },
        terms: heapless::Vec::new(),
    };
    for term in single {
        zone.terms
            .push(term)
            .map_err(|_| ModelTableError::TooManyTerms { count })?;
    }
    let mut zones = heapless::Vec::new();
    // A table holds at least one zone.
    let _ = zones.push(zone);
    let of_arm = chain.is_some();
    let limits = limits((&cumulants, of_arm), &terms, radius_m, feed_m_s);
    let table = Table {
        machine: cut(&model.machine),
        zones,
        limits,
        arm: model.kinematics.map(|kinematics| arm(kinematics, model)),
    };
    table.validate()?;
    Ok(ModelTable { table, left_out })
}

/// The arm as a table holds it.
fn arm(kinematics: Kinematics, model: &ModelFile) -> Arm {
    let centre_mm = model.valid.centre_mm;
    Arm {
        kinematics: kinematics.map(|value| value as f32),
        home_m: centre_mm.map(|centre| centre.map(|mm| (mm * 1e-3) as f32)),
    }
}

/// Time constant of the loop in a chain with these cumulants, taken for a loop behind an acceleration filter, s.
fn lag_s(cumulants: &Cumulants<f64>) -> f64 {
    (0.5 * cumulants.third_of_lag_and_average()).cbrt()
}

/// Limits that the largest correction inside the zone meets with room to spare.
fn limits(
    (cumulants, of_arm): (&Cumulants<f64>, bool),
    terms: &[Term<f64>],
    radius_m: [f64; 2],
    feed_m_s: [f64; 2],
) -> Limits {
    let [smallest, largest] = radius_m;
    let [_, fastest] = feed_m_s;
    let omega = fastest / smallest;
    let operator = Operator::new(cumulants);
    let (second, fourth) = (operator.second_s2.abs(), operator.fourth_s4.abs());
    // R·(κ2/2·ω² + …·ω⁴) with ω = f/R falls with R, so the smallest circle asks for the most.
    let law = smallest * omega * omega * (second + fourth * omega * omega);
    // What the curvature of an arm adds is not more than that.
    let law = if of_arm { 2.0 * law } else { law };
    let extent = Extent {
        radius_m: largest,
        feed_m_s: fastest,
        omega_rad_s: omega,
    };
    let reach = terms.iter().map(|term| term.reach(&extent));
    let (offset, slew) = reach.fold((law, law * omega), |(offset, slew), reach| {
        (offset + reach.offset_m, slew + reach.slew_m_s)
    });
    let offset = (HEADROOM * offset).max(LEAST_OFFSET_M);
    // In a ramp the law changes with the feed as well as with the place.
    let slew = (HEADROOM * 2.0 * slew).max(LEAST_SLEW_M_S);
    Limits {
        // What is beyond the image's bounds is clamped by the controller and counted.
        offset_m: (offset as f32).min(bounds::OFFSET_MAX_M),
        slew_m_s: (slew as f32).min(bounds::SLEW_MAX_M_S),
    }
}

/// A name, cut to fit, at a character's border.
fn cut(name: &str) -> heapless::String<32> {
    let mut out = heapless::String::new();
    for character in name.chars() {
        if out.push(character).is_err() {
            break;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::Site;
    use crate::model_file::{FORMAT, Servo, Valid};
    use giotto_shared::{Actuator, Plane};

    fn paper() -> ModelFile {
        ModelFile {
            format: FORMAT,
            campaign: "lab".to_owned(),
            machine: "ABB IRB 1600-6/1.45".to_owned(),
            servo: Servo::Beta {
                beta1_s2: -23.29e-6,
                beta2_s4: -0.23e-6,
                half_width95: [0.0; 2],
            },
            valid: Valid {
                radius_mm: [100.0, 300.0],
                feed_mm_s: [20.0, 700.0],
                centre_mm: None,
            },
            kinematics: None,
            effects: Vec::new(),
            delay_s: None,
        }
    }

    #[test]
    fn the_paper_robot_gets_its_cumulants() {
        let ModelTable { table, left_out } = table_from_model(&paper()).unwrap();
        let zone = &table.zones[0];
        assert!((f64::from(zone.cumulants.kappa2_s2) / 46.58e-6 - 1.0).abs() < 1e-6);
        assert!((f64::from(zone.cumulants.kappa4_s4) / -5.526_509e-6 - 1.0).abs() < 1e-6);
        assert!(left_out.is_empty());
        // 169 um at R = 100 mm, 700 mm/s (Eq. 15), with room for twice as much.
        assert!(
            (335e-6..345e-6).contains(&f64::from(table.limits.offset_m)),
            "{:?}",
            table.limits
        );
    }

    #[test]
    fn servo_kinds_agree_where_they_mean_the_same() {
        let lag = Servo::Lag { kv_per_s: 50.0 }.cumulants();
        // 1/sqrt(1 + w^2/kv^2) = 1 - w^2/(2 kv^2) + 3 w^4/(8 kv^4)
        let beta = Servo::Beta {
            beta1_s2: -0.5 / 2500.0,
            beta2_s4: 0.375 / 6_250_000.0,
            half_width95: [0.0; 2],
        }
        .cumulants();
        assert!((lag.kappa2_s2 / beta.kappa2_s2 - 1.0).abs() < 1e-12);
        assert!((lag.kappa4_s4 / beta.kappa4_s4 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn effects_become_terms_in_si() {
        let effect = |cause, site, value| Effect::new(cause, site, value, [0.0; 2], []).unwrap();
        let mut model = paper();
        model.effects = vec![
            effect(Cause::Squareness, Site::Pair(Plane::Xy), 120.0),
            effect(Cause::Backlash, Site::One(Actuator::Y), 0.01),
            effect(Cause::Vibration, Site::Machine, 40.0),
        ];
        let ModelTable { table, left_out } = table_from_model(&model).unwrap();
        let expected = [
            Term::Squareness {
                plane: Plane::Xy,
                shear_rad: 120e-6_f32,
            },
            Term::Backlash {
                actuator: Actuator::Y,
                step_m: 10e-6,
            },
        ];
        assert_eq!(table.zones[0].terms.as_slice(), expected);
        assert_eq!(
            (table.zones[0].terms.len(), left_out),
            (2, vec![Cause::Vibration])
        );
    }

    #[test]
    fn a_model_beyond_the_controller_is_refused() {
        let mut model = paper();
        model.servo = Servo::Beta {
            beta1_s2: -1.0,
            beta2_s4: 0.0,
            half_width95: [0.0; 2],
        };
        assert!(matches!(
            table_from_model(&model),
            Err(ModelTableError::Table(_))
        ));
        let mut model = paper();
        model.valid.radius_mm = [300.0, 100.0];
        let empty = table_from_model(&model);
        assert!(
            matches!(
                empty,
                Err(ModelTableError::Table(TableError::EmptyRange { .. }))
            ),
            "{empty:?}"
        );
    }
}
