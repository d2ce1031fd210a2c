//! How a stream comes to rest: along the curvature it had last, within acceleration and jerk, from the velocity and the
//! acceleration it had last, so that neither jumps.
//!
//! The speed falls in three pieces: the acceleration turns to that of braking at the limit of jerk, stays there, and returns
//! to none so that it reaches it with the speed. Numbers are single precision, per tick: increments of a path, never places.

use super::FARTHEST_NM;
use core::f32::consts::PI;

/// Velocity below which there is nothing to brake, nm per tick.
const SLOWEST: f32 = 2.0;
/// Below this the curvature is rounding, nm per tick: the brake is some micrometres long, and straight.
const SLOWEST_CURVED: f32 = 64.0;
/// What is left of the acceleration for braking where the curvature takes all, as a share.
const LEAST_SHARE: f32 = 0.3;

/// Places that a brake begins from, nm: the last one, and those 1, 2, 4 and 8 ticks before it.
pub(super) struct Before {
    pub(super) place_nm: [[i32; 3]; 5],
}

/// Limits, nm per tick, per tick² and per tick³.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(super) struct Limits {
    pub(super) feed: f32,
    pub(super) acceleration: f32,
    pub(super) jerk: f32,
}

impl Limits {
    /// Largest acceleration that a brake goes on from, at a speed. Taken back at the limit of jerk, an acceleration a adds
    /// a²/2j to the speed. A sender within feed and jerk has no more of it than leads to its feed, to a tick of jerk, which is
    /// what a difference of set-points is late by. A rougher sender may have more: the brake would then be faster than any
    /// set-point was, so that it begins with less.
    fn growing(&self, speed: f32) -> f32 {
        let room = (self.feed - speed).max(0.0);
        let lawful = libm::sqrtf(2.0 * self.jerk * room) + self.jerk;
        lawful.min(self.acceleration)
    }
}

/// A brake under way.
#[derive(Clone, Debug, Default)]
pub(super) struct Brake {
    /// Ticks since it began.
    tick: f32,
    /// First piece: speed, acceleration and jerk at its start, and its length.
    speed: f32,
    acceleration: f32,
    jerk: f32,
    turning: f32,
    /// Second piece: speed at its start, deceleration, and where it ends.
    turned: f32,
    deceleration: f32,
    held: f32,
    /// Third piece: jerk, and where it ends.
    last_jerk: f32,
    end: f32,
    /// Direction of travel, and the one that it turns to.
    along: [f32; 3],
    across: [f32; 3],
    /// rad per nm, and the acceleration across that it may come to.
    curvature: f32,
    sharpest: f32,
    /// Way of the last tick, nm.
    way: f32,
    /// What is below a nanometre.
    rest: [f32; 3],
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    let ([ax, ay, az], [bx, by, bz]) = (a, b);
    ax * bx + ay * by + az * bz
}

pub(super) fn size(v: [f32; 3]) -> f32 {
    libm::sqrtf(dot(v, v))
}

fn combined(a: [f32; 3], p: f32, b: [f32; 3], q: f32) -> [f32; 3] {
    let ([ax, ay, az], [bx, by, bz]) = (a, b);
    [ax * p + bx * q, ay * p + by * q, az * p + bz * q]
}

fn between(from: [i32; 3], to: [i32; 3]) -> [f32; 3] {
    let ([fx, fy, fz], [tx, ty, tz]) = (from, to);
    [
        tx.wrapping_sub(fx) as f32,
        ty.wrapping_sub(fy) as f32,
        tz.wrapping_sub(fz) as f32,
    ]
}

/// Curvature (1/nm) in the direction it turns to, of places a step apart; `None`: straight, or as good as.
fn bend(now: [i32; 3], before: [i32; 3], first: [i32; 3], step: f32) -> Option<[f32; 3]> {
    let (late, early) = (between(before, now), between(first, before));
    let velocity = combined(late, 0.5 / step, early, 0.5 / step);
    let change = combined(late, 1.0 / (step * step), early, -1.0 / (step * step));
    let square = dot(velocity, velocity);
    let across = combined(change, 1.0, velocity, -dot(change, velocity) / square);
    let curved = square >= SLOWEST_CURVED * SLOWEST_CURVED;
    curved.then(|| combined(across, 1.0 / square, across, 0.0))
}

/// How an acceleration is shared between a turn and the speed.
struct Turn {
    /// Largest centripetal acceleration: that of the curvature, until it and the growth of the speed come to the limit together.
    sharpest: f32,
    /// The same at the largest speed, and what it leaves for braking.
    at_top: f32,
    braking: f32,
}

