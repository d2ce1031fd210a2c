//! What a finding says is to be turned, turned: each cause, both signs, every slide and pair. The machine is the tests' own, its
//! faults are put in by hand, and of the code under test only the words of the finding are used: what they name is turned the
//! way they say and by the size they say, and the circles must come nearer to those without the fault.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::diagnosis::{Finding, Options, diagnose};
use giotto_tests::machine::plan::Grid;
use giotto_tests::machine::{
    AxisChain, Cyclic, Friction, Instrument, Machine, Plan, Plane, Spread, StickSlip, Thermal,
    Vibration, simulate,
};
use rayon::prelude::*;

/// Largest radius of the grid, m.
const LARGEST_M: f64 = 0.3;
const LETTERS: [&str; 3] = ["X", "Y", "Z"];

/// One fault in a machine.
struct Fault {
    /// Name of the cause.
    cause: &'static str,
    /// Slides that the finding must name; empty for the machine as a whole.
    slides: Vec<usize>,
    /// Planes that are measured.
    planes: Vec<Plane>,
    /// Share of the misfit that may be left.
    left: f64,
    machine: Machine,
}

/// A machine without a fault: one lag on each slide.
fn healthy() -> Machine {
    let axis = AxisChain {
        lag_s: 0.008,
        dead_time_s: 0.002,
        ..AxisChain::default()
    };
    Machine {
        axes: [axis.clone(), axis.clone(), axis],
        ..Machine::default()
    }
}

fn fault(cause: &'static str, slides: &[usize], plane: usize, put: impl Fn(&mut Machine)) -> Fault {
    let mut machine = healthy();
    put(&mut machine);
    Fault {
        cause,
        slides: slides.to_vec(),
        planes: vec![Plane::ALL[plane]],
        left: 0.35,
        machine,
    }
}

/// Of one slide, or of one that shifts the other, in the plane whose first slide it is.
fn of_slides(sign: f64, out: &mut Vec<Fault>) {
    for plane in 0..3 {
        let [a, b] = Plane::PAIRS[plane];
        out.push(fault("backlash", &[a], plane, |m| {
            m.axes[a].backlash_m = sign * 12e-6;
        }));
        out.push(fault("reversal_spike", &[a], plane, |m| {
            m.axes[a].friction = Some(Friction {
                peak_m: sign * 15e-6,
                decay_s: 0.03,
                rise_s: 0.003,
                presliding_m: 5e-6,
            });
        }));
        out.push(fault("cyclic_error", &[a], plane, |m| {
            m.geometry.cyclic[a] = Some(Cyclic {
                amplitude_m: 6e-6,
                pitch_m: 0.02,
                phase_rad: 1.5 + sign,
            });
        }));
        for (mover, moved) in [(a, b), (b, a)] {
            out.push(fault("lateral_play", &[mover, moved], plane, |m| {
                m.lateral_play_m[mover][moved] = sign * 12e-6;
            }));
            out.push(fault("straightness", &[mover, moved], plane, |m| {
                m.geometry.bow_per_m[mover][moved] = sign * 40e-6 / LARGEST_M.powi(2);
            }));
        }
        if sign > 0.0 {
            out.push(fault("stick_slip", &[a], plane, |m| {
                m.axes[a].stick_slip = Some(StickSlip {
                    height_m: 10e-6,
                    speed_m_s: 0.015,
                    slip_s: 0.004,
                });
            }));
        }
        // Circles in one plane cannot tell one scale from two.
        let mut scale = fault("scale_error", &[a], plane, |m| {
            m.geometry.scale[a] = sign * 80e-6;
        });
        scale.planes = Plane::ALL.to_vec();
        out.push(scale);
    }
}

/// Of two slides.
fn of_pairs(sign: f64, out: &mut Vec<Fault>) {
    for plane in 0..3 {
        let pair = Plane::PAIRS[plane];
        let [a, b] = pair;
        out.push(fault("scale_mismatch", &pair, plane, |m| {
            m.geometry.scale[a] = sign * 40e-6;
            m.geometry.scale[b] = -sign * 40e-6;
        }));
        out.push(fault("squareness", &pair, plane, |m| {
            m.geometry.squareness_rad[a] = sign * 80e-6;
        }));
        out.push(fault("servo_mismatch", &pair, plane, |m| {
            m.axes[if sign > 0.0 { a } else { b }].lag_s += 60e-6;
        }));
        out.push(fault("bandwidth_mismatch", &pair, plane, |m| {
            let filtered = if sign > 0.0 { a } else { b };
            filter(m, filtered, 0.02);
        }));
    }
}

