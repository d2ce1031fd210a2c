//! A run that was spoilt: driven over a chip, knocked, labelled wrongly. It is found before anything is explained,
//! by what the other runs foretell of it.
//!
//! Every place on the circle, and the size, is fitted over the runs by a few laws in direction, feed and radius. A run
//! whose own prediction, made without it, fails far worse than that of any other run, is not of the same machine.
use super::angular_bins::BINS;
use super::residual_waves::median;
use super::survey::Prepared;
use nalgebra::DMatrix;
use serde::Serialize;

/// A run that is not looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// File of the run.
    pub file: String,
    /// Why.
    pub reason: String,
}

/// A run that stands out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spoilt {
    /// Its place among the runs.
    pub run: usize,
    /// By how much it stands out of the others, as a ratio of root mean squares.
    pub ratio: f64,
    /// Where on the circle it fails most, rad; `None`: its size.
    pub at_rad: Option<f64>,
    /// By how much it fails there, m.
    pub off_m: f64,
}

/// Fewest runs of which one can be said to stand out.
const FEWEST: usize = 10;
/// Energy of the failing profile against the median of all runs, and against the next worst run.
const OF_MEDIAN: f64 = 9.0;
const OF_NEXT: f64 = 3.0;
/// The same of the size, in its own standard deviations (squares): sizes scatter with heavier tails.
const SIZE_OF_MEDIAN: f64 = 200.0;
const SIZE_OF_NEXT: f64 = 8.0;

/// The one run that stands out, if there is one. `profiles` are the means of each place, `sizes` the mean of each run.
pub fn find(runs: &[Prepared], profiles: &[[f64; BINS]], sizes: &[f64]) -> Option<Spoilt> {
    if runs.len() < FEWEST {
        return None;
    }
    let laws = Laws::new(runs)?;
    let failed = failed_at(&laws, profiles);
    by_profile(&failed)
        .or_else(|| by_place(&failed))
        .or_else(|| by_size(&laws, sizes))
}

/// What each run fails at each place to be as the others foretell, m.
fn failed_at(laws: &Laws, profiles: &[[f64; BINS]]) -> Vec<[f64; BINS]> {
    let mut failed = vec![[0.0; BINS]; profiles.len()];
    for place in 0..BINS {
        let values: Vec<f64> = profiles.iter().map(|profile| profile[place]).collect();
        for (failed, value) in failed.iter_mut().zip(laws.foretold_wrong(&values)) {
            failed[place] = value;
        }
    }
    failed
}

/// Standard deviations, of the other runs at the same place, by which a run must fail somewhere, and how many times as
/// many as any other run does anywhere. Of normal scatter, 78 runs fail by 4.5 at most in one campaign of ten.
const OF_PLACE: f64 = 10.0;
const OF_OTHERS: f64 = 2.0;

/// A run that fails at one place where the others hardly scatter, though steps and spikes may fail more elsewhere.
fn by_place(failed: &[[f64; BINS]]) -> Option<Spoilt> {
    let scales: Vec<f64> = (0..BINS)
        .map(|place| {
            let mut sizes: Vec<f64> = failed.iter().map(|run| run[place].abs()).collect();
            // The median of |N(0, σ)| is 0.6745σ.
            median(&mut sizes) / 0.6745
        })
        .collect();
    let floor = median(&mut scales.clone());
    let worst = |run: &[f64; BINS]| {
        let by = |place: usize| run[place].abs() / scales[place].max(floor).max(f64::MIN_POSITIVE);
        (0..BINS)
            .map(|place| (by(place), place))
            .fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
    };
    let all: Vec<(f64, usize)> = failed.iter().map(worst).collect();
    let run = (0..all.len()).max_by(|a, b| all[*a].0.total_cmp(&all[*b].0))?;
    let next = (0..all.len())
        .filter(|other| *other != run)
        .map(|other| all[other].0)
        .fold(0.0, f64::max);
    let (ratio, place) = all[run];
    (ratio > OF_PLACE && ratio > OF_OTHERS * next).then(|| Spoilt {
        run,
        ratio,
        at_rad: Some(std::f64::consts::TAU * (place as f64 + 0.5) / BINS as f64),
        off_m: failed[run][place],
    })
}

fn by_profile(failed: &[[f64; BINS]]) -> Option<Spoilt> {
    let energies: Vec<f64> = failed
        .iter()
        .map(|run| run.iter().map(|x| x * x).sum())
        .collect();
    let (run, ratio) = stands_out(&energies, OF_MEDIAN, OF_NEXT)?;
    let place = (0..BINS).max_by(|a, b| failed[run][*a].abs().total_cmp(&failed[run][*b].abs()))?;
    Some(Spoilt {
        run,
        ratio,
        at_rad: Some(std::f64::consts::TAU * (place as f64 + 0.5) / BINS as f64),
        off_m: failed[run][place],
    })
}

fn by_size(laws: &Laws, sizes: &[f64]) -> Option<Spoilt> {
    let failed = laws.foretold_wrong(sizes);
    let energies: Vec<f64> = failed.iter().map(|x| x * x).collect();
    let (run, ratio) = stands_out(&energies, SIZE_OF_MEDIAN, SIZE_OF_NEXT)?;
    Some(Spoilt {
        run,
        ratio,
        at_rad: None,
        off_m: failed[run],
    })
}

