//! A campaign made ready for the search: each run's motion, its measured turn, the lag of the machine.
//!
//! A ballbar gives time, not angle: the recorded pattern is turned by the lag φ(ω) of the machine. The
//! set-up offset does not move between runs, so the turn of the first harmonic with speed measures φ.
use super::arm::Arms;
use super::design_column::Column;
use super::low_orders::{Basis, Low};
use crate::campaign::{Campaign, Run};
use crate::causes::{Harmonics, RunView};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// One run, ready.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Index in the campaign.
    pub index: usize,
    /// Where the machine was.
    pub view: RunView,
    /// Feed as programmed, m/s.
    pub programmed_m_s: f64,
    /// Deviation at each sample, m.
    pub deviation_m: Vec<f64>,
    /// Angle by which the recorded pattern runs ahead of the machine: θ − ψ = d·φ, rad; 0 for measured angles.
    pub turned_rad: f64,
    /// Samples that nothing is read from (empty: none).
    pub hidden: Arc<[bool]>,
    /// Low orders of the circle, orthonormal over the samples; orders about the inferred angle.
    pub basis: Arc<Basis>,
    /// Where its samples are in a vector over those of all runs.
    pub place: Range<usize>,
}

/// The part of the response that all runs share.
pub type Response = giotto_shared::model::Response<f64>;

impl Prepared {
    /// Takes the recorded pattern as one that runs ahead of the machine by the lag `lag_rad`.
    pub fn turn_to(&mut self, lag_rad: f64) {
        let turned_rad = self.view.sign * lag_rad;
        let psi: Arc<[f64]> = self
            .view
            .psi_rad
            .iter()
            .map(|psi| psi + self.turned_rad - turned_rad)
            .collect();
        self.view.lag_rad = lag_rad;
        self.turned_rad = turned_rad;
        self.view.place(psi);
    }

    /// Hides samples from every product.
    pub fn hide(&mut self, hidden: Vec<bool>) {
        let angle: Vec<f64> = self
            .view
            .psi_rad
            .iter()
            .map(|psi| psi + self.turned_rad)
            .collect();
        self.basis = Arc::new(Basis::masked(&angle, &hidden));
        self.hidden = hidden.into();
        let mut deviation = std::mem::take(&mut self.deviation_m);
        self.mask(&mut deviation);
        self.deviation_m = deviation;
    }

    /// Number of samples that are not hidden.
    pub fn visible(&self) -> usize {
        self.deviation_m.len() - self.hidden.iter().filter(|hidden| **hidden).count()
    }

    /// Coordinates in the low orders of waves of the machine angle.
    pub fn low_of(&self, waves: &Harmonics) -> Low {
        self.basis.coordinates_of(&waves.seen_from(self.turned_rad))
    }

    /// Zero where hidden.
    pub fn mask(&self, samples: &mut [f64]) {
        for (sample, hidden) in samples.iter_mut().zip(self.hidden.iter()) {
            if *hidden {
                *sample = 0.0;
            }
        }
    }
}

/// How the phase lag was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag {
    /// φ = τω − τ3ω³: τ, s.
    pub tau_s: f64,
    /// τ3, s³.
    pub tau3_s3: f64,
    /// Whether the set-up offset was large enough to measure it (else it is that of the servo model).
    pub measured: bool,
    /// How far τ may be off, s (standard deviation).
    pub se_s: f64,
}

impl Lag {
    /// That of the simplest chain with a response: what a radius alone says of the delay. Dead time is not in it.
    pub fn of(response: &Response) -> Self {
        let [tau_s, tau3_s3] = response.phase();
        Self {
            tau_s,
            tau3_s3,
            measured: false,
            se_s: UNSEEN_S,
        }
    }

    /// φ(ω), rad.
    pub fn phase(&self, omega_rad_s: f64) -> f64 {
        omega_rad_s * (self.tau_s - self.tau3_s3 * omega_rad_s * omega_rad_s)
    }
}

/// Ratio of measured to programmed feed below which a run counts as slowed.
const SLOWED: f64 = 0.995;

/// Feed of the run as its turn shows it, m/s; `None` without time stamps.
pub fn measured_feed_m_s(run: &Run) -> Option<f64> {
    let turn_s = run.turn_s().filter(|turn_s| *turn_s > 0.0)?;
    Some(std::f64::consts::TAU * run.radius_m / turn_s)
}