/// A moving average on one slide, whose delay the others have as dead time: a filter of constant delay.
fn filter(machine: &mut Machine, slide: usize, average_s: f64) {
    let change_s = 0.5 * (average_s - machine.axes[slide].average_s);
    machine.axes[slide].average_s = average_s;
    for (other, axis) in machine.axes.iter_mut().enumerate() {
        if other != slide {
            axis.dead_time_s += change_s;
        }
    }
}

/// Of the machine as a whole.
fn of_the_machine(sign: f64, out: &mut Vec<Fault>) {
    out.push(fault("radius_offset", &[], 0, |m| {
        m.radius_offset_m = sign * 15e-6;
    }));
    out.push(fault("scale_error", &[], 0, |m| {
        m.geometry.scale = [sign * 80e-6; 3];
    }));
    out.push(fault("thermal_drift", &[], 0, |m| {
        m.thermal = Some(Thermal {
            total: sign * 100e-6,
            curvature: 0.0,
            hook: 0.0,
        });
    }));
    // A feed-forward that makes circles larger than its lag alone, or a filter that rounds off more. The words name no size.
    let mut higher = fault("higher_order_dynamics", &[], 0, |m| {
        for axis in &mut m.axes {
            if sign > 0.0 {
                axis.lag_s = 0.04;
                axis.feed_forward = 0.8;
            } else {
                axis.lag_s = 0.0;
                axis.average_s = 0.12;
            }
        }
    });
    higher.left = 0.9;
    out.push(higher);
    if sign > 0.0 {
        out.push(fault("vibration", &[], 0, |m| {
            m.vibration = Some(Vibration {
                frequency_hz: 23.0,
                amplitude_m: 5e-6,
                axis: None,
            });
        }));
        out.push(fault("interpolation_chord", &[], 0, |m| {
            m.interpolation_s = 0.012;
        }));
        out.push(fault("feed_clamp", &[], 0, |m| {
            m.centripetal_limit_m_s2 = 1.2;
        }));
    }
}

/// A size in words, SI: the first number that a unit follows.
fn size(words: &str) -> f64 {
    let tokens: Vec<&str> = words
        .split([' ', ',', ':', ';'])
        .filter(|t| !t.is_empty())
        .collect();
    let unit = |text: &str| {
        Some(match text {
            "µs" | "µm" | "µm/m" | "ms²" => 1e-6,
            "ms" | "mm" => 1e-3,
            "Hz" | "m/s²" => 1.0,
            _ => return None,
        })
    };
    let found = tokens.windows(2).find_map(|pair| {
        let number: f64 = pair[0].parse().ok()?;
        Some(number * unit(pair[1])?)
    });
    found.unwrap_or_else(|| panic!("no size in: {words}"))
}

/// The slide whose letter follows `before`.
fn slide_after(words: &str, before: &str) -> Option<usize> {
    let rest = words.split_once(before)?.1;
    LETTERS.iter().position(|letter| rest.starts_with(letter))
}

/// The slide that the words begin with.
fn subject(words: &str) -> usize {
    slide_after(&format!("|{words}"), "|").unwrap_or_else(|| panic!("no slide first: {words}"))
}

/// +1 if the words say the first, −1 the second.
fn side(words: &str, plus: &str, minus: &str) -> Option<f64> {
    match (words.contains(plus), words.contains(minus)) {
        (true, false) => Some(1.0),
        (false, true) => Some(-1.0),
        (true, true) => panic!("both sides: {words}"),
        (false, false) => None,
    }
}

