//! A circular move, and how its words become a circle.
use super::left::{Because, Left};
use super::word::{Counts, Line, VIA};
use std::f64::consts::TAU;

/// A circular move in its plane, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arc {
    pub(super) plane: Plane,
    pub(super) start: [f64; 2],
    pub(super) end: [f64; 2],
    pub(super) centre: [f64; 2],
    pub(super) radius_mm: f64,
    /// Angle, CCW positive; more than a turn with P.
    pub(super) sweep_rad: f64,
    /// Start and end of the axis across the plane, if it moves.
    pub(super) lift: Option<[f64; 2]>,
    /// Words that are shared along the arc.
    pub(super) shared: [Option<Shared>; 4],
    /// Speed along the circle (without the lift), mm/s.
    pub(super) feed_mm_s: f64,
    /// The F word in force, in its own units.
    pub(super) feed_word: f64,
    /// What the words mean.
    pub(super) modes: Modes,
    /// Every block ends in a stop.
    pub(super) exact_stop: Option<Because>,
}

/// A word that goes along evenly: extruder or rotary axis, in program units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shared {
    pub(super) letter: u8,
    pub(super) from: f64,
    pub(super) to: f64,
    /// The words are increments.
    pub(super) relative: bool,
}

impl Arc {
    /// Direction of travel at the start or the end, of length 1.
    pub(super) fn tangent(&self, at_end: bool) -> [f64; 2] {
        let [x, y] = sub(if at_end { self.end } else { self.start }, self.centre);
        let side = self.sweep_rad.signum() / x.hypot(y);
        [-side * y, side * x]
    }

    pub(super) fn length_mm(&self) -> f64 {
        self.radius_mm * self.sweep_rad.abs()
    }
}

/// Plane of arcs: two axes in right-handed order and the one across.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Plane {
    Xy,
    Zx,
    Yz,
}

impl Plane {
    /// Indices of first, second and third axis in XYZ.
    pub(super) fn axes(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }
}

/// Modal groups that decide what numbers mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Modes {
    pub(super) inch: bool,
    pub(super) absolute: bool,
    pub(super) absolute_centres: bool,
    pub(super) feed_mode: FeedMode,
}

impl Modes {
    /// Millimetres of one program unit.
    pub(super) fn unit_mm(self) -> f64 {
        if self.inch { 25.4 } else { 1.0 }
    }
}

/// Feed as distance a minute (G94), turns of the block a minute (G93) or distance a turn (G95).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FeedMode {
    PerMinute,
    InverseTime,
    PerTurn,
}

/// Largest difference of start and end radius, mm: LinuxCNC's for centre format.
const RADIUS_TOLERANCE_MM: f64 = 0.0127;

/// Circle of an arc in its plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Circle {
    pub(super) centre: [f64; 2],
    pub(super) radius_mm: f64,
    pub(super) sweep_rad: f64,
}

/// The circle that the words of a block mean, from `start` to `end` (mm in the plane).
pub(super) fn circle(
    line: &Line<'_>,
    plane: Plane,
    modes: Modes,
    ends: [[f64; 2]; 2],
    ccw: bool,
) -> Result<Circle, Left> {
    let [start, end] = ends;
    let unit = modes.unit_mm();
    let [a, b, c] = plane.axes();
    let word = |axis: usize| line.word(b"IJK"[axis]);
    let offset = |axis: usize| word(axis).map(|w| w.value * unit);
    if line.has(b"IJK"[c]) && offset(c) != Some(0.0) {
        return Err(Left::ThirdCentre);
    }
    let turns = match line.word(b'P') {
        None => 1.0,
        Some(p) if p.value >= 1.0 && p.value.fract() == 0.0 && p.value < 1e4 => p.value,
        Some(_) => return Err(Left::Geometry),
    };
    let same = (end[0] - start[0]).hypot(end[1] - start[1]) < 1e-9;
    let by_radius = |r: f64| radius_centre(start, end, r, ccw);
    let relative = || [0, 1].map(|i| start[i] + offset([a, b][i]).unwrap_or(0.0));
    let absolute = || Some([offset(a)?, offset(b)?]);
    let said = [a, b].map(|axis| word(axis).map_or(Counts::InForce, |w| w.counts));
    // Each from where it says so itself; what is missing is the start's.
    let own = || {
        [0, 1].map(|i| {
            let value = offset([a, b][i]).unwrap_or(0.0);
            match said[i] {
                Counts::FromOrigin => value,
                Counts::FromStart | Counts::InForce => start[i] + value,
            }
        })
    };
    let none = offset(a).is_none() && offset(b).is_none();
    let (centre, other) = match line.word(b'R') {
        Some(r) if !same && none => (by_radius(r.value * unit).ok_or(Left::Geometry)?, None),
        Some(_) => return Err(Left::Geometry),
        None if none => return Err(Left::Geometry),
        None if said != [Counts::InForce; 2] => {
            // Beside the other form, what stands in force is no rule of any controller.
            if modes.absolute_centres {
                return Err(Left::Geometry);
            }
            (own(), None)
        }
        None if modes.absolute_centres => (absolute().ok_or(Left::Geometry)?, None),
        None => (relative(), absolute()),
    };
    let Some(mut found) = about(start, end, centre, ccw) else {
        let agrees = other.is_some_and(|c| about(start, end, c, ccw).is_some());
        return Err(if agrees {
            Left::AbsoluteCentres
        } else {
            Left::Geometry
        });
    };
    found.sweep_rad += found.sweep_rad.signum() * TAU * (turns - 1.0);
    Ok(found)
}

