//! A hidden campaign from a seed: a laboratory, its effects, and the truth about them.
use super::{Effect, Hidden, Seat, Slides, left_um, listed_on, other_law, scaled, unlisted};
use crate::machine::base::{Lab, Variety};
use crate::machine::{Instrument, Machine, Plan, Plane, Spread};
use giotto::campaign::{Campaign, Run};

/// What a campaign hides.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Nothing, in four ways.
    Null(Null),
    /// One or several effects by name.
    Effects(Vec<String>),
    /// An effect whose residuals have been dealt to other runs: no cause fits them.
    Permuted(String),
}

/// Ways of hiding nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Null {
    /// A perfect machine and a noisy instrument.
    Noise,
    /// Noise and spread between runs.
    Spread,
    /// Noise, spread and a servo lag that the baseline has to fit.
    Lag,
    /// Noise, spread and second-order mechanics that are handed over as `--model`.
    Model,
}

/// The truth about one hidden effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Name of the effect.
    pub effect: String,
    /// Causes that count as right.
    pub accept: Vec<String>,
    /// What it belongs to.
    pub seat: Seat,
    /// True value, of a pair that of the pair it was hidden on.
    pub value: f64,
    /// Values for the pairs XY, YZ and ZX, where it belongs to two slides: another pair may show it too.
    pub by_pair: Option<[f64; 3]>,
    /// Its unit.
    pub unit: String,
    /// Misfit it causes alone, m.
    pub misfit_m: f64,
}

impl Truth {
    /// An effect that no cause of the list names.
    pub fn nameless(effect: String) -> Self {
        Self {
            effect,
            accept: Vec::new(),
            seat: Seat::Whole,
            value: f64::NAN,
            by_pair: None,
            unit: String::new(),
            misfit_m: f64::NAN,
        }
    }
}

/// A hidden campaign.
pub struct Case {
    /// Name.
    pub name: String,
    /// Seed.
    pub seed: u64,
    /// Wanted misfit of each effect, in units of the sample noise.
    pub strength: f64,
    /// Instrument, with noise and spread.
    pub instrument: Instrument,
    /// Machine without the effects.
    pub base: Machine,
    /// Machine with them.
    pub machine: Machine,
    /// Tests.
    pub plan: Plan,
    /// Truth about each effect.
    pub truth: Vec<Truth>,
    /// Seed of the measurement (phases, spread, noise).
    pub measured_with: u64,
    /// What was measured.
    pub campaign: Campaign,
    /// Second-order model (ωn rad/s, ζ) to be given as `--model`.
    pub model: Option<[f64; 2]>,
}

impl Case {
    /// Draws a laboratory under `seed`, hides `kind` in it at `strength` times the sample noise, measures.
    /// `None` if an effect has no such name.
    pub fn new(kind: &Kind, strength: f64, seed: u64, variety: Variety) -> Option<Self> {
        Self::on(
            kind,
            strength,
            seed,
            Lab::drawn(seed, variety),
            &[Slides::XY],
        )
    }

    /// The same with circles in other planes, three radii and half of the feeds in each; effects sit on `slides`, one
    /// after the other (the last for all that are left).
    pub fn in_space(
        kind: &Kind,
        strength: f64,
        seed: u64,
        planes: &[Plane],
        slides: &[Slides],
    ) -> Option<Self> {
        let mut lab = Lab::drawn(seed, Variety::Small);
        lab.grid.planes = planes.to_vec();
        Self::on(kind, strength, seed, lab, slides)
    }

