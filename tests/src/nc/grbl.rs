//! A reader as small controllers are: every number in 32 bits, arcs by the rules of Grbl 1.1.
//!
//! Its rules for arcs: start and end radius may differ by 5 µm, beyond that by 0.1 % and no more than 0.5 mm; an arc whose
//! angle comes out below 5e-7 rad is a full circle.
use std::f32::consts::PI;

/// A move, mm in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Line of the program, from 1.
    pub line: usize,
    /// Where it ends.
    pub end: [f32; 3],
    /// Angle of an arc, rad, positive counter-clockwise; 0 of a line.
    pub angle_rad: f32,
    /// Radius of an arc, mm.
    pub radius_mm: f32,
    /// Centre of an arc in its plane.
    pub centre: [f32; 2],
    /// First, second and third axis of the plane.
    pub plane: [usize; 3],
    /// G0.
    pub rapid: bool,
    /// F in force, mm/min.
    pub feed_mm_min: f32,
}

/// An error of Grbl by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Line, from 1.
    pub line: usize,
    /// 20 for what it does not know, 33 to 35 for arcs.
    pub error: u8,
}

struct State {
    plane: [usize; 3],
    inch: bool,
    absolute: bool,
    motion: i32,
    at: [f32; 3],
    feed_mm_min: f32,
    spoilt: bool,
}

/// The moves of a program up to the first line that Grbl refuses.
pub fn read(program: &str) -> (Vec<Move>, Option<Refused>) {
    let mut state = State {
        plane: [0, 1, 2],
        inch: false,
        absolute: true,
        motion: 0,
        at: [0.0; 3],
        feed_mm_min: 0.0,
        spoilt: false,
    };
    let mut moves = Vec::new();
    for (i, text) in program.lines().enumerate() {
        match state.line(text) {
            Ok(Some(Done {
                end,
                angle_rad,
                radius_mm,
                centre,
            })) => moves.push(Move {
                line: i + 1,
                end,
                angle_rad,
                radius_mm,
                centre,
                plane: state.plane,
                rapid: state.motion == 0,
                feed_mm_min: state.feed_mm_min,
            }),
            Ok(None) => {}
            Err(error) => return (moves, Some(Refused { line: i + 1, error })),
        }
        if state.spoilt {
            break;
        }
    }
    (moves, None)
}

struct Done {
    end: [f32; 3],
    angle_rad: f32,
    radius_mm: f32,
    centre: [f32; 2],
}

impl State {
    fn line(&mut self, text: &str) -> Result<Option<Done>, u8> {
        let words = words(text)?;
        let get = |letter: char| words.iter().find(|w| w.0 == letter).map(|w| w.1);
        let mut own = false;
        for (letter, value) in &words {
            match (letter, (value * 10.0).round() as i32) {
                ('G', motion @ (0 | 10 | 20 | 30)) => self.motion = motion / 10,
                ('G', 40) => own = true,
                ('G', 170) => self.plane = [0, 1, 2],
                ('G', 180) => self.plane = [2, 0, 1],
                ('G', 190) => self.plane = [1, 2, 0],
                ('G', 200) => self.inch = true,
                ('G', 210) => self.inch = false,
                ('G', 900) => self.absolute = true,
                ('G', 910) => self.absolute = false,
                ('G', 911 | 930 | 940 | 400 | 610) => {}
                ('G', _) => return Err(20),
                ('M', 0 | 10 | 20 | 300) => self.spoilt |= *value >= 2.0,
                ('M', 30 | 40 | 50 | 70 | 80 | 90) => {}
                ('M', _) => return Err(20),
                ('N' | 'F' | 'S' | 'T' | 'X' | 'Y' | 'Z' | 'I' | 'J' | 'K' | 'R' | 'P', _) => {}
                _ => return Err(20),
            }
        }
        let axes = ['X', 'Y', 'Z'].map(get);
        let scale: f32 = if self.inch { 25.4 } else { 1.0 };
        if let Some(f) = get('F') {
            self.feed_mm_min = f * scale;
        }
        if own || axes.iter().all(Option::is_none) && get('I').or(get('J')).or(get('K')).is_none() {
            return Ok(None);
        }
        let unit = scale;
        let from = self.at;
        let mut to = from;
        for i in 0..3 {
            if let Some(v) = axes[i] {
                to[i] = if self.absolute {
                    v * unit
                } else {
                    from[i] + v * unit
                };
            }
        }
        self.at = to;
        if self.motion < 2 {
            return Ok(Some(Done {
                end: to,
                angle_rad: 0.0,
                radius_mm: 0.0,
                centre: [0.0; 2],
            }));
        }
        let [a, b, _] = self.plane;
        let (x, y) = (to[a] - from[a], to[b] - from[b]);
        let offset = |axis: usize| get(['I', 'J', 'K'][axis]).map(|v| v * unit);
        let centre = if let Some(r) = get('R') {
            if x == 0.0 && y == 0.0 {
                return Err(33);
            }
            let r = r * unit;
            let square = 4.0 * r * r - x * x - y * y;
            if square < 0.0 {
                return Err(34);
            }
            let mut h = -square.sqrt() / (x * x + y * y).sqrt();
            if self.motion == 3 {
                h = -h;
            }
            if r < 0.0 {
                h = -h;
            }
            [0.5 * (x - y * h), 0.5 * (y + x * h)]
        } else {
            if offset(a).is_none() && offset(b).is_none() {
                return Err(35);
            }
            [offset(a).unwrap_or(0.0), offset(b).unwrap_or(0.0)]
        };
        let (tx, ty) = (x - centre[0], y - centre[1]);
        let target = (tx * tx + ty * ty).sqrt();
        let radius = (centre[0] * centre[0] + centre[1] * centre[1]).sqrt();
        let off = (target - radius).abs();
        if off > 0.005 && (off > 0.5 || off > 0.001 * radius) {
            return Err(33);
        }
        let (rx, ry) = (-centre[0], -centre[1]);
        let mut angle = (rx * ty - ry * tx).atan2(rx * tx + ry * ty);
        if self.motion == 2 {
            if angle >= -5e-7 {
                angle -= 2.0 * PI;
            }
        } else if angle <= 5e-7 {
            angle += 2.0 * PI;
        }
        Ok(Some(Done {
            end: to,
            angle_rad: angle,
            radius_mm: radius,
            centre: [from[a] + centre[0], from[b] + centre[1]],
        }))
    }
}

