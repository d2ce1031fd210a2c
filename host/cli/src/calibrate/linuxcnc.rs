//! The machine behind LinuxCNC: circles as a program of its own, its feedback as the component sees it.
use crate::failure::Failure;
use crate::ring::{Measured, Pair, Proof, image};
use giotto::analysis;
use giotto::campaign::import::{Options, add};
use giotto::campaign::{Campaign, Run, read};
use giotto_link::Controller;
use giotto_link::linuxcnc::drive::{self, Sample};
use giotto_shared::Direction;
use giotto_shared::table::Table;
use giotto_shared::wire::Command;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// A stop of a program lasts so long, s; standing still for half of it is one.
const STOP_S: f64 = 0.6;
/// So long the machine is watched before and after a circle, s.
const MARGIN_S: f64 = 0.1;
/// Turns of a circle, and those that tell one from the way to it.
const TURNS: f64 = 1.75;
const LEAST_TURNS: f64 = 1.6;
/// Way to a circle, of a second at its feed, and at least, mm; feed of the way, mm/min.
const LEAD_S: f64 = 0.2;
const LEAST_LEAD_MM: f64 = 10.0;
const POSITIONING: f64 = 3000.0;

/// One circle: radius, mm, feed, mm/s, and way.
type Circle = (f64, f64, Direction);

fn both_ways(circles: &[(f64, f64)]) -> Vec<Circle> {
    let ways = [Direction::Ccw, Direction::Cw];
    let each = circles
        .iter()
        .flat_map(|(r, f)| ways.map(|way| (*r, *f, way)));
    each.collect()
}

/// Circles about the origin, entered along a tangent, with a stop before and after each.
fn program(circles: &[Circle]) -> String {
    let mut out = String::from("G21 G17 G40 G90 G94 G64\n");
    for (r, feed_mm_s, direction) in circles {
        let (arc, side) = match direction {
            Direction::Ccw => ("G3", 1.0),
            Direction::Cw => ("G2", -1.0),
        };
        let (lead, low) = ((LEAD_S * feed_mm_s).max(LEAST_LEAD_MM), -side * r);
        // Writing to a String does not fail.
        let _ = write!(
            out,
            "G1 X-{lead:.4} Y{low:.4} F{POSITIONING}\nG4 P{STOP_S}\nG1 X0 F{:.3}\n\
             {arc} X0 Y{low:.4} I0 J{up:.4}\n{arc} X{r:.4} Y0 I0 J{up:.4}\n\
             {arc} X0 Y{up:.4} I-{r:.4} J0\n{arc} X-{r:.4} Y0 I0 J{low:.4}\nG4 P{STOP_S}\n",
            feed_mm_s * 60.0,
            up = side * r,
        );
    }
    out + "M2\n"
}

/// The samples of each circle: motions between two stops that are long enough for one.
fn cut<'a>(samples: &'a [Sample], circles: &[Circle], period_s: f64) -> Vec<&'a [Sample]> {
    let still = (0.5 * STOP_S / period_s) as usize;
    let margin = (MARGIN_S / period_s) as usize;
    let step = |k: usize| {
        let [a, b] = [samples[k].commanded_mm, samples[k + 1].commanded_mm];
        let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
        square.sqrt()
    };
    let mut motions: Vec<([usize; 2], f64)> = Vec::new();
    for k in 0..samples.len().saturating_sub(1) {
        let way = step(k);
        match motions.last_mut() {
            _ if way <= 0.0 => {}
            Some(([_, end], length)) if k - *end < still => {
                *end = k + 1;
                *length += way;
            }
            _ => motions.push(([k, k + 1], way)),
        }
    }
    let mut found = Vec::new();
    for ([from, to], length) in motions {
        let least = circles
            .get(found.len())
            .map(|(r, ..)| LEAST_TURNS * TAU * r);
        if least.is_some_and(|least| length > least) {
            let to = (to + margin).min(samples.len());
            found.push(&samples[from.saturating_sub(margin)..to]);
        }
    }
    found
}

/// Whether set-points have kept the feed of a circle. On a busy computer LinuxCNC's planner waits for the next block, and what
/// the machine then does is no circle at that feed.
fn kept_feed(samples: &[Sample], (radius_mm, feed_mm_s, _): &Circle, period_s: f64) -> bool {
    let on_circle = |sample: &Sample| {
        let [x, y, _] = sample.commanded_mm;
        (x.hypot(y) - radius_mm).abs() < ON_CIRCLE_MM
    };
    let angle = |sample: &Sample| sample.commanded_mm[1].atan2(sample.commanded_mm[0]);
    let mut quarters = [0.0f64; 4];
    let mut turned = 0.0;
    for pair in samples.windows(2).filter(|pair| pair.iter().all(on_circle)) {
        let step = angle(&pair[1]) - angle(&pair[0]);
        let step = (step - TAU * (step / TAU).round()).abs();
        turned += step;
        // The quarters between 1/4 and 5/4 of a turn: away from both ends.
        let quarter = (turned / (0.25 * TAU)) as usize;
        if let Some(time_s) = quarter.checked_sub(1).and_then(|k| quarters.get_mut(k)) {
            *time_s += period_s;
        }
    }
    let meant_s = 0.25 * TAU * radius_mm / feed_mm_s;
    let slack_s = FEED_SLACK * meant_s + 2.0 * period_s;
    quarters
        .iter()
        .all(|time_s| (time_s - meant_s).abs() < slack_s)
}

