//! One tick: set-points and feedback in, set-points and feedback out.
//!
//! Two things change over time. The *latency*: corrected set-points are those of two strides ago. It comes and goes only
//! while nothing moves, when the delayed place is the present one. The *offset*: it fades in and out at any time.
//!
//! Where the planner puts its set-points elsewhere, or follows the feedback because the machine was switched off, both end
//! at once: what the output then is beside the input is kept, so that it does not jump, and taken out smoothly.
use crate::arc::{Ahead, Turn};
use crate::fade::{Fade, Part};
use crate::guard::{Guard, NEAR_M, share};
use crate::history::History;
use crate::law::{Here, Law, LawError};
use crate::senses::{Senses, smooth};
use crate::settings::{JOINTS, PERIOD_S, Settings};
use crate::voice::Place;
use crate::watch::Watch;
use giotto_shared::table::Table;

/// So long no zone may hold before the correction fades, s.
const OUTSIDE_S: f64 = 0.1;

/// What comes in with a tick. Places in machine units.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// Set-point of each joint's motor.
    pub command: [f64; JOINTS],
    /// Measured place of each motor.
    pub feedback: [f64; JOINTS],
    /// Motor place less joint place, as homing has set it.
    pub motor_offset: [f64; JOINTS],
    /// Soft limits of each joint, least and most.
    pub soft: [[f64; 2]; JOINTS],
    /// The correction is wanted.
    pub enable: bool,
    /// Coordinated motion: a program or a command. Jogging and homing are not.
    pub coordinated: bool,
    /// The drives are on.
    pub machine_on: bool,
}

/// What goes out.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// For the drives.
    pub command: [f64; JOINTS],
    /// For the planner.
    pub feedback: [f64; JOINTS],
    /// A correction acts, or is on its way in or out, or set-points are delayed for it.
    pub active: bool,
    /// Wanted and not possible: no table, or set-points that are no numbers.
    pub fault: bool,
    /// From a set-point in to the same one out, s.
    pub latency_s: f64,
}

/// Counts since start; they wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Counters {
    /// Ticks.
    pub ticks: u32,
    /// Ticks in which the offset was cut to its bound, or to a soft limit.
    pub offset_cuts: u32,
    /// Ticks in which the change of the offset was cut.
    pub slew_cuts: u32,
    /// Times that a correction ended at once: set-points that jumped, a machine switched off.
    pub resets: u32,
    /// Tables taken over since start.
    pub tables: u32,
}

/// All state of the correction. Large: it belongs into a static or on the heap.
#[derive(Clone, Debug)]
pub struct Corrector {
    settings: Settings,
    history: History,
    watch: Watch,
    senses: Senses,
    laws: [Law; 2],
    /// The newest of them.
    law: usize,
    has_table: bool,
    bypass: bool,
    scratch: Table,
    fade: Fade,
    guard: Guard,
    /// Bounds in force, m and m/s: they outlive their law until its offset is gone.
    bounds: [f64; 2],
    delayed: bool,
    /// What the output is beside the input after a correction ended at once, machine units, and how much of it is taken out.
    left: [f64; JOINTS],
    left_done: f64,
    /// Ticks since a zone held.
    outside: usize,
    /// Ticks until a correction may begin again.
    quiet: usize,
    last: [f64; JOINTS],
    started: bool,
    counters: Counters,
}

/// Moves the place that is corrected on along the path.
fn advance(place: &mut Place, time_s: f64) {
    let ahead = Ahead::after(&place.turn, place.velocity_m_s, time_s);
    for (place, way) in place.place_m.iter_mut().zip(ahead.way_m) {
        *place += way;
    }
    place.velocity_m_s = ahead.turned(place.velocity_m_s);
    place.acceleration_m_s2 = ahead.turned(place.acceleration_m_s2);
    place.higher = place.higher.map(|higher| ahead.turned(higher));
    place.turn.outward = ahead.turned(place.turn.outward);
    place.ahead = Some(ahead);
}

/// Joint or slide `index` of an array, 0 beyond it.
fn at(places: &[f64], index: usize) -> f64 {
    places.get(index).copied().unwrap_or(0.0)
}