impl Turn {
    /// From the centripetal acceleration and the growth of the speed at its start, until the speed is `gain` times as large.
    fn at(limit: f32, growth: f32, centripetal: f32, gain: f32) -> Self {
        let left = |taken: f32| libm::sqrtf((limit * limit - taken * taken).max(0.0));
        let sharpest = left(growth).max(centripetal);
        let at_top = (centripetal * gain * gain).min(sharpest);
        Self {
            sharpest,
            at_top,
            braking: left(at_top).max(LEAST_SHARE * limit),
        }
    }
}

impl Brake {
    /// From the last places of a path.
    #[inline(never)]
    pub(super) fn begin(before: &Before, limits: Limits) -> Self {
        let [now, one, two, four, eight] = before.place_nm;
        let (velocity, earlier) = (between(one, now), between(two, one));
        let speed = size(velocity);
        if speed < SLOWEST {
            return Self::default();
        }
        let along = combined(velocity, 1.0 / speed, velocity, 0.0);
        let acceleration = (speed - dot(earlier, along)).min(limits.growing(speed));
        let mut brake = Self {
            along,
            way: speed,
            ..Self::default()
        };
        let square_to = |v: [f32; 3]| combined(v, 1.0, along, -dot(v, along));
        // What the last ticks turned by is right but coarse; what some more of them did is fine, if it is the same still: a path
        // that gains speed out of a turn had a sharper one.
        let last = square_to(combined(velocity, 1.0, earlier, -1.0));
        let across = bend(now, four, eight, 4.0)
            .map(|bend| square_to(combined(bend, speed * speed, bend, 0.0)))
            .filter(|across| size(combined(*across, 1.0, last, -1.0)) < 2.0 * limits.jerk)
            .unwrap_or(last);
        let turning = size(across);
        let centripetal = turning.min(limits.acceleration);
        if centripetal > 0.0 && speed > SLOWEST_CURVED {
            brake.across = combined(across, 1.0 / turning, across, 0.0);
            brake.curvature = centripetal / (speed * speed);
        }
        let growth = acceleration.max(0.0);
        let top = speed + 0.5 * growth * growth / limits.jerk;
        let turn = Turn::at(limits.acceleration, growth, centripetal, top / speed);
        brake.sharpest = turn.sharpest;
        brake.shape(speed, acceleration, turn.braking, limits.jerk);
        brake
    }

    /// The three pieces.
    fn shape(&mut self, speed: f32, acceleration: f32, most: f32, jerk: f32) {
        let square = acceleration * acceleration;
        if acceleration < 0.0 && jerk * speed <= 0.5 * square {
            // Nearly at rest, its deceleration more than the limit of jerk takes back in that speed: as gently as can be.
            self.last_jerk = 0.5 * square / speed;
            self.end = -2.0 * speed / acceleration;
            return;
        }
        // Without a second piece the speed is used up at this deceleration.
        let deceleration = most.min(libm::sqrtf(jerk * speed + 0.5 * square));
        let toward = if acceleration >= -deceleration {
            -jerk
        } else {
            jerk
        };
        (self.speed, self.acceleration, self.jerk) = (speed, acceleration, toward);
        self.turning = (acceleration + deceleration) / -toward;
        self.deceleration = deceleration;
        self.turned = speed + self.turning * (acceleration + 0.5 * toward * self.turning);
        let last = (2.0 * self.turned / deceleration).min(deceleration / jerk);
        self.last_jerk = deceleration / last;
        self.held = self.turning + (self.turned / deceleration - 0.5 * last).max(0.0);
        self.end = self.held + last;
    }

    /// Ticks from its beginning to rest.
    pub(super) fn ticks(&self) -> u32 {
        self.end as u32 + 1
    }

    /// Way in a tick, nm.
    fn speed_at(&self, tick: f32) -> f32 {
        if tick < self.turning {
            self.speed + tick * (self.acceleration + 0.5 * self.jerk * tick)
        } else if tick < self.held {
            self.turned - self.deceleration * (tick - self.turning)
        } else {
            let left = (self.end - tick).max(0.0);
            0.5 * self.last_jerk * left * left
        }
    }

