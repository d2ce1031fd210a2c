//! What a row of the study asks for: a machine, what is hidden in it, what the campaign suffers from.
use crate::arm::{self, Setting};
use crate::effects::{Case, Hidden, Kind, Null, Slides, Truth};
use crate::machine::base::{Lab, Variety};
use crate::machine::{Pattern, Plane};
use crate::nuisance::Nuisance;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use std::fmt;

/// Scatter between runs and noise within them, of a machine that has no fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scatter {
    /// White noise.
    White,
    /// Noise correlated along the turn.
    Memory,
    /// Scatter in orders 2 to 8.
    Lobes,
    /// Scatter that grows with the feed.
    GrowsWithFeed,
    /// Scatter that grows with the radius.
    GrowsWithRadius,
    /// A set-up that creeps.
    Creep,
}

impl Scatter {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::White,
        Self::Memory,
        Self::Lobes,
        Self::GrowsWithFeed,
        Self::GrowsWithRadius,
        Self::Creep,
    ];
}

/// A row of the study.
#[derive(Clone, Debug, PartialEq)]
pub enum Recipe {
    /// Slides in XY.
    Plain(Kind, Variety),
    /// The same with something that real campaigns have.
    Soiled(Kind, Nuisance),
    /// No fault, this scatter, so many runs (78 at most).
    Null(Scatter, usize),
    /// A wave of any order, parity and law, sized in the loudest sixth of the runs.
    Wave,
    /// Slides in several planes; effects on Z and its pairs.
    Planes(Vec<&'static str>),
    /// Three right angles and three scales from circles of three planes.
    Six,
    /// An arm.
    Arm(Setting),
}

impl Recipe {
    /// The campaign; `None` if an effect has no such name.
    pub fn hidden(&self, strength: f64, seed: u64) -> Option<Hidden> {
        match self {
            Self::Plain(kind, variety) => Some(Case::new(kind, strength, seed, *variety)?.hidden()),
            Self::Soiled(kind, nuisance) => soiled(kind, *nuisance, strength, seed),
            Self::Null(scatter, runs) => null(*scatter, *runs, seed),
            Self::Wave => Some(wave(strength, seed)),
            Self::Planes(names) => {
                let kind = Kind::Effects(names.iter().map(|s| (*s).to_owned()).collect());
                let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x706c_616e_6573);
                let tilt = [
                    rng.random_range(-0.6..0.6),
                    rng.random_range(-0.6..0.6),
                    0.8,
                ];
                let sets = [
                    vec![Plane::ZX],
                    vec![Plane::XY, Plane::YZ, Plane::ZX],
                    vec![Plane::XY, Plane::ZX, Plane::tilted(tilt)],
                ];
                let planes = &sets[rng.random_range(0..sets.len())];
                let slides = Slides {
                    pair: [2, 0],
                    axis: Some(2),
                };
                Some(Case::in_space(&kind, strength, seed, planes, &[slides])?.hidden())
            }
            Self::Six => {
                let kind = Kind::Effects(SIX.iter().map(|s| (*s).to_owned()).collect());
                let slides = [0, 1, 2, 0, 1, 2].map(|k| Slides {
                    pair: Plane::PAIRS[k],
                    axis: None,
                });
                Some(Case::in_space(&kind, strength, seed, &Plane::ALL, &slides)?.hidden())
            }
            Self::Arm(setting) => arm::hidden(
                &Setting {
                    strength,
                    ..setting.clone()
                },
                seed,
            ),
        }
    }
}

/// Of three planes.
const SIX: [&str; 6] = [
    "squareness",
    "squareness",
    "squareness",
    "scale_mismatch",
    "scale_mismatch",
    "scale_error",
];

fn soiled(kind: &Kind, nuisance: Nuisance, strength: f64, seed: u64) -> Option<Hidden> {
    let mut lab = Lab::drawn(seed, Variety::Small);
    nuisance.prepare(&mut lab, seed);
    // A robot's misfit is counted against all that its runs scatter by.
    let total = lab.instrument.noise_m.hypot(lab.instrument.spread.radius_m);
    let strength = if nuisance == Nuisance::Robot {
        strength * total / lab.instrument.noise_m
    } else {
        strength
    };
    let mut hidden = Case::on(kind, strength, seed, lab, &[Slides::XY])?.hidden();
    nuisance.soil(&mut hidden, seed);
    Some(hidden)
}

