//! The file of a path: `time_s,x_mm,y_mm[,z_mm]` in rows, as `giotto run -o` writes it and `giotto run stream` reads it.
use crate::Place;

/// Most rows: an hour at a millisecond.
const MOST_ROWS: usize = 4_000_000;

/// Set-points over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    times_s: Vec<f64>,
    places: Vec<Place>,
}

/// Why a file is no path.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: {what}; expected a CSV with time_s,x_mm,y_mm[,z_mm], times rising")]
pub struct PathError {
    /// Line from 1.
    pub line: usize,
    /// Column from 1.
    pub column: usize,
    /// What is there.
    pub what: String,
}

impl Path {
    /// Reads the text of a file; corrected columns of a recording are left out.
    ///
    /// # Errors
    /// [`PathError`] with the place in the file.
    ///
    /// ```
    /// use giotto_bridge::Path;
    ///
    /// let path = Path::read("time_s,x_mm,y_mm\n0,1,2\n0.5,3,2\n")?;
    /// assert_eq!(path.seconds(), 0.5);
    /// assert_eq!(path.at(0.25), [2.0, 2.0, 0.0]);
    /// assert_eq!(Path::read("time_s,x_mm,y_mm\n0,1,north\n").unwrap_err().column, 5);
    /// # Ok::<(), giotto_bridge::PathError>(())
    /// ```
    pub fn read(text: &str) -> Result<Self, PathError> {
        let error = |line: usize, column: usize, what: String| PathError { line, column, what };
        let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
        let header = lines.next().map_or("", |(_, line)| line);
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        let column = |name: &str| names.iter().position(|known| *known == name);
        let wanted = ["time_s", "x_mm", "y_mm", "z_mm"].map(column);
        let [Some(_), Some(_), Some(_), _] = wanted else {
            return Err(error(1, 1, "lacks a column".to_owned()));
        };
        let (mut times_s, mut places) = (Vec::new(), Vec::new());
        for (index, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
            let fields: Vec<&str> = line.split(',').collect();
            let mut values = [0.0; 4];
            for (value, field) in values.iter_mut().zip(wanted) {
                let Some(field) = field else { continue };
                let at = 1 + fields
                    .iter()
                    .take(field)
                    .map(|f| f.len() + 1)
                    .sum::<usize>();
                let text = fields.get(field).map_or("", |text| text.trim());
                *value = match text.parse::<f64>() {
                    Ok(number) if number.abs() < 1e6 => number,
                    _ => return Err(error(index + 1, at, format!("\"{text}\" is no number"))),
                };
            }
            let [time_s, x, y, z] = values;
            if times_s.last().is_some_and(|last| *last >= time_s) {
                return Err(error(index + 1, 1, "its time does not rise".to_owned()));
            }
            if times_s.len() >= MOST_ROWS {
                return Err(error(index + 1, 1, format!("more than {MOST_ROWS} rows")));
            }
            times_s.push(time_s);
            places.push([x, y, z]);
        }
        if times_s.len() < 2 {
            return Err(error(1, 1, "has less than two rows".to_owned()));
        }
        Ok(Self { times_s, places })
    }

    /// How long it takes, s.
    pub fn seconds(&self) -> f64 {
        match (self.times_s.first(), self.times_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Where it is so long after its first row, mm: a cubic through the rows around (Catmull and Rom's, by their times).
    pub fn at(&self, time_s: f64) -> Place {
        let time = self.times_s.first().copied().unwrap_or(0.0) + time_s;
        let last = self.times_s.len().saturating_sub(1);
        let after = self
            .times_s
            .partition_point(|row| *row <= time)
            .clamp(1, last.max(1));
        let row = |index: usize| {
            let index = index.min(last);
            (
                self.times_s.get(index).copied().unwrap_or(0.0),
                self.places.get(index).copied().unwrap_or([0.0; 3]),
            )
        };
        let ((t1, p1), (t2, p2)) = (row(after - 1), row(after));
        let share = ((time - t1) / (t2 - t1)).clamp(0.0, 1.0);
        let ((t0, p0), (t3, p3)) = (row(after.saturating_sub(2)), row(after + 1));
        let mut place = [0.0; 3];
        for (axis, place) in place.iter_mut().enumerate() {
            let at = |p: &Place| p.get(axis).copied().unwrap_or(0.0);
            let slope = |(ta, a): (f64, f64), (tb, b): (f64, f64)| {
                if tb > ta { (b - a) / (tb - ta) } else { 0.0 }
            };
            let (a, b) = (at(&p1), at(&p2));
            let (m1, m2) = (slope((t0, at(&p0)), (t2, b)), slope((t1, a), (t3, at(&p3))));
            let (s, h) = (share, t2 - t1);
            *place = a
                + s * s * (3.0 - 2.0 * s) * (b - a)
                + h * s * (1.0 - s) * ((1.0 - s) * m1 - s * m2);
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_met_and_a_circle_between_them_is_kept() {
        let mut text = String::from("time_s,x_mm,y_mm,z_mm,corrected_x_mm\n");
        for row in 0..2000 {
            let t = f64::from(row) * 1e-3;
            text += &format!(
                "{t:.6},{:.9},{:.9},5,0\n",
                50.0 * (4.0 * t).cos(),
                50.0 * (4.0 * t).sin()
            );
        }
        let path = Path::read(&text).unwrap();
        for k in 10..900 {
            let [x, y, z] = path.at(f64::from(k) * 2.13e-3);
            assert!((x.hypot(y) - 50.0).abs() < 1e-6 && (z - 5.0).abs() < 1e-12);
        }
        assert_eq!(path.at(-1.0), [50.0, 0.0, 5.0]);
        assert_eq!(path.at(99.0), path.at(1.999));
    }

    #[test]
    fn what_is_no_path_is_refused_with_its_place() {
        for (text, line, column) in [
            ("", 1, 1),
            ("time_s,x_mm\n0,1\n", 1, 1),
            ("time_s,x_mm,y_mm\n0,1,2\n", 1, 1),
            ("time_s,x_mm,y_mm\n0,1,2\n0,1,2\n", 3, 1),
            ("time_s,x_mm,y_mm\n0,1,2\n1,,2\n", 3, 3),
            ("time_s,x_mm,y_mm\n0,1,2\n1,nan,2\n", 3, 3),
            ("time_s,x_mm,y_mm\n0,1,2\n1,1\n", 3, 5),
        ] {
            let error = Path::read(text).unwrap_err();
            assert_eq!((error.line, error.column), (line, column), "{text:?}");
        }
    }
}
