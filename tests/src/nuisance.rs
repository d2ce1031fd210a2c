//! What real campaigns bring along: how they were set up, exported, cut short, mislabelled or spoilt.
use crate::effects::Hidden;
use crate::machine::base::Lab;
use crate::machine::{Instrument, Spread};
use giotto::campaign::Run;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Nuisance {
    /// The export has taken each run's centre off.
    Centred,
    /// Each radius has a bar and a set-up of its own, named.
    PerRadius,
    /// The set-up moves 20–50 µm from run to run.
    Moving,
    /// An arc of this many degrees, with its angle.
    Arc(u16),
    /// One run was touched: a bump of many times the noise.
    Bump,
    /// One run is labelled with the next feed of the list.
    Label,
    /// The direction of one run is written the wrong way round.
    Direction,
    /// Every feed is 1–2 % low.
    Override,
    /// One turn from rest to rest, start and stop recorded.
    Ramps,
    /// Only so many runs: 2, 4, 6, 8 or 10.
    Few(u8),
    /// Scatter of a robot, 10–40 µm.
    Robot,
}

impl Nuisance {
    /// What it does to the laboratory before anything is measured.
    pub fn prepare(self, lab: &mut Lab, seed: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6e75_6973);
        let instrument: &mut Instrument = &mut lab.instrument;
        match self {
            Self::PerRadius => instrument.per_radius_m = rng.random_range(20e-6..60e-6),
            Self::Moving => instrument.moves_m = rng.random_range(20e-6..50e-6),
            Self::Arc(_) => instrument.sees_angle = true,
            Self::Override => lab.machine.override_share = 1.0 - rng.random_range(0.01..0.02),
            Self::Ramps => lab.grid.from_rest = true,
            Self::Robot => {
                let radius_m = rng.random_range(10e-6..40e-6);
                instrument.spread = Spread {
                    radius_m,
                    oval_m: 0.3 * radius_m,
                    lobes_m: 0.1 * radius_m,
                    ..instrument.spread
                };
            }
            Self::Centred | Self::Bump | Self::Label | Self::Direction | Self::Few(_) => {}
        }
    }

    /// What it does to the campaign that was measured.
    pub fn soil(self, hidden: &mut Hidden, seed: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x736f_696c);
        let runs = &mut hidden.campaign.runs;
        match self {
            Self::Centred => runs.iter_mut().for_each(centre),
            Self::PerRadius => {
                for run in runs.iter_mut() {
                    run.setup = Some(format!("R{:.0}", run.radius_m * 1e3));
                }
            }
            Self::Arc(degrees) => {
                runs.iter_mut().for_each(|run| cut(run, degrees));
                // What a perfect model leaves was reckoned over whole turns.
                hidden.perfect_um = None;
            }
            Self::Bump => {
                let which = rng.random_range(0..runs.len());
                let run = &mut runs[which];
                let height_m = rng.random_range(40.0..120.0) * hidden.noise_m.max(0.5e-6);
                let (at, width) = (rng.random_range(0.0..2.0 * PI), rng.random_range(0.05..0.3));
                for (x, angle) in run
                    .samples
                    .deviation_m
                    .iter_mut()
                    .zip(&run.samples.angle_rad)
                {
                    let off = (angle - at + PI).rem_euclid(2.0 * PI) - PI;
                    *x += height_m * (-0.5 * (off / width).powi(2)).exp();
                }
                hidden.spoilt = Some(run.file.clone());
                hidden.perfect_um = None;
            }
            Self::Label => {
                // The label of the next feed: one off in the list, as people mislabel.
                let which = rng.random_range(0..runs.len());
                let (radius, feed) = (runs[which].radius_m, runs[which].feed_m_s);
                let other = runs
                    .iter()
                    .filter(|r| r.radius_m == radius)
                    .map(|r| r.feed_m_s)
                    .filter(|f| *f != feed)
                    .min_by(|a, b| (a - feed).abs().total_cmp(&(b - feed).abs()));
                let run = &mut runs[which];
                run.feed_m_s = other.unwrap_or(feed);
                hidden.spoilt = Some(run.file.clone());
                hidden.perfect_um = None;
            }
            Self::Direction => {
                let which = rng.random_range(0..runs.len());
                let run = &mut runs[which];
                run.direction = match run.direction {
                    giotto::campaign::Direction::Ccw => giotto::campaign::Direction::Cw,
                    giotto::campaign::Direction::Cw => giotto::campaign::Direction::Ccw,
                };
                hidden.spoilt = Some(run.file.clone());
                hidden.perfect_um = None;
            }
            Self::Few(count) => {
                keep_few(runs, usize::from(count));
                hidden.perfect_um = None;
            }
            // A start and a stop are left over.
            Self::Ramps => hidden.perfect_um = None,
            Self::Moving | Self::Override | Self::Robot => {}
        }
    }
}

/// Takes the first harmonic off, as an export that fits a circle does.
fn centre(run: &mut Run) {
    let samples = &mut run.samples;
    let n = samples.deviation_m.len() as f64;
    let (mut cos, mut sin) = (0.0, 0.0);
    for (x, angle) in samples.deviation_m.iter().zip(&samples.angle_rad) {
        cos += 2.0 * x * angle.cos() / n;
        sin += 2.0 * x * angle.sin() / n;
    }
    for (x, angle) in samples.deviation_m.iter_mut().zip(&samples.angle_rad) {
        *x -= cos * angle.cos() + sin * angle.sin();
    }
}

/// Keeps the first `degrees` of a turn.
fn cut(run: &mut Run, degrees: u16) {
    let samples = &mut run.samples;
    let keep = samples.angle_rad.len() * usize::from(degrees) / 360;
    samples.angle_rad.truncate(keep);
    samples.deviation_m.truncate(keep);
    if let Some(time) = &mut samples.time_s {
        time.truncate(keep);
    }
}

/// A short session: both directions of one radius at one, two or three feeds; eight runs of two radii at two feeds; ten
/// of one radius at five feeds.
fn keep_few(runs: &mut Vec<Run>, count: usize) {
    let distinct = |of: &dyn Fn(&Run) -> f64| {
        let mut all: Vec<f64> = runs.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    let (radii, feeds) = (distinct(&|r| r.radius_m), distinct(&|r| r.feed_m_s));
    let last = feeds.len() - 1;
    let (radii, picked) = match count {
        2 => (&radii[..1], vec![feeds[last / 2]]),
        4 => (&radii[..1], vec![feeds[last / 4], feeds[last]]),
        6 => (&radii[..1], vec![feeds[0], feeds[last / 2], feeds[last]]),
        8 => (&radii[..2.min(radii.len())], vec![feeds[0], feeds[last]]),
        _ => (
            &radii[..1],
            (0..5).map(|k| feeds[k * last / 4]).collect::<Vec<_>>(),
        ),
    };
    runs.retain(|r| radii.contains(&r.radius_m) && picked.contains(&r.feed_m_s));
}
