//! What a machine leaves of a program: its moves through the chain that the model stands for, held against the moves that were meant.
//!
//! Each chain of moves without a corner or a stop is run from rest to rest at the programmed feeds and the acceleration of the
//! options. The effects of the model (backlash, friction, …) are not run: they are not what `compensate` corrects.
use super::chain::{Response, STEP};
use super::path::{Kind, Move};
use std::f64::consts::TAU;

/// Largest contour errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// Of each move of the original, µm; `None` where it was not run.
    pub most_um: Vec<Option<f64>>,
    /// All that could be run was run; otherwise what lies behind the place where the work became too long is missing.
    pub whole: bool,
}

/// Moves that meet by less than this are passed at speed, as a cosine: 3°.
const TANGENT: f64 = 0.9986;
/// Samples that are run at most.
const MOST_SAMPLES: usize = 20_000_000;
/// Way beside that of a sample in which the nearest move is looked for, mm.
const REACH_MM: f64 = 1.0;
/// Distances that are one.
const SAME_MM: f64 = 1e-6;

/// The error that a machine leaves of the contour `meant` when it is driven along `run`: the same moves, or those of the corrected
/// program. `None` where no chain is known for the model, or where `run` is no correction of `meant`.
///
/// ```
/// use giotto::model_file::ModelFile;
/// use giotto_nc::{Options, compensate, contour::contour, path::moves};
/// # use std::path::Path;
///
/// let model = ModelFile::parse(
///     "format = 2\ncampaign = \"lab\"\nmachine = \"mill\"\n\
///      [servo]\nkind = \"lag\"\nkv_per_s = 43.3\n\
///      [valid]\nradius_mm = [20.0, 150.0]\nfeed_mm_s = [5.0, 700.0]",
///     Path::new("model.toml"),
/// )?;
/// let options = Options::default();
/// let program = b"G21 G17 G90\nG0 X-20 Y0\nG1 X0 Y0 F15000\nG3 X50 Y50 I0 J50\nG1 Y80\nM2\n";
/// let meant = moves(program, &options);
/// let corrected = moves(&compensate(program, &model, &options).program, &options);
/// let arc = 2;
/// let left_um = |run| contour(run, &meant, &model, &options).unwrap().most_um[arc].unwrap();
/// // 330 µm inside before, 27 afterwards, where the arc meets its lines.
/// let (before, after) = (left_um(&meant), left_um(&corrected));
/// assert!(before > 300.0 && after < 0.1 * before, "{before} {after}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn contour(
    run: &[Move],
    meant: &[Move],
    model: &giotto::model_file::ModelFile,
    options: &super::Options,
) -> Option<Contour> {
    let machine = Machine {
        response: Response::of(&model.servo)?,
        acceleration_mm_s2: options.acceleration_mm_s2,
    };
    let groups = |list: &[Move]| list.last().map(|m| m.group);
    if groups(run) != groups(meant) {
        return None;
    }
    let mut result = Contour {
        most_um: vec![None; meant.len()],
        whole: true,
    };
    let mut samples = 0;
    let mut begin = 0;
    for driven in run.chunk_by(|a, b| a.group == b.group) {
        let group = driven[0].group;
        let from = begin
            + meant[begin..]
                .iter()
                .take_while(|m| m.group < group)
                .count();
        let count = meant[from..]
            .iter()
            .take_while(|m| m.group == group)
            .count();
        begin = from + count;
        let mut nominal: Vec<(usize, Stretch)> = Vec::new();
        for (k, m) in meant[from..begin].iter().enumerate() {
            nominal.extend(Stretch::of(m).map(|stretch| (from + k, stretch)));
        }
        let mut follower = Follower {
            nominal: &nominal,
            at: 0,
        };
        for chain in chains(driven) {
            samples += machine.samples(&chain);
            if samples > MOST_SAMPLES {
                result.whole = false;
                return Some(result);
            }
            for (p, reach_mm) in machine.driven(&chain) {
                let off_mm = follower.follow(p, reach_mm);
                for index in follower.near(p, reach_mm, off_mm) {
                    let most = result.most_um[index].get_or_insert(0.0);
                    *most = most.max(off_mm * 1e3);
                }
            }
        }
    }
    Some(result)
}