fn null(scatter: Scatter, runs: usize, seed: u64) -> Option<Hidden> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6e75_6c6c);
    let mut lab = Lab::drawn(seed, Variety::Usual);
    let instrument = &mut lab.instrument;
    instrument.spread.radius_m = rng.random_range(0.3e-6..3e-6);
    let spread = &mut instrument.spread;
    match scatter {
        Scatter::White => {}
        Scatter::Memory => instrument.memory_rad = rng.random_range(0.02..0.5),
        Scatter::Lobes => {
            let each = spread.radius_m * rng.random_range(0.3..1.0);
            (spread.oval_m, spread.lobes_m, spread.high_m) = (each, 0.7 * each, 0.4 * each);
        }
        Scatter::GrowsWithFeed => spread.grows[0] = rng.random_range(0.5..1.5),
        Scatter::GrowsWithRadius => spread.grows[1] = rng.random_range(0.5..1.5),
        Scatter::Creep => {
            instrument.creep_m = [0, 1].map(|_| rng.random_range(-3e-5..3e-5));
        }
    }
    let mut hidden = Case::on(&Kind::Null(Null::Lag), 0.0, seed, lab, &[Slides::XY])?.hidden();
    let all = &mut hidden.campaign.runs;
    if runs < all.len() {
        all.shuffle(&mut rng);
        all.truncate(runs);
        all.sort_by(|a, b| a.file.cmp(&b.file));
        hidden.perfect_um = None;
    }
    Some(hidden)
}

/// Patterns are sized by what is seen where they are loudest: `strength` times all noise, rms over the loudest sixth.
fn wave(strength: f64, seed: u64) -> Hidden {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x7761_7665);
    let mut lab = Lab::drawn(seed, Variety::Usual);
    lab.grid
        .feeds_m_s
        .retain(|f| ![0.15, 0.25, 0.35, 0.45, 0.6].contains(f));
    let plan = lab.grid.plan(seed ^ 0x706c_616e);
    let (order, odd, reach) = loop {
        let order: i32 = rng.random_range(2..=40);
        let odd = rng.random_bool(0.5);
        let reach = [rng.random_range(0..=4), rng.random_range(-2..=2)];
        // What a listed cause makes is no pattern without a name.
        let listed = matches!(
            (order, odd, reach),
            (2, false, [0, 1] | [2, -1]) | (2, true, [1, 0]) | (3, false, [0, 2])
        );
        if !listed {
            break (order, odd, reach.map(f64::from));
        }
    };
    let mut size: Vec<f64> = plan
        .tests
        .iter()
        .map(|t| (t.feed_m_s / 0.5).powf(reach[0]) * (t.radius_m / 0.15).powf(reach[1]))
        .collect();
    size.sort_by(|a, b| b.total_cmp(a));
    let sixth = size.len().div_ceil(6);
    let loud = (size[..sixth].iter().map(|x| 0.5 * x * x).sum::<f64>() / sixth as f64).sqrt();
    let total = lab.instrument.noise_m.hypot(lab.instrument.spread.radius_m);
    let mut machine = lab.machine.clone();
    machine.patterns.push(Pattern::Lobes {
        order: f64::from(order),
        amplitude_m: strength * total / loud,
        phase_rad: rng.random_range(0.0..2.0 * PI),
        odd,
        reach,
    });
    let parity = if odd { "odd" } else { "even" };
    let effect = format!("order {order} {parity} f^{} R^{}", reach[0], reach[1]);
    Hidden {
        name: effect.clone(),
        seed,
        strength,
        noise_m: lab.instrument.noise_m,
        scatter_m: lab.instrument.spread.radius_m,
        truth: vec![Truth::nameless(effect)],
        campaign: lab.instrument.measure(&machine, &plan, seed ^ 0x6d65_6173),
        perfect_um: None,
        model: None,
        kinematics: None,
        spoilt: None,
    }
}

impl fmt::Display for Recipe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plain(kind, Variety::Laws) => write!(f, "{kind}@laws"),
            Self::Plain(kind, _) => write!(f, "{kind}"),
            Self::Soiled(kind, nuisance) => {
                write!(f, "{kind}@{}", format!("{nuisance:?}").to_lowercase())
            }
            Self::Null(scatter, runs) => {
                write!(f, "null_{}_{runs}", format!("{scatter:?}").to_lowercase())
            }
            Self::Wave => f.write_str("unlisted_wave"),
            Self::Planes(names) => write!(f, "{}@z", names.join("+")),
            Self::Six => f.write_str("three_squarenesses+three_scales"),
            Self::Arm(setting) => f.write_str(&arm::hidden::name(setting)),
        }
    }
}
