//! The state machine of all doors: engage, answer, hold, leave, refuse. No socket, no clock.
use crate::Place;
use crate::adder::{Added, Adder};
use crate::egm::Egm;
use crate::egm_path::EgmPath;
use crate::j519::J519;
use crate::player::Player;
use crate::protocol::{Answer, Heard, Kind, Protocol, Told};
use crate::rsi::Rsi;
use crate::sequence::{Counters, Order, Sequence};
use crate::setup::{Setup, SetupError, limits};
use giotto_corrector::{PERIOD_S, Settings};
use std::time::Duration;

/// A robot that was guided on our path and is silent so long is lost; on a path of its own, its program has ended.
const LOST: Duration = Duration::from_secs(2);
const SILENCE: Duration = Duration::from_secs(10);
/// Leaving takes no longer than this, whatever does not come to rest.
const LEAVING: Duration = Duration::from_secs(5);
/// Farthest that a robot's planned place is from its measured one, mm: farther is another frame or unit.
const APART_MM: f64 = 100.0;
/// So many datagrams in a row that cannot be read are another program's.
const MOST_MALFORMED: u32 = 100;
/// So many cycles in a row in which the robot plans what it was just told are an echo.
const ECHOES: u32 = 25;
/// Most cycles that are answered at once for datagrams that were lost.
const MOST_AT_ONCE: u32 = 10;

/// Where a session stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The robot was not heard yet, or is not ready; why, in words.
    Waiting(Option<&'static str>),
    /// It is guided.
    Guiding,
    /// The correction is on its way out, or the path comes to rest.
    Leaving,
    /// Done.
    Ended,
    /// The robot cannot be guided: why, in words.
    Refused(String),
}

/// Whose path it is.
#[derive(Clone, Debug)]
enum Source {
    Robots(Adder),
    Ours(Player),
}

/// One session with one robot.
pub struct Door {
    protocol: Box<dyn Protocol + Send>,
    source: Source,
    planned_is_corrected: bool,
    /// A set-point door without a path follows what the robot plans.
    needs_planned: bool,
    sequence: Sequence,
    counters: Counters,
    phase: Phase,
    cycle_ms: f64,
    latency_s: f64,
    patience: Duration,
    first_heard: Option<Duration>,
    last_heard: Duration,
    leaving_since: Option<Duration>,
    /// The last number that was answered.
    number: u32,
    answer: Answer,
    measured: Option<(Duration, Place)>,
    missed: Option<u64>,
    malformed_in_a_row: u32,
    echoes: u32,
}

impl std::fmt::Debug for Door {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Door")
            .field("phase", &self.phase)
            .field("counters", &self.counters)
            .finish_non_exhaustive()
    }
}

impl Door {
    /// A door that waits for its robot.
    ///
    /// # Errors
    /// [`SetupError`]: nothing was sent.
    pub fn new(setup: Setup) -> Result<Self, SetupError> {
        let cycle_s = setup.cycle_ms * 1e-3;
        let [shortest, longest] = PERIOD_S;
        if !(shortest..=longest).contains(&cycle_s) {
            return Err(SetupError::Number("the cycle has to be 0.25 to 50 ms"));
        }
        if !(setup.limit_mm > 0.0 && setup.limit_mm <= 100.0) {
            return Err(SetupError::Number(
                "the limit has to be above 0, up to 100 mm",
            ));
        }
        let protocol: Box<dyn Protocol + Send> = match setup.kind {
            Kind::Egm => Box::new(Egm::new()),
            Kind::EgmPath => Box::new(EgmPath::new(&setup)),
            Kind::Rsi => Box::new(Rsi::new(&setup)),
            Kind::J519 => Box::new(J519::new()),
        };
        let settings = Settings::new(3, "XYZ", 1.0)?;
        let follows = setup.path.is_some() || setup.kind == Kind::J519;
        let adds = matches!(setup.kind, Kind::Rsi | Kind::EgmPath);
        if adds && setup.path.is_some() {
            return Err(SetupError::Number(
                "this door adds to the robot's own path and takes no other",
            ));
        }
        let limits = limits(&setup.table)?;
        let source = if follows {
            let player = Player::new(
                settings,
                &setup.table,
                cycle_s,
                setup.motion,
                setup.path.clone(),
            )?;
            if let Some(words) = player.too_much() {
                return Err(SetupError::Path(words));
            }
            Source::Ours(player)
        } else if adds {
            let settings = settings.with_lead(setup.dead_time_ms * 1e-3)?;
            let bounds = [setup.limit_mm, f64::from(limits.slew_m_s) * 1e3];
            Source::Robots(Adder::new(settings, &setup.table, cycle_s, Some(bounds))?)
        } else {
            Source::Robots(Adder::new(settings, &setup.table, cycle_s, None)?)
        };
        Ok(Self {
            sequence: Sequence::new(protocol.step(), cycle_s),
            protocol,
            planned_is_corrected: setup.planned_is_corrected && adds,
            needs_planned: !follows && !adds,
            // Two strides of 15 ms each, in whole cycles.
            latency_s: if adds {
                0.0
            } else {
                2.0 * cycle_s * (0.015 / cycle_s).round().max(1.0)
            },
            source,
            counters: Counters::default(),
            phase: Phase::Waiting(None),
            cycle_ms: setup.cycle_ms,
            patience: setup.patience,
            first_heard: None,
            last_heard: Duration::ZERO,
            leaving_since: None,
            number: 0,
            answer: Answer::default(),
            measured: None,
            missed: None,
            malformed_in_a_row: 0,
            echoes: 0,
        })
    }

