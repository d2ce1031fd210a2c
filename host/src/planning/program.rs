//! The plan as a program for the machine: RS-274 for machine tools, RAPID for ABB robots.
//!
//! Every run is entered along a tangent from outside the reach of a ballbar of ±1 mm, goes a quarter turn to
//! settle, then the turn that is to be measured, from angle 0, a quarter turn more, and leaves along a tangent. The
//! machine stands still before and after it, so that a bar can be mounted and a recording started. The centre is the
//! origin of the work offset or work object; the third axis is not moved. Written from the manuals and read back by
//! giotto's own readers and the `gcode` crate: no such program has been run on a real machine.
use super::{Plan, Purpose, Step};
use crate::campaign::{Direction, Plane};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Beyond the ±1 mm of a ballbar, mm: where the tangents begin and end.
const OUT_OF_RANGE_MM: f64 = 1.5;
/// The tangents take at least this long, s: time to come up to speed.
const RUN_UP_S: f64 = 0.1;
/// Feed between runs, mm/s.
const POSITIONING_MM_S: f64 = 50.0;

/// What the machine is told, along the two axes of the plane of each circle.
#[derive(Clone, Debug, PartialEq)]
enum Order {
    Say(String),
    /// Stand still until the operator goes on.
    Wait(String),
    Line([f64; 2], f64),
    /// What follows lies in this plane.
    In(Plane),
    /// About the origin: angles in quarter turns from the X axis, CCW positive.
    Arc {
        radius_mm: f64,
        from: i32,
        quarters: i32,
        feed_mm_s: f64,
    },
}

fn on(radius_mm: f64, quarter: f64) -> [f64; 2] {
    let (sin, cos) = (quarter * std::f64::consts::FRAC_PI_2).sin_cos();
    // 6e-17 is 0.
    [radius_mm * cos, radius_mm * sin].map(|v| (v * 1e6).round() / 1e6)
}

fn sign(step: &Step) -> i32 {
    if step.direction == Direction::Ccw {
        1
    } else {
        -1
    }
}

fn words(step: &Step) -> String {
    let way = if step.direction == Direction::Ccw {
        "ccw"
    } else {
        "cw"
    };
    let plane = match step.plane {
        Plane::Xy => "",
        Plane::Yz => ", plane YZ",
        Plane::Zx => ", plane ZX",
    };
    format!(
        "R {} mm, {} mm/s, {way}{plane}",
        step.radius_mm, step.feed_mm_s
    )
}

fn orders(plan: &Plan) -> Vec<Order> {
    let mut out = Vec::new();
    let mut bar = None;
    let mut plane = None;
    let mut circle =
        |out: &mut Vec<Order>, step: &Step, turns: usize, before: &str, after: &str| {
            let (r, f, d) = (step.radius_mm, step.feed_mm_s, sign(step));
            let lead = ((r + OUT_OF_RANGE_MM).powi(2) - r * r)
                .sqrt()
                .max(RUN_UP_S * f);
            let lead = (lead * 10.0).ceil() / 10.0;
            let side = f64::from(d);
            if plane != Some(step.plane) {
                plane = Some(step.plane);
                out.push(Order::In(step.plane));
            }
            out.push(Order::Line([-lead, -side * r], POSITIONING_MM_S));
            out.push(Order::Wait(before.to_owned()));
            out.push(Order::Line([0.0, -side * r], f));
            let arc = |from, quarters| Order::Arc {
                radius_mm: r,
                from,
                quarters,
                feed_mm_s: f,
            };
            out.push(arc(-d, d));
            out.extend((0..turns).map(|_| arc(0, 4 * d)));
            out.push(arc(0, d));
            out.push(Order::Line([-lead, side * r], f));
            out.push(Order::Wait(after.to_owned()));
        };
    if let Some(first) = plan.runs.first() {
        out.push(Order::Say(format!(
            "warm-up: {} turns of {}",
            plan.warm_up_turns,
            words(first)
        )));
        circle(
            &mut out,
            first,
            plan.warm_up_turns,
            "clear the path, no bar, then go on",
            "warm",
        );
    }
    for (k, step) in plan.runs.iter().enumerate() {
        let what = if step.purpose == Purpose::Reference {
            ", reference"
        } else {
            ""
        };
        out.push(Order::Say(format!(
            "run {} of {}: {}{what}",
            k + 1,
            plan.runs.len(),
            words(step)
        )));
        let before = if bar == Some(step.radius_mm) {
            "start the recording, then go on".to_owned()
        } else {
            format!(
                "mount the bar of {} mm, start the recording, then go on",
                step.radius_mm
            )
        };
        bar = Some(step.radius_mm);
        circle(
            &mut out,
            step,
            1,
            &before,
            "stop the recording, take the bar off its ball, then go on",
        );
    }
    out
}

/// Letters, digits and marks that no controller takes for anything in a comment.
fn plain(text: &str) -> String {
    text.chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() || " .,:/-+_=".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect()
}

fn head(plan: &Plan, campaign: &str) -> [String; 3] {
    [
        format!(
            "next measurement of {}, seed {}, {:.0} min",
            plain(campaign),
            plan.seed,
            (plan.duration_s / 60.0).ceil()
        ),
        {
            let planes: BTreeSet<_> = plan.runs.iter().map(|step| step.plane).collect();
            if planes.iter().all(|plane| *plane == Plane::Xy) {
                "centre of the circles at X0 Y0, in the plane XY, Z as it stands".into()
            } else {
                "centre of the circles at X0 Y0 Z0; the axis across a circle stays where it is"
                    .into()
            }
        },
        "the path between runs is a straight line: take the bar off first".into(),
    ]
}

