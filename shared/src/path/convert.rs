//! From SI in double precision to the engine's own numbers, for whoever talks to a controller.
use super::exact::{
    ExactArc, ExactCircle, ExactSegment, MAX_POSITION_M, MAX_RADIUS_M, MAX_TURNS, MIN_FRACTION,
    MIN_RADIUS_M,
};
use super::{CircleRun, Quantity, Segment};
use crate::angle::phase_from_rad;
use crate::fixed::rounded;
use core::f64::consts::TAU;

/// Nanometres in a metre.
const NM: f64 = 1e9;
/// Units of phase in a turn.
const TURN: f64 = 18_446_744_073_709_551_616.0;
/// Largest angle to start at, rad: what a phase is exact for.
const MAX_START_RAD: f64 = 1e6;

/// A number that the engine cannot be told.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// NaN or infinity.
    #[error("{0} is not a finite number")]
    NotANumber(Quantity),
    /// Beyond the integers of a path.
    #[error("{quantity} is {value}, possible are {lo} to {hi}")]
    OutOfBounds {
        /// Which.
        quantity: Quantity,
        /// Its value.
        value: f64,
        /// Smallest possible.
        lo: f64,
        /// Largest possible.
        hi: f64,
    },
}

impl PathError {
    /// The number that it speaks of.
    pub const fn quantity(&self) -> Quantity {
        match self {
            Self::NotANumber(quantity) | Self::OutOfBounds { quantity, .. } => *quantity,
        }
    }
}

fn finite(quantity: Quantity, values: &[f64]) -> Result<(), PathError> {
    // In single precision, which what follows them has.
    let all = values.iter().all(|value| (*value as f32).is_finite());
    if all {
        Ok(())
    } else {
        Err(PathError::NotANumber(quantity))
    }
}

fn within(quantity: Quantity, value: f64, [lo, hi]: [f64; 2]) -> Result<(), PathError> {
    if value >= lo && value <= hi {
        Ok(())
    } else {
        Err(PathError::OutOfBounds {
            quantity,
            value,
            lo,
            hi,
        })
    }
}

/// A place, nm.
fn to_nm(quantity: Quantity, place_m: &[f64; 3]) -> Result<[i32; 3], PathError> {
    finite(quantity, place_m)?;
    for coordinate in place_m {
        within(quantity, *coordinate, [-MAX_POSITION_M, MAX_POSITION_M])?;
    }
    Ok(place_m.map(|metres| rounded(metres, NM) as i32))
}

fn to_half_nm(metres: f64) -> i32 {
    rounded(metres, 2.0 * NM) as i32
}

impl CircleRun {
    /// In the engine's numbers.
    ///
    /// # Errors
    /// A number that is none, a place beyond ±[`MAX_POSITION_M`], a radius beyond [`MAX_RADIUS_M`]; whether a controller
    /// runs it, it decides itself.
    pub fn exact(&self) -> Result<ExactCircle, PathError> {
        finite(Quantity::Radius, &[self.radius_m])?;
        within(
            Quantity::Radius,
            self.radius_m,
            [-MAX_RADIUS_M, MAX_RADIUS_M],
        )?;
        finite(Quantity::Feed, &[self.feed_m_s])?;
        finite(Quantity::Start, &[self.start_rad])?;
        within(
            Quantity::Start,
            self.start_rad,
            [-MAX_START_RAD, MAX_START_RAD],
        )?;
        Ok(ExactCircle {
            centre_nm: to_nm(Quantity::Centre, &self.centre_m)?,
            radius_half_nm: to_half_nm(self.radius_m),
            feed_m_s: self.feed_m_s as f32,
            plane: self.plane,
            direction: self.direction,
            laps: self.laps,
            start: phase_from_rad(self.start_rad),
        })
    }
}

impl Segment {
    /// In the engine's numbers, starting at a place.
    ///
    /// # Errors
    /// A number that is none, or that the integers of a path cannot hold.
    pub fn exact(&self, from_nm: [i32; 3]) -> Result<ExactSegment, PathError> {
        match self {
            Self::Line { to_m, feed_m_s } => {
                finite(Quantity::Feed, &[*feed_m_s])?;
                let to_nm = to_nm(Quantity::Position, to_m)?;
                Ok(ExactSegment::Line {
                    to_nm,
                    feed_m_s: *feed_m_s as f32,
                })
            }
            Self::Arc {
                centre_m,
                normal,
                sweep_rad,
                rise_m,
                feed_m_s,
            } => {
                finite(Quantity::Feed, &[*feed_m_s])?;
                arc(
                    from_nm,
                    *centre_m,
                    *normal,
                    *sweep_rad,
                    *rise_m,
                    *feed_m_s as f32,
                )
                .map(ExactSegment::Arc)
            }
            Self::Dwell { time_s } => {
                finite(Quantity::Time, &[*time_s])?;
                Ok(ExactSegment::Dwell {
                    time_s: *time_s as f32,
                })
            }
        }
    }
}

