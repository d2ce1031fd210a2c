//! A whole session at once: files of a folder, what their names say, what a list of them says.
use super::add::Options;
use crate::campaign::{CampaignError, Direction, Place, Plane, Problem};
use std::path::{Path, PathBuf};

/// What is said of one file, beyond what is said of all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// Programmed radius, m.
    pub radius_m: Option<f64>,
    /// Programmed feed, m/s.
    pub feed_m_s: Option<f64>,
    /// Direction of travel.
    pub direction: Option<Direction>,
    /// Angle of the first sample, rad.
    pub start_angle_rad: Option<f64>,
    /// Start since the campaign began, s.
    pub started_s: Option<f64>,
    /// Temperature, °C.
    pub temperature_c: Option<f64>,
    /// Plane of the circle.
    pub plane: Option<Plane>,
    /// Set-up that the run belongs to.
    pub setup: Option<String>,
}

/// Keys of a pattern and of the header of a list.
const KEYS: &str =
    "radius, feed, feed_mm_min, direction, plane, setup, start_angle, started, temperature";

impl Said {
    /// These words before those of `options`.
    pub fn over(&self, options: &Options) -> Options {
        let options = options.clone();
        Options {
            radius_m: self.radius_m.unwrap_or(options.radius_m),
            feed_m_s: self.feed_m_s.unwrap_or(options.feed_m_s),
            direction: self.direction.or(options.direction),
            start_angle_rad: self.start_angle_rad.or(options.start_angle_rad),
            started_s: self.started_s.or(options.started_s),
            temperature_c: self.temperature_c.or(options.temperature_c),
            plane: self.plane.or(options.plane),
            setup: self.setup.clone().or(options.setup),
            ..options
        }
    }

    /// Takes a value by its key, with or without the unit: `radius`, `radius_mm`. What was expected, where it does not fit.
    fn take(&mut self, key: &str, text: &str) -> Result<(), &'static str> {
        let text = text.trim();
        let number = || {
            text.replace(',', ".")
                .parse::<f64>()
                .ok()
                .filter(|v| v.is_finite())
        };
        let above = || number().filter(|v| *v > 0.0 && *v <= 1e5);
        const LENGTH: &str = "a number above 0, up to 100000";
        match key {
            "radius" | "radius_mm" => self.radius_m = Some(above().ok_or(LENGTH)? * 1e-3),
            "feed" | "feed_mm_s" => self.feed_m_s = Some(above().ok_or(LENGTH)? * 1e-3),
            "feed_mm_min" => self.feed_m_s = Some(above().ok_or(LENGTH)? * 1e-3 / 60.0),
            "direction" => {
                self.direction = Some(match text.to_lowercase().as_str() {
                    "ccw" | "g3" | "g03" | "+" => Direction::Ccw,
                    "cw" | "g2" | "g02" | "-" => Direction::Cw,
                    _ => return Err("ccw or cw"),
                });
            }
            "plane" => {
                let lower = text.to_lowercase();
                let named =
                    |p: &Plane| lower == p.name() || lower.chars().rev().eq(p.name().chars());
                self.plane = Some(Plane::ALL.into_iter().find(named).ok_or("xy, yz or zx")?);
            }
            "setup" => self.setup = Some(text.to_owned()),
            "start_angle" | "start_angle_deg" => {
                self.start_angle_rad = Some(number().ok_or("an angle in degrees")?.to_radians());
            }
            "started" | "started_s" => self.started_s = Some(number().ok_or("seconds")?),
            "temperature" | "temperature_c" => {
                self.temperature_c = Some(number().ok_or("a temperature in °C")?);
            }
            _ => return Err(KEYS),
        }
        Ok(())
    }
}

/// The files of measurements in what was given: files as they are, folders by what is in them, by name.
///
/// # Errors
/// A folder that cannot be read, or that has no file of measurements.
pub fn files(given: &[PathBuf]) -> Result<Vec<PathBuf>, CampaignError> {
    let mut files = Vec::new();
    for path in given {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let io = |e: std::io::Error| CampaignError::io(path, "read", "a folder", &e);
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(path).map_err(io)? {
            let file = entry.map_err(io)?.path();
            let of = |part: Option<&std::ffi::OsStr>| {
                part.map_or_else(String::new, |p| p.to_string_lossy().to_lowercase())
            };
            let (name, kind) = (of(file.file_name()), of(file.extension()));
            let measured = ["csv", "txt", "log", "tsv", "dat", "asc", "xml", "out", ""]
                .contains(&kind.as_str());
            if file.is_file() && measured && !name.starts_with('.') && !name.starts_with("readme") {
                inside.push(file);
            }
        }
        if inside.is_empty() {
            let problem = Problem::EmptyFolder;
            return Err(CampaignError::new(Place::file(path), problem));
        }
        inside.sort_by_key(|name| natural(name));
        files.extend(inside);
    }
    Ok(files)
}

