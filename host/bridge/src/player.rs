//! Set-points of a path that is ours: from the robot's own place into the path, along it, and to rest.
use crate::adder::{input, smooth};
use crate::{Path, Place};
use giotto_corrector::{Corrector, LawError, Settings};

/// Farthest that the robot may stand from the first row, mm: more is another place than was meant.
const NEAR_MM: f64 = 2.0;
/// Time in which it is brought there, s.
const EASE_S: f64 = 1.0;
/// Shortest time in which the path gets up to speed again or comes to rest, s.
const SHORTEST_S: f64 = 0.5;
/// Longest loss of the robot over which the path goes on, s.
const BRIDGED_S: f64 = 0.1;

/// Bounds on what a robot is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Speed, mm/s.
    pub speed_mm_s: f64,
    /// Acceleration, mm/s².
    pub acceleration_mm_s2: f64,
    /// Jerk, mm/s³.
    pub jerk_mm_s3: f64,
}

impl Default for Motion {
    /// A tenth to a third of what six-axis robots of 10 to 50 kg do.
    fn default() -> Self {
        Self {
            speed_mm_s: 500.0,
            acceleration_mm_s2: 4000.0,
            jerk_mm_s3: 80_000.0,
        }
    }
}

/// The last four set-points, and what they ask for.
#[derive(Clone, Copy, Debug, Default)]
struct Differences {
    last: [Place; 3],
    count: u32,
}

impl Differences {
    /// Takes a set-point; speed, acceleration and jerk up to it.
    fn take(&mut self, place: Place, cycle_s: f64) -> Motion {
        if self.count == 0 {
            self.last = [place; 3];
        }
        self.count = self.count.saturating_add(1);
        let [a, b, c] = self.last;
        let norm = |weights: [f64; 4], power: i32| {
            let square: f64 = (0..3)
                .map(|axis| {
                    let at = |p: &Place| p.get(axis).copied().unwrap_or(0.0);
                    let [w0, w1, w2, w3] = weights;
                    let sum = w0 * at(&place) + w1 * at(&a) + w2 * at(&b) + w3 * at(&c);
                    sum * sum
                })
                .sum();
            square.sqrt() / cycle_s.powi(power)
        };
        self.last = [place, a, b];
        Motion {
            speed_mm_s: norm([1.0, -1.0, 0.0, 0.0], 1),
            acceleration_mm_s2: norm([1.0, -2.0, 1.0, 0.0], 2),
            jerk_mm_s3: norm([1.0, -3.0, 3.0, -1.0], 3),
        }
    }
}

/// Plays a path, corrected, one set-point a cycle.
#[derive(Clone, Debug)]
pub(crate) struct Player {
    corrector: Box<Corrector>,
    cycle_s: f64,
    motion: Motion,
    /// `None`: holds the place where the robot stands.
    path: Option<Path>,
    /// Where the robot stood beside the first row.
    aside: Place,
    home: Place,
    /// Cycles so far.
    cycles: u64,
    /// Time along the path, s.
    time_s: f64,
    /// Pace of that time: 0 held, 1 as the file says; and where its ramp is.
    ramp: f64,
    /// The ramp's length, s: a path begins at rest by itself; where it is held or stopped the ramp is all there is.
    ramp_s: f64,
    stopping: bool,
    /// Cycles at rest since the end.
    rested: u64,
    differences: Differences,
    /// Highest speed so far, mm/s.
    top_mm_s: f64,
    out: Place,
}

/// What a player says of one cycle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Played {
    pub(crate) target: Place,
    /// What of it is correction.
    pub(crate) offset: Place,
    /// A bound was reached.
    pub(crate) limited: bool,
    /// At rest at its end.
    pub(crate) done: bool,
}

impl Player {
    pub(crate) fn new(
        settings: Settings,
        image: &[u8],
        cycle_s: f64,
        motion: Motion,
        path: Option<Path>,
    ) -> Result<Self, LawError> {
        let mut corrector = Box::new(Corrector::new(settings));
        corrector.load(image)?;
        Ok(Self {
            corrector,
            cycle_s,
            motion,
            path,
            aside: [0.0; 3],
            home: [0.0; 3],
            cycles: 0,
            time_s: 0.0,
            ramp: 0.0,
            ramp_s: SHORTEST_S,
            stopping: false,
            rested: 0,
            differences: Differences::default(),
            top_mm_s: 0.0,
            out: [0.0; 3],
        })
    }

