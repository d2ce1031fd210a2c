//! What the name of a column says: quantity, side (wanted or measured), unit. English, German, French, Spanish and Italian.
use super::layout::unit;

/// What a column holds, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Time,
    Angle,
    Deviation,
    Radius,
    /// Axis 0 to 2.
    Position(usize, Side),
    /// Number of the row.
    Index,
    /// Known, and of no use for a circle: velocities, temperatures, orientations, remarks.
    Other,
    Unknown,
}

/// Which of the controller's positions a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Measured,
    Wanted,
    Unsaid,
}

/// A column by its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Word {
    pub(super) meaning: Meaning,
    /// Factor of the unit that the name gives, SI; nothing where it gives none.
    pub(super) factor: Option<f64>,
    /// The unit is "grad", which is a degree in German and a 400th of a turn elsewhere.
    pub(super) grad: bool,
}

const TIME: &[&str] = &[
    "time",
    "zeit",
    "temps",
    "tempo",
    "tiempo",
    "t",
    "timestamp",
    "stamp",
    "ts",
    "sec",
    "secs",
    "second",
    "seconds",
    "sekunde",
    "sekunden",
    "secondes",
    "elapsed",
    "uhrzeit",
    "zeitstempel",
    "horodatage",
    "heure",
    "clock",
    "ipoc",
    "tm",
];
const ANGLE: &[&str] = &[
    "angle",
    "winkel",
    "phi",
    "theta",
    "angolo",
    "angulo",
    "ángulo",
    "azimuth",
    "azimut",
    "polar",
    "polarwinkel",
    "drehwinkel",
];
const DEVIATION: &[&str] = &[
    "deviation",
    "abweichung",
    "radialabweichung",
    "ecart",
    "écart",
    "dr",
    "dev",
    "desviacion",
    "desviación",
    "deviazione",
    "scostamento",
    "radial",
];
const RADIUS: &[&str] = &[
    "radius", "r", "rayon", "radio", "raggio", "length", "länge", "laenge",
];
const WANTED: &[&str] = &[
    "soll",
    "sollwert",
    "cmd",
    "command",
    "commanded",
    "target",
    "dest",
    "destination",
    "desired",
    "set",
    "setpoint",
    "setp",
    "nominal",
    "ref",
    "reference",
    "consigne",
    "planned",
    "plan",
    "rsol",
    "rsoll",
    "theor",
    "theoretical",
    "programmed",
    "prog",
    "demand",
];
const MEASURED: &[&str] = &[
    "ist", "istwert", "act", "actual", "meas", "measured", "fb", "feedback", "real", "mesure",
    "mesuré", "mesurée", "encoder", "enc", "rist", "gemessen", "medido", "misurato", "messwert",
];
const OTHER: &[&str] = &[
    "vel",
    "velocity",
    "speed",
    "spd",
    "feed",
    "acc",
    "accel",
    "acceleration",
    "jerk",
    "torque",
    "trq",
    "current",
    "curr",
    "force",
    "temp",
    "temperature",
    "temperatur",
    "température",
    "status",
    "state",
    "error",
    "err",
    "fehler",
    "ferror",
    "following",
    "quality",
    "residual",
    "orientation",
    "orient",
    "quat",
    "quaternion",
    "rot",
    "rotation",
    "rx",
    "ry",
    "rz",
    "qx",
    "qy",
    "qz",
    "qw",
    "qw",
    "w",
    "a",
    "b",
    "c",
    "roll",
    "pitch",
    "yaw",
    "rpm",
    "load",
    "u",
    "remark",
    "bemerkung",
    "name",
    "comment",
    "kommentar",
    "id",
    "date",
    "datum",
    "delay",
    "override",
    "geschwindigkeit",
    "vitesse",
    "linear",
    "angular",
    "covariance",
    "voltage",
    "power",
];
const INDEX: &[&str] = &[
    "index", "frame", "sample", "nr", "no", "num", "number", "row", "seq", "seqno", "counter",
    "count", "point", "punkt", "i", "n", "id",
];
/// Words beside an axis that change nothing.
const FILLING: &[&str] = &[
    "axis",
    "achse",
    "axe",
    "asse",
    "eje",
    "pos",
    "position",
    "koordinate",
    "coordinate",
    "coord",
    "tcp",
    "tool",
    "tip",
    "marker",
    "cart",
    "cartesian",
    "pose",
    "field",
    "transform",
    "translation",
    "machine",
    "world",
    "base",
    "motor",
    "joint",
    "value",
    "wert",
    "back",
    "the",
];

impl Word {
    pub(super) fn of(name: &str) -> Self {
        let (words, given) = divide(name);
        let grad = given.as_deref() == Some("grad")
            && !words.iter().any(|w| w == "winkel" || w == "drehwinkel");
        Self {
            meaning: meaning(&words),
            factor: given.as_deref().and_then(unit),
            grad,
        }
    }
}