/// Numbers in a name count as numbers: run2 before run10.
fn natural(path: &Path) -> Vec<(String, u64)> {
    let name = path
        .file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut parts: Vec<(String, u64)> = vec![(String::new(), 0)];
    let mut digits = false;
    for c in name.chars() {
        let digit = c.to_digit(10);
        if digit.is_none() && digits {
            parts.push((String::new(), 0));
        }
        if let Some(last) = parts.last_mut() {
            match digit {
                Some(digit) => last.1 = last.1.saturating_mul(10).saturating_add(u64::from(digit)),
                None => last.0.push(c),
            }
        }
        digits = digit.is_some();
    }
    parts
}

/// What the name of a file says by a pattern such as `{radius}_{feed}_{direction}`; `{}` stands for anything.
///
/// # Errors
/// A pattern that is none, and a name that does not fit it.
pub fn by_name(pattern: &str, file: &Path) -> Result<Said, CampaignError> {
    let stem = file
        .file_stem()
        .map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let problem = |expected: String| {
        let problem = Problem::NamePattern {
            name: stem.clone(),
            pattern: pattern.to_owned(),
            expected,
        };
        CampaignError::new(Place::file(file), problem)
    };
    let mut said = Said::default();
    let (mut rest, mut text) = (pattern, stem.as_str());
    while let Some((before, behind)) = rest.split_once('{') {
        text = text
            .strip_prefix(before)
            .ok_or_else(|| problem(format!("\"{before}\" before \"{text}\"")))?;
        let (key, after) = behind
            .split_once('}')
            .ok_or_else(|| problem("a } for each {".to_owned()))?;
        let literal = after.split('{').next().unwrap_or("");
        let end = if after.is_empty() {
            text.len()
        } else if literal.is_empty() {
            // Between two keys without a sign: where digits end or begin.
            let numeric = text.starts_with(|c: char| c.is_ascii_digit());
            text.find(|c: char| c.is_ascii_digit() != numeric && c != '.')
                .unwrap_or(text.len())
        } else {
            text.find(literal)
                .ok_or_else(|| problem(format!("\"{literal}\" in \"{text}\"")))?
        };
        if !key.is_empty() && key != "*" && key != "any" {
            said.take(key, &text[..end])
                .map_err(|expected| problem(format!("{{{key}}} to be {expected}")))?;
        }
        (rest, text) = (after, &text[end..]);
    }
    if text != rest {
        return Err(problem(format!("\"{rest}\" at the end")));
    }
    Ok(said)
}

/// A pattern that fits the name of a file, if it says radius, feed and direction one after the other.
pub fn pattern_of(file: &Path) -> Option<String> {
    let stem = file.file_stem()?.to_string_lossy().into_owned();
    let separator = ['_', '-', ' ']
        .into_iter()
        .find(|s| stem.split(*s).count() >= 3)?;
    let parts: Vec<&str> = stem.split(separator).collect();
    let mut names = ["{radius}", "{feed}"].into_iter();
    let mut directed = false;
    let pattern: Vec<String> = parts
        .iter()
        .map(|part| {
            if part.parse::<f64>().is_ok() {
                return names.next().unwrap_or("{}").to_owned();
            }
            if ["ccw", "cw"].contains(&part.to_lowercase().as_str()) {
                directed = true;
                return "{direction}".to_owned();
            }
            "{}".to_owned()
        })
        .collect();
    (directed && names.next().is_none()).then(|| pattern.join(&separator.to_string()))
}

