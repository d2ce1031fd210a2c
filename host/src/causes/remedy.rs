//! What to turn, which way and how far: the words of a finding by its sign.
//!
//! One entry a cause. A knob says what the words mean on a machine, so that a test can turn it: the misfit of the simulated
//! machine then falls, whatever the sign.
use super::Cause;
use crate::units;

/// Words for both signs of a cause. `{a}` and `{b}` are its actuators, `{size}` its size with its unit.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// The cause.
    pub cause: Cause,
    /// Where the value is positive.
    pub positive: &'static str,
    /// Where it is negative.
    pub negative: &'static str,
    /// What the words turn; `None` where no setting of the machine answers.
    pub knob: Option<Knob>,
}

/// A setting of the machine that the words name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
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
    /// Shape of the guide of one.
    Guide,
    /// Play sideways of one.
    Sideways,
    /// Time between set-points.
    SetPoints,
    /// Limit of the centripetal acceleration.
    Clamp,
}

/// Every cause with its words.
pub const ALL: [Entry; 23] = [
    Entry {
        cause: Cause::HigherOrderDynamics,
        positive: "at the highest speeds circles come out larger than the lag alone would make them: the machine swings out; lower the \
                   feed-forward, or the jerk and acceleration of the path",
        negative: "at the highest speeds circles shrink more than the lag alone would make them: raise the velocity feed-forward, or \
                   shorten the acceleration filters",
        knob: None,
    },
    Entry {
        cause: Cause::RadiusOffset,
        positive: "every circle is {size} too large: enter the bar's length {size} shorter, or raise the tool radius by {size}",
        negative: "every circle is {size} too small: enter the bar's length {size} longer, or lower the tool radius by {size}",
        knob: Some(Knob::Radius),
    },
    Entry {
        cause: Cause::ScaleError,
        positive: "both axes travel {size} too far: lower the scale of both by {size}",
        negative: "both axes travel {size} too little: raise the scale of both by {size}",
        knob: Some(Knob::ScaleOfBoth),
    },
    Entry {
        cause: Cause::ScaleMismatch,
        positive: "{a} travels {size} more than {b}: lower the scale of {a} by {size}, or raise that of {b}",
        negative: "{a} travels {size} less than {b}: raise the scale of {a} by {size}, or lower that of {b}",
        knob: Some(Knob::ScaleOfFirst),
    },
    Entry {
        cause: Cause::Squareness,
        positive: "the angle between {a} and {b} is {size} under 90°: open it by {size}",
        negative: "the angle between {a} and {b} is {size} over 90°: close it by {size}",
        knob: Some(Knob::Angle),
    },
    Entry {
        cause: Cause::ServoMismatch,
        positive: "{a} follows {size} later than {b}: raise kv of {a}, or lower that of {b}",
        negative: "{b} follows {size} later than {a}: raise kv of {b}, or lower that of {a}",
        knob: Some(Knob::Kv),
    },
    Entry {
        cause: Cause::BandwidthMismatch,
        positive: "{a} rounds off its motion more than {b}, by {size}: shorten the filter of {a}, or lengthen that of {b}",
        negative: "{b} rounds off its motion more than {a}, by {size}: shorten the filter of {b}, or lengthen that of {a}",
        knob: None,
    },
    Entry {
        cause: Cause::Backlash,
        positive: "{a} loses {size} at each reversal: raise its backlash compensation by {size}, or take up the play of screw and nut",
        negative: "{a} jumps ahead by {size} at each reversal: lower its backlash compensation by {size}",
        knob: Some(Knob::Backlash),
    },
    Entry {
        cause: Cause::LateralPlay,
        positive: "{a} shifts sideways by {size} when it turns back: raise the preload of its guide until the {size} are gone",
        negative: "{a} shifts sideways by {size}, against its usual side, when it turns back: raise the preload of its guide until the \
                   {size} are gone",
        knob: Some(Knob::Sideways),
    },
    Entry {
        cause: Cause::ReversalSpike,
        positive: "{a} sticks for {size} after it turns back: raise its friction compensation by {size}, or lubricate the guide",
        negative: "{a} is pushed {size} too far after it turns back: lower its friction compensation by {size}",
        knob: Some(Knob::Friction),
    },
    Entry {
        cause: Cause::CyclicError,
        positive: "{a} is off by up to {size} within each pitch: map it, or look at the alignment of screw and scale",
        negative: "{a} is off by up to {size} within each pitch: map it, or look at the alignment of screw and scale",
        knob: None,
    },
    Entry {
        cause: Cause::Straightness,
        positive: "the guide of {a} bows by {size} over the circle, its ends towards plus: align or map it",
        negative: "the guide of {a} bows by {size} over the circle, its ends towards minus: align or map it",
        knob: Some(Knob::Guide),
    },
    Entry {
        cause: Cause::Vibration,
        positive: "something swings at {size}: find it with a shaker or an accelerometer; stiffen or damp it, or keep the speed from it",
        negative: "something swings at {size}: find it with a shaker or an accelerometer; stiffen or damp it, or keep the speed from it",
        knob: None,
    },
    Entry {
        cause: Cause::InterpolationChord,
        positive: "the path is a polygon with a set-point every {size}: shorten the cycle of the interpolator",
        negative: "the path is a polygon with a set-point every {size}: shorten the cycle of the interpolator",
        knob: Some(Knob::SetPoints),
    },
    Entry {
        cause: Cause::FeedClamp,
        positive: "arcs are slowed to {size} of centripetal acceleration: raise that limit, or program what the machine can hold",
        negative: "arcs are slowed to {size} of centripetal acceleration: raise that limit, or program what the machine can hold",
        knob: Some(Knob::Clamp),
    },
    Entry {
        cause: Cause::ThermalDrift,
        positive: "circles grew by {size}: warm up longer before measuring or working, or compensate for the temperature",
        negative: "circles shrank by {size}: warm up longer before measuring or working, or compensate for the temperature",
        knob: None,
    },
    Entry {
        cause: Cause::StickSlip,
        positive: "an axis sticks and slips by {size} when it is slow: lubricate its guide, or raise the gain at low speed",
        negative: "an axis sticks and slips by {size} when it is slow: lubricate its guide, or raise the gain at low speed",
        knob: None,
    },
    Entry {
        cause: Cause::JointLagMismatch,
        positive: "{a} follows {size} later than the joints on average: raise its gain",
        negative: "{a} follows {size} earlier than the joints on average: lower its gain, or raise that of the others",
        knob: None,
    },
    Entry {
        cause: Cause::JointReversal,
        positive: "{a} sticks where it turns back, {size} at the tool: raise its friction compensation, look at its gear",
        negative: "{a} is pushed too far where it turns back, {size} at the tool: lower its friction compensation",
        knob: None,
    },
    Entry {
        cause: Cause::JointBacklash,
        positive: "the gear of {a} has {size} of play: take it up, or have the gear overhauled",
        negative: "{a} jumps ahead by {size} where it turns back: lower its backlash compensation by {size}",
        knob: None,
    },
    Entry {
        cause: Cause::JointCyclicError,
        positive: "the gear of {a} is off by up to {size} within each turn of its input: map it, or have it overhauled",
        negative: "the gear of {a} is off by up to {size} within each turn of its input: map it, or have it overhauled",
        knob: None,
    },
    Entry {
        cause: Cause::JointZero,
        positive: "{a} stands {size} further than its controller reads: set its zero again, {size} less",
        negative: "{a} stands {size} less far than its controller reads: set its zero again, {size} more",
        knob: None,
    },
    Entry {
        cause: Cause::LinkLength,
        positive: "the link behind {a} is {size} longer than the controller has it: enter its calibrated length",
        negative: "the link behind {a} is {size} shorter than the controller has it: enter its calibrated length",
        knob: None,
    },
];