/// Turns what the words name, the way they say, by their size. `slides` are those of the finding.
fn turn(machine: &mut Machine, words: &str, slides: &[usize]) {
    // What has no way to turn, but a thing to mend: it must be the thing that is broken.
    let same = |found: f64, real: f64, share: f64| {
        assert!(
            (found / real - 1.0).abs() < share,
            "{real} is called {found}: {words}"
        );
    };
    let response = side(
        words,
        "lower the feed-forward",
        "shorten the acceleration filters",
    );
    if let Some(side) = response {
        return for axis in &mut machine.axes {
            match side > 0.0 {
                true => axis.feed_forward -= 0.3,
                false => axis.average_s *= 0.5,
            }
        };
    }
    let size = size(words);
    if let Some(slide) = slide_after(words, "raise kv of ") {
        machine.axes[slide].lag_s -= size;
    } else if let Some(slide) = slide_after(words, "shorten the filter of ") {
        let now_s2 = machine.axes[slide].average_s.powi(2) / 12.0;
        filter(machine, slide, (12.0 * (now_s2 - size).max(0.0)).sqrt());
    } else if let Some(way) = side(words, "raise the scale of both", "lower the scale of both") {
        machine
            .geometry
            .scale
            .iter_mut()
            .for_each(|s| *s += way * size);
    } else if let Some(slide) = slide_after(words, "raise the scale of ") {
        machine.geometry.scale[slide] += size;
    } else if let Some(slide) = slide_after(words, "lower the scale of ") {
        machine.geometry.scale[slide] -= size;
    } else if let Some(way) = side(words, "raise its scale by", "lower its scale by") {
        machine.geometry.scale[subject(words)] += way * size;
    } else if let Some(way) = side(words, "open it by", "close it by") {
        // The first slide moves by ε of the second: the angle between their ways is ε less than a right one.
        let first = slide_after(words, "the angle between ").unwrap();
        machine.geometry.squareness_rad[first] -= way * size;
    } else if let Some(way) = side(
        words,
        "raise its backlash compensation by",
        "lower its backlash compensation by",
    ) {
        machine.axes[subject(words)].backlash_m -= way * size;
    } else if let Some(way) = side(
        words,
        "raise its friction compensation by",
        "lower its friction compensation by",
    ) {
        let friction = machine.axes[subject(words)].friction.as_mut().unwrap();
        friction.peak_m -= way * size;
    } else if let Some(way) = side(
        words,
        "raise the tool radius by",
        "lower the tool radius by",
    ) {
        machine.radius_offset_m -= way * size;
    } else if words.contains("raise the preload of its guide until") {
        let play = &mut machine.lateral_play_m[slides[0]][slides[1]];
        assert_eq!(subject(words), slides[0], "{words}");
        *play -= play.signum() * size;
    } else if let Some(way) = side(words, "its ends towards plus", "its ends towards minus") {
        let guide = slide_after(words, "the guide of ").unwrap();
        machine.geometry.bow_per_m[guide][slides[1]] -= way * size / LARGEST_M.powi(2);
    } else if words.contains("within each pitch: map it") {
        let map = machine.geometry.cyclic[subject(words)].as_mut().unwrap();
        map.amplitude_m -= size;
    } else if let Some(way) = side(words, "circles grew by", "circles shrank by") {
        machine.thermal.as_mut().unwrap().total -= way * size;
    } else if words.contains("stiffen or damp it") {
        same(size, machine.vibration.unwrap().frequency_hz, 0.01);
        machine.vibration = None;
    } else if words.contains("shorten the cycle of the interpolator") {
        same(size, machine.interpolation_s, 0.05);
        machine.interpolation_s /= 3.0;
    } else if words.contains("raise that limit") {
        same(size, machine.centripetal_limit_m_s2, 0.05);
        machine.centripetal_limit_m_s2 *= 4.0;
    } else if words.contains("lubricate its guide") {
        let slide = subject(words);
        same(size, machine.axes[slide].stick_slip.unwrap().height_m, 0.5);
        machine.axes[slide].stick_slip = None;
    } else {
        panic!("nothing to turn in: {words}");
    }
}

fn plan(planes: &[Plane]) -> Plan {
    Grid {
        radii_m: vec![0.1, 0.15, LARGEST_M],
        feeds_m_s: vec![0.02, 0.06, 0.12, 0.2, 0.3, 0.45, 0.6],
        samples: 500,
        planes: planes.to_vec(),
        ..Grid::paper()
    }
    .plan(7)
}

/// Root mean square of the machine's circles less those of the healthy one, m. Of a pair the words turn one slide against the
/// other: what both have in common is another cause's.
fn misfit_m(machine: &Machine, plan: &Plan, pair: bool) -> f64 {
    let healthy = healthy();
    let (mut sum, mut count) = (0.0, 0.0);
    for test in &plan.tests {
        let off: Vec<f64> = {
            let [a, b] = [machine, &healthy].map(|m| {
                let places = simulate(m, test, plan.length_s, 0.0).position_m;
                let radii = places.into_iter().map(|p| test.plane.radius(p));
                radii.collect::<Vec<f64>>()
            });
            a.iter().zip(&b).map(|(a, b)| a - b).collect()
        };
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let common = if pair { mean } else { 0.0 };
        sum += off.iter().map(|v| (v - common).powi(2)).sum::<f64>();
        count += off.len() as f64;
    }
    (sum / count).sqrt()
}