fn words(text: &str) -> Result<Vec<(char, f32)>, u8> {
    let mut code = String::new();
    let mut inside = false;
    for c in text.chars() {
        match c {
            '(' => inside = true,
            ')' => inside = false,
            ';' if !inside => break,
            '%' => break,
            c if !inside && !c.is_whitespace() => code.push(c.to_ascii_uppercase()),
            _ => {}
        }
    }
    if code.starts_with('/') {
        code.remove(0);
    }
    let mut list = Vec::new();
    let mut rest = code.as_str();
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        rest = &rest[1..];
        let length = rest
            .find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-' || c == '+'))
            .unwrap_or(rest.len());
        list.push((letter, rest[..length].parse().map_err(|_| 2_u8)?));
        rest = &rest[length..];
    }
    Ok(list)
}

/// Grbl takes the output as it takes the original, and no arc of it is another one than meant.
///
/// # Errors
/// What it refuses, and arcs that come out as full circles.
pub fn compare(before: &str, after: &str) -> Result<(), String> {
    let (original, refused) = read(before);
    let (moves, output_refused) = read(after);
    if refused.is_none()
        && let Some(Refused { line, error }) = output_refused
    {
        return Err(format!(
            "Grbl refuses line {line} of the output with error {error}"
        ));
    }
    let longest = |moves: &[Move]| {
        moves
            .iter()
            .map(|m| (m.angle_rad * m.radius_mm).abs())
            .fold(0.0, f32::max)
    };
    let (was, is) = (longest(&original), longest(&moves));
    if refused.is_none() && is > 1.1 * was + 1.0 {
        return Err(format!(
            "Grbl runs an arc of {is} mm where {was} mm was the longest"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_are_those_of_grbl() {
        let (moves, refused) =
            read("G21 G0 X20 Y0\nG3 X-20 I-20\nG2 X20 I20 J0\nG3 I-20\nG2 X0 Y-20 R20\n");
        assert_eq!(refused, None);
        let angles: Vec<f32> = moves
            .iter()
            .map(|m| (m.angle_rad / PI * 2.0).round())
            .collect();
        assert_eq!(angles, [0.0, 2.0, -2.0, 4.0, -1.0]);
        assert_eq!(
            read("G0 X20\nG3 X-20 I-19\n").1,
            Some(Refused { line: 2, error: 33 })
        );
        assert_eq!(
            read("G0 X20\nG3 X-20\n").1,
            Some(Refused { line: 2, error: 35 })
        );
        assert_eq!(read("M62 P1\n").1, Some(Refused { line: 1, error: 20 }));
        // A hair of an arc so flat that 32 bits lose its side.
        let (moves, _) = read("G0 X1000\nG3 X1000 Y0.001 I-1000000 J0\n");
        assert!(moves[1].angle_rad > 6.0);
    }
}