/// Set-points that lie so near to a circle are on it, mm.
const ON_CIRCLE_MM: f64 = 0.05;
/// So much may a quarter of a circle take longer, or less long, than its feed says.
const FEED_SLACK: f64 = 0.02;
/// So often circles are run again whose feed was not kept.
const AGAIN: usize = 2;

/// Runs circles in LinuxCNC, those again that were not run as they should; the campaign is kept in `folder`.
pub(super) fn measure(
    circles: &[(f64, f64)],
    folder: &Path,
    wish: &AtomicBool,
) -> Result<Campaign, Failure> {
    let failed =
        |what: &dyn std::fmt::Display| Failure::input(format_args!("{}: {what}", folder.display()));
    let period_s = drive::period_s()?;
    let circles = both_ways(circles);
    let mut kept: Vec<Option<Vec<Sample>>> = vec![None; circles.len()];
    for _ in 0..=AGAIN {
        let open: Vec<usize> = (0..circles.len()).filter(|k| kept[*k].is_none()).collect();
        if open.is_empty() {
            break;
        }
        let list: Vec<Circle> = open.iter().map(|k| circles[*k]).collect();
        let samples = ran(&list, wish)?;
        let runs = cut(&samples, &list, period_s);
        if runs.len() != list.len() {
            return Err(Failure::controller(format_args!(
                "{} circles were seen of {}: did LinuxCNC wait on its way?",
                runs.len(),
                list.len()
            )));
        }
        for (k, rows) in open.into_iter().zip(runs) {
            if kept_feed(rows, &circles[k], period_s) {
                kept[k] = Some(rows.to_vec());
            }
        }
    }
    for (rows, circle) in kept.iter().zip(&circles) {
        let (radius_mm, feed_mm_s, _) = circle;
        let rows = rows.as_ref().ok_or_else(|| {
            Failure::controller(format_args!(
                "LinuxCNC did not keep its feed on R {radius_mm} mm at {feed_mm_s} mm/s"
            ))
            .help("give this computer less to do beside it, or lower --max-feed and --max-acceleration")
        })?;
        add_circle(rows, circle, period_s, folder)?;
    }
    read(folder).map_err(|error| failed(&error))
}

/// Has LinuxCNC run circles.
fn ran(circles: &[Circle], wish: &AtomicBool) -> Result<Vec<Sample>, Failure> {
    let failed = |error: std::io::Error| Failure::input(format_args!("the program: {error}"));
    let work = tempfile::tempdir().map_err(failed)?;
    let file = work.path().join("circles.ngc");
    std::fs::write(&file, program(circles)).map_err(failed)?;
    let motion_s = |(r, f, _): &Circle| (TURNS * TAU * r + 4.0 * r) / f + 10.0;
    let whole_s: f64 = circles.iter().map(motion_s).sum();
    Ok(drive::run(
        &file,
        Duration::from_secs_f64(2.0 * whole_s),
        wish,
    )?)
}

/// Adds a circle to the campaign.
fn add_circle(
    rows: &[Sample],
    circle: &Circle,
    period_s: f64,
    folder: &Path,
) -> Result<(), Failure> {
    let failed =
        |what: &dyn std::fmt::Display| Failure::input(format_args!("{}: {what}", folder.display()));
    let work = tempfile::tempdir().map_err(|error| failed(&error))?;
    let file = work.path().join("circle.csv");
    let mut text = String::from("time_s,x_mm,y_mm,z_mm\n");
    for (row, sample) in rows.iter().enumerate() {
        let [x, y, z] = sample.measured_mm;
        let _ = writeln!(text, "{:.6},{x:.6},{y:.6},{z:.6}", row as f64 * period_s);
    }
    std::fs::write(&file, text).map_err(|error| failed(&error))?;
    add(&[file], folder, &options(circle), &|_, _| ()).map_err(|error| failed(&error))?;
    Ok(())
}

fn options((radius_mm, feed_mm_s, direction): &Circle) -> Options {
    Options {
        setup: Some("A".to_owned()),
        machine: Some("LinuxCNC".to_owned()),
        ..Options::of_circle(radius_mm * 1e-3, feed_mm_s * 1e-3, *direction)
    }
}

