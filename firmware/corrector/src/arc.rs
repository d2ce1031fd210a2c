//! The circle that the path is on at the place that is corrected, from its derivatives.
use crate::law::STRAIGHT_M_S2;
use crate::senses::smooth;

/// Below this speed a path has no direction, m/s.
const STANDING_M_S: f64 = 1e-5;
/// Time in which what belongs to circles alone fades in and out, s.
const FADE_S: f64 = 0.05;
/// What a radius may be beyond a zone's and still count as meant, share.
const SLACK: f64 = 0.02;

/// Farthest that a path is followed ahead along its circle, rad: beyond a quarter of a turn it is guesswork.
const FARTHEST_RAD: f64 = core::f64::consts::FRAC_PI_2;

/// How the path turns.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Turn {
    pub(crate) speed_m_s: f64,
    pub(crate) centripetal_m_s2: f64,
    /// Unit vector along the path; zero where it stands or is straight.
    along: [f64; 3],
    /// Unit vector away from the centre; zero where it is straight.
    pub(crate) outward: [f64; 3],
    /// Infinite where it is straight.
    pub(crate) radius_m: f64,
    pub(crate) ccw: Option<bool>,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    let ([ax, ay, az], [bx, by, bz]) = (a, b);
    ax * bx + ay * by + az * bz
}

impl Turn {
    pub(crate) fn of(velocity: [f64; 3], acceleration: [f64; 3]) -> Self {
        let square = dot(velocity, velocity);
        let speed_m_s = libm::sqrt(square);
        let straight = Self {
            speed_m_s,
            radius_m: f64::INFINITY,
            ..Self::default()
        };
        if speed_m_s < STANDING_M_S {
            return straight;
        }
        let along = dot(acceleration, velocity) / square;
        let ([vx, vy, vz], [ax, ay, az]) = (velocity, acceleration);
        let across = [ax - along * vx, ay - along * vy, az - along * vz];
        let centripetal_m_s2 = libm::sqrt(dot(across, across));
        if centripetal_m_s2 < STRAIGHT_M_S2 {
            return straight;
        }
        let [x, y, z] = [vy * az - vz * ay, vz * ax - vx * az, vx * ay - vy * ax];
        let largest =
            [x, y, z].into_iter().fold(
                0.0f64,
                |most, c| if c.abs() > most.abs() { c } else { most },
            );
        Self {
            speed_m_s,
            centripetal_m_s2,
            along: velocity.map(|c| c / speed_m_s),
            outward: across.map(|c| -c / centripetal_m_s2),
            radius_m: square / centripetal_m_s2,
            ccw: Some(largest > 0.0),
        }
    }
}

/// The path after some time more on its circle or line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ahead {
    along: [f64; 3],
    outward: [f64; 3],
    /// Of the angle that it turns by until then.
    sin: f64,
    cos: f64,
    /// Way to the place there, m.
    pub(crate) way_m: [f64; 3],
}

impl Ahead {
    /// `time_s` after a place with this velocity.
    pub(crate) fn after(turn: &Turn, velocity_m_s: [f64; 3], time_s: f64) -> Self {
        let angle = if turn.radius_m.is_finite() {
            (turn.speed_m_s / turn.radius_m * time_s).min(FARTHEST_RAD)
        } else {
            0.0
        };
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let mut way_m = velocity_m_s.map(|velocity| velocity * time_s);
        if angle > 0.0 {
            for ((way, along), outward) in way_m.iter_mut().zip(turn.along).zip(turn.outward) {
                *way = turn.radius_m * (sin * along - (1.0 - cos) * outward);
            }
        }
        Self {
            along: turn.along,
            outward: turn.outward,
            sin,
            cos,
            way_m,
        }
    }

    /// A vector that turns with the path.
    pub(crate) fn turned(&self, vector: [f64; 3]) -> [f64; 3] {
        let (t, n) = (dot(vector, self.along), dot(vector, self.outward));
        let mut turned = vector;
        for ((turned, along), outward) in turned.iter_mut().zip(self.along).zip(self.outward) {
            *turned += (self.cos * t + self.sin * n - t) * along
                + (self.cos * n - self.sin * t - n) * outward;
        }
        turned
    }
}

/// What belongs to circles alone, faded in while the path is on one within these radii.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OnArc {
    outward: [f64; 3],
    radius_m: f64,
    share: f64,
}

impl OnArc {
    pub(crate) const fn new() -> Self {
        Self {
            outward: [0.0; 3],
            radius_m: 0.0,
            share: 0.0,
        }
    }

    /// One tick: how much of it acts, away from the centre, and the vector from the centre, m.
    pub(crate) fn tick(
        &mut self,
        turn: &Turn,
        within_m: [f64; 2],
        tick_s: f64,
    ) -> (f64, [f64; 3], [f64; 3]) {
        let [least, most] = within_m;
        let on = turn.radius_m >= least * (1.0 - SLACK) && turn.radius_m <= most * (1.0 + SLACK);
        let step = tick_s / FADE_S;
        if on {
            (self.outward, self.radius_m) = (turn.outward, turn.radius_m);
        }
        self.share = (self.share + if on { step } else { -step }).clamp(0.0, 1.0);
        let arm = self.outward.map(|c| c * self.radius_m);
        (smooth(self.share), self.outward, arm)
    }
}