    /// Plays the whole path in thought, from its first row: what it asks of the robot beyond `motion`, in words.
    pub(crate) fn too_much(&self) -> Option<String> {
        let mut twin = self.clone();
        let first = twin.path.as_ref()?.at(0.0);
        twin.start(first).ok()?;
        let mut differences = Differences::default();
        loop {
            let played = twin.cycle();
            let asked = differences.take(played.target, self.cycle_s);
            let pairs = [
                ("speed", asked.speed_mm_s, self.motion.speed_mm_s, "mm/s"),
                (
                    "acceleration",
                    asked.acceleration_mm_s2,
                    self.motion.acceleration_mm_s2,
                    "mm/s²",
                ),
                ("jerk", asked.jerk_mm_s3, self.motion.jerk_mm_s3, "mm/s³"),
            ];
            if let Some((name, asked, most, unit)) = pairs.into_iter().find(|(_, a, b, _)| a > b) {
                return Some(format!(
                    "at {:.3} s of the path the corrected set-points ask for a {name} of {asked:.0} {unit}, allowed are {most:.0}",
                    twin.time_s
                ));
            }
            if played.done {
                return None;
            }
        }
    }

    /// The robot stands here.
    ///
    /// # Errors
    /// Words, if the path begins elsewhere.
    pub(crate) fn start(&mut self, place: Place) -> Result<(), String> {
        let first = self.path.as_ref().map_or(place, |path| path.at(0.0));
        let mut square = 0.0;
        for ((aside, place), first) in self.aside.iter_mut().zip(place).zip(first) {
            *aside = place - first;
            square += *aside * *aside;
        }
        let far = f64::sqrt(square);
        if far > NEAR_MM {
            let [x, y, z] = first;
            return Err(format!(
                "the robot stands {far:.1} mm from the first row ({x:.1}, {y:.1}, {z:.1}); it has to be brought there first, to within {NEAR_MM} mm"
            ));
        }
        self.home = place;
        self.out = place;
        Ok(())
    }

    /// The robot was not heard for so many cycles: it stands, and gets up to speed again.
    pub(crate) fn lost(&mut self, cycles: u32) {
        if f64::from(cycles - 1) * self.cycle_s > BRIDGED_S {
            self.ramp = 0.0;
            self.ramp_s = self.brake_s();
        }
    }

    /// Half of the acceleration and of the jerk is the ramp's: the path has its own.
    fn brake_s(&self) -> f64 {
        let speed = self.top_mm_s;
        (3.75 * speed / self.motion.acceleration_mm_s2)
            .max((11.6 * speed / self.motion.jerk_mm_s3).sqrt())
            .max(SHORTEST_S)
    }

    /// The path comes to rest on itself.
    pub(crate) fn stop(&mut self) {
        self.stopping = true;
        self.ramp_s = self.brake_s();
    }

    /// The path does not move.
    pub(crate) fn at_rest(&self) -> bool {
        self.ramp <= 0.0
    }

    /// The next set-point.
    pub(crate) fn cycle(&mut self) -> Played {
        self.cycles += 1;
        let now_s = self.cycles as f64 * self.cycle_s;
        let eased = smooth(now_s / EASE_S);
        let length_s = self.path.as_ref().map_or(f64::INFINITY, Path::seconds);
        if now_s >= EASE_S {
            let step = self.cycle_s / self.ramp_s;
            self.ramp = (self.ramp + if self.stopping { -step } else { step }).clamp(0.0, 1.0);
            self.time_s = (self.time_s + self.cycle_s * smooth(self.ramp)).min(length_s);
        }
        let planned = self
            .path
            .as_ref()
            .map_or(self.home, |path| path.at(self.time_s));
        let out = self.corrector.tick(&input(planned, true), self.cycle_s);
        let mut target = planned;
        let aside = if self.path.is_some() {
            self.aside
        } else {
            [0.0; 3]
        };
        for ((target, command), aside) in target.iter_mut().zip(out.command).zip(aside) {
            *target = command + (1.0 - eased) * aside;
        }
        let ended = self.time_s >= length_s || (self.stopping && self.ramp <= 0.0);
        let same = target == self.out;
        self.rested = if ended && same { self.rested + 1 } else { 0 };
        self.out = target;
        let asked = self.differences.take(target, self.cycle_s);
        self.top_mm_s = self.top_mm_s.max(asked.speed_mm_s);
        Played {
            target,
            offset: self.corrector.offset_m().map(|m| 1e3 * m),
            limited: asked.speed_mm_s > self.motion.speed_mm_s
                || asked.acceleration_mm_s2 > self.motion.acceleration_mm_s2
                || asked.jerk_mm_s3 > self.motion.jerk_mm_s3,
            // Longer than any latency.
            done: self.rested as f64 * self.cycle_s > 2.0 * EASE_S.min(0.25),
        }
    }
}
