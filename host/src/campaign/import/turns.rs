//! What of a recording is a circular test: passages in one direction, their turns, and the rows that are left out.
use std::fmt;
use std::ops::Range;

/// The turns of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Turns {
    pub(super) passes: Vec<Pass>,
}

/// A passage along the circle in one direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pass {
    /// +1 counter-clockwise, −1 clockwise, 0 where it cannot be seen.
    pub(super) sign: f64,
    pub(super) turns: Vec<Turn>,
    /// Angle covered where there is no whole turn, rad; the only turn is then this arc.
    pub(super) arc_rad: Option<f64>,
    /// Rows of the motion of which the turns are part.
    pub(super) motion: Range<usize>,
    /// About as many rows of it run in before the first turn, and out behind the last.
    pub(super) lead: [usize; 2],
}

/// One turn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turn {
    pub(super) rows: Range<usize>,
    /// Rows between the first and the last that are not of it, in order.
    pub(super) left_out: Vec<LeftOut>,
    /// Angle of the first row since the first row of the file that is of the test, rad, where angles are inferred from time.
    pub(super) from_rad: f64,
}

/// Rows that are left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LeftOut {
    pub(super) rows: Range<usize>,
    pub(super) why: Why,
}

/// Why rows are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Why {
    /// The machine stood still.
    Standing,
    /// The machine speeds up or slows down: rows lie closer than the others.
    Ramp,
    /// The instrument repeated a value while the machine went on.
    Held,
    /// Far from the circle.
    OffCircle,
    /// Before the turn, and the same behind it.
    RunIn,
    RunOut,
    /// Of another turn.
    OtherTurn,
    /// A value is missing.
    Missing,
}

impl Turns {
    /// Why the rows outside of turn `k` of pass `p` are left out, and how many before it and behind it. `on` are the rows on
    /// the circle.
    pub(super) fn outside(
        &self,
        [p, k]: [usize; 2],
        rows: usize,
        on: &[Range<usize>],
    ) -> [Vec<(Why, usize)>; 2] {
        let (pass, turn) = (&self.passes[p], &self.passes[p].turns[k]);
        let side = |within: Range<usize>, lead: usize, run: Why| {
            let overlap = |r: &Range<usize>| {
                r.end
                    .min(within.end)
                    .saturating_sub(r.start.max(within.start))
            };
            let others = self.passes.iter().flat_map(|pass| &pass.turns);
            let other: usize = others
                .filter(|t| *t != turn)
                .map(|t| overlap(&t.rows))
                .sum();
            let on: usize = on.iter().map(overlap).sum();
            let off = within.len() - on;
            let free = on.saturating_sub(other);
            // With other turns between, what runs in before the first is theirs.
            let lead = lead.min(free).min(overlap(&pass.motion));
            let counts = [
                (Why::OffCircle, off),
                (Why::OtherTurn, on - free),
                (run, lead),
                (Why::Standing, free - lead),
            ];
            counts.into_iter().filter(|(_, n)| *n > 0).collect()
        };
        [
            side(0..turn.rows.start, pass.lead[0], Why::RunIn),
            side(turn.rows.end..rows, pass.lead[1], Why::RunOut),
        ]
    }
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Standing => "the machine stood still",
            Self::Ramp => "closer than the others, at a start or a stop",
            Self::Held => "a value held while the machine went on",
            Self::OffCircle => "off the circle",
            Self::RunIn => "run-in",
            Self::RunOut => "run-out",
            Self::OtherTurn => "of another turn",
            Self::Missing => "without a value",
        })
    }
}