/// The measured feed; the programmed one without time stamps or where they agree to 0.5 %.
pub fn believed_feed_m_s(run: &Run) -> f64 {
    match measured_feed_m_s(run) {
        Some(measured) if !(SLOWED..=1.0 / SLOWED).contains(&(measured / run.feed_m_s)) => measured,
        _ => run.feed_m_s,
    }
}

/// What a campaign without start times is taken to last, s.
const UNTIMED_S: f64 = 3600.0;

/// A campaign read once: what no model of the machine changes.
#[derive(Clone, Debug)]
pub struct Survey {
    runs: Vec<Prepared>,
    /// First harmonic of each run.
    firsts: Vec<[f64; 2]>,
    /// Whether the angles follow from the time, and so hold the lag.
    inferred: bool,
    /// The joints, where the machine is an arm.
    arms: Arms,
}

/// When the runs of a campaign were measured.
struct CampaignClock {
    /// Of each run, s; its number where the campaign has no times.
    starts: Vec<f64>,
    began: f64,
    span: f64,
    /// Whether every run states its start.
    timed: bool,
}

impl CampaignClock {
    fn of(campaign: &Campaign) -> Self {
        let starts: Vec<f64> = campaign
            .runs
            .iter()
            .enumerate()
            .map(|(i, run)| run.started_s.unwrap_or(i as f64))
            .collect();
        let began = starts.iter().copied().fold(f64::INFINITY, f64::min);
        let span = starts.iter().copied().fold(f64::NEG_INFINITY, f64::max) - began;
        Self {
            began,
            span,
            timed: campaign.runs.iter().all(|run| run.started_s.is_some()),
            starts,
        }
    }

    /// Share of the campaign that had passed at a run. What it shows of a drift is that of its middle.
    fn elapsed(&self, run: &Run, index: usize, omega_rad_s: f64) -> f64 {
        let middle = match run.started_s {
            Some(started_s) => started_s + std::f64::consts::PI / omega_rad_s,
            None => self.starts[index],
        };
        if self.span > 0.0 {
            (middle - self.began) / self.span
        } else {
            0.0
        }
    }

    /// Duration of the campaign, s.
    fn campaign_s(&self) -> f64 {
        if self.timed && self.span > 0.0 {
            self.span
        } else {
            UNTIMED_S
        }
    }
}

impl Survey {
    /// Reads a campaign.
    pub fn new(campaign: &Campaign) -> Self {
        let clock = CampaignClock::of(campaign);
        let largest = campaign
            .runs
            .iter()
            .map(|run| run.radius_m)
            .fold(0.0, f64::max);
        let ends: Vec<usize> = campaign
            .runs
            .iter()
            .scan(0, |end, run| {
                *end += run.samples.deviation_m.len();
                Some(*end)
            })
            .collect();
        let (runs, firsts) = campaign
            .runs
            .par_iter()
            .zip(&ends)
            .enumerate()
            .map(|(index, (run, &end))| {
                let feed = believed_feed_m_s(run);
                let omega = feed / run.radius_m;
                let theta = &run.samples.angle_rad;
                let from = theta.first().copied().unwrap_or(0.0);
                let time_s = match &run.samples.time_s {
                    Some(time_s) => time_s.as_slice().into(),
                    None => theta
                        .iter()
                        .map(|angle| (angle - from).abs() / omega)
                        .collect(),
                };
                let basis = Basis::new(theta);
                let [_, first, ..] = basis.harmonics(&run.samples.deviation_m).0;
                let mut deviation_m = run.samples.deviation_m.clone();
                if campaign.kinematics.is_some() {
                    without_second_order(run, first, &mut deviation_m);
                }
                let prepared = Prepared {
                    index,
                    programmed_m_s: run.feed_m_s,
                    turned_rad: 0.0,
                    deviation_m,
                    hidden: Arc::default(),
                    basis: Arc::new(basis),
                    place: end - theta.len()..end,
                    view: RunView {
                        radius_m: run.radius_m,
                        feed_m_s: feed,
                        omega_rad_s: omega,
                        sign: run.sign(),
                        frame: run.frame,
                        centre_m: run.centre_m.unwrap_or_default(),
                        elapsed: clock.elapsed(run, index, omega),
                        campaign_s: clock.campaign_s(),
                        largest_radius_m: largest,
                        psi_rad: theta.as_slice().into(),
                        direction: Arc::default(),
                        strokes: Default::default(),
                        time_s,
                        gain: 1.0,
                        lag_rad: 0.0,
                        arm: None,
                    },
                };
                (prepared, first)
            })
            .unzip();
        let inferred = campaign.runs.iter().any(|run| run.samples.angle_inferred);
        Self {
            runs,
            firsts,
            inferred,
            arms: Arms::new(campaign),
        }
    }

