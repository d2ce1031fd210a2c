//! Sizes that depend on the radius alone: as many of them as there are radii fit whatever was measured, and nothing tests them.
use super::explained::Explained;
use super::finding::Finding;
use super::hypothesis::Kind;
use super::status::HIGHEST_UNPROVEN;
use crate::causes::{Cause, Harmonics, Site};

/// The causes among the chosen ones that fit any size of each radius together; none as long as radii are left to test them.
pub(super) fn untested(found: &Explained) -> Vec<Cause> {
    let mut radii_m: Vec<f64> = found.runs.iter().map(|run| run.view.radius_m).collect();
    radii_m.sort_by(f64::total_cmp);
    radii_m.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * b.abs());
    let causes: Vec<Cause> = found
        .stated()
        .filter_map(|item| match &found.items[item].kind {
            Kind::Cause { cause, site, shape } => {
                is_static_size(found, *cause, *site, shape).then_some(*cause)
            }
            Kind::Pattern(_) => None,
        })
        .collect();
    if causes.len() < radii_m.len() {
        Vec::new()
    } else {
        causes
    }
}

/// Whether a cause makes circles larger or smaller by the same amount at every speed, both ways.
fn is_static_size(found: &Explained, cause: Cause, site: Site, shape: &[f64]) -> bool {
    let mut by_radius: Vec<(f64, f64)> = Vec::new();
    found.runs.iter().all(|run| {
        let Some(harmonics) = cause.model().harmonics(site, shape, &run.view) else {
            return false;
        };
        let mean_m = harmonics.0[0][0];
        if harmonics != Harmonics::mean(mean_m) {
            return false;
        }
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
        match by_radius
            .iter()
            .find(|(radius_m, _)| same(*radius_m, run.view.radius_m))
        {
            Some((_, other_m)) => same(*other_m, mean_m),
            None => {
                by_radius.push((run.view.radius_m, mean_m));
                true
            }
        }
    })
}

/// Takes what nothing tests out of the certain findings.
pub(super) fn doubt(untested: &[Cause], findings: &mut [Finding]) {
    for finding in findings {
        if untested.contains(&finding.cause) {
            finding.probability = finding.probability.min(HIGHEST_UNPROVEN);
        }
    }
}

/// What cannot be told for want of radii.
pub(super) fn words(untested: &[Cause]) -> Option<String> {
    let names: Vec<&str> = untested.iter().map(|c| c.model().words().name).collect();
    (names.len() > 1).then(|| {
        format!(
            "{} together fit any sizes of {} radii, so that nothing tests them: measure one more radius",
            names.join(" and "),
            names.len()
        )
    })
}