    /// Hides `kind` in a laboratory.
    pub fn on(kind: &Kind, strength: f64, seed: u64, lab: Lab, slides: &[Slides]) -> Option<Self> {
        let (mut base, mut instrument) = (lab.machine, lab.instrument);
        let seat_of = |index: usize| {
            let place = index.min(slides.len().saturating_sub(1));
            slides.get(place).copied().unwrap_or(Slides::XY)
        };
        let plan = lab.grid.plan(seed ^ 0x706c_616e);
        let mut model = None;
        let effects: Vec<Effect> = match kind {
            Kind::Null(null) => {
                match null {
                    Null::Noise | Null::Spread => base = Machine::default(),
                    Null::Lag => {}
                    Null::Model => {
                        let omega_zeta = [
                            30.0 + 30.0 * fraction(seed, 1),
                            0.6 + 0.2 * fraction(seed, 2),
                        ];
                        base = Machine::default();
                        base.axes
                            .iter_mut()
                            .for_each(|a| a.mechanics = Some(omega_zeta));
                        model = Some(omega_zeta);
                    }
                }
                if *null == Null::Noise {
                    instrument.spread = Spread {
                        radius_m: 0.0,
                        oval_m: 0.0,
                        lobes_m: 0.0,
                        high_m: 0.0,
                        ..instrument.spread
                    };
                    instrument.drift_m = 0.0;
                }
                Vec::new()
            }
            Kind::Effects(names) => {
                let effects: Option<Vec<_>> = names
                    .iter()
                    .zip(1_u64..)
                    .map(|(n, i)| {
                        listed_on(n, seed.wrapping_mul(31) + i, seat_of(i as usize - 1))
                            .or_else(|| unlisted(n, seed.wrapping_mul(31) + i))
                            .or_else(|| other_law(n, seed.wrapping_mul(31) + i))
                    })
                    .collect();
                effects?
            }
            Kind::Permuted(name) => {
                vec![listed_on(name, seed, seat_of(0)).or_else(|| unlisted(name, seed))?]
            }
        };
        let mut machine = base.clone();
        let mut truth = Vec::new();
        // An effect is sized on whole turns: what a start and a stop do is none of it.
        let mut sized_on = plan.clone();
        sized_on.tests.iter_mut().for_each(|t| t.from_rest = false);
        for effect in &effects {
            // Each is sized alone on the bare machine, then put on top of those before it.
            let wanted_m = strength * instrument.noise_m;
            let (alone, misfit_m) = scaled(effect, &base, &sized_on, wanted_m);
            machine = merged(machine, &base, &alone);
            let pair = match effect.seat {
                Seat::Pair(pair) => pair,
                _ => Plane::PAIRS[0],
            };
            truth.push(Truth {
                effect: effect.name.to_owned(),
                accept: effect.accept.iter().map(|s| (*s).to_owned()).collect(),
                seat: effect.seat,
                value: (effect.value)(&alone, &plan, pair),
                by_pair: matches!(effect.seat, Seat::Pair(_))
                    .then(|| Plane::PAIRS.map(|pair| (effect.value)(&alone, &plan, pair))),
                unit: effect.unit.to_owned(),
                misfit_m,
            });
        }
        together(&mut truth);
        if lab.grid.planes.len() > 1 {
            scales_by_slide(&mut truth, &machine, &base);
        }
        let measured_with = seed ^ 0x6d65_6173;
        let mut campaign = instrument.measure(&machine, &plan, measured_with);
        if matches!(kind, Kind::Permuted(_)) {
            truth.clear();
            deal_residuals(&mut campaign, &base, &plan, &instrument, seed);
        }
        Some(Self {
            name: kind.to_string(),
            measured_with,
            seed,
            strength,
            instrument,
            base,
            machine,
            plan,
            truth,
            campaign,
            model,
        })
    }
}

/// Effects of one name on several pairs add up in each pair: two slides with scales of their own make a third
/// difference.
fn together(truth: &mut [Truth]) {
    let all: Vec<(String, [f64; 3])> = truth
        .iter()
        .filter_map(|t| t.by_pair.map(|v| (t.effect.clone(), v)))
        .collect();
    for t in truth {
        let (Some(values), Seat::Pair(pair)) = (&mut t.by_pair, t.seat) else {
            continue;
        };
        *values = [0, 1, 2].map(|k| {
            let same = all.iter().filter(|(name, _)| *name == t.effect);
            same.map(|(_, v)| v[k]).sum()
        });
        // A pair has the number of its first slide.
        t.value = values[pair[0]];
    }
}