    /// The low orders of each run about its recorded angle, nothing hidden.
    pub fn bases(&self) -> Vec<Arc<Basis>> {
        self.runs.iter().map(|run| Arc::clone(&run.basis)).collect()
    }

    /// The runs, and the first harmonic of each about its recorded angle, m.
    pub fn set_ups(&self) -> impl Iterator<Item = (&RunView, [f64; 2])> {
        let views = self.runs.iter().map(|run| &run.view);
        views.zip(self.firsts.iter().copied())
    }

    /// Whether the angles follow from the time, and so hold the delay.
    pub const fn inferred(&self) -> bool {
        self.inferred
    }

    /// Lag of the machine behind the command: by the turn of the set-up offset, or else that of the response's own chain.
    pub fn lag(&self, response: &Response) -> Lag {
        if self.inferred {
            self.measure_lag(response)
        } else {
            Lag {
                tau_s: 0.0,
                tau3_s3: 0.0,
                measured: true,
                se_s: 0.0,
            }
        }
    }

    /// The runs about a guess of the response, their lag `more_lag_s` longer than the set-up offset says.
    pub fn prepare(&self, response: &Response, more_lag_s: f64) -> (Vec<Prepared>, Lag) {
        let mut lag = self.lag(response);
        lag.tau_s += more_lag_s;
        let place = |run: &Prepared| {
            let mut run = run.clone();
            let omega = run.view.omega_rad_s;
            run.view.gain = response.gain(omega);
            run.view.arm = self.arms.view(run.index, response, omega, run.view.sign);
            if self.inferred {
                run.turn_to(lag.phase(omega));
            } else {
                // An angle that was measured holds no lag, but the servo's own phase still turns its signatures.
                run.view.lag_rad = Lag::of(response).phase(omega);
                run.view.place(Arc::clone(&run.view.psi_rad));
            }
            run
        };
        (self.runs.par_iter().map(place).collect(), lag)
    }
}

/// Takes out what a shift of the centre does to the radius in second order. Zeros and lengths of an arm shift circles by
/// millimetres, where it is no longer small: (e×n̂)²/(2R), outward about the angle of the command, inward about the measured one.
fn without_second_order(run: &Run, [shift_cos, shift_sin]: [f64; 2], deviation_m: &mut [f64]) {
    let side = if run.samples.angle_inferred {
        1.0
    } else {
        -1.0
    };
    for (deviation, angle) in deviation_m.iter_mut().zip(&run.samples.angle_rad) {
        let (sin, cos) = angle.sin_cos();
        let across = shift_cos * sin - shift_sin * cos;
        *deviation -= side * across * across / (2.0 * run.radius_m);
    }
}

/// What the baseline leaves of the runs, where it is seen.
pub fn misfit(runs: &[Prepared]) -> Column {
    let left = |run: &Prepared, out: &mut [&mut [f64]]| {
        if let (Some(arm), [out]) = (&run.view.arm, &mut *out) {
            let samples = run.deviation_m.iter().zip(run.view.psi_rad.iter());
            for (out, (deviation, psi)) in out.iter_mut().zip(samples) {
                *out = deviation - arm.common.at(*psi);
            }
            return;
        }
        let shrink = run.view.radius_m * (run.view.gain - 1.0);
        for (out, deviation) in out
            .iter_mut()
            .flat_map(|out| out.iter_mut())
            .zip(&run.deviation_m)
        {
            *out = deviation - shrink;
        }
    };
    let column = Column::split(runs, 1, left).pop();
    column.unwrap_or_else(|| Column::zero(runs.len()))
}

/// Delay that filters, networks and dead times may add to the lag of a response, s: standard deviation of what is known
/// of the delay before it is measured.
const UNSEEN_S: f64 = 0.03;

/// Least eccentricity that shows its turn clearly against a micrometre of noise, m.
const SMALLEST_OFFSET_M: f64 = 3e-6;

