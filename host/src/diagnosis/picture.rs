//! Run by run, what was measured and what the simulation leaves of it, before and after: what plots draw.
use super::design_column::Column;
use super::explained::{Explained, residual};
use super::hypothesis::Kind;
use super::misfit::of_baseline;
use super::search::columns_of;
use crate::campaign::Campaign;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Sectors of a turn that a profile is averaged over: 2° each.
pub const SECTORS: usize = 180;

/// One run, with the centre of the circle taken out of every profile.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPicture {
    /// Index of the run in the campaign.
    pub index: usize,
    /// ω of the feed that the duration of the turn shows, rad/s.
    pub omega_rad_s: f64,
    /// Mean over the turn, m: measured deviation, and what the baseline and the extended model leave of it.
    pub size_m: [f64; 3],
    /// Root mean square, m: what the baseline and the extended model leave.
    pub rms_m: [f64; 2],
    /// The same three over the turn, m: mean of each sector of the recorded angle, nothing where there are no
    /// samples (or none that were read: stick-slip teeth are not simulated).
    pub profile_m: [Vec<Option<f64>>; 3],
}

/// Draws every run. `seen` is the campaign without the effects of a given model.
pub fn draw(campaign: &Campaign, seen: &Campaign, found: &Explained) -> Vec<RunPicture> {
    // The baseline with its own coefficient fitted, as in `misfit`.
    let (_, amount) = of_baseline(found);
    let (data, own) = (found.gram.column(0), found.gram.column(found.nuisance[0]));
    let left = left_by_simulation(found);
    found
        .runs
        .par_iter()
        .enumerate()
        .map(|(at, run)| {
            let theta = &seen.runs[run.index].samples.angle_rad;
            let raw = &seen.runs[run.index].samples.deviation_m;
            let visible = |i: usize| !run.hidden.get(i).copied().unwrap_or(false);
            let radius = run.view.radius_m;
            // The baseline is a size: the same at every sample of the run. It knows the programmed feed only.
            let size = (0..raw.len()).find(|&i| visible(i)).map_or(0.0, |i| {
                let slowed = found.response.gain(run.programmed_m_s / radius) - run.view.gain;
                let (data, own) = (data.samples(run, at), own.samples(run, at));
                run.deviation_m[i] - data[i] + amount * own[i] + radius * slowed
            });
            let arc = campaign.runs[run.index].samples.covered_rad().is_some();
            let centred = |samples: Vec<f64>| -> (f64, Vec<f64>) {
                let mut read = samples.clone();
                run.mask(&mut read);
                // Over an arc the orders are not independent: with all of them size and centre would be anything.
                let (size, [c, s]) = match arc {
                    true => circle(theta, &samples, visible),
                    false => {
                        let harmonics = run.basis.harmonics(&read).0;
                        (harmonics[0][0], harmonics[1])
                    }
                };
                let free = samples
                    .iter()
                    .zip(theta)
                    .map(|(y, a)| y - c * a.cos() - s * a.sin())
                    .collect();
                (size, free)
            };
            let measured = centred(campaign.runs[run.index].samples.deviation_m.clone());
            let before = centred(raw.iter().map(|y| y - size).collect());
            let after = centred(left.samples(run, at));
            let everywhere = |_: usize| true;
            RunPicture {
                index: run.index,
                omega_rad_s: run.view.omega_rad_s,
                size_m: [measured.0, before.0, after.0],
                rms_m: [rms(&before.1, everywhere), rms(&after.1, visible)],
                profile_m: [
                    sectors(theta, &measured.1, everywhere),
                    sectors(theta, &before.1, everywhere),
                    sectors(theta, &after.1, visible),
                ],
            }
        })
        .collect()
}

/// What the extended simulation leaves: the residual of the search, and what has no name, which no simulation
/// holds.
fn left_by_simulation(found: &Explained) -> Column {
    let mut left = residual(found);
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    for &item in &found.chosen {
        let Kind::Pattern(_) = found.items[item].kind else {
            continue;
        };
        for own in &found.items[item].columns {
            let Some(at) = columns.iter().position(|column| column == own) else {
                continue;
            };
            left.add(found.solution.coefficients[at], found.gram.column(*own));
        }
    }
    left
}

/// Size and centre of the least-squares circle alone.
fn circle(theta: &[f64], samples: &[f64], read: impl Fn(usize) -> bool) -> (f64, [f64; 2]) {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (_, (angle, y)) in (theta.iter().zip(samples).enumerate()).filter(|(i, _)| read(*i)) {
        let row = Vector3::new(1.0, angle.cos(), angle.sin());
        normal += row * row.transpose();
        right += row * *y;
    }
    // Three parameters of an arc of 180° and more: only where nothing was read is there nothing to solve.
    let solved = normal
        .try_inverse()
        .map_or_else(Vector3::zeros, |inverse| inverse * right);
    (solved[0], [solved[1], solved[2]])
}

fn rms(samples: &[f64], read: impl Fn(usize) -> bool) -> f64 {
    let (sum, count) = samples
        .iter()
        .enumerate()
        .filter(|(i, _)| read(*i))
        .fold((0.0, 0.0), |(sum, count), (_, y)| {
            (sum + y * y, count + 1.0)
        });
    (sum / f64::max(count, 1.0)).sqrt()
}

