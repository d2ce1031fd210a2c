//! Whether circles look like those of a serial arm whose kinematics nobody gave.
//!
//! When all joints lag alike the path differs from that of slides by −½κ2·n̂ᵀJ̇q̇: a quadratic form of the velocity, seen along the
//! normal. Over a circle this is one wave and three, the same both ways, ∝ f² and whatever the radius. Slides have no such three
//! waves: a bowed guide grows with R² and not with the speed, what comes of the servo goes as f²/R and has two waves. Where they
//! are there, no cause of a slide can be believed.
use super::explained::{Explained, refit};
use super::low_orders::Low;
use super::recommendation::{Action, Recommendation};
use super::spread::is_arc;
use super::survey::Prepared;
use super::veto;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Waves that an arm leaves beside the shift of the centre.
const ORDER: usize = 3;
/// Chance by noise below which they are there: alone, or beside a shift of the centre by the same law, and that of the shift.
const CHANCE: f64 = 1e-5;
const CHANCE_BESIDE_SHIFT: f64 = 1e-2;
const CHANCE_OF_SHIFT: f64 = 1e-4;
/// 2·ln of the odds by which another law of feed and radius may be better.
const AS_GOOD: f64 = 6.0;
/// Smallest amplitude on the fastest circles, as a share of the noise of a sample.
const OF_NOISE: f64 = 0.3;
/// Laws of feed and radius that are held against each other.
const FEEDS: [i32; 4] = [1, 2, 3, 4];
const RADII: [i32; 5] = [-2, -1, 0, 1, 2];
/// That of an arm.
const OF_ARM: (i32, i32) = (2, 0);
/// Degrees of freedom below which nothing is said.
const FEWEST: usize = 8;

/// What is to be done.
pub const WORDS: &str = "three waves a turn, the same both ways, ∝ f² and whatever the radius: this looks like an arm: give its kinematics ([kinematics] in \
                         campaign.toml, with centre_mm of the runs); no cause of a slide is named";

/// One harmonic of a run, about the machine angle, with what it goes by.
struct Seen {
    radius_m: f64,
    feed: f64,
    sign: f64,
    wave: [f64; 2],
}

/// Whether the baseline's misfit has the mark of an arm. Of arcs, and of campaigns with kinematics, it is not asked.
pub fn is_like_arm(found: &Explained) -> bool {
    let not_asked = |run: &Prepared| run.view.arm.is_some() || is_arc(run);
    if found.runs.iter().any(not_asked) {
        return false;
    }
    let seen = harmonic(found, ORDER);
    let Some((chance, fit)) = follows(&seen) else {
        return false;
    };
    let shifts = || {
        let shift = follows(&harmonic(found, 1));
        shift.is_some_and(|(chance, _)| chance < CHANCE_OF_SHIFT)
    };
    if chance > CHANCE && !(chance < CHANCE_BESIDE_SHIFT && shifts()) {
        return false;
    }
    let fastest = seen.iter().map(|run| run.feed).fold(0.0, f64::max);
    if fit.amount * fastest * fastest < OF_NOISE * found.spread.noise_m() {
        return false;
    }
    let best = FEEDS
        .into_iter()
        .flat_map(|feed| RADII.map(|radius| (feed, radius)))
        .filter_map(|law| centred(&seen, Some(law)))
        .map(|fit| fit.left)
        .fold(f64::INFINITY, f64::min);
    (fit.dof as f64) * (fit.left / best.max(f64::MIN_POSITIVE)).ln() < AS_GOOD
}

/// One order of what the baseline leaves of each run.
fn harmonic(found: &Explained, order: usize) -> Vec<Seen> {
    let data = found.gram.column(0);
    let seen = |(run, low): (&Prepared, &Low)| {
        let waves = run.basis.harmonics_of(low).seen_from(-run.turned_rad);
        Seen {
            radius_m: run.view.radius_m,
            feed: run.view.feed_m_s / 0.3,
            sign: run.view.sign,
            wave: waves.0[order],
        }
    };
    found.runs.iter().zip(data.low()).map(seen).collect()
}

/// Chance by noise that the waves follow the law of an arm so well, and the fit; `None`: too few runs to say.
fn follows(seen: &[Seen]) -> Option<(f64, Fit)> {
    let whole = centred(seen, None)?;
    let fit = centred(seen, Some(OF_ARM)).filter(|fit| fit.dof >= FEWEST)?;
    let mean_square = (fit.left / fit.dof as f64).max(f64::MIN_POSITIVE);
    let ratio = 0.5 * (whole.left - fit.left) / mean_square;
    let chance = FisherSnedecor::new(2.0, fit.dof as f64).map_or(1.0, |law| law.sf(ratio));
    Some((chance, fit))
}

/// What a law leaves of the waves.
struct Fit {
    /// Sum of squares, m².
    left: f64,
    /// Amplitude at unit size, m.
    amount: f64,
    dof: usize,
}

/// The waves of each radius and direction less their mean, by one law; `None`: nothing is left to fit.
fn centred(seen: &[Seen], law: Option<(i32, i32)>) -> Option<Fit> {
    let mut groups: Vec<(f64, f64, Vec<&Seen>)> = Vec::new();
    for run in seen {
        let same = |g: &&mut (f64, f64, Vec<&Seen>)| {
            g.0 == run.sign && (g.1 / run.radius_m - 1.0).abs() < 1e-6
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.2.push(run),
            None => groups.push((run.sign, run.radius_m, vec![run])),
        }
    }
    let size = |run: &Seen| match law {
        Some((feed, radius)) => run.feed.powi(feed) * (run.radius_m / 0.15).powi(radius),
        None => 0.0,
    };
    let (mut xx, mut xy, mut yy, mut count) = (0.0, [0.0; 2], 0.0, 0);
    for (_, _, runs) in &groups {
        let n = runs.len() as f64;
        let mean_x = runs.iter().map(|run| size(run)).sum::<f64>() / n;
        let mean = [0, 1].map(|k| runs.iter().map(|run| run.wave[k]).sum::<f64>() / n);
        for run in runs {
            let x = size(run) - mean_x;
            xx += x * x;
            for (xy, (wave, mean)) in xy.iter_mut().zip(run.wave.iter().zip(mean)) {
                *xy += x * (wave - mean);
                yy += (wave - mean).powi(2);
            }
        }
        count += runs.len() - 1;
    }
    let taken = if xx > 0.0 {
        (xy[0] * xy[0] + xy[1] * xy[1]) / xx
    } else {
        0.0
    };
    let parameters = if law.is_some() { 2 } else { 0 };
    let dof = (2 * count).checked_sub(parameters).filter(|dof| *dof > 0)?;
    Some(Fit {
        left: yy - taken,
        amount: if xx > 0.0 {
            xy[0].hypot(xy[1]) / xx
        } else {
            0.0
        },
        dof,
    })
}

/// Takes all listed causes out: on an arm they are pieces of what its joints do.
pub fn take_out_slides(found: &mut Explained) {
    let listed: Vec<usize> = found
        .chosen
        .iter()
        .copied()
        .filter(|item| found.items[*item].listed())
        .collect();
    for item in listed {
        veto::take_out(found, item);
    }
    found.tones.clear();
    found.teeth.clear();
    let all = found.all();
    refit(found, &all);
}

/// What to do now.
pub fn recommendation() -> Recommendation {
    Recommendation {
        action: Action::Measure,
        words: WORDS.to_owned(),
        command: None,
    }
}