impl Corrector {
    /// Without a table: passes everything through.
    pub const fn new(settings: Settings) -> Self {
        Self {
            settings,
            history: History::new(),
            watch: Watch::new(),
            senses: Senses::new(),
            laws: [Law::none(), Law::none()],
            law: 0,
            has_table: false,
            bypass: false,
            scratch: Table::empty(),
            fade: Fade::silent(),
            guard: Guard::new(),
            bounds: [0.0; 2],
            delayed: false,
            left: [0.0; JOINTS],
            left_done: 1.0,
            outside: 0,
            quiet: 0,
            last: [0.0; JOINTS],
            started: false,
            counters: Counters {
                ticks: 0,
                offset_cuts: 0,
                slew_cuts: 0,
                resets: 0,
                tables: 0,
            },
        }
    }

    /// Begins anew with other settings, in place: it is large. Tables are forgotten.
    pub fn set(&mut self, settings: Settings) {
        self.settings = settings;
        self.law = 0;
        self.has_table = false;
        (self.started, self.delayed) = (false, false);
        self.fade = Fade::silent();
        self.guard = Guard::new();
        self.left_done = 1.0;
        self.counters = Counters::default();
    }

    /// Whether a new table can be taken over now: not while one is being exchanged.
    pub fn takes_table(&self) -> bool {
        !self.fade.uses(self.law ^ 1)
    }

    /// Corrects by this table from now on; the change is smooth.
    ///
    /// # Errors
    /// [`LawError`], [`LawError::Busy`] unless [`Self::takes_table`]; the table in use stays in use.
    pub fn load(&mut self, image: &[u8]) -> Result<(), LawError> {
        if !self.takes_table() {
            return Err(LawError::Busy);
        }
        let free = (self.law ^ 1) & 1;
        if let Some(law) = self.laws.get_mut(free) {
            law.load(image, &mut self.scratch)?;
            (self.law, self.has_table) = (free, true);
            self.counters.tables = self.counters.tables.wrapping_add(1);
        }
        Ok(())
    }

    /// No table from now on; the correction fades out.
    pub fn unload(&mut self) {
        self.has_table = false;
    }

    /// Switches the correction off (`true`), or on where it is enabled, smoothly.
    pub fn set_bypass(&mut self, bypass: bool) {
        self.bypass = bypass;
    }

    /// Whether a table is there.
    pub const fn has_table(&self) -> bool {
        self.has_table
    }

    /// Counts since start.
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Offset by slide that went out last, m.
    pub const fn offset_m(&self) -> [f64; 3] {
        self.guard.last_m()
    }

    /// Set-points that came last, by slide, in machine coordinates, m.
    pub fn slides_m(&self, input: &Input) -> [f64; 3] {
        self.by_slide(&input.command, &input.motor_offset)
    }

    /// One tick. `period_s` is the time between two, within [`PERIOD_S`].
    pub fn tick(&mut self, input: &Input, period_s: f64) -> Output {
        self.counters.ticks = self.counters.ticks.wrapping_add(1);
        let joints = self.settings.joints;
        let good = input
            .command
            .iter()
            .take(joints)
            .all(|place| place.is_finite());
        if !good {
            return self.pass_bad(input);
        }
        if !self.started {
            self.start(input, period_s);
        }
        self.history.push(&input.command);
        let metre = self.settings.units_per_m;
        let seen = self
            .watch
            .look(&input.command, joints, metre, self.history.tick_s());
        let acts = self.delayed || !self.fade.is_silent() || self.guard.last_m() != [0.0; 3];
        let off = seen.off || !input.machine_on;
        self.quiet = self.quiet.saturating_sub(1);
        if off || seen.jumped {
            self.quiet = self.reach();
            if acts {
                self.end_at_once(input);
            }
        }
        let wanted = input.enable && input.coordinated && !off && !self.bypass && self.has_table;
        let wanted = wanted && self.quiet == 0;
        let rests = seen.still as usize >= self.history.latency();
        let delays = wanted && self.settings.lead_s.is_none();
        if rests && delays != self.delayed {
            self.delayed = delays;
            if wanted && self.fade.is_silent() {
                let here = self.by_slide(&input.command, &input.motor_offset);
                self.senses.forget(here);
            }
        }
        self.offset(wanted, input);
        let out = self.put_together(input);
        self.watch.gave(&out.feedback);
        self.last = out.command;
        out
    }