/// What to turn and which way. `value` is in the unit of the contract; a finding of the machine as a whole is one of X
/// against Y where its actuators are not given.
pub fn remedy(cause: Cause, actuators: &[&str], value: f64) -> String {
    let Some(entry) = ALL.iter().find(|entry| entry.cause == cause) else {
        return String::new();
    };
    let shown = units::shown(value.abs(), [value.abs(); 2], cause.model().words().unit);
    let name = |at: usize, otherwise: &str| {
        let given = actuators.get(at).copied().unwrap_or(otherwise);
        // A slide is a letter, a joint a word: `joint2` is read as `joint 2`.
        match given.strip_prefix("joint") {
            Some(number) => format!("joint {number}"),
            None => given.to_uppercase(),
        }
    };
    let words = if value < 0.0 {
        entry.negative
    } else {
        entry.positive
    };
    words
        .replace("{a}", &name(0, "x"))
        .replace("{b}", &name(1, "y"))
        .replace("{size}", &format!("{} {}", shown.value, shown.unit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::{Effect, Seat, Site};
    use crate::simulation::machine::{Friction, Machine, PositionLoop};
    use crate::simulation::{CircleTest, circle};
    use giotto_shared::{Actuator, Direction, Plane};

    #[test]
    fn every_cause_has_one_entry_and_words_without_gaps() {
        for model in crate::causes::ALL {
            let cause = model.cause();
            assert_eq!(
                ALL.iter().filter(|e| e.cause == cause).count(),
                1,
                "{}",
                cause.id()
            );
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
    }

    /// Turns the setting that the words name, the way they say for this sign, by the size.
    fn turn(machine: &mut Machine, knob: Knob, words: &str, axis: usize, size: f64, kv: f64) {
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
            Knob::Guide | Knob::Sideways | Knob::SetPoints | Knob::Clamp => {
                let _ = kv;
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
        for entry in &ALL {
            let Some(knob) = entry.knob else { continue };
            // Size in the unit of the machine, and the factor from the contract's to it.
            let (contract, factor) = match entry.cause {
                Cause::ServoMismatch => (60e-6, 1.0),
                Cause::ScaleError | Cause::ScaleMismatch | Cause::Squareness => (80.0, 1e-6),
                Cause::Backlash | Cause::RadiusOffset => (0.012, 1e-3),
                Cause::ReversalSpike => (8.0, 1e-6),
                _ => continue,
            };
            for sign in [1.0, -1.0] {
                for axis in 0..2 {
                    let value = sign * contract;
                    let seat = entry.cause.model().seat();
                    let place = seat == Seat::One;
                    let site = match seat {
                        Seat::One => Site::One(Actuator::SLIDES[axis]),
                        Seat::Pair => Site::Pair(Plane::Xy),
                        _ => Site::Machine,
                    };
                    let decay = [("decay_s", 0.02)];
                    let given = entry.cause.model().parameters();
                    let params = decay
                        .iter()
                        .copied()
                        .filter(|(name, _)| given.iter().any(|p| p.name == *name));
                    let effect = Effect::new(entry.cause, site, value, [value; 2], params).unwrap();
                    let mut machine = ideal.clone();
                    machine.friction = [Some(Friction::default()); 3];
                    entry.cause.model().apply(&effect, &mut machine);
                    let before = misfit(&machine, &ideal, seat == Seat::Pair);
                    let names: &[&str] = if place {
                        &[["x", "y"][axis]]
                    } else {
                        &["x", "y"]
                    };
                    let words = remedy(entry.cause, names, value);
                    turn(&mut machine, knob, &words, axis, contract * factor, kv);
                    let after = misfit(&machine, &ideal, seat == Seat::Pair);
                    // Raising one loop of two also changes the mean lag: what is left of that is small.
                    assert!(
                        after < 0.3 * before,
                        "{} {value} {names:?}: {before:e} -> {after:e}: {words}",
                        entry.cause.id()
                    );
                }
            }
        }
    }
}
