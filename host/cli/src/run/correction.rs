//! Whether all of a run was corrected, and why not.
use crate::Failure;
use giotto_link::Controller;
use giotto_shared::table::Zone;
use giotto_shared::wire::Status;

/// Why part of the run since `before` was not corrected; `None`: all of it was.
pub(super) fn lacks(
    controller: &mut Controller,
    before: &Status,
) -> Result<Option<String>, Failure> {
    let after = controller.status()?;
    if after.active.is_none() {
        return Ok(Some("NOT corrected: no table on the controller".to_owned()));
    }
    if after.bypass || before.bypass {
        return Ok(Some(
            "NOT corrected: the correction is off (bypass)".to_owned(),
        ));
    }
    if after.counters.uncorrected_segments == before.counters.uncorrected_segments {
        return Ok(None);
    }
    let zones: Vec<String> = controller
        .table()?
        .map(|table| table.zones.iter().map(words).collect())
        .unwrap_or_default();
    Ok(Some(format!(
        "NOT corrected: outside the table's zones ({})",
        zones.join("; ")
    )))
}

fn words(zone: &Zone) -> String {
    // Single precision, to the digits that it has.
    let mm = |m: f32| format!("{:.4}", f64::from(m) * 1e3);
    let short = |m: f32| mm(m).trim_end_matches('0').trim_end_matches('.').to_owned();
    let ([r0, r1], [f0, f1]) = (zone.radius_m.map(short), zone.feed_m_s.map(short));
    format!("R {r0}–{r1} mm, {f0}–{f1} mm/s")
}