fn sectors(theta: &[f64], samples: &[f64], read: impl Fn(usize) -> bool) -> Vec<Option<f64>> {
    let mut sums = vec![(0.0, 0.0); SECTORS];
    for (_, (angle, y)) in theta
        .iter()
        .zip(samples)
        .enumerate()
        .filter(|(i, _)| read(*i))
    {
        let at = (angle.rem_euclid(TAU) / TAU * SECTORS as f64) as usize;
        let slot = &mut sums[at.min(SECTORS - 1)];
        slot.0 += y;
        slot.1 += 1.0;
    }
    sums.into_iter()
        .map(|(sum, count)| (count > 0.0).then(|| sum / count))
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::diagnosis::{Options, diagnose};
    use crate::simulation::machine::PositionLoop;
    use crate::simulation::{CircleTest, Instrument, Machine, Plan, PlannedTest, campaign};
    use giotto_shared::Direction;

    /// A square machine with a squareness error: measured is an oval, before keeps it, after does not, and the
    /// size of the lag is in none but the measured one.
    #[test]
    fn before_keeps_what_the_baseline_cannot_and_after_does_not() {
        let mut tests = Vec::new();
        for radius_m in [0.1, 0.2] {
            for feed_m_s in [0.02, 0.1, 0.2] {
                for direction in [Direction::Ccw, Direction::Cw] {
                    tests.push(PlannedTest {
                        test: CircleTest::new(radius_m, feed_m_s, direction),
                        timed: false,
                    });
                }
            }
        }
        let plan = Plan {
            name: "oval".into(),
            machine_name: "simulated".into(),
            machine: Machine {
                servo: [PositionLoop {
                    kv_per_s: 40.0,
                    feed_forward: 0.0,
                }; 3],
                squareness_rad: [200e-6, 0.0, 0.0],
                ..Machine::default()
            },
            instrument: Instrument {
                setup_m: [30e-6, -20e-6],
                ..Instrument::ballbar()
            },
            tests,
            shuffle: true,
        };
        let campaign = campaign(&plan, 3);
        let diagnosis = diagnose(&campaign, &Options::default()).unwrap();
        for picture in &diagnosis.picture {
            let run = &campaign.runs[picture.index];
            // ½εR·sin2θ has an rms of ½εR/√2.
            let oval = 0.5 * 200e-6 * run.radius_m / std::f64::consts::SQRT_2;
            assert!(
                (picture.rms_m[0] / oval - 1.0).abs() < 0.05,
                "{} {oval}",
                picture.rms_m[0]
            );
            assert!(picture.rms_m[1] < 2e-6, "{}", picture.rms_m[1]);
            // ΔR = −½ω²/kv²·R
            let shrink = -0.5 * (run.omega_rad_s() / 40.0).powi(2) * run.radius_m;
            assert!(
                (picture.size_m[0] - shrink).abs() < 2.5e-6,
                "{} {shrink}",
                picture.size_m[0]
            );
            assert!(picture.size_m[1].abs() < 2.5e-6 && picture.size_m[2].abs() < 2.5e-6);
            // At 45° the oval is at its largest whatever the direction; the set-up offset is not in it.
            let there = picture.profile_m[0][22].unwrap() - picture.size_m[0];
            assert!(
                (there.abs() / (0.5 * 200e-6 * run.radius_m) - 1.0).abs() < 0.25,
                "{there}"
            );
        }
    }

    /// Of arcs of 220° the size and the form are those of the circle, not of orders that an arc cannot tell apart.
    #[test]
    fn an_arc_is_drawn_as_the_circle_it_is_part_of() {
        let text = "[machine]\nboth = { kv_per_s = 40.0 }\nsquareness_um_per_m = 100.0\n[instrument]\nsetup_um = [30.0, -20.0]\n\
                    noise_um = 0.3\n[grid]\nradii_mm = [100.0, 200.0]\nfeeds_mm_s = [50.0, 200.0, 400.0]\n";
        let plan = Plan::parse(text, std::path::Path::new("plan.toml")).unwrap();
        let mut campaign = campaign(&plan, 5);
        for run in &mut campaign.runs {
            let samples = &mut run.samples;
            let kept = samples.deviation_m.len() * 220 / 360;
            samples.deviation_m.truncate(kept);
            samples.angle_rad.truncate(kept);
            if let Some(time) = &mut samples.time_s {
                time.truncate(kept);
            }
        }
        let diagnosis = diagnose(&campaign, &Options::default()).unwrap();
        assert!(!diagnosis.picture.is_empty());
        for picture in &diagnosis.picture {
            let run = &campaign.runs[picture.index];
            let shrink = -0.5 * (run.omega_rad_s() / 40.0).powi(2) * run.radius_m;
            // The oval of the missing angle between the axes is seen as size, too: half of it at most.
            let oval = 0.5 * 100e-6 * run.radius_m;
            let off = (picture.size_m[0] - shrink).abs();
            assert!(off < oval + 3e-6, "{} {shrink}", picture.size_m[0]);
            let known = || picture.profile_m[0].iter().flatten();
            let (low, high) =
                known().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            assert!(high - low < 3.0 * oval + 4e-6, "{low} {high}");
        }
    }
}