    /// Where the session stands.
    pub const fn phase(&self) -> &Phase {
        &self.phase
    }

    /// Counts so far.
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// From a set-point in to the same one out, s; 0 where the robot adds the correction to its own path.
    pub const fn latency_s(&self) -> f64 {
        self.latency_s
    }

    /// Correction that went out last, mm.
    pub const fn correction_mm(&self) -> Place {
        self.answer.offset
    }

    /// Where the robot was last, mm, and when by its own numbers, since it was heard first.
    pub const fn measured_mm(&self) -> Option<(Duration, Place)> {
        self.measured
    }

    /// Answers that the robot says it has missed, where it counts them.
    pub const fn missed(&self) -> Option<u64> {
        self.missed
    }

    /// What is to be sent while the robot is silent and has not been heard.
    pub fn greeting(&self) -> Vec<Vec<u8>> {
        match self.phase {
            Phase::Waiting(_) if self.first_heard.is_none() => self.protocol.greeting(),
            _ => Vec::new(),
        }
    }

    /// What is to be sent at the end.
    pub fn farewell(&self) -> Vec<Vec<u8>> {
        self.protocol.farewell()
    }

    /// Takes the correction out and ends; a path of ours comes to rest on itself.
    pub fn leave(&mut self, now: Duration) {
        match self.phase {
            Phase::Guiding => {
                self.phase = Phase::Leaving;
                self.leaving_since = Some(now);
                if let Source::Ours(player) = &mut self.source {
                    player.stop();
                }
            }
            Phase::Waiting(_) => self.phase = Phase::Ended,
            Phase::Leaving | Phase::Ended | Phase::Refused(_) => {}
        }
    }

    /// Time goes by without a datagram.
    pub fn silence(&mut self, now: Duration) {
        let silent = now.saturating_sub(self.last_heard);
        match &self.phase {
            Phase::Waiting(Some(why)) if self.is_tired(now) => {
                self.phase = Phase::Refused((*why).to_owned());
            }
            Phase::Guiding => match &self.source {
                Source::Ours(player) if !player.at_rest() && silent > LOST => {
                    self.phase = Phase::Refused(format!(
                        "the robot has gone silent on its path; it was last heard {:.1} s ago",
                        silent.as_secs_f64()
                    ));
                }
                _ if silent > SILENCE => self.phase = Phase::Ended,
                _ => {}
            },
            Phase::Leaving if silent > LOST => self.phase = Phase::Ended,
            _ => {}
        }
    }

    fn is_tired(&self, now: Duration) -> bool {
        self.first_heard
            .is_some_and(|first| now.saturating_sub(first) > self.patience)
    }

    /// A datagram of the robot came at `now`; what is to be sent back, in this order.
    pub fn answer(&mut self, datagram: &[u8], now: Duration) -> Vec<Vec<u8>> {
        if matches!(self.phase, Phase::Ended | Phase::Refused(_)) {
            return Vec::new();
        }
        let told = match self.protocol.read(datagram) {
            Heard::Told(told) => told,
            Heard::Aside => return Vec::new(),
            Heard::Malformed(what) => {
                self.malformed(what);
                return Vec::new();
            }
        };
        self.malformed_in_a_row = 0;
        self.counters.received += 1;
        self.first_heard.get_or_insert(now);
        self.last_heard = now;
        let order = self
            .sequence
            .take(told.number, told.stamp_ms, now, &mut self.counters);
        let cycles = match order {
            Order::Old => return Vec::new(),
            Order::Between(ahead) => {
                return self.refuse(format!(
                    "the robot's number grew by {ahead}, which is no whole number of cycles of {} ms; say its cycle (--cycle)",
                    self.cycle_ms
                ));
            }
            Order::First => None,
            Order::After(cycles) => Some(cycles),
        };
        self.measured = told.measured.map(|place| (self.sequence.told(), place));
        self.missed = told.missed.or(self.missed);
        self.protocol.taken(&told, cycles.unwrap_or(1));
        if let Err(words) = self.check(&told, now) {
            return self.refuse(words);
        }
        if told.not_ready.is_some() || told.idle {
            return Vec::new();
        }
        self.guide(&told, cycles, now)
    }

    fn refuse(&mut self, words: String) -> Vec<Vec<u8>> {
        self.phase = Phase::Refused(words);
        Vec::new()
    }

    fn malformed(&mut self, what: &'static str) {
        self.counters.malformed += 1;
        self.malformed_in_a_row += 1;
        if self.first_heard.is_none() || self.malformed_in_a_row >= MOST_MALFORMED {
            self.phase = Phase::Refused(what.to_owned());
        }
    }

