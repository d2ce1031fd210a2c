//! Circles without and with correction, as a table and as JSON: of the demo and of a calibration.
use super::grid::Grid;
use crate::ring::{Proof, Size};
use giotto_shared::Direction;
use serde_json::{Value, json};

const fn word(direction: Direction) -> &'static str {
    match direction {
        Direction::Ccw => "ccw",
        Direction::Cw => "cw",
    }
}

/// A row a circle; radius and feed to so many decimals.
pub(super) fn grid(proof: &Proof, decimals: usize) -> Grid {
    let header = [
        "R mm",
        "mm/s",
        "way",
        "ΔR before",
        "ΔR after",
        "roundness before",
        "after (µm)",
    ];
    let mut circles = Grid::new(&header, 0, 3);
    for pair in &proof.circles {
        let (before, after) = (&pair.before.analysis, &pair.after.analysis);
        circles.row([
            format!("{:.decimals$}", before.radius_m * 1e3),
            format!("{:.decimals$}", before.feed_m_s * 1e3),
            word(before.direction).to_owned(),
            format!("{:.2}", before.radius_error_m * 1e6),
            format!("{:+.2}", after.radius_error_m * 1e6),
            format!("{:.1}", before.out_of_roundness_m * 1e6),
            format!("{:.1}", after.out_of_roundness_m * 1e6),
        ]);
    }
    circles
}

/// The contract's form of each circle, with its form error beside it.
pub(super) fn circles(proof: &Proof) -> Value {
    let circles = proof.circles.iter().map(|pair| {
        let (before, after) = (&pair.before.analysis, &pair.after.analysis);
        json!({
            "radius_mm": (before.radius_m * 1e9).round() / 1e6,
            "feed_mm_s": (before.feed_m_s * 1e9).round() / 1e6,
            "direction": word(before.direction),
            "before_um": before.radius_error_m * 1e6,
            "after_um": after.radius_error_m * 1e6,
            "out_of_roundness_um": [before.out_of_roundness_m * 1e6, after.out_of_roundness_m * 1e6],
        })
    });
    circles.collect()
}

/// The contract's form of the errors of all circles together.
pub(super) fn um(size: Size) -> Value {
    json!({
        "radius_error_rms_um": size.radius_error_rms_m * 1e6,
        "out_of_roundness_um": size.out_of_roundness_m * 1e6,
    })
}