    /// From the last place to the next, nm.
    pub(super) fn step(&mut self) -> [i32; 3] {
        self.tick += 1.0;
        let way = self.speed_at(self.tick).max(0.0);
        let mean = 0.5 * (way + self.way);
        // At rest the second is no number, which is not the less.
        let angle = (self.curvature * mean).min(self.sharpest / mean);
        self.way = way;
        // Some hundredths of a turn at most: what these leave out is below a nanometre.
        let (c, s) = (
            1.0 - 0.5 * angle * angle,
            angle * (1.0 - angle * angle * (1.0 / 6.0)),
        );
        (self.along, self.across) = (
            combined(self.along, c, self.across, s),
            combined(self.across, c, self.along, -s),
        );
        let mut whole = [0; 3];
        for ((whole, rest), along) in whole.iter_mut().zip(&mut self.rest).zip(self.along) {
            let exact = *rest + along * way;
            *whole = exact as i32;
            *rest = exact - *whole as f32;
        }
        whole
    }
}

/// Whether a path that is led from a place at a velocity (nm per tick), which changes (nm per tick²), can stop within the
/// coordinates, wherever it goes and one tick later. Mostly one comparison: few are so near their end.
pub(super) fn has_room(
    limits: Limits,
    place: [i32; 3],
    velocity: [i32; 3],
    change: [i32; 3],
) -> bool {
    /// Farther from the end of the coordinates than any brake is long.
    const FAR_NM: u32 = FARTHEST_NM as u32 / 2;
    let most = place.iter().fold(0, |most, nm| nm.unsigned_abs().max(most));
    if most < FAR_NM {
        return true;
    }
    let Limits {
        acceleration, jerk, ..
    } = limits;
    // At most: as `farthest_nm`, straight outward and with what is left if all of the change is across.
    let speed = size(velocity.map(|nm| nm as f32));
    let growth = size(change.map(|nm| nm as f32)).min(acceleration);
    let top = speed + growth * (1.0 + 0.5 * growth / jerk);
    let growing = growth / jerk * top;
    let left = Turn::at(acceleration, growth, growth, top / speed.max(1.0)).braking;
    let braked = 0.5 * top * (top / left + acceleration / jerk);
    most as f32 + 2.0 * top + growing + braked < FARTHEST_NM as f32
}

/// Farthest that a brake leads outward, nm, from a velocity and its change; `outward` is a unit vector. All per tick.
///
/// At most: an acceleration is taken back at the limit of jerk, while the speed still grows; then the path goes on along the
/// curvature that velocity and change have, which leaves less for braking and may turn outward what was not.
pub(crate) fn farthest_nm(
    [acceleration, jerk]: [f32; 2],
    velocity: [f32; 3],
    change: [f32; 3],
    outward: [f32; 3],
) -> f32 {
    let speed = size(velocity);
    if speed < SLOWEST {
        return 0.0;
    }
    let along = combined(velocity, 1.0 / speed, velocity, 0.0);
    let growth = dot(change, along);
    let across = combined(change, 1.0, along, -growth);
    // Not `clamp`: it panics at a limit that is no number.
    let growth = growth.max(0.0).min(acceleration);
    let bend = libm::sqrtf(dot(across, across));
    let centripetal = bend.min(acceleration);
    let top = speed + 0.5 * growth * growth / jerk;
    let turn = Turn::at(acceleration, growth, centripetal, top / speed);
    let most = turn.braking;
    let growing = growth / jerk * (speed + growth * growth / (3.0 * jerk));
    let length = growing + 0.5 * top * (top / most + most / jerk);
    // Outward share of where it goes and of where it turns to.
    let u = dot(along, outward);
    let n = if bend > 0.0 {
        dot(across, outward) / bend
    } else {
        0.0
    };
    // As sharp as it begins, or as little as where it is fastest.
    let [sharp, slight] = [centripetal / (speed * speed), turn.at_top / (top * top)];
    reach(sharp, length, u, n).max(reach(slight, length, u, n))
}

/// Farthest outward on an arc of a curvature and a length, which begins with the outward shares u of its direction and n of where it
/// turns to.
fn reach(curvature: f32, length: f32, u: f32, n: f32) -> f32 {
    let angle = curvature * length;
    if angle < 1e-3 {
        return length * (u + 0.5 * n * angle).max(0.0);
    }
    if angle > PI {
        return (n + libm::sqrtf(u * u + n * n)) / curvature;
    }
    // (u sin + n (1 − cos))/κ has its largest where it goes square to outward, or at the end.
    let square = libm::atan2f(u, -n);
    let end = if u > 0.0 { square.min(angle) } else { angle };
    let turned = u * libm::sinf(end) + n * (1.0 - libm::cosf(end));
    turned.max(0.0) / curvature
}
