//! From one correction to another without a step: a new table, another zone, switched on or off.
use crate::history::History;
use crate::law::{Law, ZoneLaw};
use crate::senses::smooth;
use crate::settings::Settings;
use crate::voice::{Place, Voice};
use core::cmp::Ordering;
use giotto_shared::law::Pace;

/// Corrections nearer to each other than this are exchanged at once, m.
const SAME_M: f64 = 1e-9;

/// A zone of one of the two laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) law: usize,
    pub(crate) zone: usize,
}

/// The correction that acts, and the one before it while it still does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fade {
    from: Option<(Part, Voice)>,
    to: Option<(Part, Voice)>,
    /// 0 to 1.
    done: f64,
}

impl Fade {
    /// No correction.
    pub(crate) const fn silent() -> Self {
        Self {
            from: None,
            to: None,
            done: 1.0,
        }
    }

    /// Whether this law acts.
    pub(crate) fn uses(&self, law: usize) -> bool {
        [&self.from, &self.to]
            .into_iter()
            .flatten()
            .any(|(part, _)| part.law == law)
    }

    /// What acts, or is on its way to.
    pub(crate) fn heading(&self) -> Option<Part> {
        self.to.map(|(part, _)| part)
    }

    /// Nothing acts and nothing is on its way to.
    pub(crate) const fn is_silent(&self) -> bool {
        self.from.is_none() && self.to.is_none()
    }

    /// Offset by slide, m, on the way to what is wanted. A change under way is finished first: turning it round would be
    /// a step in velocity.
    pub(crate) fn tick(
        &mut self,
        wanted: Option<Part>,
        laws: &[Law; 2],
        at: &Place,
        history: &History,
        settings: &Settings,
    ) -> [f64; 3] {
        let settled = self.done >= 1.0;
        let begins = settled && wanted != self.to.map(|(part, _)| part);
        if begins {
            let pace = Pace {
                tick_s: history.tick_s(),
                turn_s: settings.take_up_s,
            };
            self.begin(wanted, laws, at, (history, &pace));
        }
        let sound = |voice: &mut Option<(Part, Voice)>| match voice {
            Some((part, voice)) => {
                zone(laws, *part).map_or([0.0; 3], |zone| voice.tick(zone, at, history, settings))
            }
            None => [0.0; 3],
        };
        let to = sound(&mut self.to);
        if self.done >= 1.0 {
            return to;
        }
        let from = sound(&mut self.from);
        let apart = to
            .iter()
            .zip(from)
            .any(|(to, from)| (to - from).abs().partial_cmp(&SAME_M) != Some(Ordering::Less));
        self.done = if begins && !apart {
            1.0
        } else {
            (self.done + history.tick_s() / settings.engage_s).min(1.0)
        };
        if self.done >= 1.0 {
            self.from = None;
            return to;
        }
        let share = smooth(self.done);
        let mut offset = from;
        for (offset, to) in offset.iter_mut().zip(to) {
            *offset += share * (to - *offset);
        }
        offset
    }

    fn begin(
        &mut self,
        wanted: Option<Part>,
        laws: &[Law; 2],
        at: &Place,
        (history, pace): (&History, &Pace<f64>),
    ) {
        self.from = self.to;
        // Who adds the offset to a path of its own gets it for a place ahead: the lag's delay would only have to be foreseen as well.
        let inverse = |zone: &ZoneLaw| match at.ahead {
            Some(_) => zone.inverse.without_lag(),
            None => zone.inverse,
        };
        let to = wanted.and_then(|part| zone(laws, part).map(|zone| (part, zone)));
        self.to = to.map(|(part, zone)| {
            // Errors of position go on being counted from where they were.
            let here = self.from.map_or(at.place_m, |(_, voice)| voice.reference_m);
            let reference_m = zone.reference_m().unwrap_or(here);
            (
                part,
                Voice::new(zone, reference_m, history.stencil(&inverse(zone)), pace),
            )
        });
        self.done = 0.0;
    }
}

fn zone(laws: &[Law; 2], part: Part) -> Option<&crate::law::ZoneLaw> {
    laws.get(part.law).and_then(|law| law.zone(part.zone))
}
