//! What a machine leaves of a contour: the moves of a program through a plant whose laws are not the host's.
use super::grbl::{self, Move};
use crate::machine::linear::{Average, Lag, SecondOrder};

/// One axis of the plant, the same for all.
#[derive(Clone, Copy, Debug)]
pub enum Plant {
    /// 1/(1 + sτ).
    Lag(f64),
    /// A lag behind a moving average.
    LagAverage(f64, f64),
    /// ωn, ζ.
    SecondOrder(f64, f64),
}

/// Time step, s.
const STEP_S: f64 = 2.5e-4;
/// Acceleration along the path, mm/s².
const ACCELERATION: f64 = 5000.0;
/// A corner sharper than this is a stop, as a cosine.
const TANGENT: f64 = 0.998;

/// Deviation of a machine from a contour, µm, positive to the left of travel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Farthest to the left.
    pub left_um: f64,
    /// Farthest to the right, as a positive number.
    pub right_um: f64,
}

impl Deviation {
    /// The farthest to either side.
    pub fn most_um(self) -> f64 {
        self.left_um.max(self.right_um)
    }
}

/// A stretch in a plane, mm.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: [f64; 3],
    to: [f64; 3],
    arc: Option<Arc>,
    axes: [usize; 3],
    feed: f64,
}

#[derive(Clone, Copy, Debug)]
struct Arc {
    centre: [f64; 2],
    angle: f64,
}

impl Stretch {
    fn flat(&self, p: [f64; 3]) -> [f64; 2] {
        [p[self.axes[0]], p[self.axes[1]]]
    }

    fn length(&self) -> f64 {
        let climb = self.to[self.axes[2]] - self.from[self.axes[2]];
        let [a, b] = [self.flat(self.from), self.flat(self.to)];
        let along = match self.arc {
            Some(arc) => (a[0] - arc.centre[0]).hypot(a[1] - arc.centre[1]) * arc.angle.abs(),
            None => (b[0] - a[0]).hypot(b[1] - a[1]),
        };
        along.hypot(climb)
    }

    fn at(&self, share: f64) -> [f64; 3] {
        let mut p = [0, 1, 2].map(|i| self.from[i] + share * (self.to[i] - self.from[i]));
        if let Some(arc) = self.arc {
            let a = self.flat(self.from);
            let (sin, cos) = (share * arc.angle).sin_cos();
            let r = [a[0] - arc.centre[0], a[1] - arc.centre[1]];
            p[self.axes[0]] = arc.centre[0] + r[0] * cos - r[1] * sin;
            p[self.axes[1]] = arc.centre[1] + r[0] * sin + r[1] * cos;
        }
        p
    }

    fn direction(&self, at_end: bool) -> [f64; 2] {
        let (p, q) = if at_end {
            (self.at(1.0 - 1e-6), self.at(1.0))
        } else {
            (self.at(0.0), self.at(1e-6))
        };
        let (p, q) = (self.flat(p), self.flat(q));
        let n = (q[0] - p[0]).hypot(q[1] - p[1]).max(1e-300);
        [(q[0] - p[0]) / n, (q[1] - p[1]) / n]
    }

    /// Distance of a point in the plane, mm, and the same with its sign, positive to the left.
    fn distance(&self, p: [f64; 2]) -> (f64, f64) {
        let [a, b] = [self.flat(self.from), self.flat(self.to)];
        let (off, own) = match self.arc {
            Some(arc) => {
                let v = [p[0] - arc.centre[0], p[1] - arc.centre[1]];
                let r = [a[0] - arc.centre[0], a[1] - arc.centre[1]];
                let side = arc.angle.signum();
                let turned = (side * (v[1].atan2(v[0]) - r[1].atan2(r[0])))
                    .rem_euclid(std::f64::consts::TAU);
                let off = side * (r[0].hypot(r[1]) - v[0].hypot(v[1]));
                (off, turned <= arc.angle.abs())
            }
            None => {
                let d = [b[0] - a[0], b[1] - a[1]];
                let l = d[0].hypot(d[1]);
                let v = [p[0] - a[0], p[1] - a[1]];
                let along = (v[0] * d[0] + v[1] * d[1]) / (l * l);
                (
                    (d[0] * v[1] - d[1] * v[0]) / l,
                    (0.0..=1.0).contains(&along),
                )
            }
        };
        if own {
            return (off.abs(), off);
        }
        let ends = [a, b].map(|e| (p[0] - e[0]).hypot(p[1] - e[1]));
        let near = ends[0].min(ends[1]);
        (near, near.copysign(off))
    }
}