    /// The first tick: the machine stands where it is, and always has.
    fn start(&mut self, input: &Input, period_s: f64) {
        let [shortest, longest] = PERIOD_S;
        self.history
            .pace(self.settings.window_s, period_s.max(shortest).min(longest));
        self.history.fill(&input.command);
        self.watch.stand(&input.command);
        self.senses
            .forget(self.by_slide(&input.command, &input.motor_offset));
        if self.settings.lead_s.is_some() {
            // The path may be under way already: its beginning is no corner.
            self.quiet = self.reach();
        }
        self.started = true;
    }

    /// Set-points that are no numbers are the planner's: they pass, and nothing is known afterwards.
    fn pass_bad(&mut self, input: &Input) -> Output {
        (self.started, self.delayed) = (false, false);
        self.fade = Fade::silent();
        self.guard = Guard::new();
        self.left_done = 1.0;
        Output {
            command: input.command,
            feedback: input.feedback,
            active: false,
            fault: true,
            latency_s: 0.0,
        }
    }

    /// What the output is beside the input stays for a moment; all else of the correction ends.
    fn end_at_once(&mut self, input: &Input) {
        // A controller that adds the offset itself has moved its path and kept the offset.
        let kept = match self.settings.lead_s {
            Some(_) => self.history.back(1),
            None => &input.command,
        };
        for ((left, last), command) in self.left.iter_mut().zip(self.last).zip(kept) {
            *left = last - command;
        }
        self.left_done = 0.0;
        self.delayed = false;
        self.fade = Fade::silent();
        self.guard = Guard::new();
        self.quiet = self.reach();
        self.counters.resets = self.counters.resets.wrapping_add(1);
    }

    /// Ticks until set-points from before have left all filters.
    fn reach(&self) -> usize {
        let lag_s = self.laws.iter().map(Law::lag_s).fold(0.0, f64::max);
        // Not negative; a cast saturates.
        let late = (lag_s / self.history.tick_s()) as usize;
        let centre = self.history.latency().saturating_add(late);
        centre.saturating_mul(2).saturating_add(3)
    }

    fn by_slide(&self, places: &[f64; JOINTS], motor_offset: &[f64; JOINTS]) -> [f64; 3] {
        let metre = self.settings.units_per_m;
        self.settings.joint.map(|joint| {
            joint.map_or(0.0, |joint| {
                (at(places, joint) - at(motor_offset, joint)) / metre
            })
        })
    }

    /// The place that is corrected, as all voices see it.
    fn place(&mut self, input: &Input) -> Place {
        let metre = self.settings.units_per_m;
        let latency = self.history.latency();
        let mut place = Place {
            place_m: self.by_slide(self.history.back(latency), &input.motor_offset),
            ..Place::default()
        };
        for (slide, joint) in self.settings.joint.into_iter().enumerate() {
            if let Some(joint) = joint {
                let derivatives = self.history.derivatives(joint);
                let [third, fourth] = &mut place.higher;
                let slots = [
                    &mut place.velocity_m_s,
                    &mut place.acceleration_m_s2,
                    third,
                    fourth,
                ];
                let values = [
                    derivatives.velocity,
                    derivatives.acceleration,
                    derivatives.third,
                    derivatives.fourth,
                ];
                for (slot, value) in slots.into_iter().zip(values) {
                    if let Some(slot) = slot.get_mut(slide) {
                        *slot = value / metre;
                    }
                }
            }
        }
        place.turn = Turn::of(place.velocity_m_s, place.acceleration_m_s2);
        // Half a take-up, and half a tick, because a reversal is noticed so late on average.
        let share = self.history.tick_s() / self.settings.take_up_s;
        let lead = (0.5 / share + 1.0) as usize;
        let mut back = latency.saturating_sub(lead);
        if let Some(lead_s) = self.settings.lead_s {
            // Where a slide will turn nobody can know: it is seen when it has.
            back = 0;
            advance(&mut place, latency as f64 * self.history.tick_s() + lead_s);
        }
        let ahead_m = self.by_slide(self.history.back(back), &input.motor_offset);
        place.sensed = self.senses.tick(ahead_m, share);
        place
    }

