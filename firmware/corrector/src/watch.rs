//! What the planner and the machine are doing, seen from the set-points and the feedback alone.
use crate::settings::JOINTS;

/// A planner that changes a joint's velocity faster than this has put its set-points somewhere else, m/s².
const JUMP_M_S2: f64 = 200.0;
/// Set-points this near to the last feedback follow it, share of their size and of a millimetre.
const NEAR: f64 = 1e-9;
/// Ticks in a row after which following is no chance.
const FOLLOWS: u32 = 3;

/// Rest, jumps, and a planner that is switched off: LinuxCNC then sets the commanded place to the measured one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Watch {
    last: [f64; JOINTS],
    before: [f64; JOINTS],
    given_back: [f64; JOINTS],
    /// Ticks without a change of any set-point.
    still: u32,
    following: u32,
    off: bool,
}

/// What this tick is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Seen {
    /// The set-points went where no planner leads.
    pub(crate) jumped: bool,
    /// The planner follows the feedback: the machine is off.
    pub(crate) off: bool,
    /// Since how many ticks no set-point has changed.
    pub(crate) still: u32,
}

impl Watch {
    pub(crate) const fn new() -> Self {
        Self {
            last: [0.0; JOINTS],
            before: [0.0; JOINTS],
            given_back: [0.0; JOINTS],
            still: 0,
            following: 0,
            off: false,
        }
    }

    /// Stands here, with nothing known of before.
    pub(crate) fn stand(&mut self, place: &[f64; JOINTS]) {
        *self = Self {
            last: *place,
            before: *place,
            given_back: [f64::NAN; JOINTS],
            ..Self::new()
        };
    }

    /// Looks at the set-points of one tick; `unit` is a metre in machine units.
    pub(crate) fn look(
        &mut self,
        place: &[f64; JOINTS],
        joints: usize,
        unit: f64,
        tick_s: f64,
    ) -> Seen {
        let (mut moved, mut follows, mut jumped) = (false, true, false);
        let most = (JUMP_M_S2 * tick_s * tick_s) * unit;
        let joined = place
            .iter()
            .zip(self.last)
            .zip(self.before)
            .zip(self.given_back);
        for (((&now, last), before), given_back) in joined.take(joints) {
            let tolerance = NEAR * (now.abs() + 1e-3 * unit);
            moved |= (now - last).abs() > tolerance;
            // A comparison with what is not a number fails.
            follows &= (now - given_back).abs() <= tolerance;
            jumped |= (now - 2.0 * last + before).abs() > most;
        }
        let same = place
            .iter()
            .zip(self.last)
            .take(joints)
            .all(|(now, last)| *now == last);
        self.still = if same {
            self.still.saturating_add(1)
        } else {
            0
        };
        if moved {
            self.following = if follows {
                self.following.saturating_add(1)
            } else {
                0
            };
            if self.following >= FOLLOWS {
                self.off = true;
            } else if !follows {
                self.off = false;
            }
        }
        (self.before, self.last) = (self.last, *place);
        Seen {
            jumped,
            off: self.off,
            still: self.still,
        }
    }

    /// What was given back as feedback in this tick.
    pub(crate) fn gave(&mut self, feedback: &[f64; JOINTS]) {
        self.given_back = *feedback;
    }
}