/// The parts of a program that are run without a stop.
fn chains(program: &str) -> Vec<Vec<Stretch>> {
    let (moves, refused) = grbl::read(program);
    assert_eq!(refused, None, "{program}");
    let mut chains: Vec<Vec<Stretch>> = vec![Vec::new()];
    let mut at = [0.0; 3];
    for m in moves {
        let to = m.end.map(f64::from);
        let stretch = stretch(at, to, &m);
        at = to;
        if m.rapid {
            chains.push(Vec::new());
            continue;
        }
        if stretch.length() < 1e-9 {
            continue;
        }
        let last = chains.last().and_then(|c| c.last());
        let corner = last.is_some_and(|l| {
            let (a, b) = (l.direction(true), stretch.direction(false));
            a[0] * b[0] + a[1] * b[1] < TANGENT
        });
        if corner {
            chains.push(Vec::new());
        }
        chains.last_mut().expect("one is there").push(stretch);
    }
    chains.retain(|c| !c.is_empty());
    chains
}

fn stretch(from: [f64; 3], to: [f64; 3], m: &Move) -> Stretch {
    let arc = (m.angle_rad != 0.0).then(|| {
        let centre = m.centre.map(f64::from);
        let [a, b, _] = m.plane;
        // The angle anew from these ends, which 32 bits have rounded.
        let angle = |p: [f64; 3]| (p[b] - centre[1]).atan2(p[a] - centre[0]);
        let raw = angle(to) - angle(from) - f64::from(m.angle_rad);
        let turn = std::f64::consts::TAU;
        Arc {
            centre,
            angle: f64::from(m.angle_rad) + (raw + 0.5 * turn).rem_euclid(turn) - 0.5 * turn,
        }
    });
    Stretch {
        from,
        to,
        arc,
        axes: m.plane,
        feed: f64::from(m.feed_mm_min) / 60.0,
    }
}

/// The speed that a controller reaches along a chain from rest to rest: each stretch at its feed, slowed down ahead of a slower
/// one.
struct Course<'a> {
    chain: &'a [Stretch],
    /// Way at the end of each stretch, mm.
    ends: Vec<f64>,
}

impl<'a> Course<'a> {
    fn new(chain: &'a [Stretch]) -> Self {
        let ends = chain
            .iter()
            .scan(0.0, |way, stretch| {
                *way += stretch.length();
                Some(*way)
            })
            .collect();
        Self { chain, ends }
    }

    fn total(&self) -> f64 {
        self.ends.last().copied().unwrap_or(0.0)
    }

    /// Highest speed at a way from which all that follows and all that went before can be met, mm/s.
    fn speed(&self, way: f64) -> f64 {
        let within = |distance: f64, speed: f64| {
            (speed * speed + 2.0 * ACCELERATION * distance.max(0.0)).sqrt()
        };
        let mut most = within(way, 0.0).min(within(self.total() - way, 0.0));
        let mut from = 0.0;
        for (stretch, to) in self.chain.iter().zip(&self.ends) {
            let distance = (from - way).max(way - to).max(0.0);
            most = most.min(within(distance, stretch.feed));
            from = *to;
        }
        most
    }

    fn place(&self, way: f64) -> [f64; 3] {
        let k = self
            .ends
            .partition_point(|end| *end < way)
            .min(self.chain.len() - 1);
        let stretch = &self.chain[k];
        let length = stretch.length();
        stretch.at(((way - self.ends[k]) / length + 1.0).clamp(0.0, 1.0))
    }

