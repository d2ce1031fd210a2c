//! What no run may ask for, whatever the table says.
use giotto_shared::table::bounds;
use giotto_shared::wire::{CircleRun, MotionRefusal, RunField};

/// Most turns of one run.
pub const MAX_LAPS: u32 = 10_000;
/// Largest centripetal acceleration of a programmed circle, m/s²: five g, above any robot or machine tool.
pub const CENTRIPETAL_MAX_M_S2: f32 = 50.0;

/// Checks a run against the bounds of the image.
pub(super) fn check_run(run: &CircleRun) -> Result<(), MotionRefusal> {
    let within = |field, value: f64, lo: f32, hi: f32| {
        // Programmed values are decimal, bounds single precision: a bound that was meant to be met is met. Written
        // so that NaN fails.
        let (low, high) = (f64::from(lo), f64::from(hi));
        if value >= low - 1e-6 * low.abs() && value <= high + 1e-6 * high.abs() {
            Ok(())
        } else {
            Err(MotionRefusal::OutOfBounds { field, value: value as f32, lo, hi })
        }
    };
    within(RunField::Radius, run.radius_m, bounds::RADIUS_MIN_M, bounds::RADIUS_MAX_M)?;
    within(RunField::Feed, run.feed_m_s, bounds::FEED_MIN_M_S, bounds::FEED_MAX_M_S)?;
    within(RunField::Laps, f64::from(run.laps), 1.0, MAX_LAPS as f32)?;
    within(RunField::Start, run.start_rad, -bounds::PHASE_MAX_RAD, bounds::PHASE_MAX_RAD)?;
    for coordinate in run.centre_m {
        within(RunField::Centre, coordinate, -bounds::PLACE_MAX_M, bounds::PLACE_MAX_M)?;
    }
    let centripetal = run.feed_m_s * run.feed_m_s / run.radius_m;
    within(RunField::Acceleration, centripetal, 0.0, CENTRIPETAL_MAX_M_S2)
}