/// A move at a feed, as it is run.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: [f64; 3],
    to: [f64; 3],
    /// Plane, centre, angle.
    arc: Option<([usize; 3], [f64; 2], f64)>,
    feed_mm_s: f64,
    length_mm: f64,
}

impl Stretch {
    /// `None` where too little is known, and for what is not at a feed. An axis that the program has not placed stands still.
    fn of(m: &Move) -> Option<Self> {
        let arc = match m.kind {
            Kind::Line => None,
            Kind::Arc {
                axes,
                centre_mm,
                sweep_rad,
            } => Some((axes, centre_mm, sweep_rad)),
            Kind::Rapid | Kind::Unread => return None,
        };
        let (mut from, mut to) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            match (m.from_mm[axis], m.to_mm[axis]) {
                (Some(a), Some(b)) => (from[axis], to[axis]) = (a, b),
                (None, None) => {}
                _ => return None,
            }
        }
        let mut stretch = Self {
            from,
            to,
            arc,
            feed_mm_s: m.feed_mm_s?,
            length_mm: 0.0,
        };
        let along = match arc {
            Some((axes, centre, sweep)) => {
                let [x, y] = [0, 1].map(|i| from[axes[i]] - centre[i]);
                (x.hypot(y) * sweep).hypot(to[axes[2]] - from[axes[2]])
            }
            None => length([0, 1, 2].map(|i| to[i] - from[i])),
        };
        stretch.length_mm = along;
        (along > 1e-9).then_some(stretch)
    }

    fn at(&self, share: f64) -> [f64; 3] {
        let mut p = [0, 1, 2].map(|i| self.from[i] + share * (self.to[i] - self.from[i]));
        if let Some(([a, b, _], centre, sweep)) = self.arc {
            let (sin, cos) = (share * sweep).sin_cos();
            let r = [self.from[a] - centre[0], self.from[b] - centre[1]];
            // The radius of the end, where the program's rounding makes it another one.
            let end = (self.to[a] - centre[0]).hypot(self.to[b] - centre[1]);
            let start = r[0].hypot(r[1]);
            let grow = 1.0 + share * (end / start - 1.0);
            p[a] = centre[0] + grow * (r[0] * cos - r[1] * sin);
            p[b] = centre[1] + grow * (r[0] * sin + r[1] * cos);
        }
        p
    }

    fn direction(&self, at_end: bool) -> [f64; 3] {
        let (p, q) = if at_end {
            (self.at(1.0 - 1e-6), self.at(1.0))
        } else {
            (self.at(0.0), self.at(1e-6))
        };
        let d = [0, 1, 2].map(|i| q[i] - p[i]);
        let n = length(d).max(1e-300);
        d.map(|v| v / n)
    }

    /// Distance of a point, mm; of an arc in its plane.
    fn distance(&self, p: [f64; 3]) -> f64 {
        if let Some(([a, b, _], centre, sweep)) = self.arc {
            let v = [p[a] - centre[0], p[b] - centre[1]];
            let r = [self.from[a] - centre[0], self.from[b] - centre[1]];
            let turned = sweep.signum() * (v[1].atan2(v[0]) - r[1].atan2(r[0]));
            if turned.rem_euclid(TAU) <= sweep.abs() {
                return (v[0].hypot(v[1]) - r[0].hypot(r[1])).abs();
            }
            let flat = |e: [f64; 3]| (p[a] - e[a]).hypot(p[b] - e[b]);
            return flat(self.from).min(flat(self.to));
        }
        let d = [0, 1, 2].map(|i| self.to[i] - self.from[i]);
        let v = [0, 1, 2].map(|i| p[i] - self.from[i]);
        let dot: f64 = (0..3).map(|i| v[i] * d[i]).sum();
        let u = (dot / (self.length_mm * self.length_mm)).clamp(0.0, 1.0);
        length([0, 1, 2].map(|i| v[i] - u * d[i]))
    }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Moves of one group that are run without a stop.
fn chains(driven: &[Move]) -> Vec<Vec<Stretch>> {
    let mut list: Vec<Vec<Stretch>> = vec![Vec::new()];
    for m in driven {
        let Some(stretch) = Stretch::of(m) else {
            list.push(Vec::new());
            continue;
        };
        let corner = list.last().and_then(|c| c.last()).is_some_and(|last| {
            let (a, b) = (last.direction(true), stretch.direction(false));
            (0..3).map(|i| a[i] * b[i]).sum::<f64>() < TANGENT
        });
        if corner {
            list.push(Vec::new());
        }
        if let Some(chain) = list.last_mut() {
            chain.push(stretch);
        }
    }
    list.retain(|c| !c.is_empty());
    list
}