    /// Ways at every time step, to the end.
    fn ways(&self) -> Vec<f64> {
        // Finer than the plant's, for the ramps last a few steps.
        let parts = 20;
        let dt = STEP_S / f64::from(parts);
        let total = self.total();
        let (mut way, mut speed) = (0.0, 0.0);
        let mut ways = vec![0.0];
        while way < total - 1e-7 {
            for _ in 0..parts {
                let faster: f64 = speed + ACCELERATION * dt;
                let ahead = way + speed * dt + 0.5 * ACCELERATION * dt * dt;
                let next = faster.min(self.speed(ahead.min(total)));
                way += 0.5 * (speed + next) * dt;
                speed = next;
            }
            // The last step to rest is a tenth of a micrometre.
            let still = speed * dt < 1e-9;
            ways.push(if still { total } else { way.min(total) });
            if still {
                break;
            }
        }
        ways
    }
}

/// Where the plant goes along a chain, from rest to rest.
fn driven(plant: Plant, chain: &[Stretch]) -> Vec<[f64; 3]> {
    let course = Course::new(chain);
    let mut ways = course.ways();
    let settling = (0.6 / STEP_S) as usize;
    ways.extend(std::iter::repeat_n(course.total(), settling));
    let start = chain[0].at(0.0);
    let mut axes: Vec<Box<dyn FnMut(f64) -> f64>> = start.iter().map(|p| axis(plant, *p)).collect();
    ways.into_iter()
        .map(|way| {
            let p = course.place(way);
            [0, 1, 2].map(|i| axes[i](p[i]))
        })
        .collect()
}

fn axis(plant: Plant, at: f64) -> Box<dyn FnMut(f64) -> f64> {
    match plant {
        Plant::Lag(tau) => {
            let mut lag = Lag::new(tau, 0.0, STEP_S, at);
            Box::new(move |u| lag.step(u))
        }
        Plant::LagAverage(tau, window) => {
            let mut lag = Lag::new(tau, 0.0, STEP_S, at);
            let mut average = Average::new(window, STEP_S, at);
            Box::new(move |u| lag.step(average.step(u)))
        }
        Plant::SecondOrder(omega, zeta) => {
            let mut second = SecondOrder::new(omega, zeta, STEP_S, at);
            Box::new(move |u| second.step(u))
        }
    }
}

/// What the plant leaves of each chain of `nominal` when it is driven by `program`.
///
/// # Panics
/// The programs are not run in as many chains.
pub fn deviations(plant: Plant, program: &str, nominal: &str) -> Vec<Deviation> {
    let (driven_chains, meant) = (chains(program), chains(nominal));
    assert_eq!(
        driven_chains.len(),
        meant.len(),
        "another stop in\n{program}"
    );
    let one = |(chain, meant): (&Vec<Stretch>, &Vec<Stretch>)| {
        let mut most = Deviation::default();
        for p in driven(plant, chain) {
            let off = meant
                .iter()
                .map(|s| s.distance(s.flat(p)))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .map_or(0.0, |(_, off)| off);
            most.left_um = most.left_um.max(off * 1e3);
            most.right_um = most.right_um.max(-off * 1e3);
        }
        most
    };
    driven_chains.iter().zip(&meant).map(one).collect()
}

/// Parts of a circle whose walls are told apart.
const PARTS: usize = 720;

/// What the plant leaves of the wall of a circle about a centre, µm: the least and the most, positive where material is left,
/// negative where it goes too deep. The wall is cut by all moves but rapids. `hole`: the material lies outside.
///
/// # Panics
/// The program does not go all the way round.
pub fn wall_um(plant: Plant, program: &str, centre: [f64; 2], radius: f64, hole: bool) -> [f64; 2] {
    let mut reached = [f64::NAN; PARTS];
    for chain in chains(program) {
        for p in driven(plant, &chain) {
            let [x, y] = [p[0] - centre[0], p[1] - centre[1]];
            let turn = y.atan2(x) / std::f64::consts::TAU;
            let part = (turn.rem_euclid(1.0) * PARTS as f64) as usize % PARTS;
            let off = if hole {
                radius - x.hypot(y)
            } else {
                x.hypot(y) - radius
            };
            // The minimum of a number and NaN is the number.
            reached[part] = off.min(reached[part]);
        }
    }
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    reached.iter().fold(start, |[least, most], off| {
        assert!(!off.is_nan(), "not all the way round in\n{program}");
        [least.min(off * 1e3), most.max(off * 1e3)]
    })
}
