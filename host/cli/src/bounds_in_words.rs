//! What a controller cannot be told, in the units that were typed.
use giotto_link::ControllerError;
use giotto_shared::path::{PathError, Quantity};
use giotto_shared::table::bounds;
use giotto_shared::wire::{MotionRefusal, Refusal};

/// Radii that a controller runs, m.
const RADIUS_M: [f32; 2] = [bounds::RADIUS_MIN_M, bounds::RADIUS_MAX_M];

/// Name, factor from SI, and unit of a quantity as the options of a run have them.
const fn typed(quantity: Quantity) -> Option<(&'static str, f64, &'static str)> {
    const DEG: f64 = 180.0 / std::f64::consts::PI;
    Some(match quantity {
        Quantity::Radius => ("radius", 1e3, " mm"),
        Quantity::Feed => ("feed", 1e3, " mm/s"),
        Quantity::Laps => ("laps", 1.0, ""),
        Quantity::Centre => ("centre", 1e3, " mm"),
        Quantity::Start => ("start angle", DEG, "°"),
        Quantity::Acceleration => ("centripetal acceleration", 1e3, " mm/s²"),
        Quantity::Position => ("position", 1e3, " mm"),
        Quantity::Sweep => ("sweep", DEG, "°"),
        Quantity::Rise => ("rise", 1e3, " mm"),
        Quantity::Gap => ("gap between the machine and the start", 1e3, " mm"),
        Quantity::Length => ("length", 1e3, " mm"),
        Quantity::Time => ("time", 1.0, " s"),
        Quantity::Terms => ("correction by profile terms", 1e6, " µm"),
        Quantity::Window => ("distance of the set-points", 1e3, " ms"),
        Quantity::Override => ("override of the feed", 1.0, " %"),
        Quantity::Normal | Quantity::Plane => return None,
    })
}

/// `radius 8000 mm; possible are 1 to 1000 mm`, if the error is one of bounds.
pub fn words(error: &ControllerError) -> Option<String> {
    let (quantity, value, [lo, hi]) = match *error {
        // A radius has the sign of its direction, and there is a smallest one.
        ControllerError::Path(PathError::OutOfBounds {
            quantity: Quantity::Radius,
            value,
            ..
        }) => (Quantity::Radius, value.abs(), RADIUS_M.map(f64::from)),
        ControllerError::Path(PathError::OutOfBounds {
            quantity,
            value,
            lo,
            hi,
        }) => (quantity, value, [lo, hi]),
        ControllerError::Refused(Refusal::Motion(MotionRefusal::OutOfBounds {
            quantity,
            value,
            lo,
            hi,
        })) => (quantity, f64::from(value), [lo, hi].map(f64::from)),
        _ => return None,
    };
    let (name, factor, unit) = typed(quantity)?;
    let [value, lo, hi] = [value, lo, hi].map(|si| six_digits(si * factor));
    Some(format!(
        "{name} {value}{unit}; possible are {lo} to {hi}{unit}"
    ))
}

/// Six digits: more than a number in single precision has of its own is not shown.
fn six_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let decimals = (5 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_in_the_unit_in_which_they_were_typed() {
        let refused = |quantity, value, lo, hi| {
            words(&ControllerError::Refused(Refusal::Motion(
                MotionRefusal::OutOfBounds {
                    quantity,
                    value,
                    lo,
                    hi,
                },
            )))
        };
        let feed = refused(Quantity::Feed, 5.0, 0.0001, 2.0);
        assert_eq!(
            feed.unwrap(),
            "feed 5000 mm/s; possible are 0.1 to 2000 mm/s"
        );
        let path = ControllerError::Path(PathError::OutOfBounds {
            quantity: Quantity::Radius,
            value: -8.0,
            lo: -1.05,
            hi: 1.05,
        });
        assert_eq!(
            words(&path).unwrap(),
            "radius 8000 mm; possible are 1 to 1000 mm"
        );
        assert_eq!(words(&ControllerError::Stopped), None);
    }
}
