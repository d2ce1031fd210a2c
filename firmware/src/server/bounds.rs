//! What no run may ask for, whatever the table says.
use giotto_shared::table::bounds;
use giotto_shared::wire::{CircleRun, MotionRefusal, RunField};

/// Most turns of one run.
pub const MAX_LAPS: u32 = 10_000;
/// Largest centripetal acceleration of a programmed circle, m/s²: five g, above any robot or machine tool.
pub const CENTRIPETAL_MAX_M_S2: f32 = 50.0;

/// Checks a run against the bounds of the image.
pub(super) fn check_run(run: &CircleRun) -> Result<(), MotionRefusal> {
    let within = |field, value: f32, lo: f32, hi: f32| {
        // Programmed values are decimal: a bound that was meant to be met is met in single precision. Written so that
        // NaN fails.
        if value >= lo - 1e-6 * lo.abs() && value <= hi + 1e-6 * hi.abs() {
            Ok(())
        } else {
            Err(MotionRefusal::OutOfBounds { field, value, lo, hi })
        }
    };
    let (radius_m, feed_m_s) = (run.radius_m as f32, run.feed_m_s as f32);
    within(RunField::Radius, radius_m, bounds::RADIUS_MIN_M, bounds::RADIUS_MAX_M)?;
    within(RunField::Feed, feed_m_s, bounds::FEED_MIN_M_S, bounds::FEED_MAX_M_S)?;
    within(RunField::Laps, run.laps as f32, 1.0, MAX_LAPS as f32)?;
    within(RunField::Start, run.start_rad as f32, -bounds::PHASE_MAX_RAD, bounds::PHASE_MAX_RAD)?;
    for coordinate in run.centre_m {
        within(RunField::Centre, coordinate as f32, -bounds::PLACE_MAX_M, bounds::PLACE_MAX_M)?;
    }
    let centripetal = feed_m_s * feed_m_s / radius_m;
    within(RunField::Acceleration, centripetal, 0.0, CENTRIPETAL_MAX_M_S2)
}