/// Circles of several planes tell the scale of each slide that they move, and differences of scales are no thing beside those.
fn scales_by_slide(truth: &mut Vec<Truth>, machine: &Machine, base: &Machine) {
    /// Below this share of the largest a scale is that of a slide that nothing was done to.
    const SOMETHING: f64 = 1e-3;
    let is_scale = |t: &Truth| matches!(t.effect.as_str(), "scale_error" | "scale_mismatch");
    let Some(first) = truth.iter().find(|t| is_scale(t)).cloned() else {
        return;
    };
    let scale = [0, 1, 2].map(|k| 1e6 * (machine.geometry.scale[k] - base.geometry.scale[k]));
    let largest = scale.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    truth.retain(|t| !is_scale(t));
    for (slide, value) in scale.into_iter().enumerate() {
        if value.abs() > SOMETHING * largest {
            truth.push(Truth {
                effect: "scale_error".into(),
                accept: vec!["scale_error".into()],
                seat: Seat::Slide(slide),
                value,
                by_pair: None,
                unit: "um/m".into(),
                ..first.clone()
            });
        }
    }
}

impl Case {
    /// What is handed over, with its truth.
    pub fn hidden(&self) -> Hidden {
        Hidden {
            name: self.name.clone(),
            seed: self.seed,
            strength: self.strength,
            noise_m: self.instrument.noise_m,
            scatter_m: self.instrument.spread.radius_m,
            truth: self.truth.clone(),
            campaign: self.campaign.clone(),
            perfect_um: (self.campaign.runs.len() == self.plan.tests.len())
                .then(|| self.perfect_um()),
            model: self.model,
            kinematics: None,
            spoilt: None,
        }
    }

    /// What the true machine leaves of the measurement, rms over all samples, each run's centre removed, µm. The phase of
    /// a vibration, the places of teeth and where on the circle a polygon has its corners are new in each run: no model
    /// could foretell them, so they count as left (of a polygon all but its mean).
    pub fn perfect_um(&self) -> f64 {
        let case = self;
        let perfect = Instrument {
            noise_m: 0.0,
            resolution_m: 0.0,
            drift_m: 0.0,
            jitter_s: 0.0,
            ..case.instrument
        };
        let perfect = Instrument {
            spread: crate::machine::Spread {
                radius_m: 0.0,
                oval_m: 0.0,
                lobes_m: 0.0,
                high_m: 0.0,
                ..perfect.spread
            },
            ..perfect
        };
        let mut machine = case.machine.clone();
        machine.vibration = None;
        machine
            .axes
            .iter_mut()
            .for_each(|axis| axis.stick_slip = None);
        let polygon = perfect.measure(&machine, &case.plan, case.measured_with);
        machine.interpolation_s = 0.0;
        let mut clean = perfect.measure(&machine, &case.plan, case.measured_with);
        for (run, polygon) in clean.runs.iter_mut().zip(&polygon.runs) {
            let mean = |run: &Run| {
                run.samples.deviation_m.iter().sum::<f64>() / run.samples.deviation_m.len() as f64
            };
            let shift = mean(polygon) - mean(run);
            run.samples.deviation_m.iter_mut().for_each(|x| *x += shift);
        }
        left_um(&case.campaign, &clean)
    }
}

/// A share 0…1 that depends on the seed and a number.
fn fraction(seed: u64, salt: u64) -> f64 {
    use rand::{RngExt, SeedableRng};
    rand_chacha::ChaCha8Rng::seed_from_u64(seed.wrapping_add(salt << 32)).random()
}