/// A list of files, a CSV with the columns `file`, `radius_mm`, `feed_mm_s`, `direction` and, if wanted, `plane`, `setup`,
/// `start_angle_deg`, `started_s`, `temperature_c`. Files are sought beside the list.
///
/// # Errors
/// A list that cannot be read, by line and column.
pub fn by_list(list: &Path) -> Result<Vec<(PathBuf, Said)>, CampaignError> {
    let expected = "a CSV with the columns file, radius_mm, feed_mm_s, direction";
    let bytes = std::fs::read(list).map_err(|e| CampaignError::io(list, "read", expected, &e))?;
    let text = super::layout::latin1(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes));
    let first = text.lines().next().unwrap_or("");
    let separator = if first.contains(';') { b';' } else { b',' };
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .trim(csv::Trim::All)
        .flexible(true)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let refuse = |line: u64, column: usize, found: &str, expected: &str| {
        let at = Place::at(list, line as usize, column);
        let (found, expected) = (found.to_owned(), expected.to_owned());
        Err(CampaignError::new(at, Problem::List { found, expected }))
    };
    let header = match reader.headers() {
        Ok(header) => header.clone(),
        Err(e) => return refuse(1, 1, &e.to_string(), expected),
    };
    let Some(named) = header
        .iter()
        .position(|name| name.eq_ignore_ascii_case("file"))
    else {
        return refuse(1, 1, first, expected);
    };
    let folder = list.parent().unwrap_or(Path::new(""));
    let mut files = Vec::new();
    for record in reader.records() {
        let record = match record {
            Ok(record) => record,
            Err(e) => {
                return refuse(
                    e.position().map_or(1, csv::Position::line),
                    1,
                    &e.to_string(),
                    expected,
                );
            }
        };
        let line = record.position().map_or(1, csv::Position::line);
        let mut said = Said::default();
        for (k, (key, field)) in header.iter().zip(&record).enumerate() {
            if k == named || field.is_empty() {
                continue;
            }
            if let Err(expected) = said.take(&key.to_lowercase(), field) {
                return refuse(line, k + 1, &format!("{key} = {field}"), expected);
            }
        }
        match record.get(named).filter(|f| !f.is_empty()) {
            Some(file) => files.push((folder.join(file), said)),
            None => return refuse(line, named + 1, "no file", "the name of a file"),
        }
    }
    if files.is_empty() {
        return refuse(1, 1, "no rows", expected);
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_the_pattern_says() {
        let said = by_name(
            "{radius}_{feed}_{direction}",
            Path::new("a/100_250.5_cw.csv"),
        )
        .unwrap();
        assert_eq!((said.radius_m, said.feed_m_s), (Some(0.1), Some(0.2505)));
        assert_eq!(said.direction, Some(Direction::Cw));
        let said = by_name(
            "R{radius}-F{feed_mm_min}{}{direction}",
            Path::new("R50-F3000xCCW.txt"),
        );
        assert!(said.is_err()); // `{}{direction}` has no sign between
        let said = by_name(
            "{}-{plane}-R{radius}f{feed}",
            Path::new("day 2-zx-R150f20.log"),
        )
        .unwrap();
        assert_eq!((said.plane, said.radius_m), (Some(Plane::Zx), Some(0.15)));
        for (pattern, name, says) in [
            ("{radius}_{feed}", "100.csv", "\"_\""),
            ("{radius}_{speed}", "100_2.csv", "{speed}"),
            ("{radius}_{direction}", "100_left.csv", "ccw or cw"),
            ("{radius", "100.csv", "}"),
        ] {
            let refused = by_name(pattern, Path::new(name)).unwrap_err().to_string();
            assert!(refused.contains(says), "{refused}");
        }
        assert_eq!(
            pattern_of(Path::new("mill-100-250-ccw.csv")).as_deref(),
            Some("{}-{radius}-{feed}-{direction}")
        );
        assert_eq!(pattern_of(Path::new("ball-ccw.csv")), None);
    }

    #[test]
    fn a_list_says_it_file_by_file() {
        let dir = tempfile::tempdir().unwrap();
        let list = dir.path().join("runs.csv");
        std::fs::write(
            &list,
            "file;radius_mm;feed_mm_s;direction;plane\na.csv;100;50;ccw;\nb.csv;100,5;50;cw;yz\n",
        )
        .unwrap();
        let files = by_list(&list).unwrap();
        assert_eq!(files[0].0, dir.path().join("a.csv"));
        assert_eq!(
            (files[1].1.radius_m, files[1].1.plane),
            (Some(0.1005), Some(Plane::Yz))
        );
        for (text, says) in [
            ("name,radius_mm\na,1\n", "runs.csv:1:1"),
            ("file,radius_mm\na.csv,big\n", "runs.csv:2:2"),
            ("file,height\na.csv,2\n", "height = 2"),
            ("file\n", "no rows"),
        ] {
            std::fs::write(&list, text).unwrap();
            let refused = by_list(&list).unwrap_err().to_string();
            assert!(refused.contains(says), "{refused}");
        }
    }

    #[test]
    fn a_folder_gives_its_files_in_the_order_of_their_numbers() {
        let dir = tempfile::tempdir().unwrap();
        for name in [
            "run10.csv",
            "run2.csv",
            "notes.md",
            ".hidden.csv",
            "README.txt",
        ] {
            std::fs::write(dir.path().join(name), "x").unwrap();
        }
        let names: Vec<_> = files(&[dir.path().to_path_buf()]).unwrap();
        assert_eq!(
            names,
            [dir.path().join("run2.csv"), dir.path().join("run10.csv")]
        );
        let empty = tempfile::tempdir().unwrap();
        assert!(files(&[empty.path().to_path_buf()]).is_err());
    }
}
