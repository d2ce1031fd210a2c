//! What to turn, which way and how far: the words of a finding by its sign.
//!
//! The words stand in the file of each cause. A test turns what they name: the misfit of the simulated machine then falls,
//! whatever the sign.
use super::{Cause, Seat};
use crate::units;

/// Name of an actuator for a person: a slide is a letter, a joint a word, `joint2` is read as `joint 2`.
pub fn spoken(actuator: &str) -> String {
    match actuator.strip_prefix("joint") {
        Some(number) => format!("joint {number}"),
        None => actuator.to_uppercase(),
    }
}

/// What to turn and which way. `value` is in the unit of the contract; a finding of the machine as a whole is one of X
/// against Y where its actuators are not given.
pub fn remedy(cause: Cause, actuators: &[&str], value: f64) -> String {
    let model = cause.model();
    let of_cause = model.words();
    let shown = units::shown(value.abs(), [value.abs(); 2], of_cause.unit);
    let name = |at: usize, otherwise: &str| spoken(actuators.get(at).copied().unwrap_or(otherwise));
    let negative = usize::from(value < 0.0);
    let usual = [of_cause.positive, of_cause.negative];
    let spoken_of = ["{a}", "{b}"].map(|gap| usize::from(usual[negative].contains(gap)));
    let words = match of_cause.elsewhere {
        Some(other) if actuators.len() != spoken_of.iter().sum::<usize>() => other[negative],
        _ => usual[negative],
    };
    // Found on two axes alike, it is set right on both.
    let first = match (model.seat(), actuators) {
        (Seat::One | Seat::Joint, [_, _, ..]) => {
            let others: Vec<String> = (1..actuators.len()).map(|at| name(at, "y")).collect();
            format!("{}, and likewise {},", name(0, "x"), others.join(" and "))
        }
        _ => name(0, "x"),
    };
    words
        .replace("{a}", &first)
        .replace("{b}", &name(1, "y"))
        .replace("{size}", &format!("{} {}", shown.value, shown.unit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::{Effect, Site};
    use crate::simulation::machine::{Friction, Machine, PositionLoop};
    use crate::simulation::{CircleTest, circle};
    use giotto_shared::{Actuator, Direction, Plane};

    #[test]
    fn every_cause_has_words_without_gaps() {
        for model in crate::causes::ALL {
            let cause = model.cause();
            for value in [-3e-5, 3e-5] {
                let words = remedy(cause, &["x", "y"], value);
                assert!(!words.is_empty() && !words.contains(['{', '}']), "{words}");
            }
        }
        assert_eq!(
            remedy(Cause::ServoMismatch, &[], 58e-6),
            "X follows 58.0 µs later than Y: raise kv of X, or lower that of Y"
        );
        assert!(
            remedy(Cause::ServoMismatch, &["x", "z"], -58e-6)
                .starts_with("Z follows 58.0 µs later than X")
        );
        assert!(remedy(Cause::JointReversal, &["joint2"], 4.0).starts_with("joint 2 sticks"));
        assert_eq!(
            remedy(Cause::ScaleError, &["z"], -40.0),
            "Z alone travels 40.0 µm/m too little: raise its scale by 40.0 µm/m"
        );
        assert!(remedy(Cause::ScaleError, &[], -40.0).starts_with("both axes travel"));
        assert!(remedy(Cause::BandwidthMismatch, &["joint2"], 1e-6).contains("the other joints"));
        assert!(
            remedy(Cause::Backlash, &["y", "x"], 0.01)
                .starts_with("Y, and likewise X, loses 10.0 µm")
        );
    }

    /// A setting of the machine that the words name.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    enum Knob {
        /// The slower of two position loops is made faster.
        Kv,
        /// Scale of the first actuator against the second.
        ScaleOfFirst,
        /// Scale of both.
        ScaleOfBoth,
        /// The angle between the two.
        Angle,
        /// Backlash compensation of one.
        Backlash,
        /// Length of the bar, or radius of the tool.
        Radius,
        /// Friction compensation of one.
        Friction,
    }

    /// What is turned, the size of the fault in the contract's unit, and the factor from that to the machine's.
    const TURNED: [(Cause, Knob, f64, f64); 7] = [
        (Cause::ServoMismatch, Knob::Kv, 60e-6, 1.0),
        (Cause::ScaleError, Knob::ScaleOfBoth, 80.0, 1e-6),
        (Cause::ScaleMismatch, Knob::ScaleOfFirst, 80.0, 1e-6),
        (Cause::Squareness, Knob::Angle, 80.0, 1e-6),
        (Cause::Backlash, Knob::Backlash, 0.012, 1e-3),
        (Cause::RadiusOffset, Knob::Radius, 0.012, 1e-3),
        (Cause::ReversalSpike, Knob::Friction, 8.0, 1e-6),
    ];

    /// Turns the setting that the words name, the way they say for this sign, by the size.
    fn turn(machine: &mut Machine, knob: Knob, words: &str, axis: usize, size: f64) {
        // `up` is what the words say, not the sign of the value: a wrong side in the words fails here.
        let says = |what: &str| words.contains(what);
        match knob {
            Knob::Kv => {
                let at = usize::from(says("raise kv of Y"));
                assert!(at == 1 || says("raise kv of X"), "{words}");
                let tau = 1.0 / machine.servo[at].kv_per_s - size;
                machine.servo[at].kv_per_s = 1.0 / tau;
            }
            Knob::ScaleOfFirst => {
                machine.scale[0] += if says("raise the scale of X") {
                    size
                } else {
                    -size
                };
            }
            Knob::ScaleOfBoth => {
                let change = if says("raise the scale of both") {
                    size
                } else {
                    -size
                };
                machine.scale = machine.scale.map(|s| s + change);
            }
            Knob::Angle => machine.squareness_rad[0] += if says("open it") { -size } else { size },
            Knob::Backlash => {
                machine.backlash_m[axis] += if says("raise its backlash") {
                    -size
                } else {
                    size
                };
            }
            Knob::Radius => {
                machine.radius_offset_m += if says("raise the tool radius") {
                    -size
                } else {
                    size
                };
            }
            Knob::Friction => {
                let mut friction = machine.friction[axis].unwrap_or_default();
                friction.peak_m += if says("raise its friction") {
                    -size
                } else {
                    size
                };
                machine.friction[axis] = Some(friction);
            }
        }
    }

    /// Of a pair the words turn one against the other: what both have in common is another cause's.
    fn misfit(machine: &Machine, ideal: &Machine, pair: bool) -> f64 {
        let mut sum = 0.0;
        for direction in [Direction::Ccw, Direction::Cw] {
            for feed_m_s in [0.05, 0.2] {
                let test = CircleTest::new(0.1, feed_m_s, direction);
                let [a, b] = [machine, ideal].map(|m| circle(m, &test).deviation_m);
                let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
                let mean = off.iter().sum::<f64>() / off.len() as f64;
                let common = if pair { mean } else { 0.0 };
                sum += off.iter().map(|v| (v - common).powi(2)).sum::<f64>();
            }
        }
        sum.sqrt()
    }

    /// Each cause with a knob, both signs, each axis: the machine has the fault, the words are followed by the size of
    /// the fault, and the misfit falls to a tenth.
    #[test]
    fn turned_as_the_words_say_the_misfit_falls() {
        let kv = 40.0;
        let ideal = Machine {
            servo: [PositionLoop {
                kv_per_s: kv,
                feed_forward: 0.0,
            }; 3],
            ..Machine::default()
        };
        for (cause, knob, contract, factor) in TURNED {
            for sign in [1.0, -1.0] {
                for axis in 0..2 {
                    let value = sign * contract;
                    let seat = cause.model().seat();
                    let site = match seat {
                        Seat::One => Site::One(Actuator::SLIDES[axis]),
                        Seat::Pair => Site::Pair(Plane::Xy),
                        _ => Site::Machine,
                    };
                    let decay = [("decay_s", 0.02)];
                    let given = cause.model().parameters();
                    let params = decay
                        .iter()
                        .copied()
                        .filter(|(name, _)| given.iter().any(|p| p.name == *name));
                    let effect = Effect::new(cause, site, value, [value; 2], params).unwrap();
                    let mut machine = ideal.clone();
                    machine.friction = [Some(Friction::default()); 3];
                    cause.model().apply(&effect, &mut machine);
                    let before = misfit(&machine, &ideal, seat == Seat::Pair);
                    let names: &[&str] = match seat {
                        Seat::One => &[["x", "y"][axis]],
                        Seat::Pair => &["x", "y"],
                        _ => &[],
                    };
                    let words = remedy(cause, names, value);
                    turn(&mut machine, knob, &words, axis, contract * factor);
                    let after = misfit(&machine, &ideal, seat == Seat::Pair);
                    // Raising one loop of two also changes the mean lag: what is left of that is small.
                    assert!(
                        after < 0.3 * before,
                        "{} {value} {names:?}: {before:e} -> {after:e}: {words}",
                        cause.id()
                    );
                }
            }
        }
    }
}
