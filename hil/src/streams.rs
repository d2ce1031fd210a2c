//! Scenarios of streams: set-points sent one a tick, and the contour that comes of them.
use crate::contour;
use crate::planes;
use crate::programs;
use crate::scenarios::{Scenario, Trouble, ensure, holds};
use giotto_link::Controller;
use giotto_link::streaming::Streamed;
use giotto_shared::path::smoothstep;
use giotto_shared::wire::{Command, FaultCause, MotionState};
use std::f64::consts::TAU;

/// Every set-point is sent or recorded.
pub const ALL: [Scenario; 6] = [
    (
        "a program ends where its segments do, to the nanometre",
        programs::ends_exactly,
    ),
    (
        "flash, programs: contour of arcs between lines, through a machine",
        programs::contour,
    ),
    (
        "flash: contour of a ZX and a tilted circle, through a machine with a bad Z",
        planes::contour,
    ),
    ("a stream is followed set-point by set-point", followed),
    (
        "flash, streams: contour of an ellipse and a figure of eight, through a machine",
        contour,
    ),
    (
        "a stream that dries up comes to rest and faults until a reset",
        dries_up,
    ),
];

/// Time in which a stream gains its speed, and loses it, s: 150 time constants of the machine behind it, as in the library's own
/// test. What no circle shows of a machine, its third cumulant, streams leave uncorrected, and it acts while the feed changes.
const START_S: f64 = 1.2;

type Curve = fn(f64) -> [f64; 2];

fn ellipse(u: f64) -> [f64; 2] {
    [0.05 * u.cos(), 0.03 * u.sin()]
}

fn eight(u: f64) -> [f64; 2] {
    [0.05 * u.sin(), 0.03 * (2.0 * u).sin()]
}

/// Once round a closed curve at a rate (rad/s), started and ended smoothly, nm.
fn places(curve: Curve, rate: f64, tick_s: f64) -> Vec<[i32; 3]> {
    let turn_s = TAU / rate;
    let way = |t: f64| START_S * smoothstep(t / START_S).integral + (t - START_S).max(0.0);
    let place = |n: usize| {
        let t = n as f64 * tick_s;
        let [x, y] = curve(rate * (way(t) - way((t - turn_s).max(0.0))));
        [(x * 1e9).round() as i32, (y * 1e9).round() as i32, 0]
    };
    (0..=((turn_s + START_S) / tick_s).ceil() as usize)
        .map(place)
        .collect()
}

/// Streams a curve from rest at its start.
fn streamed(controller: &mut Controller, places_nm: &[[i32; 3]]) -> Result<Streamed, Trouble> {
    let start_nm = places_nm.first().copied().unwrap_or_default();
    controller.move_to(start_nm, 0.3)?;
    Ok(controller.run_stream(places_nm, 0.5, 1)?)
}

fn tick_s(controller: &Controller) -> f64 {
    1.0 / f64::from(controller.identity().tick_hz)
}

/// What comes out is what went in, one a tick, and it ends there.
fn followed(controller: &mut Controller) -> Result<(), Trouble> {
    let places_nm = places(ellipse, 8.0, tick_s(controller));
    let streamed = streamed(controller, &places_nm)?;
    ensure(
        streamed.missing + streamed.late + streamed.rejected == 0,
        || {
            let Streamed {
                missing,
                late,
                rejected,
                ..
            } = &streamed;
            format!("{missing} missing, {late} late, {rejected} rejected")
        },
    )?;
    let nm = |metres: [f64; 3]| metres.map(|m| (m * 1e9).round() as i32);
    // From the first that moves on, each in its turn.
    let start_nm = places_nm.first().copied().unwrap_or_default();
    let moved = |places: Vec<[i32; 3]>| -> Vec<[i32; 3]> {
        places
            .into_iter()
            .skip_while(|place| *place == start_nm)
            .collect()
    };
    let out = moved(
        streamed
            .recording
            .points
            .iter()
            .map(|point| nm(point.programmed_m))
            .collect(),
    );
    let same = out.starts_with(&moved(places_nm.clone()));
    ensure(same, || {
        "a set-point is not the one that was sent".to_owned()
    })?;
    let status = controller.status()?;
    let (end, is) = (places_nm.last().copied(), status.raw_nm);
    ensure(
        end == Some(is) && status.motion == MotionState::Idle,
        || format!("ends at {is:?}, not at {end:?}"),
    )?;
    ensure(status.counters.tick_overruns == 0, || {
        "ticks are late".to_owned()
    })
}

/// Distance from a polyline of many points, m.
fn from_polyline(points: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let from = |pair: &[[f64; 2]]| {
        let (a, b) = (pair[0], [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
        let square = b[0] * b[0] + b[1] * b[1];
        let t = (((p[0] - a[0]) * b[0] + (p[1] - a[1]) * b[1]) / square).clamp(0.0, 1.0);
        (p[0] - a[0] - t * b[0]).hypot(p[1] - a[1] - t * b[1])
    };
    points.windows(2).map(from).fold(f64::INFINITY, f64::min)
}

fn contour(controller: &mut Controller) -> Result<(), Trouble> {
    controller.flash(&contour::table(), &mut |_| {})?;
    let shapes: [(&str, Curve, f64, f64); 2] = [
        ("ellipse", ellipse, 5.0, 0.02),
        ("figure of eight", eight, 4.0, 0.05),
    ];
    for (name, curve, rate, bar) in shapes {
        let streamed = streamed(controller, &places(curve, rate, tick_s(controller)))?;
        let points: Vec<[f64; 2]> = (0..=2000)
            .map(|i| curve(TAU * f64::from(i) / 2000.0))
            .collect();
        let errors = contour::errors(&streamed.recording, &|p| from_polyline(&points, p));
        holds(name, errors, bar)?;
    }
    Ok(())
}

/// The host dies in the middle of a stream.
fn dries_up(controller: &mut Controller) -> Result<(), Trouble> {
    let places_nm = places(ellipse, 6.0, tick_s(controller));
    let half = &places_nm[..places_nm.len() / 2];
    // The end of the first half is no end: nobody says so.
    let before = streamed(controller, &places_nm)?;
    let dry = controller.run_stream_without_end(half, 0.5)?;
    ensure(
        dry.fault == Some(FaultCause::Starved) && dry.motion == MotionState::Fault,
        || format!("{dry:?}"),
    )?;
    ensure(dry.raw_nm == dry.corrected_nm, || {
        format!("not at rest without correction: {dry:?}")
    })?;
    ensure(controller.command(Command::Begin).is_err(), || {
        "something starts in fault".to_owned()
    })?;
    controller.reset()?;
    let after = controller.status()?;
    ensure(
        after.motion == MotionState::Idle && !before.recording.points.is_empty(),
        || format!("{after:?}"),
    )
}