/// The arc about a centre; `None` where start and end do not lie on one circle. One that ends where it begins goes once round.
pub(super) fn about(start: [f64; 2], end: [f64; 2], centre: [f64; 2], ccw: bool) -> Option<Circle> {
    let [from, to] = [sub(start, centre), sub(end, centre)].map(|v| v[0].hypot(v[1]));
    if from < 1e-6 || (to - from).abs() > RADIUS_TOLERANCE_MM {
        return None;
    }
    let angle = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
    let raw = angle(end) - angle(start);
    let mut sweep = if ccw { raw } else { -raw }.rem_euclid(TAU);
    if (end[0] - start[0]).hypot(end[1] - start[1]) < 1e-9 || sweep < 1e-12 {
        sweep = TAU;
    }
    Some(Circle {
        centre,
        radius_mm: from,
        sweep_rad: if ccw { sweep } else { -sweep },
    })
}

/// The circle of a `CIP` of Siemens from `start` to `end`: through the point of its I1, J1 or K1 in the plane.
pub(super) fn circle_through(
    line: &Line<'_>,
    plane: Plane,
    modes: Modes,
    [start, end]: [[f64; 2]; 2],
) -> Result<Circle, Left> {
    let [a, b, c] = plane.axes();
    // All in the plane, and all from the origin: what is missing is not the same to every release.
    let said = |letter: u8| {
        let word = line.word(letter)?;
        let absolute = match word.counts {
            Counts::InForce => modes.absolute,
            Counts::FromOrigin => true,
            Counts::FromStart => false,
        };
        (absolute && word.value.is_finite()).then_some(word.value * modes.unit_mm())
    };
    if line.has(b"XYZ"[c]) || line.has(VIA[c]) {
        return Err(Left::OtherPlane);
    }
    let all = [b"XYZ"[a], b"XYZ"[b]].map(said);
    let (Some(x), Some(y), [Some(_), Some(_)]) = (said(VIA[a]), said(VIA[b]), all) else {
        return Err(Left::Dialect(
            "CIP of Siemens without all of its points in G90",
        ));
    };
    let (centre, sweep_rad) = through(start, [x, y], end).ok_or(Left::Geometry)?;
    Ok(Circle {
        centre,
        radius_mm: (start[0] - centre[0]).hypot(start[1] - centre[1]),
        sweep_rad,
    })
}

/// Centre and signed sweep of the arc from `s` through `v` to `e`; `None` for points that are nearly one or nearly on a line.
pub(super) fn through(s: [f64; 2], v: [f64; 2], e: [f64; 2]) -> Option<([f64; 2], f64)> {
    let (b, c) = (sub(v, s), sub(e, s));
    let cross = 2.0 * (b[0] * c[1] - b[1] * c[0]);
    let (bb, cc) = (b[0] * b[0] + b[1] * b[1], c[0] * c[0] + c[1] * c[1]);
    if cross.abs() < 1e-9 * (bb + cc) || cc < 1e-12 {
        return None;
    }
    let centre = [
        s[0] + (c[1] * bb - b[1] * cc) / cross,
        s[1] + (b[0] * cc - c[0] * bb) / cross,
    ];
    let angle = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
    let turned = |p: [f64; 2]| (angle(p) - angle(s)).rem_euclid(TAU);
    let (to_via, to_end) = (turned(v), turned(e));
    let sweep = if to_via < to_end {
        to_end
    } else {
        to_end - TAU
    };
    Some((centre, sweep))
}

/// Centre from the radius format: R > 0 takes the arc of less than half a turn.
pub(super) fn radius_centre(start: [f64; 2], end: [f64; 2], r: f64, ccw: bool) -> Option<[f64; 2]> {
    let [dx, dy] = sub(end, start);
    let chord = dx.hypot(dy);
    let square = r * r - chord * chord / 4.0;
    // Half a turn may miss its chord by the rounding of the program.
    if square < -RADIUS_TOLERANCE_MM * r.abs() {
        return None;
    }
    let height = square.max(0.0).sqrt() / chord;
    let side = if ccw == (r > 0.0) { height } else { -height };
    Some([
        0.5 * (start[0] + end[0]) - side * dy,
        0.5 * (start[1] + end[1]) + side * dx,
    ])
}

pub(super) fn sub(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
