//! Figures of a pair of runs in the terms of ballbar software, for comparison. Only those that follow from the
//! second order of the profile are formed here; backlash, spikes and the rest are for diagnosis.
use super::iso230::pairs;
use super::{Report, RunAnalysis};

/// What a pair says in ballbar terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counterparts {
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// G(b), m.
    pub circularity_m: Option<f64>,
    /// ε: even sin 2θ is ½εR.
    pub squareness: f64,
    /// sx − sy: even cos 2θ is ½R(sx − sy).
    pub scale_mismatch: f64,
    /// τx − τy, s: odd sin 2θ is ½fΔτ.
    pub servo_mismatch_s: f64,
}

impl Counterparts {
    /// The figure that goes by this name in Ballbar 20, in its unit; `None` where giotto has none or the unit is another.
    pub fn get(&self, name: &str, unit: &str) -> Option<f64> {
        match (name, unit) {
            ("CIRCULARITY", "um") => self.circularity_m.map(|v| v * 1e6),
            ("SQUARENESS", "um/m") => Some(self.squareness * 1e6),
            // As a length: difference of the axes over the diameter of the test.
            ("SCALE_MISMATCH", "um") => Some(self.scale_mismatch * 2.0 * self.radius_m * 1e6),
            ("SCALE_MISMATCH", "um/m") => Some(self.scale_mismatch * 1e6),
            ("SERVO_MISMATCH", "ms") => Some(self.servo_mismatch_s * 1e3),
            _ => None,
        }
    }
}

/// The pairs of a report that have both directions and a whole turn each.
pub fn counterparts(report: &Report) -> Vec<Counterparts> {
    let grouped = pairs(
        report
            .runs
            .iter()
            .map(|r| (r.radius_m, r.feed_m_s, r.direction)),
    );
    let second = |run: &RunAnalysis| {
        let found = run.harmonics.iter().find(|h| h.order == 2)?;
        Some((found.cos_m, found.sin_m))
    };
    let of = |(pair, circularity_m): (&[Option<usize>; 2], Option<f64>)| {
        let (cw, ccw) = (&report.runs[pair[0]?], &report.runs[pair[1]?]);
        let ((cw_cos, cw_sin), (ccw_cos, ccw_sin)) = (second(cw)?, second(ccw)?);
        Some(Counterparts {
            radius_m: cw.radius_m,
            feed_m_s: cw.feed_m_s,
            circularity_m,
            squareness: (ccw_sin + cw_sin) / cw.radius_m,
            scale_mismatch: (ccw_cos + cw_cos) / cw.radius_m,
            servo_mismatch_s: (ccw_sin - cw_sin) / cw.feed_m_s,
        })
    };
    let flat = grouped.concat();
    flat.iter()
        .zip(report.iso230_4.iter().map(|i| i.g_b_m))
        .filter_map(of)
        .collect()
}