/// A decimal to the micrometre, without trailing zeros.
fn number(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

/// Code of a plane and the words of its two coordinates and of the centre.
const fn gcode_words(plane: Plane) -> (&'static str, [char; 4]) {
    match plane {
        Plane::Xy => ("G17", ['X', 'Y', 'I', 'J']),
        Plane::Yz => ("G19", ['Y', 'Z', 'J', 'K']),
        Plane::Zx => ("G18", ['Z', 'X', 'K', 'I']),
    }
}

impl Plan {
    /// The measuring program in RS-274, as LinuxCNC and Grbl read it.
    pub fn gcode(&self, campaign: &str) -> String {
        let mut out = String::from("%\n");
        // Writing to a String cannot fail.
        head(self, campaign)
            .iter()
            .for_each(|line| _ = writeln!(out, "({line})"));
        out += "G17 G21 G40 G90 G94\n";
        let mut words = gcode_words(Plane::Xy);
        for order in orders(self) {
            let _ = match order {
                Order::Say(text) => writeln!(out, "({text})"),
                Order::In(plane) => {
                    words = gcode_words(plane);
                    if words.0 == "G17" && !out.contains("G18") && !out.contains("G19") {
                        continue;
                    }
                    writeln!(out, "{}", words.0)
                }
                Order::Wait(text) => writeln!(out, "M0 ({text})"),
                Order::Line([x, y], feed) => {
                    writeln!(
                        out,
                        "G1 {first}{} {second}{} F{}",
                        number(x),
                        number(y),
                        number(feed * 60.0),
                        first = words.1[0],
                        second = words.1[1],
                    )
                }
                Order::Arc {
                    radius_mm,
                    from,
                    quarters,
                    feed_mm_s,
                } => {
                    let ([sx, sy], [x, y]) = (
                        on(radius_mm, f64::from(from)),
                        on(radius_mm, f64::from(from + quarters)),
                    );
                    let code = if quarters > 0 { "G3" } else { "G2" };
                    let [x, y, i, j] = [x, y, -sx, -sy].map(number);
                    writeln!(
                        out,
                        "{code} {first}{x} {second}{y} {third}{i} {fourth}{j} F{}",
                        number(feed_mm_s * 60.0),
                        first = words.1[0],
                        second = words.1[1],
                        third = words.1[2],
                        fourth = words.1[3],
                    )
                }
            };
        }
        out + "M2\n%\n"
    }

    /// The measuring program in RAPID: literal targets in a work object whose origin is the centre. Tool, work
    /// object, orientation and configuration stand at its top, to be set by whoever knows the robot.
    pub fn rapid(&self, campaign: &str) -> String {
        let mut out = String::from("MODULE giotto_plan\n");
        head(self, campaign)
            .iter()
            .for_each(|line| _ = writeln!(out, "    ! {line}"));
        out += "    ! Set these to the robot at hand; the orientation and configuration of every target below are those of a\n    \
                ! tool that points down: replace [0,0,1,0],[0,0,0,0] throughout if yours are others.\n    \
                PERS tooldata giotto_tool := [TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n    \
                PERS wobjdata giotto_frame := [FALSE,TRUE,\"\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n    \
                PROC main()\n        ConfL \\Off;\n";
        let target = |plane: Plane, [u, v]: [f64; 2]| {
            let mut point = [0.0; 3];
            let [first, second] = plane.axes();
            (point[first.index()], point[second.index()]) = (u, v);
            let [x, y, z] = point.map(number);
            format!("[[{x},{y},{z}],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
        };
        let mut plane = Plane::Xy;
        let speed = |feed: f64| format!("[{},500,5000,1000]", number(feed));
        let with = "giotto_tool\\WObj:=giotto_frame";
        let list = orders(self);
        for (k, order) in list.iter().enumerate() {
            // Before standing still the path ends; elsewhere it is passed at speed.
            let zone = if matches!(list.get(k + 1), Some(Order::Wait(_)) | None) {
                "fine"
            } else {
                "z0"
            };
            let _ = match order {
                Order::Say(text) => writeln!(out, "        ! {text}"),
                Order::In(new) => {
                    plane = *new;
                    Ok(())
                }
                Order::Wait(text) => {
                    writeln!(out, "        TPWrite \"{text}\";\n        Stop \\NoRegain;")
                }
                Order::Line(to, feed) => {
                    writeln!(
                        out,
                        "        MoveL {},{},{zone},{with};",
                        target(plane, *to),
                        speed(*feed)
                    )
                }
                Order::Arc {
                    radius_mm,
                    from,
                    quarters,
                    feed_mm_s,
                } => {
                    // Half a turn at most in one instruction.
                    let parts = (quarters.abs() + 1) / 2;
                    let at = |share: f64| {
                        target(
                            plane,
                            on(*radius_mm, f64::from(*from) + share * f64::from(*quarters)),
                        )
                    };
                    for part in 0..parts {
                        let share = |s: f64| (f64::from(part) + s) / f64::from(parts);
                        let (via, to, speed) = (at(share(0.5)), at(share(1.0)), speed(*feed_mm_s));
                        let zone = if part + 1 == parts { zone } else { "z0" };
                        let _ = writeln!(out, "        MoveC {via},{to},{speed},{zone},{with};");
                    }
                    Ok(())
                }
            };
        }
        out + "    ENDPROC\nENDMODULE\n"
    }
}