fn arc(
    from_nm: [i32; 3],
    centre: [f64; 3],
    normal: [f64; 3],
    sweep: f64,
    rise: f64,
    feed_m_s: f32,
) -> Result<ExactArc, PathError> {
    finite(Quantity::Centre, &centre)?;
    finite(Quantity::Normal, &normal)?;
    finite(Quantity::Sweep, &[sweep])?;
    finite(Quantity::Rise, &[rise])?;
    let n = unit(normal).ok_or(PathError::NotANumber(Quantity::Normal))?;
    let from = from_nm.map(|nm| f64::from(nm) / NM);
    // The centre may be given anywhere on the axis: its foot is the centre.
    let height = dot(sub(from, centre), n);
    let centre = add(centre, n.map(|n| height * n));
    let u = sub(from, centre);
    within(
        Quantity::Radius,
        libm::sqrt(dot(u, u)),
        [MIN_RADIUS_M, MAX_RADIUS_M],
    )?;
    let (sign, angle) = (if sweep < 0.0 { -1.0 } else { 1.0 }, libm::fabs(sweep));
    let least = MIN_FRACTION as f64 / TURN * TAU;
    within(
        Quantity::Sweep,
        angle,
        [least * (1.0 - 1e-9), f64::from(MAX_TURNS) * TAU],
    )?;
    within(
        Quantity::Rise,
        rise,
        [-2.0 * MAX_POSITION_M, 2.0 * MAX_POSITION_M],
    )?;
    let per_turn = n.map(|n| n * rise * TAU / angle);
    // Steeper than that it is more of a line: the travel of a whole turn would not fit into a coordinate.
    for travel in per_turn {
        within(Quantity::Rise, travel, [-MAX_POSITION_M, MAX_POSITION_M])?;
    }
    let turns = libm::floor(angle / TAU);
    let fraction =
        (((angle / TAU - turns) * TURN) as u64).max(if turns > 0.0 { 0 } else { MIN_FRACTION });
    Ok(ExactArc {
        centre_nm: to_nm(Quantity::Centre, &centre)?,
        u_half_nm: u.map(to_half_nm),
        v_half_nm: cross(n, u).map(|v| to_half_nm(sign * v)),
        rise_nm: per_turn.map(|travel| rounded(travel, NM) as i32),
        turns: turns as u32,
        fraction,
        feed_m_s,
    })
}