/// `machine` with everything by which `alone` differs from `base`.
fn merged(mut machine: Machine, base: &Machine, alone: &Machine) -> Machine {
    macro_rules! take {
        ($($field:ident).+) => { if alone.$($field).+ != base.$($field).+ { machine.$($field).+ = alone.$($field).+.clone(); } };
        (add $($field:ident).+ $([$i:expr])+) => { machine.$($field).+$([$i])+ += alone.$($field).+$([$i])+ - base.$($field).+$([$i])+ };
    }
    take!(interpolation_s);
    take!(centripetal_limit_m_s2);
    take!(vibration);
    take!(thermal);
    take!(override_share);
    machine.radius_offset_m += alone.radius_offset_m - base.radius_offset_m;
    for i in 0..3 {
        take!(add geometry.scale[i]);
        take!(add geometry.sense_scale[i]);
        take!(add geometry.squareness_rad[i]);
        for j in 0..3 {
            take!(add geometry.bow_per_m[i][j]);
            take!(add lateral_play_m[i][j]);
        }
        if alone.geometry.cyclic[i].is_some() {
            machine.geometry.cyclic[i] = alone.geometry.cyclic[i];
        }
        let (to, from, was) = (&mut machine.axes[i], &alone.axes[i], &base.axes[i]);
        to.dead_time_s += from.dead_time_s - was.dead_time_s;
        to.average_s += from.average_s - was.average_s;
        to.exponential_s += from.exponential_s - was.exponential_s;
        to.lag_s += from.lag_s - was.lag_s;
        to.backlash_m += from.backlash_m - was.backlash_m;
        to.mechanics = from.mechanics.or(to.mechanics);
        to.friction = from.friction.or(to.friction);
        to.two_mass = from.two_mass.or(to.two_mass);
        to.stick_slip = from.stick_slip.or(to.stick_slip);
    }
    machine.patterns.extend(alone.patterns.iter().copied());
    machine
}

/// Gives the residual of each run (measured minus base machine) to another run with as many samples, place by place
/// on the circle: a turn in the other direction is dealt backwards, or what flips with the direction would go along.
fn deal_residuals(
    campaign: &mut Campaign,
    base: &Machine,
    plan: &Plan,
    instrument: &Instrument,
    seed: u64,
) {
    use rand::{SeedableRng, seq::SliceRandom};
    let bare = Instrument {
        offset_m: instrument.offset_m,
        height_m: instrument.height_m,
        ..Instrument::perfect()
    }
    .measure(base, plan, seed);
    let residuals: Vec<Vec<f64>> = campaign
        .runs
        .iter()
        .zip(&bare.runs)
        .map(|(a, b)| {
            a.samples
                .deviation_m
                .iter()
                .zip(&b.samples.deviation_m)
                .map(|(a, b)| a - b)
                .collect()
        })
        .collect();
    let mut order: Vec<usize> = (0..residuals.len()).collect();
    order.shuffle(&mut rand_chacha::ChaCha8Rng::seed_from_u64(
        seed ^ 0x6465_616c,
    ));
    let signs: Vec<f64> = campaign.runs.iter().map(|run| run.sign()).collect();
    for (i, run) in campaign.runs.iter_mut().enumerate() {
        let n = run.samples.deviation_m.len();
        // The next in the shuffled order that is as long as this run; itself if none is.
        let from = order
            .iter()
            .position(|k| residuals[*k].len() == n)
            .map_or(i, |k| order.remove(k));
        let backwards = signs[i] != signs[from];
        for (k, x) in run.samples.deviation_m.iter_mut().enumerate() {
            let place = if backwards { (n - k) % n } else { k };
            *x = bare.runs[i].samples.deviation_m[k]
                + residuals[from].get(place).copied().unwrap_or(0.0);
        }
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Null(null) => f.write_str(match null {
                Null::Noise => "null_noise",
                Null::Spread => "null_spread",
                Null::Lag => "null_lag",
                Null::Model => "null_model",
            }),
            Self::Effects(names) => f.write_str(&names.join("+")),
            Self::Permuted(name) => write!(f, "permuted_{name}"),
        }
    }
}
