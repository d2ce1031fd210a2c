//! Which campaigns the study runs.
use crate::effects::{Kind, LISTED, Null, UNLISTED};

/// Rows of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// One listed effect.
    Single,
    /// Two.
    Pair,
    /// Three.
    Triple,
    /// Nothing.
    Null,
    /// Something outside the list.
    Unlisted,
    /// Residuals dealt to other runs.
    Permuted,
}

/// One campaign to be drawn and diagnosed.
#[derive(Clone, Debug)]
pub struct Job {
    /// Row.
    pub group: Group,
    /// What is hidden.
    pub kind: Kind,
    /// In units of the noise.
    pub strength: f64,
    /// Seed.
    pub seed: u64,
}

/// Pairs that a machine could well have but that circles of one machine cannot hold apart, or where one
/// takes the place of the other.
const SENSELESS: [(&str, &str); 3] = [
    // The clamp keeps the runs away in which the other shows.
    ("higher_order_dynamics", "feed_clamp"),
    // Chords bring a κ4 of their own.
    ("higher_order_dynamics", "interpolation_chord"),
    // Both live in the same degrees after the same reversals.
    ("reversal_spike", "stick_slip"),
];

/// All pairs that make sense.
pub fn pairs() -> Vec<[&'static str; 2]> {
    let mut all = Vec::new();
    for (i, a) in LISTED.iter().enumerate() {
        for b in &LISTED[i + 1..] {
            if !SENSELESS.contains(&(*a, *b)) {
                all.push([*a, *b]);
            }
        }
    }
    all
}

/// Triples that belong together in practice: a robot, a worn machine tool, a badly tuned one, a warm one.
pub const TRIPLES: [[&str; 3]; 10] = [
    ["higher_order_dynamics", "scale_mismatch", "squareness"],
    ["servo_mismatch", "backlash", "squareness"],
    ["backlash", "lateral_play", "straightness"],
    ["servo_mismatch", "bandwidth_mismatch", "scale_mismatch"],
    ["thermal_drift", "scale_error", "squareness"],
    ["cyclic_error", "backlash", "servo_mismatch"],
    ["vibration", "reversal_spike", "squareness"],
    ["feed_clamp", "servo_mismatch", "scale_mismatch"],
    ["radius_offset", "straightness", "backlash"],
    ["thermal_drift", "vibration", "lateral_play"],
];

/// Campaigns a cause and strength of the full study: with pairs and triples more than 40 a cause, and 200 nulls.
pub const FULL: usize = 10;

/// The whole study with `each` campaigns a cause and strength ([`FULL`] in full). `only` keeps the rows whose
/// name contains it.
pub fn schedule(seed: u64, each: usize, only: Option<&str>) -> Vec<Job> {
    let mut jobs = Vec::new();
    let mut add = |group: Group, kind: Kind, strength: f64, count: usize| {
        let name = kind.to_string();
        if only.is_some_and(|o| !name.contains(o) && !format!("{group:?}").eq_ignore_ascii_case(o))
        {
            return;
        }
        for k in 0..count {
            // Seeds differ between rows, so that no laboratory is met twice.
            let row = name.bytes().fold(strength.to_bits(), |h, b| {
                h.wrapping_mul(0x0100_0000_01b3) ^ u64::from(b)
            });
            jobs.push(Job {
                group,
                kind: kind.clone(),
                strength,
                seed: seed ^ row.rotate_left(17) ^ (k as u64) << 1,
            });
        }
    };
    let names = |list: &[&str]| Kind::Effects(list.iter().map(|s| (*s).to_owned()).collect());
    for null in [Null::Noise, Null::Spread, Null::Lag, Null::Model] {
        // Two in a hundred are only seen in hundreds.
        add(
            Group::Null,
            Kind::Null(null),
            0.0,
            if each < FULL {
                each.div_ceil(2)
            } else {
                5 * FULL.max(each)
            },
        );
    }
    for name in LISTED {
        for (strength, count) in [(1.0, each), (3.0, each), (10.0, each.div_ceil(2))] {
            add(Group::Single, names(&[name]), strength, count);
        }
    }
    for name in UNLISTED {
        for (strength, count) in [(3.0, each.div_ceil(2)), (10.0, each.div_ceil(4))] {
            add(Group::Unlisted, names(&[name]), strength, count);
        }
    }
    for pair in pairs() {
        add(Group::Pair, names(&pair), 3.0, each.div_ceil(2 * FULL));
    }
    for triple in TRIPLES {
        add(Group::Triple, names(&triple), 3.0, each.div_ceil(4));
    }
    // Only what flips with the direction averages out when it is dealt to other runs.
    for name in ["servo_mismatch", "lateral_play"] {
        add(
            Group::Permuted,
            Kind::Permuted(name.to_owned()),
            3.0,
            each.div_ceil(4),
        );
    }
    jobs
}
