//! Each cause alone on each circle, by the time-domain simulation: what the machine draws with all causes less what it draws
//! without this one. What-if boxes subtract these profiles, and each cause has a picture of its own.
use giotto::campaign::{Campaign, Run};
use giotto::causes::Effect;
use giotto::diagnosis::Diagnosis;
use giotto::diagnosis::picture::SECTORS;
use giotto::model_file::ModelFile;
use giotto::simulation::{self, CircleTest, Machine};
use std::f64::consts::TAU;

/// A profile over the turn, m: mean of each sector of 2°.
pub type Profile = Vec<Option<f64>>;

/// Below this nothing of a cause can be seen, m.
const NOTHING_M: f64 = 0.05e-6;

/// What each finding does to each run; findings that no simulation holds have no profile.
pub struct Alone {
    /// By finding, then by run of the campaign.
    pub profiles: Vec<Option<Vec<Profile>>>,
}

impl Alone {
    /// By the extended model with and without each finding.
    pub fn of(campaign: &Campaign, d: &Diagnosis) -> Self {
        let whole = Machine::from_model(&d.model).ok();
        let profiles = d.findings.iter().map(|finding| {
            let without = without(&d.model, &finding.effects)?;
            let (with, without) = (whole.as_ref()?, Machine::from_model(&without).ok()?);
            let runs: Vec<Profile> = campaign
                .runs
                .iter()
                .map(|run| difference(with, &without, run))
                .collect();
            let seen = runs.iter().flatten().flatten().any(|v| v.abs() > NOTHING_M);
            seen.then_some(runs)
        });
        Self {
            profiles: profiles.collect(),
        }
    }

    /// The run on which a finding does most to the form or the size, and its largest deviation there, m.
    pub fn largest(&self, finding: usize) -> Option<(usize, f64)> {
        let runs = self.profiles.get(finding)?.as_ref()?;
        let most = |profile: &Profile| {
            profile
                .iter()
                .flatten()
                .fold(0.0, |m: f64, v| m.max(v.abs()))
        };
        let sizes = runs.iter().map(most).enumerate();
        sizes.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The model without these effects; `None` if it holds none of them.
fn without(model: &ModelFile, effects: &[Effect]) -> Option<ModelFile> {
    let mut rest = model.clone();
    rest.effects.retain(|effect| !effects.contains(effect));
    (rest.effects.len() < model.effects.len()).then_some(rest)
}

fn difference(with: &Machine, without: &Machine, run: &Run) -> Profile {
    let test = CircleTest::of(run);
    let [a, b] = [with, without].map(|machine| simulation::circle(machine, &test).deviation_m);
    let theta = &run.samples.angle_rad;
    let left: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    // The centre is free: what only moves the circle is no error of it.
    let [c, s] = first_wave(theta, &left);
    let mut sums = vec![(0.0, 0.0); SECTORS];
    for (angle, value) in theta.iter().zip(&left) {
        let at = (angle.rem_euclid(TAU) / TAU * SECTORS as f64) as usize;
        let slot = &mut sums[at.min(SECTORS - 1)];
        slot.0 += value - c * angle.cos() - s * angle.sin();
        slot.1 += 1.0;
    }
    sums.into_iter()
        .map(|(sum, count)| (count > 0.0).then(|| sum / count))
        .collect()
}

/// Least squares of 1, cos θ, sin θ: the coefficients of the last two.
fn first_wave(theta: &[f64], values: &[f64]) -> [f64; 2] {
    // Normal equations of the two waves with the mean eliminated.
    let n = theta.len().min(values.len()).max(1) as f64;
    let mean = |of: &dyn Fn(usize) -> f64| (0..theta.len()).map(of).sum::<f64>() / n;
    let (mc, ms) = (mean(&|i| theta[i].cos()), mean(&|i| theta[i].sin()));
    let mv = mean(&|i| values.get(i).copied().unwrap_or(0.0));
    let (mut cc, mut cs, mut ss, mut cv, mut sv) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (angle, value) in theta.iter().zip(values) {
        let (c, s, v) = (angle.cos() - mc, angle.sin() - ms, value - mv);
        cc += c * c;
        cs += c * s;
        ss += s * s;
        cv += c * v;
        sv += s * v;
    }
    let det = cc * ss - cs * cs;
    if det <= 1e-9 * n * n {
        return [0.0; 2];
    }
    [(cv * ss - sv * cs) / det, (sv * cc - cv * cs) / det]
}