/// Finds the move that a point of the way belongs to, going forward only.
struct Follower<'a> {
    nominal: &'a [(usize, Stretch)],
    at: usize,
}

impl Follower<'_> {
    /// Moves from the last one on, up to `reach_mm` ahead, with their places in the list.
    fn ahead(&self, reach_mm: f64) -> impl Iterator<Item = (usize, &(usize, Stretch))> {
        let (at, mut ahead) = (self.at, 0.0);
        let list = self.nominal.iter().enumerate().skip(at.saturating_sub(1));
        list.take_while(move |(k, (_, stretch))| {
            let within = ahead <= reach_mm;
            if *k > at {
                ahead += stretch.length_mm;
            }
            within
        })
    }

    /// Goes on to the move nearest to a point; how far off it lies, mm.
    fn follow(&mut self, p: [f64; 3], reach_mm: f64) -> f64 {
        let off = |(k, (_, stretch)): (usize, &(usize, Stretch))| (k, stretch.distance(p));
        let list = || self.ahead(reach_mm).map(off);
        let least = list().map(|(_, off)| off).fold(f64::INFINITY, f64::min);
        // Where the way lies upon itself, the part that comes first.
        let nearest = list().find(|(_, off)| *off <= least + SAME_MM);
        let (k, off) = nearest.unwrap_or((self.at, 0.0));
        self.at = self.at.max(k);
        off
    }

    /// Indices of the moves that lie so near: more than one where a circle is run twice.
    fn near(&self, p: [f64; 3], reach_mm: f64, off_mm: f64) -> impl Iterator<Item = usize> {
        let same = move |stretch: &Stretch| stretch.distance(p) <= off_mm + SAME_MM;
        let near = self
            .ahead(reach_mm)
            .filter(move |(_, (_, stretch))| same(stretch));
        near.map(|(_, (index, _))| *index)
    }
}

/// The machine that is run.
struct Machine {
    response: Response,
    acceleration_mm_s2: f64,
}

impl Machine {
    fn dt_s(&self) -> f64 {
        STEP * self.response.unit_s
    }

    /// About so many samples.
    fn samples(&self, chain: &[Stretch]) -> usize {
        let time_s =
            |s: &Stretch| s.length_mm / s.feed_mm_s + s.feed_mm_s / self.acceleration_mm_s2;
        let moving: f64 = chain.iter().map(time_s).sum();
        ((moving / self.dt_s() + self.response.chain.settling() / STEP) as usize).max(1)
    }

    /// Where the machine goes along a chain, from rest to rest, each with the way that it may be behind or ahead, mm.
    fn driven(&self, chain: &[Stretch]) -> Vec<([f64; 3], f64)> {
        let (mut places, mut speeds) = self.commanded(chain);
        let settling = (self.response.chain.settling() / STEP) as usize;
        let end = chain[chain.len() - 1].at(1.0);
        places.resize(places.len() + settling, end);
        speeds.resize(places.len(), 0.0);
        let start = chain[0].at(0.0);
        let answers = [0, 1, 2].map(|axis| {
            let way: Vec<f64> = places.iter().map(|p| p[axis] - start[axis]).collect();
            self.response.chain.apply(&way)
        });
        let dt = self.dt_s();
        speeds
            .iter()
            .enumerate()
            .map(|(k, v)| {
                let p = [0, 1, 2].map(|axis| start[axis] + answers[axis][k]);
                (p, REACH_MM + 3.0 * v * dt)
            })
            .collect()
    }

    /// Places and speeds of the command at every step of time.
    fn commanded(&self, chain: &[Stretch]) -> (Vec<[f64; 3]>, Vec<f64>) {
        let a = self.acceleration_mm_s2;
        let leaving = self.leaving(chain);
        let dt = self.dt_s();
        let (mut places, mut speeds) = (vec![chain[0].at(0.0)], vec![0.0]);
        let (mut k, mut way, mut speed) = (0, 0.0, 0.0_f64);
        while k < chain.len() {
            let (stretch, out) = (&chain[k], leaving[k]);
            let left = stretch.length_mm - way;
            let brake = (out * out + 2.0 * a * (left - speed * dt).max(0.0)).sqrt();
            let next = (speed + a * dt).min(stretch.feed_mm_s).min(brake);
            let go = (0.5 * (speed + next) * dt).max(1e-6);
            (way, speed) = (way + go, next);
            while k < chain.len() && way >= chain[k].length_mm {
                way -= chain[k].length_mm;
                k += 1;
            }
            if let Some(stretch) = chain.get(k) {
                places.push(stretch.at(way / stretch.length_mm));
                speeds.push(speed);
            }
        }
        (places, speeds)
    }

