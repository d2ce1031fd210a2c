//! What is known of the controller at a moment.
use super::watch::Event;
use giotto_shared::wire::{Identity, MotionState, SetPoint, Status};
use std::collections::VecDeque;

/// Longest trace: two minutes at 100 a second.
const TRACE: usize = 12_000;
/// The largest correction is drawn as this share of the picture.
const SHOWN_SHARE: f64 = 0.15;

/// The view.
#[derive(Clone, Debug, Default)]
pub(super) struct View {
    pub(super) port: String,
    pub(super) identity: Option<Identity>,
    pub(super) status: Option<Status>,
    /// Why the line is lost; nothing while it is open.
    pub(super) lost: Option<String>,
    /// How often it was.
    pub(super) losses: u32,
    /// What was refused last.
    pub(super) refused: Option<String>,
    /// Whether the person wants to go.
    pub(super) leaving: Leaving,
    trace: VecDeque<SetPoint>,
}

/// How far someone is with leaving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Leaving {
    /// Not at all.
    #[default]
    No,
    /// Asked, since the machine moves.
    Asked,
    /// As soon as the machine is at rest.
    AtRest,
}

/// A trace ready to be drawn, mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Trace {
    pub(super) programmed: Vec<(f64, f64)>,
    /// With the correction magnified.
    pub(super) corrected: Vec<(f64, f64)>,
    pub(super) magnification: f64,
    /// Largest correction, µm.
    pub(super) largest_um: f64,
    /// Middle of the picture and half its height.
    pub(super) centre: [f64; 2],
    pub(super) reach: f64,
}

/// A state in one word.
pub(super) fn motion(state: MotionState) -> &'static str {
    match state {
        MotionState::Idle => "idle",
        MotionState::Running => "running",
        MotionState::Stopping => "stopping",
        MotionState::Fault => "fault",
        MotionState::Paused => "feed hold",
    }
}

impl View {
    pub(super) fn new(port: &str) -> Self {
        Self {
            port: port.to_owned(),
            ..Self::default()
        }
    }

    /// Whether the machine was under way when it was last heard of.
    pub(super) fn moves(&self) -> bool {
        let status = self.status.as_ref().filter(|_| self.lost.is_none());
        status.is_some_and(|status| status.motion.is_run())
    }

    pub(super) fn take(&mut self, event: Event) {
        match event {
            Event::Up(identity) => {
                self.identity = Some(*identity);
                self.lost = None;
            }
            Event::Down(why) => {
                self.losses += u32::from(self.lost.is_none());
                self.lost = Some(why);
            }
            Event::Status(status) => {
                let moves = |s: MotionState| s.is_run();
                let before = self.status.as_ref().is_some_and(|s| moves(s.motion));
                if moves(status.motion) && !before {
                    // Another run, another picture.
                    self.trace.clear();
                    self.refused = None;
                }
                self.status = Some(*status);
            }
            Event::Points(points) => {
                self.trace.extend(points);
                let over = self.trace.len().saturating_sub(TRACE);
                self.trace.drain(..over);
            }
            Event::Refused(why) => self.refused = Some(why),
        }
    }

    /// The set-points as a picture; the correction magnified by a round number so that it can be seen.
    pub(super) fn trace(&self) -> Trace {
        let mm = |nm: i32| f64::from(nm) * 1e-6;
        let raw: Vec<[f64; 2]> = self
            .trace
            .iter()
            .map(|p| [mm(p.raw_nm[0]), mm(p.raw_nm[1])])
            .collect();
        let offset = |p: &SetPoint| {
            [0, 1].map(|i| f64::from(p.corrected_nm[i].wrapping_sub(p.raw_nm[i])) * 1e-6)
        };
        let largest = self
            .trace
            .iter()
            .map(offset)
            .map(|[x, y]| x.hypot(y))
            .fold(0.0, f64::max);
        if raw.is_empty() {
            return Trace {
                magnification: 1.0,
                reach: 1.0,
                ..Trace::default()
            };
        }
        let bound = |i: usize, pick: fn(f64, f64) -> f64, start: f64| {
            raw.iter().map(|p| p[i]).fold(start, pick)
        };
        let (low, high) = (
            [0, 1].map(|i| bound(i, f64::min, f64::INFINITY)),
            [0, 1].map(|i| bound(i, f64::max, f64::NEG_INFINITY)),
        );
        let centre = [0, 1].map(|i| 0.5 * (low[i] + high[i]));
        let half = (0.5 * (high[0] - low[0]).max(high[1] - low[1])).max(1e-3);
        let magnification = if largest > 0.0 {
            round_down(SHOWN_SHARE * half / largest).max(1.0)
        } else {
            1.0
        };
        let corrected = self.trace.iter().zip(&raw).map(|(p, [x, y])| {
            let [dx, dy] = offset(p);
            (x + magnification * dx, y + magnification * dy)
        });
        Trace {
            corrected: corrected.collect(),
            programmed: raw.iter().map(|p| (p[0], p[1])).collect(),
            magnification,
            largest_um: largest * 1e3,
            centre,
            reach: half * (1.0 + 1.3 * SHOWN_SHARE),
        }
    }
}

/// The next of 1, 2, 5, 10 … below.
fn round_down(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0]
        .into_iter()
        .map(|k| k * decade)
        .find(|v| *v <= value)
        .unwrap_or(decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correction_is_magnified_by_a_round_number() {
        let mut view = View::new("sim");
        assert_eq!(view.trace().reach, 1.0);
        let point = |k: usize| {
            let (sin, cos) = (k as f64 * 0.01).sin_cos();
            let at = |r: f64| [(r * cos) as i32, (r * sin) as i32, 0];
            SetPoint {
                raw_nm: at(50e6),
                corrected_nm: at(50.012e6),
            }
        };
        view.take(Event::Points((0..629).map(point).collect()));
        let trace = view.trace();
        assert_eq!(trace.magnification, 500.0); // 0.15·50/0.012 = 625
        assert!(
            (trace.largest_um - 12.0).abs() < 0.01,
            "{}",
            trace.largest_um
        );
        let (x, y) = trace.corrected[100];
        assert!((x.hypot(y) - 56.0).abs() < 1e-3, "{x} {y}");
        assert!(trace.centre[0].abs() < 0.1 && trace.reach > 56.0);
        for (value, expected) in [(625.0, 500.0), (499.0, 200.0), (1.0, 1.0), (0.03, 0.02)] {
            assert!(
                (round_down(value) / expected - 1.0).abs() < 1e-12,
                "{value}"
            );
        }
    }

    #[test]
    fn a_long_watch_keeps_the_last_two_minutes() {
        let mut view = View::new("sim");
        let points = |n: i32| {
            (0..n)
                .map(|k| SetPoint {
                    raw_nm: [k, 0, 0],
                    corrected_nm: [k, 0, 0],
                })
                .collect()
        };
        view.take(Event::Points(points(TRACE as i32)));
        view.take(Event::Points(points(100)));
        assert_eq!(view.trace().programmed.len(), TRACE);
        view.take(Event::Down("cut".into()));
        view.take(Event::Down("still".into()));
        assert_eq!((view.losses, view.lost.as_deref()), (1, Some("still")));
    }
}