/// Circles before and after the table is flashed.
pub(super) fn prove(
    controller: &mut Controller,
    table: &Table,
    circles: &[(f64, f64)],
    folder: &Path,
    wish: &AtomicBool,
) -> Result<Proof, Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::input(format_args!("the table: {error}"));
    let image = image(table).map_err(|error| failed(&error))?;
    controller.command(Command::Bypass { on: true })?;
    let before = measure(circles, &folder.join("before"), wish)?;
    let flashed = controller.flash(&image, &mut |_| ())?;
    let counters = controller.status()?.counters;
    controller.command(Command::Bypass { on: false })?;
    let after = measure(circles, &folder.join("after"), wish)?;
    let since = controller.status()?.counters;
    let measured = |run: Run| -> Result<Measured, Failure> {
        let analysis = analysis::of_run(&run, None).map_err(|error| failed(&error))?;
        Ok(Measured {
            samples: run.samples,
            analysis,
        })
    };
    let pair = |(before, after)| -> Result<Pair, Failure> {
        Ok(Pair {
            before: measured(before)?,
            after: measured(after)?,
        })
    };
    let circles: Result<Vec<Pair>, Failure> =
        before.runs.into_iter().zip(after.runs).map(pair).collect();
    Ok(Proof {
        flashed,
        clamped: since.offset_clamps.wrapping_sub(counters.offset_clamps)
            + since.slew_clamps.wrapping_sub(counters.slew_clamps),
        circles: circles?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Set-points of the program at 1 kHz, by its own words: lines and arcs at their feed, stops.
    fn walked(circles: &[Circle]) -> Vec<Sample> {
        let mut places = vec![[0.0; 2]];
        let stop = |places: &mut Vec<[f64; 2]>| {
            let [x, y] = *places.last().unwrap();
            places.extend(std::iter::repeat_n([x, y], 600));
        };
        for (r, f, direction) in circles {
            let side = if *direction == Direction::Ccw {
                1.0
            } else {
                -1.0
            };
            let [x0, y0] = *places.last().unwrap();
            let (x1, y1) = (-(0.2 * f).max(10.0), -side * r);
            let ticks = (f64::hypot(x1 - x0, y1 - y0) / 0.05) as usize;
            for k in 1..=ticks {
                let s = k as f64 / ticks as f64;
                places.push([x0 + s * (x1 - x0), y0 + s * (y1 - y0)]);
            }
            stop(&mut places);
            let ticks = (1.75 * TAU * r / (f * 1e-3)) as usize;
            for k in 0..=ticks {
                let angle = 1.75 * TAU * k as f64 / ticks as f64;
                places.push([r * angle.sin(), -side * r * angle.cos()]);
            }
            stop(&mut places);
        }
        let sample = |[x, y]: [f64; 2]| Sample {
            commanded_mm: [x, y, 0.0],
            measured_mm: [x, y, 0.0],
        };
        places.into_iter().map(sample).collect()
    }

    #[test]
    fn each_circle_is_cut_out_and_no_way_to_one_is_taken_for_it() {
        let circles = both_ways(&[(150.0, 300.0), (60.0, 100.0)]);
        let samples = walked(&circles);
        let runs = cut(&samples, &circles, 1e-3);
        assert_eq!(runs.len(), 4);
        for (rows, (r, f, _)) in runs.iter().zip(&circles) {
            let turns = (rows.len() as f64 - 200.0) * 1e-3 * f / (TAU * r);
            assert!((turns - 1.75).abs() < 0.02, "{turns}");
        }
        // One that LinuxCNC did not run to its end is missed.
        let half = &samples[..samples.len() - 5000];
        assert_eq!(cut(half, &circles, 1e-3).len(), 3);
    }

    #[test]
    fn a_circle_on_which_the_planner_waited_is_run_again() {
        let circles = both_ways(&[(150.0, 300.0), (60.0, 100.0)]);
        let samples = walked(&circles);
        for (rows, circle) in cut(&samples, &circles, 1e-3).into_iter().zip(&circles) {
            assert!(kept_feed(rows, circle, 1e-3));
            // A tenth of a second at one place, in the middle of it.
            let middle = rows.len() / 2;
            let waited: Vec<Sample> = rows[..middle]
                .iter()
                .chain(std::iter::repeat_n(&rows[middle], 100))
                .chain(&rows[middle..])
                .copied()
                .collect();
            assert!(!kept_feed(&waited, circle, 1e-3));
            let (r, f, way) = *circle;
            assert!(!kept_feed(rows, &(r, 1.05 * f, way), 1e-3));
        }
    }

    #[test]
    fn arcs_of_the_program_have_their_centre_at_the_origin() {
        for line in program(&both_ways(&[(150.0, 300.0)])).lines() {
            let word = |letter: char| -> f64 {
                let word = line.split(' ').find_map(|word| word.strip_prefix(letter));
                word.map_or(0.0, |number| number.parse().unwrap())
            };
            if line.starts_with("G2 ") || line.starts_with("G3 ") {
                // Start is end of the centre's way back: centre = start + (I, J), and every end lies on the circle.
                assert!(
                    (f64::hypot(word('X'), word('Y')) - 150.0).abs() < 1e-9,
                    "{line}"
                );
                assert!(
                    (f64::hypot(word('I'), word('J')) - 150.0).abs() < 1e-9,
                    "{line}"
                );
            }
        }
    }
}