    /// The robot's state.
    fn check(&mut self, told: &Told, now: Duration) -> Result<(), String> {
        if let Some(why) = told.not_ready {
            return match self.phase {
                Phase::Waiting(_) if !self.is_tired(now) => {
                    self.phase = Phase::Waiting(Some(why));
                    Ok(())
                }
                Phase::Leaving => {
                    self.phase = Phase::Ended;
                    Ok(())
                }
                _ => Err(why.to_owned()),
            };
        }
        if let Some(measured_ms) = self.sequence.other_cycle_ms() {
            return Err(format!(
                "the robot's cycle is {measured_ms:.0} ms by its own clock, not {} ms; say so (--cycle {measured_ms:.0})",
                self.cycle_ms
            ));
        }
        if let (Some(planned), Some(measured)) = (told.planned, told.measured) {
            let square: f64 = planned
                .iter()
                .zip(measured)
                .map(|(a, b)| (a - b) * (a - b))
                .sum();
            let apart = square.sqrt();
            if apart > APART_MM {
                return Err(format!(
                    "the robot's planned place is {apart:.0} mm from where it is: another frame, another unit, or no path"
                ));
            }
        }
        Ok(())
    }

    /// One cycle of a robot that is ready.
    fn guide(&mut self, told: &Told, cycles: Option<u32>, now: Duration) -> Vec<Vec<u8>> {
        let begins = matches!(self.phase, Phase::Waiting(_));
        let Some(here) = told.planned.or(told.measured) else {
            return self.refuse("the robot does not say where it is".to_owned());
        };
        if begins {
            if self.needs_planned && told.planned.is_none() {
                return self.refuse(
                    "the robot plans no path of its own: give the one to be followed (--path FILE)"
                        .to_owned(),
                );
            }
            if let Source::Ours(player) = &mut self.source
                && let Err(words) = player.start(told.measured.unwrap_or(here))
            {
                return self.refuse(words);
            }
            self.phase = Phase::Guiding;
        }
        // A number without an answer is one that the robot has given up, unless it insists on each.
        let behind = cycles.filter(|_| !begins).unwrap_or(1);
        let answers = if self.protocol.answers_each() {
            behind.min(MOST_AT_ONCE)
        } else {
            1
        };
        let mut replies = Vec::new();
        for back in (0..answers).rev() {
            if matches!(self.phase, Phase::Ended | Phase::Refused(_)) {
                break;
            }
            self.number = told
                .number
                .wrapping_sub(back.wrapping_mul(self.protocol.step()));
            let done = self.one_answer(
                here,
                told.planned,
                if begins { None } else { Some(behind) },
                now,
            );
            replies.push(self.protocol.write(&self.answer));
            if done {
                self.phase = Phase::Ended;
            }
        }
        self.counters.answered += 1;
        replies
    }

    /// Works out one answer; whether it is the last.
    fn one_answer(
        &mut self,
        here: Place,
        planned: Option<Place>,
        cycles: Option<u32>,
        now: Duration,
    ) -> bool {
        let leaving = self.phase == Phase::Leaving;
        let tired = self
            .leaving_since
            .is_some_and(|since| now.saturating_sub(since) > LEAVING);
        let (target, offset, done, limited) = match &mut self.source {
            Source::Ours(player) => {
                player.lost(cycles.unwrap_or(1));
                let played = player.cycle();
                (played.target, played.offset, played.done, played.limited)
            }
            Source::Robots(adder) => {
                let mut bare = here;
                if self.planned_is_corrected || (planned.is_none() && !self.needs_planned) {
                    // What was added is in the place already.
                    for (bare, offset) in bare.iter_mut().zip(self.answer.offset) {
                        *bare -= offset;
                    }
                }
                let Added {
                    beside,
                    active,
                    limited,
                } = adder.cycle(bare, cycles, !leaving);
                let mut target = bare;
                for (target, beside) in target.iter_mut().zip(beside) {
                    *target += beside;
                }
                (target, beside, leaving && !active, limited)
            }
        };
        self.counters.limited += u64::from(limited);
        if self.needs_planned {
            self.listen_for_echo(planned);
        }
        let last = done || (leaving && tired);
        self.answer = Answer {
            number: self.number,
            target,
            offset,
            last,
        };
        last
    }

    /// A robot without a path of its own plans what it is told: the correction would be added to itself.
    fn listen_for_echo(&mut self, planned: Option<Place>) {
        let near = |a: Place, b: Place| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        let corrects = !near(self.answer.offset, [0.0; 3]);
        let echo = corrects && planned.is_some_and(|planned| near(planned, self.answer.target));
        self.echoes = if echo { self.echoes + 1 } else { 0 };
        if self.echoes >= ECHOES {
            self.phase = Phase::Refused(
                "the robot plans what it is told and has no path of its own: give the one to be followed (--path FILE)"
                    .to_owned(),
            );
        }
    }
}
