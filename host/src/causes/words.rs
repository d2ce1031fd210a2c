//! What a person reads about a cause.

/// Name, meaning, usual reasons, remedy and the measurement that would make sure.
#[derive(Clone, Copy, Debug)]
pub struct Words {
    /// Name in files and JSON.
    pub id: &'static str,
    /// Name for a person.
    pub name: &'static str,
    /// Unit of the estimate (contract).
    pub unit: &'static str,
    /// What it is, in one sentence.
    pub what: &'static str,
    /// What usually makes it.
    pub usual: &'static str,
    /// What to adjust.
    pub adjust: &'static str,
    /// What to turn, which way and how far, where the value is positive: `{a}` and `{b}` are its actuators, `{size}` its
    /// size with its unit.
    pub positive: &'static str,
    /// The same where the value is negative.
    pub negative: &'static str,
    /// Both again for the other kind of seat, where a cause has two: on one actuator instead of the machine or a pair, or
    /// the machine as a whole instead of a joint.
    pub elsewhere: Option<[&'static str; 2]>,
    /// What cannot be told from it by circles at all.
    pub never_told_from: &'static [&'static str],
    /// The measurement that would separate it from its look-alikes.
    pub next: &'static str,
    /// Why the controller cannot correct it; `None` if it can.
    pub not_compensable: Option<&'static str>,
}