    /// Speeds at the ends of the stretches, within the acceleration; 0 at the last.
    fn leaving(&self, chain: &[Stretch]) -> Vec<f64> {
        let within = |speed: f64, length: f64| {
            (speed * speed + 2.0 * self.acceleration_mm_s2 * length).sqrt()
        };
        let mut out = vec![0.0; chain.len()];
        let mut speed = 0.0;
        for k in 0..chain.len().saturating_sub(1) {
            speed = within(speed, chain[k].length_mm)
                .min(chain[k].feed_mm_s)
                .min(chain[k + 1].feed_mm_s);
            out[k] = speed;
        }
        let mut speed = 0.0;
        for k in (0..chain.len().saturating_sub(1)).rev() {
            speed = within(speed, chain[k + 1].length_mm);
            out[k] = speed.min(out[k]);
            speed = out[k];
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::model;
    use crate::{Options, compensate, path::moves};
    use giotto::model_file::Servo;

    const PLATE: &str = include_str!("parts/plate.nc");

    fn arcs_um(run: &[u8], servo: Servo) -> Vec<f64> {
        let options = Options::default();
        let meant = moves(PLATE.as_bytes(), &options);
        let found = contour(&moves(run, &options), &meant, &model(servo), &options).unwrap();
        assert!(found.whole);
        let arcs = meant.iter().zip(found.most_um);
        arcs.filter(|(m, _)| matches!(m.kind, Kind::Arc { .. }))
            .map(|(_, um)| um.unwrap())
            .collect()
    }

    /// The bundled part, whose arcs are meant to be corrected to 5 %: here as the page says it.
    #[test]
    fn the_part_before_and_after() {
        for servo in [
            Servo::Lag { kv_per_s: 43.3 },
            Servo::SecondOrder {
                omega_n_rad_s: 60.0,
                zeta: 0.95,
            },
        ] {
            let before = arcs_um(PLATE.as_bytes(), servo);
            let output = compensate(PLATE.as_bytes(), &model(servo), &Options::default());
            let after = arcs_um(&output.program, servo);
            let most = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
            println!("{before:.1?} {after:.1?}");
            assert_eq!(before.len(), after.len());
            assert!(most(&before) > 5.0, "{before:?}");
            assert!(most(&after) < 0.1 * most(&before), "{after:?}");
        }
    }

    /// On a full circle, long after its start, a lag makes the radius smaller by τ²f²/2R: 20 ms, 50 mm/s, 20 mm.
    #[test]
    fn a_lag_is_off_by_its_radius_error() {
        let program = "G21 G17 G90 F3000\nG0 X20 Y0\nG3 I-20\nG3 I-20\nM2\n";
        let options = Options::default();
        let meant = moves(program.as_bytes(), &options);
        let servo = model(Servo::Lag { kv_per_s: 50.0 });
        let found = contour(&meant, &meant, &servo, &options).unwrap();
        // The exact one: R(1 − 1/√(1 + ω²τ²)) = 24.95 µm.
        let expected = 20e3 * (1.0 - 1.0 / 1.0025_f64.sqrt());
        let um = found.most_um[1].unwrap();
        assert!((um / expected - 1.0).abs() < 0.01, "{um} {expected}");
    }

    #[test]
    fn another_program_is_no_correction() {
        let options = Options::default();
        let [a, b] = [
            "G21 G17 G90 F600\nG0 X0 Y0\nG1 X10\n",
            "G21 G17 G90 F600\nG0 X0 Y0\nG0 Z1\nG1 X10\n",
        ]
        .map(|text| moves(text.as_bytes(), &options));
        assert_eq!(
            contour(&a, &b, &model(Servo::Lag { kv_per_s: 50.0 }), &options),
            None
        );
    }
}