/// The largest of the energies, if it is so much above the median and the next; the root of the former.
fn stands_out(energies: &[f64], of_median: f64, of_next: f64) -> Option<(usize, f64)> {
    let mut order: Vec<usize> = (0..energies.len()).collect();
    order.sort_by(|a, b| energies[*b].total_cmp(&energies[*a]));
    let (worst, next) = (energies[order[0]], energies[order[1]]);
    let median = energies[order[order.len() / 2]];
    (worst > of_median * median && worst > of_next * next)
        .then(|| (order[0], (worst / median.max(f64::MIN_POSITIVE)).sqrt()))
}

/// What a run of a radius, feed and direction is foretold by: an orthonormal basis over the runs.
struct Laws {
    basis: DMatrix<f64>,
    /// 1 − h: what a run leaves of its own deviation when it takes part in the fit.
    left: Vec<f64>,
}

/// A run that nothing but itself determines cannot be foretold.
const OWN: f64 = 0.05;

impl Laws {
    fn new(runs: &[Prepared]) -> Option<Self> {
        let x = |run: &Prepared| run.view.feed_m_s.powi(2) / run.view.radius_m;
        let laws: [&dyn Fn(&Prepared) -> f64; 7] = [
            &|_| 1.0,
            &|run| run.view.sign,
            &|run| run.view.radius_m,
            &|run| x(run),
            &|run| run.view.sign * run.view.feed_m_s,
            &|run| run.view.feed_m_s,
            &|run| x(run).powi(2) / run.view.radius_m,
        ];
        let most = (runs.len() / 3).min(laws.len());
        let mut columns: Vec<Vec<f64>> = Vec::new();
        for law in &laws[..most] {
            let mut column: Vec<f64> = runs.iter().map(law).collect();
            let length = norm(&column);
            for _ in 0..2 {
                for earlier in &columns {
                    let along: f64 = earlier.iter().zip(&column).map(|(a, b)| a * b).sum();
                    column
                        .iter_mut()
                        .zip(earlier)
                        .for_each(|(c, e)| *c -= along * e);
                }
            }
            let left = norm(&column);
            if left > 1e-6 * length {
                column.iter_mut().for_each(|c| *c /= left);
                columns.push(column);
            }
        }
        let left = (0..runs.len())
            .map(|run| {
                1.0 - columns
                    .iter()
                    .map(|column| column[run].powi(2))
                    .sum::<f64>()
            })
            .collect();
        let basis = DMatrix::from_fn(runs.len(), columns.len(), |i, j| columns[j][i]);
        Some(Self { basis, left })
    }

    /// Value of each run less what the other runs foretell of it.
    fn foretold_wrong(&self, values: &[f64]) -> Vec<f64> {
        let y = nalgebra::DVector::from_column_slice(values);
        let rest = &y - &self.basis * (self.basis.transpose() * &y);
        rest.iter()
            .zip(&self.left)
            .map(|(rest, left)| if *left > OWN { rest / left } else { 0.0 })
            .collect()
    }
}

fn norm(column: &[f64]) -> f64 {
    column.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// What a person is told of it.
pub fn reason(spoilt: &Spoilt) -> String {
    match spoilt.at_rad {
        Some(at_rad) => format!(
            "off by {:.1} µm near {:.0}°, {:.0} times as far from what the other runs foretell as they are from each other",
            spoilt.off_m * 1e6,
            at_rad.to_degrees(),
            spoilt.ratio
        ),
        None => format!(
            "its size is off by {:.1} µm, {:.0} times as far from what the other runs foretell as they are from each other: a wrong label or another set-up",
            spoilt.off_m * 1e6,
            spoilt.ratio
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_stands_out_only_if_it_is_alone() {
        let mut energies: Vec<f64> = (0..20)
            .map(|i| 1.0 + 0.1 * f64::from((i * 7) % 5))
            .collect();
        assert_eq!(stands_out(&energies, 9.0, 3.0), None);
        energies[4] = 40.0;
        assert_eq!(
            stands_out(&energies, 9.0, 3.0).map(|found| found.0),
            Some(4)
        );
        energies[11] = 30.0;
        assert_eq!(
            stands_out(&energies, 9.0, 3.0),
            None,
            "two are a kind of their own"
        );
    }

    #[test]
    fn a_bump_shows_at_its_place_beside_runs_that_fail_more_elsewhere() {
        let mut failed = vec![[0.0; BINS]; 24];
        for (i, run) in failed.iter_mut().enumerate() {
            for (place, value) in run.iter_mut().enumerate() {
                let scatter = ((i * 31 + place * 17) % 13) as f64 / 6.0 - 1.0;
                // A step that no run foretells of another sits at place 5.
                *value = if place == 5 {
                    20.0 * scatter
                } else {
                    0.5 * scatter
                };
            }
        }
        assert_eq!(by_place(&failed), None);
        failed[7][40] += 8.0;
        assert_eq!(by_place(&failed).map(|spoilt| spoilt.run), Some(7));
    }
}