impl Survey {
    /// Fits z = E·e^{idφ(ω)} to the first harmonics z = c + is of all runs.
    fn measure_lag(&self, response: &Response) -> Lag {
        // What the joints of an arm shift the circle by is not of the set-up.
        let joints = |run: &Prepared| {
            let arm = self
                .arms
                .view(run.index, response, run.view.omega_rad_s, run.view.sign);
            arm.map_or([0.0; 2], |arm| arm.common.0[1])
        };
        let points: Vec<(f64, f64, [f64; 2], [f64; 2])> = self
            .runs
            .iter()
            .zip(&self.firsts)
            .map(|(run, first)| (run.view.sign, run.view.omega_rad_s, *first, joints(run)))
            .collect();
        let unmeasured = Lag::of(response);
        let guess = unmeasured.tau_s;
        let cost = |tau: f64, tau3: f64| -> (f64, f64) {
            let (mut re, mut im, mut energy) = (0.0, 0.0, 0.0);
            for (sign, omega, [c, s], [own_c, own_s]) in &points {
                let phase = -sign * omega * (tau - tau3 * omega * omega);
                let (sin, cos) = phase.sin_cos();
                let (c, s) = (c * cos - s * sin - own_c, c * sin + s * cos - own_s);
                re += c;
                im += s;
                energy += c * c + s * s;
            }
            let n = points.len() as f64;
            let (re, im) = (re / n, im / n);
            let left = energy / n - re * re - im * im;
            (left.max(0.0), re.hypot(im))
        };
        let fastest = points.iter().map(|p| p.1).fold(0.0, f64::max);
        let slowest = points.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        if points.len() < 3 || fastest <= 0.0 || (fastest - slowest) < 0.2 * fastest {
            return unmeasured;
        }
        // A phase beyond ±π at the fastest run would be another branch.
        let widest = (std::f64::consts::PI / fastest).min(0.2);
        let tau = (0..=80)
            .map(|i| -0.1 * widest + 1.1 * widest * f64::from(i) / 80.0)
            .min_by(|l, r| cost(*l, 0.0).0.total_cmp(&cost(*r, 0.0).0))
            .unwrap_or(guess);
        let steps = [
            widest / 80.0,
            0.2 * tau.abs().max(1e-3) / (fastest * fastest),
        ];
        let [tau, tau3] = lowest_by_parabolas([tau, 0.0], steps, &|[tau, tau3]| cost(tau, tau3).0);
        let (left, eccentricity) = cost(tau, tau3);
        // Standard error of the phase at the fastest run, rad.
        let se = (left / points.len() as f64).sqrt() / eccentricity.max(1e-12);
        if eccentricity < SMALLEST_OFFSET_M || se > 0.02 {
            return unmeasured;
        }
        // τ and τ3 share what the fastest runs tell.
        Lag {
            tau_s: tau,
            tau3_s3: tau3,
            measured: true,
            se_s: 2.0 * se / fastest,
        }
    }
}

/// The lowest place near `at`, one parameter after the other, by parabolas through three points whose steps shrink.
fn lowest_by_parabolas(
    mut at: [f64; 2],
    mut steps: [f64; 2],
    cost: &dyn Fn([f64; 2]) -> f64,
) -> [f64; 2] {
    #[allow(
        clippy::needless_range_loop,
        reason = "the number is a choice of parameter"
    )]
    for _ in 0..60 {
        for which in 0..2 {
            let moved = |delta: f64| {
                let mut place = at;
                place[which] += delta;
                place
            };
            let step = steps[which];
            let [low, mid, high] = [-step, 0.0, step].map(|delta| cost(moved(delta)));
            let bend = low - 2.0 * mid + high;
            let delta = if bend > 0.0 {
                (0.5 * step * (low - high) / bend).clamp(-step, step)
            } else {
                0.0
            };
            let to = moved(delta);
            if cost(to) <= mid {
                at = to;
            }
            steps[which] *= 0.85;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::Servo;

    #[test]
    fn own_lag_is_the_phase_of_the_chain() {
        let (omega_n, zeta) = (38.0_f64, 0.72_f64);
        let second = Servo::SecondOrder {
            omega_n_rad_s: omega_n,
            zeta,
        }
        .response();
        let lag = Servo::Lag { kv_per_s: 90.0 }.response();
        for omega in [0.5, 3.0, 7.0] {
            let exact = (2.0 * zeta * omega / omega_n).atan2(1.0 - (omega / omega_n).powi(2));
            assert!(
                (Lag::of(&second).phase(omega) - exact).abs() < 2e-4,
                "{omega}: {exact}"
            );
            assert!(
                (Lag::of(&lag).phase(omega) - (omega / 90.0).atan()).abs() < 1e-6,
                "{omega}"
            );
        }
    }
}
