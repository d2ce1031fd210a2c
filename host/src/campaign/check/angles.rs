//! Angles of a run: their sense, what they cover, their holes and where they start.
use super::{LARGEST_GAP_DEG, err, tidy};
use crate::campaign::Note;
use crate::campaign::error::{CampaignError, Problem};
use crate::campaign::manifest::Entry;
use giotto_shared::Direction;
use std::f64::consts::TAU;

/// Unwrapped angles must make one turn (or the declared arc) in the direction of travel.
pub(in crate::campaign) fn angles(
    entry: &Entry,
    angle: &[f64],
    field: usize,
    covered: &mut f64,
    notes: &mut Vec<Note>,
) -> Result<(), CampaignError> {
    let n = angle.len();
    let (lowest, highest) = angle
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, h), &a| (l.min(a), h.max(a)));
    if (highest - lowest).to_degrees() < 0.5 {
        return Err(err(
            entry,
            n - 1,
            field,
            Problem::AngleConstant {
                at_deg: angle[0].to_degrees(),
            },
        ));
    }
    sense(entry, angle, field)?;
    let span = angle[n - 1] - angle[0];
    let spacing = span.abs() / (n - 1) as f64;
    *covered = span.abs() + spacing;
    coverage(entry, angle, field, spacing, *covered)?;
    hole(entry, angle, field, spacing)?;
    notes.extend(other_start(entry, angle, field, spacing));
    Ok(())
}

/// Angles run as the direction says, and never back.
fn sense(entry: &Entry, angle: &[f64], field: usize) -> Result<(), CampaignError> {
    let n = angle.len();
    let d = f64::from(entry.direction.sign());
    let span = angle[n - 1] - angle[0];
    if span * d < 0.0 {
        let words = |up: bool| {
            if up {
                "counter-clockwise (growing)"
            } else {
                "clockwise (falling)"
            }
        };
        let ccw = entry.direction == Direction::Ccw;
        let direction = if ccw { "ccw" } else { "cw" };
        let problem = Problem::DirectionContradicted {
            found: words(!ccw),
            expected: words(ccw),
            direction,
        };
        return Err(err(entry, n - 1, field, problem));
    }
    let one_degree = 1f64.to_radians();
    if let Some(k) = angle
        .windows(2)
        .position(|w| d * (w[1] - w[0]) < -one_degree)
    {
        let back_deg = (d * (angle[k] - angle[k + 1])).to_degrees();
        return Err(err(
            entry,
            k + 1,
            field,
            Problem::AngleBackwards { back_deg },
        ));
    }
    Ok(())
}

/// Angles cover what is declared: an arc, or one turn.
fn coverage(
    entry: &Entry,
    angle: &[f64],
    field: usize,
    spacing: f64,
    covered: f64,
) -> Result<(), CampaignError> {
    let last = angle.len() - 1;
    let tolerance = 2.0 * spacing + 1f64.to_radians();
    let covered_deg = covered.to_degrees();
    match entry.arc_rad {
        Some(declared) if (covered - declared).abs() > tolerance => {
            let problem = Problem::ArcContradicted {
                covered_deg,
                declared_deg: tidy(declared.to_degrees()),
            };
            return Err(err(entry, last, field, problem));
        }
        Some(_) => {}
        None if covered < TAU - tolerance => {
            return Err(err(entry, last, field, Problem::Arc { covered_deg }));
        }
        None if covered > TAU + tolerance => {
            let row = angle
                .iter()
                .position(|a| (a - angle[0]).abs() >= TAU)
                .unwrap_or(last);
            return Err(err(
                entry,
                row,
                field,
                Problem::SeveralTurns {
                    turns: covered / TAU,
                },
            ));
        }
        None => {}
    }
    Ok(())
}

/// No hole lies between neighbours.
fn hole(entry: &Entry, angle: &[f64], field: usize, spacing: f64) -> Result<(), CampaignError> {
    if let Some(k) = angle.windows(2).position(|w| {
        let hole = (w[1] - w[0]).abs();
        hole.to_degrees() > LARGEST_GAP_DEG && hole > 3.0 * spacing
    }) {
        let gap_deg = (angle[k + 1] - angle[k]).abs().to_degrees();
        let gap_s = gap_deg.to_radians() * entry.radius_m / entry.feed_m_s;
        return Err(err(
            entry,
            k + 1,
            field,
            Problem::Gap {
                gap_s,
                gap_deg,
                limit_deg: LARGEST_GAP_DEG,
            },
        ));
    }
    Ok(())
}

/// A start that is not the one stated.
fn other_start(entry: &Entry, angle: &[f64], field: usize, spacing: f64) -> Option<Note> {
    let start = entry.start_angle_rad?;
    let off = ((angle[0] - start + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0).to_degrees();
    (off.abs() > 5.0 + spacing.to_degrees()).then(|| {
        let (said, found) = (start.to_degrees(), angle[0].to_degrees());
        let text = format!(
            "start_angle_deg = {said:.1}, the first sample lies at {found:.1}°: the file is believed"
        );
        Note {
            at: entry.place(0, field),
            text,
        }
    })
}