    /// The offset that may go out now.
    fn offset(&mut self, wanted: bool, input: &Input) {
        if !wanted && self.fade.is_silent() && self.guard.last_m() == [0.0; 3] {
            return;
        }
        let place = self.place(input);
        let here = Here {
            place_m: place.place_m,
            speed_m_s: place.turn.speed_m_s,
            centripetal_m_s2: place.turn.centripetal_m_s2,
            ccw: place.turn.ccw,
        };
        let law = self.law & 1;
        let mut part = None;
        if let Some(laws) = self.laws.get(law).filter(|_| wanted) {
            self.bounds = [laws.offset_m, laws.slew_m_s];
            part = laws.choose(&here).map(|zone| Part { law, zone });
        }
        if part.is_some() || !wanted {
            self.outside = 0;
        } else {
            self.outside = self.outside.saturating_add(1);
            // A corner at the feed of a rapid is over before anything could fade.
            if (self.outside as f64) * self.history.tick_s() < OUTSIDE_S {
                part = self.fade.heading().filter(|part| part.law == law);
            }
        }
        let offset = self
            .fade
            .tick(part, &self.laws, &place, &self.history, &self.settings);
        let [offset_m, slew_m_s] = self.bounds;
        let verdict = self
            .guard
            .pass(offset, offset_m, slew_m_s, self.history.tick_s());
        let counters = &mut self.counters;
        counters.offset_cuts = counters
            .offset_cuts
            .wrapping_add(u32::from(verdict.offset_cut));
        counters.slew_cuts = counters.slew_cuts.wrapping_add(u32::from(verdict.slew_cut));
    }

    /// Delayed set-point, offset, what is left of an earlier one, soft limits; and the feedback without all that.
    fn put_together(&mut self, input: &Input) -> Output {
        let latency = if self.delayed {
            self.history.latency()
        } else {
            0
        };
        let planned = *self.history.back(latency);
        let step = self.history.tick_s() / self.settings.engage_s;
        self.left_done = (self.left_done + step).min(1.0);
        let left = 1.0 - smooth(self.left_done);
        let offset = self.guard.last_m();
        let mut out = Output {
            command: input.command,
            feedback: input.feedback,
            active: self.delayed || !self.fade.is_silent() || offset != [0.0; 3],
            fault: input.enable && !self.has_table,
            latency_s: latency as f64 * self.history.tick_s(),
        };
        let mut cut = false;
        for joint in 0..JOINTS.min(self.settings.joints) {
            let (planned, given, measured) = (
                at(&planned, joint),
                at(&input.command, joint),
                at(&input.feedback, joint),
            );
            let slide = self.settings.slide.get(joint).copied().flatten();
            let by_law = slide.map_or(0.0, |slide| at(&offset, slide) * self.settings.units_per_m);
            let mut place = planned;
            if left > 0.0 {
                // Between two places that were within the limits.
                place += left * at(&self.left, joint);
            }
            if by_law != 0.0 {
                let motor = at(&input.motor_offset, joint);
                let soft = input.soft.get(joint).copied().unwrap_or([0.0; 2]);
                let near = NEAR_M * self.settings.units_per_m;
                let share = share(place, soft.map(|limit| limit + motor), near);
                place += share * by_law;
                cut |= share < 1.0;
            }
            if let (Some(command), Some(feedback)) =
                (out.command.get_mut(joint), out.feedback.get_mut(joint))
            {
                *command = place;
                if place != given {
                    *feedback = measured - (place - given);
                }
            }
        }
        self.counters.offset_cuts = self.counters.offset_cuts.wrapping_add(u32::from(cut));
        out
    }
}
