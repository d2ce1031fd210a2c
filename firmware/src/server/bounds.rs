//! What no run may ask for, whatever the table says.
use giotto_shared::path::ExactArc;
use giotto_shared::table::bounds;
use giotto_shared::wire::{ExactCircle, ExactSegment, MotionRefusal, OVERRIDE_PERCENT, Quantity};

/// Most turns of one run.
pub const MAX_LAPS: u32 = 10_000;
/// Longest dwell, s.
const DWELL_MAX_S: f32 = 3600.0;
/// Largest centripetal acceleration of a programmed circle, m/s²: five g, above any robot or machine tool.
pub const CENTRIPETAL_MAX_M_S2: f32 = 50.0;

#[inline(never)]
fn within(quantity: Quantity, value: f32, lo: f32, hi: f32) -> Result<(), MotionRefusal> {
    // Programmed values are decimal: a bound that was meant to be met is met in single precision. Written so that NaN
    // fails.
    if value >= lo - 1e-6 * lo.abs() && value <= hi + 1e-6 * hi.abs() {
        Ok(())
    } else {
        Err(MotionRefusal::OutOfBounds {
            quantity,
            value,
            lo,
            hi,
        })
    }
}

/// Checks a segment against the bounds of the image. Its radius is the planner's to judge, which slows it down to what the
/// acceleration allows.
pub(super) fn check_segment(segment: &ExactSegment) -> Result<(), MotionRefusal> {
    match segment {
        ExactSegment::Line { feed_m_s, .. } | ExactSegment::Arc(ExactArc { feed_m_s, .. }) => {
            check_feed(*feed_m_s)
        }
        ExactSegment::Dwell { time_s } => within(Quantity::Time, *time_s, 0.0, DWELL_MAX_S),
    }
}

/// Checks an override of the feed.
pub(super) fn check_override(percent: u8) -> Result<(), MotionRefusal> {
    let [lo, hi] = OVERRIDE_PERCENT.map(f32::from);
    within(Quantity::Override, f32::from(percent), lo, hi)
}

/// Checks a feed alone.
pub(super) fn check_feed(feed_m_s: f32) -> Result<(), MotionRefusal> {
    within(
        Quantity::Feed,
        feed_m_s,
        bounds::FEED_MIN_M_S,
        bounds::FEED_MAX_M_S,
    )
}

/// Checks a run against the bounds of the image.
pub(super) fn check_run(run: &ExactCircle) -> Result<(), MotionRefusal> {
    let (radius_m, feed_m_s) = (run.radius_half_nm as f32 * 0.5e-9, run.feed_m_s);
    within(
        Quantity::Radius,
        radius_m,
        bounds::RADIUS_MIN_M,
        bounds::RADIUS_MAX_M,
    )?;
    check_feed(feed_m_s)?;
    within(Quantity::Laps, run.laps as f32, 1.0, MAX_LAPS as f32)?;
    let centripetal = feed_m_s * feed_m_s / radius_m;
    within(
        Quantity::Acceleration,
        centripetal,
        0.0,
        CENTRIPETAL_MAX_M_S2,
    )
}