fn names(finding: &Finding) -> Vec<usize> {
    finding.actuators.iter().map(|a| a.index()).collect()
}

/// Hides the fault, asks, does what is said. What went wrong, if anything did.
fn wrong(fault: &Fault, seed: u64) -> Option<String> {
    let instrument = Instrument {
        noise_m: 0.7e-6,
        spread: Spread {
            radius_m: 0.4e-6,
            ..Instrument::perfect().spread
        },
        offset_m: [35e-6, -20e-6],
        ..Instrument::perfect()
    };
    let plan = plan(&fault.planes);
    let campaign = instrument.measure(&fault.machine, &plan, seed);
    let found = diagnose(&campaign, &Options::default()).unwrap();
    let named = |f: &&Finding| f.cause.id() == fault.cause && names(f) == fault.slides;
    let what = format!("{} of {:?}, seed {seed}", fault.cause, fault.slides);
    let remedy = match found.findings.iter().find(named) {
        Some(finding) => finding.remedy.clone(),
        None => {
            let all: Vec<String> = found.findings.iter().map(Finding::title).collect();
            return Some(format!("{what}: found is {all:?}"));
        }
    };
    let pair = fault.slides.len() == 2 && !["lateral_play", "straightness"].contains(&fault.cause);
    let misfit_m = |machine: &Machine| match fault.cause {
        "higher_order_dynamics" => beside_a_lag_m(machine, &plan),
        _ => misfit_m(machine, &plan, pair),
    };
    let before = misfit_m(&fault.machine);
    let mut turned = fault.machine.clone();
    turn(&mut turned, &remedy, &fault.slides);
    let after = misfit_m(&turned);
    // Written so that a misfit that is no number fails.
    let fell = before > 0.5e-6 && after < fault.left * before;
    (!fell).then(|| {
        let [before, after] = [before, after].map(|m| m * 1e6);
        format!("{what}: {before:.2} -> {after:.2} µm: {remedy}")
    })
}

/// What the best lag leaves of the sizes of the circles, rms, m: what is beyond it has a higher order.
fn beside_a_lag_m(machine: &Machine, plan: &Plan) -> f64 {
    let sizes: Vec<(f64, f64, f64)> = plan
        .tests
        .iter()
        .map(|test| {
            let places = simulate(machine, test, plan.length_s, 0.0).position_m;
            let sum: f64 = places
                .iter()
                .map(|p| test.plane.radius(*p) - test.radius_m)
                .sum();
            let omega = test.feed_m_s / test.radius_m;
            (test.radius_m, omega, sum / places.len() as f64)
        })
        .collect();
    let left = |tau_s: f64| {
        let off = sizes.iter().map(|(radius, omega, size)| {
            size - radius * ((1.0 + (omega * tau_s).powi(2)).powf(-0.5) - 1.0)
        });
        (off.map(|v| v * v).sum::<f64>() / sizes.len() as f64).sqrt()
    };
    (0..2000)
        .map(|k| left(f64::from(k) * 5e-5))
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn turned_as_the_finding_says_the_machine_comes_nearer_to_a_sound_one() {
    let mut faults = Vec::new();
    for sign in [1.0, -1.0] {
        of_slides(sign, &mut faults);
        of_pairs(sign, &mut faults);
        of_the_machine(sign, &mut faults);
    }
    // Every cause that needs no arm.
    let slides: Vec<&str> = giotto::causes::ALL
        .iter()
        .map(|model| model.words().id)
        .filter(|id| !id.starts_with("joint_") && *id != "link_length")
        .collect();
    for id in &slides {
        assert!(faults.iter().any(|f| f.cause == *id), "{id} is not turned");
    }
    let wrong: Vec<String> = faults
        .par_iter()
        .enumerate()
        .filter_map(|(seed, fault)| wrong(fault, 900 + seed as u64))
        .collect();
    assert!(
        wrong.is_empty(),
        "{} of {}: {wrong:#?}",
        wrong.len(),
        faults.len()
    );
}
