//! Findings of several axes that are one.
use crate::causes::Seat;
use crate::diagnosis::finding::Finding;
use crate::diagnosis::statement;

/// One finding where both axes show the same cause of the same size.
pub(super) fn join_axes(findings: Vec<Finding>) -> Vec<Finding> {
    let mut out: Vec<Finding> = Vec::new();
    for finding in findings {
        let twin = out.iter_mut().find(|other| {
            let one_of_several = other.axis.is_some() || other.actuators.len() > 1;
            // Where circles tell the slides apart, each keeps its own.
            let apart = finding.cause.model().seat() == Seat::MachineOrOne;
            !apart && other.cause == finding.cause && one_of_several && finding.axis.is_some()
        });
        match twin {
            Some(twin) if alike(twin, &finding) => {
                let halves =
                    [&twin.estimate, &finding.estimate].map(|e| 0.5 * (e.ci95[1] - e.ci95[0]));
                let value = 0.5 * (twin.estimate.value + finding.estimate.value);
                let half = 0.5 * halves[0].hypot(halves[1]);
                twin.axis = None;
                for actuator in finding.actuators {
                    if !twin.actuators.contains(&actuator) {
                        twin.actuators.push(actuator);
                    }
                }
                if finding.effect_um.max > twin.effect_um.max {
                    twin.effect_um = finding.effect_um;
                }
                twin.remedy = statement::remedy(twin.cause, &twin.actuators, value);
                twin.estimate.value = value;
                twin.estimate.ci95 = [value - half, value + half];
                twin.share_percent += finding.share_percent;
                twin.rms_um = twin.rms_um.hypot(finding.rms_um);
                twin.probability = twin.probability.max(finding.probability);
                twin.effects.extend(finding.effects);
            }
            _ => out.push(finding),
        }
    }
    out
}

fn alike(a: &Finding, b: &Finding) -> bool {
    let width = |f: &Finding| f.estimate.ci95[1] - f.estimate.ci95[0];
    let off = (a.estimate.value - b.estimate.value).abs();
    off < width(a) + width(b) || off < 0.1 * a.estimate.value.abs()
}