fn dot([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> f64 {
    a * x + b * y + c * z
}

fn add([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a + x, b + y, c + z]
}

fn sub([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a - x, b - y, c - z]
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = libm::sqrt(dot(a, a));
    (length > 1e-12).then(|| a.map(|x| x / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::RAD_PER_UNIT;
    use crate::{Direction, Plane};
    use std::vec::Vec;

    const FROM_NM: [i32; 3] = [60_000_000, 5_000_000, 1_000_000];

    fn arc_of(normal: [f64; 3], sweep_rad: f64, rise_m: f64) -> Segment {
        Segment::Arc {
            centre_m: [0.01, 0.005, 0.3],
            normal,
            sweep_rad,
            rise_m,
            feed_m_s: 0.3,
        }
    }

    /// Rodrigues' formula in double precision.
    fn turned(p: [f64; 3], centre: [f64; 3], n: [f64; 3], angle: f64, rise: f64) -> [f64; 3] {
        let r = sub(p, centre);
        let (s, c) = libm::sincos(angle);
        let along = dot(n, r) * (1.0 - c);
        let turned = add(
            add(r.map(|r| r * c), cross(n, r).map(|k| k * s)),
            n.map(|n| n * (along + rise)),
        );
        add(centre, turned)
    }

    #[test]
    fn ends_are_those_of_a_rotation_in_double_precision() {
        let planes = [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -3.0],
            [0.3, -0.2, 1.0],
            [1.0, 0.0, 0.0],
            [0.0, 2.0, 0.1],
        ];
        let sweeps = [1.5, -1.5, TAU, -TAU, 2.5 * TAU, -7.3, 0.001];
        for normal in planes {
            for sweep in sweeps {
                for rise in [0.0, 0.02, -0.007] {
                    // Short and steep is refused, which is another test.
                    let Ok(exact) = arc_of(normal, sweep, rise).exact(FROM_NM) else {
                        continue;
                    };
                    let from = FROM_NM.map(|nm| f64::from(nm) * 1e-9);
                    let n = unit(normal).unwrap();
                    let expected = turned(from, [0.01, 0.005, 0.3], n, sweep, rise);
                    let end = exact.end_nm(FROM_NM);
                    for (end, expected) in end.iter().zip(expected) {
                        assert!(
                            (f64::from(*end) - expected * 1e9).abs() < 5.0,
                            "{normal:?} {sweep} {rise}"
                        );
                    }
                    let ExactSegment::Arc(arc) = exact else {
                        panic!()
                    };
                    assert!(
                        arc.gap_nm(FROM_NM).iter().all(|gap| gap.abs() <= 3),
                        "{:?}",
                        arc.gap_nm(FROM_NM)
                    );
                }
            }
        }
    }

    /// Each from where the one before really ends: places are rounded down, and nothing worse adds up.
    #[test]
    fn a_chain_of_arcs_drifts_by_no_more_than_a_nanometre_an_arc() {
        let mut at = FROM_NM;
        let mut worst = 0;
        for n in 0..1000 {
            // A full turn in four quarters, now here, now there.
            let (centre_m, sweep_rad) = (
                [0.01, 0.005, 0.001],
                TAU / 4.0 * if n / 4 % 2 == 0 { 1.0 } else { -1.0 },
            );
            let quarter = Segment::Arc {
                centre_m,
                normal: [0.0, 0.0, 1.0],
                sweep_rad,
                rise_m: 0.0,
                feed_m_s: 0.3,
            };
            at = quarter.exact(at).unwrap().end_nm(at);
            if n % 4 == 3 {
                worst = worst.max((0..3).map(|i| (at[i] - FROM_NM[i]).abs()).max().unwrap());
            }
        }
        std::println!("1000 arcs end {worst} nm from where they should");
        assert!(worst <= 1000, "{worst}");
    }

    #[test]
    fn circles_are_whole_half_nanometres_and_phases() {
        let run = CircleRun {
            centre_m: [-0.29, 0.987, 0.615],
            radius_m: 0.1,
            feed_m_s: 0.7,
            plane: Plane::Zx,
            direction: Direction::Cw,
            laps: 3,
            start_rad: -TAU / 4.0,
        };
        let exact = run.exact().unwrap();
        assert_eq!(exact.centre_nm, [-290_000_000, 987_000_000, 615_000_000]);
        assert_eq!(
            (exact.radius_half_nm, exact.start, exact.laps),
            (200_000_000, 3 << 30, 3)
        );
        assert_eq!(exact.feed_m_s, 0.7);
        // Negative radii are for the controller to refuse; the integers hold them.
        assert_eq!(
            CircleRun {
                radius_m: -0.005,
                ..run
            }
            .exact()
            .unwrap()
            .radius_half_nm,
            -10_000_000
        );
        assert!((f64::from(exact.start) * RAD_PER_UNIT - 0.75 * TAU).abs() < 1e-9);
    }

    #[test]
    fn what_the_integers_cannot_hold_is_refused_by_name() {
        let good = CircleRun {
            centre_m: [0.0; 3],
            radius_m: 0.1,
            feed_m_s: 0.7,
            plane: Plane::Xy,
            direction: Direction::Ccw,
            laps: 1,
            start_rad: 0.0,
        };
        let runs = [
            (
                CircleRun {
                    radius_m: f64::NAN,
                    ..good
                },
                Quantity::Radius,
            ),
            (
                CircleRun {
                    radius_m: 1.06,
                    ..good
                },
                Quantity::Radius,
            ),
            (
                CircleRun {
                    feed_m_s: 1e300,
                    ..good
                },
                Quantity::Feed,
            ),
            (
                CircleRun {
                    centre_m: [0.0, 2.2, 0.0],
                    ..good
                },
                Quantity::Centre,
            ),
            (
                CircleRun {
                    start_rad: f64::INFINITY,
                    ..good
                },
                Quantity::Start,
            ),
        ];
        let refused: Vec<_> = runs
            .iter()
            .map(|(run, _)| run.exact().unwrap_err().quantity())
            .collect();
        assert_eq!(refused, runs.map(|(_, quantity)| quantity));
        let z = [0.0, 0.0, 1.0];
        let segments = [
            (
                Segment::Line {
                    to_m: [0.0, 0.0, f64::NAN],
                    feed_m_s: 0.1,
                },
                Quantity::Position,
            ),
            (
                Segment::Line {
                    to_m: [0.0, 0.0, -2.11],
                    feed_m_s: 0.1,
                },
                Quantity::Position,
            ),
            (
                Segment::Dwell {
                    time_s: f64::INFINITY,
                },
                Quantity::Time,
            ),
            (arc_of([0.0; 3], 1.0, 0.0), Quantity::Normal),
            (arc_of(z, 0.0, 0.0), Quantity::Sweep),
            (arc_of(z, 1e8, 0.0), Quantity::Sweep),
            (arc_of(z, 0.01, 0.1), Quantity::Rise),
            (
                arc_of([f64::INFINITY, 0.0, 0.0], 1.0, 0.0),
                Quantity::Normal,
            ),
        ];
        for (segment, quantity) in segments {
            assert_eq!(
                segment.exact(FROM_NM).unwrap_err().quantity(),
                quantity,
                "{segment:?}"
            );
        }
        let on_the_axis = arc_of(z, 1.0, 0.0).exact([10_000_000, 5_000_000, 0]);
        assert_eq!(on_the_axis.unwrap_err().quantity(), Quantity::Radius);
    }
}