fn meaning(words: &[String]) -> Meaning {
    let any = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    let first_is = |list: &[&str]| words.first().is_some_and(|w| list.contains(&w.as_str()));
    let side = if any(WANTED) {
        Side::Wanted
    } else if any(MEASURED) || (any(&["feed"]) && any(&["back"])) {
        Side::Measured
    } else {
        Side::Unsaid
    };
    let feedback = any(&["feed"]) && any(&["back"]);
    if let Some(axis) = axis(words) {
        let stopped = words
            .iter()
            .any(|w| OTHER.contains(&w.as_str()) && !(feedback && w == "feed"));
        return if stopped {
            Meaning::Other
        } else {
            Meaning::Position(axis, side)
        };
    }
    if any(DEVIATION) && !any(ANGLE) {
        return Meaning::Deviation;
    }
    if any(ANGLE) {
        return Meaning::Angle;
    }
    if any(RADIUS) && words.len() <= 2 {
        return Meaning::Radius;
    }
    if any(TIME) && !any(&["delay"]) {
        return Meaning::Time;
    }
    if first_is(INDEX) || any(&["seq", "seqno"]) {
        return Meaning::Index;
    }
    if any(OTHER) {
        return Meaning::Other;
    }
    Meaning::Unknown
}

/// The axis that a name means: a letter, or a number behind `pos`, `dest`, `joint` or `axis`.
fn axis(words: &[String]) -> Option<usize> {
    let letter = |w: &String| ["x", "y", "z"].iter().position(|a| a == w);
    let mut letters = words.iter().filter_map(letter);
    if let Some(axis) = letters.next() {
        let known = words.iter().all(|w| {
            letter(w).is_some()
                || [FILLING, WANTED, MEASURED, OTHER]
                    .iter()
                    .any(|list| list.contains(&w.as_str()))
                || w.bytes().all(|b| b.is_ascii_digit())
        });
        // One more word may be the name of the body that moved.
        return (letters.next().is_none() && (known || words.len() <= 3)).then_some(axis);
    }
    let has = |word: &str| words.iter().any(|w| w == word);
    let numbered = has("pos") || has("position") || has("dest");
    let number = words.iter().find_map(|w| w.parse::<usize>().ok());
    let named = words.iter().all(|w| {
        FILLING.contains(&w.as_str())
            || WANTED.contains(&w.as_str())
            || MEASURED.contains(&w.as_str())
            || w.parse::<usize>().is_ok()
    });
    number.filter(|n| numbered && named && *n < 3)
}

/// The words of a name in small letters, and the unit that it gives in brackets or as its last word.
fn divide(name: &str) -> (Vec<String>, Option<String>) {
    let name = name.trim().trim_start_matches(['#', '%']);
    let (text, mut given) = match name.find(['[', '(']) {
        Some(at) => {
            let inside = name[at + 1..].trim_end_matches([']', ')', ' ']);
            (&name[..at], Some(inside.trim().to_lowercase()))
        }
        None => (name, None),
    };
    let mut words: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in text.chars() {
        let boundary = (before.is_lowercase() && c.is_uppercase())
            || (before.is_alphabetic() && c.is_numeric())
            || (before.is_numeric() && c.is_alphabetic());
        if c.is_alphanumeric() || c == '°' {
            match words.last_mut() {
                Some(word) if !boundary && (before.is_alphanumeric() || before == '°') => {
                    word.push(c)
                }
                _ => words.push(c.to_string()),
            }
        }
        before = c;
    }
    // `RIst` and `RSol` are words of their own.
    let mut words: Vec<String> = words.iter().map(|w| w.to_lowercase()).collect();
    if given.is_none() && words.len() > 1 && words.last().is_some_and(|w| unit(w).is_some()) {
        given = words.pop();
    }
    (words, given)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_instruments_and_controllers_are_understood() {
        use Meaning::{Angle, Deviation, Index, Other, Position, Radius, Time, Unknown};
        use Side::{Measured, Unsaid, Wanted};
        let cases: &[(&str, Meaning, Option<f64>)] = &[
            ("x_mm", Position(0, Unsaid), Some(1e-3)),
            ("Temps [s]", Time, Some(1.0)),
            ("# time_s", Time, Some(1.0)),
            ("Time (Seconds)", Time, Some(1.0)),
            ("%time", Time, None),
            ("Abweichung [µm]", Deviation, Some(1e-6)),
            ("x_soll", Position(0, Wanted), None),
            ("Y_IST", Position(1, Measured), None),
            ("X Achse", Position(0, Unsaid), None),
            ("joint.1.motor-pos-fb", Position(1, Measured), None),
            ("joint.0.pos-cmd", Position(0, Wanted), None),
            ("dest1", Position(1, Wanted), None),
            ("pos2", Position(2, Unsaid), None),
            ("field.pose.position.x", Position(0, Unsaid), None),
            ("field.pose.orientation.x", Other, None),
            ("RIst.X", Position(0, Measured), None),
            ("RSol.Y", Position(1, Wanted), None),
            ("feedBack.cartesian.pos.z", Position(2, Measured), None),
            ("x_velocity", Other, None),
            ("radius_mm", Radius, Some(1e-3)),
            ("Winkel [Grad]", Angle, Some(std::f64::consts::PI / 180.0)),
            ("angle_gon", Angle, Some(std::f64::consts::PI / 200.0)),
            ("Frame", Index, None),
            ("Sub Frame", Other, None),
            ("Druck", Unknown, None),
        ];
        for (name, meaning, factor) in cases {
            let word = Word::of(name);
            if *name == "Sub Frame" {
                assert!(!matches!(word.meaning, Position(..) | Time), "{name}");
                continue;
            }
            assert_eq!((word.meaning, word.factor), (*meaning, *factor), "{name}");
        }
    }
}
