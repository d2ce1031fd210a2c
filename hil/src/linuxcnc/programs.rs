//! Programs for LinuxCNC: circles with a stop before and after each, and a part.
use giotto::campaign::{Direction, Plane};
use std::fmt::Write as _;

/// A circle about the origin.
#[derive(Clone, Copy, Debug)]
pub struct Circle {
    /// mm.
    pub radius_mm: f64,
    /// mm/s.
    pub feed_mm_s: f64,
    /// Seen from the end of the third axis.
    pub direction: Direction,
    /// Where it lies.
    pub plane: Plane,
}

/// Code of a plane, letters of its axes and of the centre.
const fn words(plane: Plane) -> (&'static str, [char; 4]) {
    match plane {
        Plane::Xy => ("G17", ['X', 'Y', 'I', 'J']),
        Plane::Yz => ("G19", ['Y', 'Z', 'J', 'K']),
        Plane::Zx => ("G18", ['Z', 'X', 'K', 'I']),
    }
}

/// A turn and three quarters of each, entered and left along a tangent; the machine stands still before and after it.
pub(super) fn circles(list: &[Circle]) -> String {
    let mut out = String::from("G21 G40 G90 G94 G64\n");
    for circle in list {
        let Circle {
            radius_mm: r,
            feed_mm_s,
            direction,
            plane,
        } = *circle;
        let (code, [u, v, i, j]) = words(plane);
        let side = if direction == Direction::Ccw {
            1.0
        } else {
            -1.0
        };
        let arc = if direction == Direction::Ccw {
            "G3"
        } else {
            "G2"
        };
        let (lead, low, feed) = ((0.2 * feed_mm_s).max(10.0), -side * r, feed_mm_s * 60.0);
        // Writing to a String does not fail.
        let _ = write!(
            out,
            "{code}\nG1 {u}-{lead:.4} {v}{low:.4} F6000\nM0\nG1 {u}0 {v}{low:.4} F{feed:.3}\n\
             {arc} {u}0 {v}{low:.4} {i}0 {j}{up:.4}\n{arc} {u}{r:.4} {v}0 {i}0 {j}{up:.4}\n\
             {arc} {u}0 {v}{high:.4} {i}-{r:.4} {j}0\n{arc} {u}-{r:.4} {v}0 {i}0 {j}{down:.4}\nM0\n",
            up = side * r,
            high = side * r,
            down = -side * r,
        );
        let _ = writeln!(out, "G0 {u}0 {v}0");
    }
    out + "M2\n"
}

/// Lines and arcs in three planes, blended.
pub(super) const PART: &str = "G21 G40 G90 G94 G64 P0.05
G17
G0 X0 Y0 Z0
G1 X60 Y0 F9000
G3 X90 Y30 I0 J30
G1 X90 Y70
G3 X60 Y100 I-30 J0
G1 X20 Y100
G3 X-20 Y60 I0 J-40
G1 X-20 Y20
G3 X0 Y0 I20 J0
G18
G1 X40 Z0 F12000
G2 X65 Z25 I0 K25
G1 X65 Z50
G2 X40 Z75 I-25 K0
G1 X0 Z75
G19
G1 Y30 Z75
G2 Y60 Z45 J0 K-30
G1 Y60 Z20
G2 Y40 Z0 J-20 K0
G17
G1 X0 Y0 Z0 F9000
G1 X30 Y10
G1 X45 Y60
G1 X0 Y0
M2
";
