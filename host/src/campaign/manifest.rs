//! `campaign.toml`, strictly: every value checked, every refusal with its line and column.
use super::error::{CampaignError, Place, Problem};
use super::import::Slice;
use super::{Direction, Frame, Note, Plane};
use crate::kinematics::Kinematics;
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

mod kinematics;
mod values;

/// What a run may say of itself.
const RUN_KEYS: [&str; 11] = [
    "file",
    "radius_mm",
    "feed_mm_s",
    "direction",
    "start_angle_deg",
    "started_s",
    "temperature_c",
    "centre_mm",
    "arc_deg",
    "plane",
    "setup",
];

const EXPECTED: &str = "a directory with campaign.toml and one CSV a run";
const EXPECTED_TOML: &str = "[campaign] and [[run]] tables";
/// Shortest arc that a campaign may declare, degrees.
pub const SHORTEST_ARC_DEG: f64 = 180.0;

/// Cosine of the largest angle between a plane that is named and the points' own: 45°, from where another is nearer.
const FARTHEST_TILT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A campaign before its samples are read.
#[derive(Clone, Debug, PartialEq)]
pub struct Manifest {
    /// The `campaign.toml`.
    pub path: PathBuf,
    /// Name of the campaign.
    pub name: String,
    /// Machine under test.
    pub machine: String,
    /// Known scatter of the size between runs of one circle, m.
    pub repeatability_m: Option<f64>,
    /// SHA-256 of the correction table that was at work.
    pub table: Option<String>,
    /// The arm, if the machine is one.
    pub kinematics: Option<Kinematics>,
    /// What it says of each run, in file order.
    pub runs: Vec<Entry>,
    /// What the reader should know (unknown keys).
    pub notes: Vec<Note>,
}

/// What `campaign.toml` says of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// File name as written.
    pub file: String,
    /// Where the file is.
    pub path: PathBuf,
    /// Line of `file` in `campaign.toml`.
    pub line: usize,
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// Direction of travel.
    pub direction: Direction,
    /// `start_angle_deg` if given, rad.
    pub start_angle_rad: Option<f64>,
    /// Start since the campaign began, s.
    pub started_s: Option<f64>,
    /// Temperature, °C.
    pub temperature_c: Option<f64>,
    /// Programmed centre, m.
    pub centre_m: Option<[f64; 3]>,
    /// Plane of the circle, if the campaign or the run names it.
    pub plane: Option<Plane>,
    /// Name of the set-up, if given.
    pub setup: Option<String>,
    /// Declared arc, rad, if the run is not a whole turn.
    pub arc_rad: Option<f64>,
    /// Where the run stands in a foreign file; `None` for a file of the contract.
    pub slice: Option<Slice>,
}

impl Manifest {
    /// Opens a campaign: its directory, or its `campaign.toml`.
    ///
    /// # Errors
    /// Whatever keeps `campaign.toml` from being used; the CSVs are not touched yet.
    pub fn open(path: &Path) -> Result<Self, CampaignError> {
        let file = if path.is_dir() {
            path.join("campaign.toml")
        } else {
            path.to_path_buf()
        };
        let bytes =
            std::fs::read(&file).map_err(|e| CampaignError::io(&file, "read", EXPECTED, &e))?;
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
        let text = std::str::from_utf8(bytes).map_err(|e| {
            let at = Place::of_byte(&file, bytes, e.valid_up_to());
            CampaignError::new(
                at,
                Problem::NotUtf8 {
                    expected: EXPECTED_TOML,
                },
            )
        })?;
        if text.trim().is_empty() {
            return Err(CampaignError::new(
                Place::file(&file),
                Problem::Empty {
                    expected: EXPECTED_TOML,
                },
            ));
        }
        Self::parse(&file, text)
    }

    /// A campaign by the text of the `campaign.toml` at `file`.
    ///
    /// # Errors
    /// As [`Manifest::open`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, CampaignError> {
        Source {
            file,
            text,
            notes: Vec::new(),
        }
        .manifest()
    }
}

impl Entry {
    /// Where `campaign.toml` lists the run.
    pub(super) fn listed(&self) -> Place {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        Place::at(folder.join("campaign.toml"), self.line, 1)
    }

    /// How the circle lies: as its points say, else as the campaign says, else in XY.
    pub(super) fn frame_of(&self, measured: Option<Frame>) -> Result<Frame, CampaignError> {
        let declared = self.plane.map(Frame::of);
        let (Some(measured), Some(declared)) = (measured, declared) else {
            return Ok(measured.or(declared).unwrap_or_default());
        };
        let (a, b) = (measured.normal(), declared.normal());
        let cosine: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        if cosine > FARTHEST_TILT {
            return Ok(measured);
        }
        let normal = a.map(|c| (c * 1e3).round() / 1e3);
        let problem = Problem::OtherPlane {
            declared: self.plane.map_or("", Plane::name),
            normal,
        };
        Err(CampaignError::new(self.place(0, 0), problem))
    }
}

/// What `campaign.toml` says of all runs.
#[derive(Default)]
struct Head {
    name: String,
    machine: String,
    plane: Option<Plane>,
    repeatability_m: Option<f64>,
    table: Option<String>,
}

/// The text under examination.
struct Source<'a> {
    file: &'a Path,
    text: &'a str,
    notes: Vec<Note>,
}

type Value<'a> = Spanned<DeValue<'a>>;

impl Source<'_> {
    fn error(&self, span: Range<usize>, problem: Problem) -> CampaignError {
        CampaignError::new(
            Place::of_byte(self.file, self.text.as_bytes(), span.start),
            problem,
        )
    }

    fn manifest(mut self) -> Result<Manifest, CampaignError> {
        let document = DeTable::parse(self.text).map_err(|e| {
            let span = e.span().unwrap_or(0..0);
            self.error(
                span,
                Problem::Toml {
                    reason: e.message().replace('\n', ", "),
                },
            )
        })?;
        let root = document.get_ref();
        self.known_keys(root, &["campaign", "kinematics", "run"])?;
        let mut head = match root.get("campaign") {
            None => {
                let problem = Problem::MissingKey {
                    key: "[campaign]",
                    expected: "a table with name and machine",
                };
                return Err(self.error(0..0, problem));
            }
            Some(value) => self.head(value)?,
        };
        if head.name.is_empty() {
            let folder = self
                .file
                .canonicalize()
                .ok()
                .and_then(|p| Some(p.parent()?.file_name()?.to_owned()));
            head.name = folder.map_or_else(String::new, |f| f.to_string_lossy().into_owned());
        }
        let kinematics = match root.get("kinematics") {
            Some(value) => self.kinematics(value)?,
            None => None,
        };
        let list = match root.get("run") {
            None => return Err(self.error(0..0, Problem::NoRuns)),
            Some(v) => match v.get_ref() {
                DeValue::Array(list) if list.is_empty() => {
                    return Err(self.error(v.span(), Problem::NoRuns));
                }
                DeValue::Array(list) => list,
                other => {
                    return Err(self.wrong_type(
                        v.span(),
                        "run",
                        other,
                        "[[run]] (two brackets), one a run",
                    ));
                }
            },
        };
        let runs = self.entries(list, &head, kinematics.is_some())?;
        Ok(Manifest {
            path: self.file.to_path_buf(),
            name: head.name,
            machine: head.machine,
            repeatability_m: head.repeatability_m,
            table: head.table,
            kinematics,
            runs,
            notes: self.notes,
        })
    }

    /// The runs of the list; those of an arm say where they are.
    fn entries(
        &mut self,
        list: &[Value<'_>],
        head: &Head,
        of_arm: bool,
    ) -> Result<Vec<Entry>, CampaignError> {
        let mut runs = Vec::with_capacity(list.len());
        let mut seen: HashMap<PathBuf, usize> = HashMap::new();
        for value in list {
            let (entry, span) = self.entry(value, head.plane)?;
            if of_arm {
                self.with_centre(&entry, span.clone())?;
            }
            let plain: PathBuf = entry
                .path
                .components()
                .filter(|c| *c != Component::CurDir)
                .collect();
            if let Some(&first) = seen.get(&plain) {
                return Err(self.error(
                    span,
                    Problem::DuplicateRun {
                        file: entry.file,
                        first,
                    },
                ));
            }
            seen.insert(plain, entry.line);
            runs.push(entry);
        }
        Ok(runs)
    }

    fn head(&mut self, value: &Value<'_>) -> Result<Head, CampaignError> {
        let table = self.table(value, "campaign")?;
        self.known_keys(
            table,
            &["name", "machine", "plane", "repeatability_um", "table"],
        )?;
        let text = |key| table.get(key).map(|v| self.string(v, key)).transpose();
        let repeatability = table.get("repeatability_um").map(|v| {
            let expected = "the scatter of a circle's size between runs, 0 to 10000 µm";
            self.within(v, "repeatability_um", expected, |v| {
                (0.0..=1e4).contains(&v)
            })
        });
        Ok(Head {
            name: text("name")?.unwrap_or_default(),
            machine: text("machine")?.unwrap_or_default(),
            plane: table.get("plane").map(|v| self.plane(v)).transpose()?,
            repeatability_m: repeatability.transpose()?.map(|um| um * 1e-6),
            table: table.get("table").map(|v| self.digest(v)).transpose()?,
        })
    }

    fn plane(&self, value: &Value<'_>) -> Result<Plane, CampaignError> {
        let name = self.string(value, "plane")?;
        let known = Plane::ALL.into_iter().find(|plane| plane.name() == name);
        known.ok_or_else(|| {
            let problem = Problem::OutOfRange {
                key: "plane",
                value: format!("\"{name}\""),
                expected: "\"xy\", \"yz\" or \"zx\"",
            };
            self.error(value.span(), problem)
        })
    }

    fn digest(&self, value: &Value<'_>) -> Result<String, CampaignError> {
        let text = self.string(value, "table")?;
        if text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Ok(text.to_ascii_lowercase());
        }
        let problem = Problem::OutOfRange {
            key: "table",
            value: format!("\"{}\"", super::table::shorten(&text)),
            expected: "the SHA-256 of a table, 64 hexadecimal digits",
        };
        Err(self.error(value.span(), problem))
    }

    fn entry(
        &mut self,
        value: &Value<'_>,
        plane: Option<Plane>,
    ) -> Result<(Entry, Range<usize>), CampaignError> {
        let table = self.table(value, "run")?;
        self.known_keys(table, &RUN_KEYS)?;
        let need = |key, expected| {
            table
                .get(key)
                .ok_or_else(|| self.error(value.span(), Problem::MissingKey { key, expected }))
        };
        let file_value = need("file", "the name of the run's CSV")?;
        let file = self.string(file_value, "file")?;
        let span = file_value.span();
        let path = self.path_of(&file, span.clone())?;
        let line = Place::of_byte(self.file, self.text.as_bytes(), span.start)
            .line
            .unwrap_or(1);

        let radius = need("radius_mm", "the programmed radius in mm")?;
        let radius_mm = self.within(radius, "radius_mm", "a radius of 0.1 to 100000 mm", |v| {
            (0.1..=1e5).contains(&v)
        })?;
        let feed = need("feed_mm_s", "the programmed feed in mm/s")?;
        let feed_mm_s = self.within(
            feed,
            "feed_mm_s",
            "a feed above 0, up to 100000 mm/s",
            |v| v > 0.0 && v <= 1e5,
        )?;
        let direction_value = need("direction", "\"ccw\" or \"cw\"")?;
        let direction = self.direction(direction_value)?;
        let optional = |key: &'static str, expected, ok: fn(f64) -> bool| {
            table
                .get(key)
                .map(|v| self.within(v, key, expected, ok))
                .transpose()
        };
        let start = optional("start_angle_deg", "an angle of −360 to 360°", |v| {
            v.abs() <= 360.0
        })?;
        let started_s = optional(
            "started_s",
            "seconds since the campaign began, 0 or more",
            |v| v >= 0.0,
        )?;
        let temperature_c = optional("temperature_c", "a temperature of −50 to 150 °C", |v| {
            (-50.0..=150.0).contains(&v)
        })?;
        let arc = optional(
            "arc_deg",
            "180 to 360° (leave it out for a whole turn)",
            |v| (SHORTEST_ARC_DEG..=360.0).contains(&v),
        )?;
        let centre_m = table.get("centre_mm").map(|v| self.centre(v)).transpose()?;
        let entry = Entry {
            file,
            path,
            line,
            radius_m: radius_mm * 1e-3,
            feed_m_s: feed_mm_s * 1e-3,
            direction,
            start_angle_rad: start.map(f64::to_radians),
            started_s,
            temperature_c,
            centre_m,
            plane: match table.get("plane") {
                Some(v) => Some(self.plane(v)?),
                None => plane,
            },
            setup: table
                .get("setup")
                .map(|v| self.string(v, "setup"))
                .transpose()?,
            arc_rad: arc.map(f64::to_radians),
            slice: None,
        };
        Ok((entry, span))
    }

    fn centre(&self, value: &Value<'_>) -> Result<[f64; 3], CampaignError> {
        const EXPECTED: &str = "three numbers [x, y, z] in mm";
        let DeValue::Array(list) = value.get_ref() else {
            return Err(self.wrong_type(value.span(), "centre_mm", value.get_ref(), EXPECTED));
        };
        if list.len() != 3 {
            let value_text = format!("a list of {}", list.len());
            let problem = Problem::OutOfRange {
                key: "centre_mm",
                value: value_text,
                expected: EXPECTED,
            };
            return Err(self.error(value.span(), problem));
        }
        let mut centre = [0.0; 3];
        for (slot, v) in centre.iter_mut().zip(list.iter()) {
            *slot = 1e-3 * self.within(v, "centre_mm", EXPECTED, |v| v.abs() <= 1e6)?;
        }
        Ok(centre)
    }
}

impl Source<'_> {
    /// Where the file of a run lies: in the campaign's directory.
    fn path_of(&self, file: &str, span: Range<usize>) -> Result<PathBuf, CampaignError> {
        if file.is_empty() {
            let problem = Problem::OutOfRange {
                key: "file",
                value: "\"\"".into(),
                expected: "the name of the run's CSV",
            };
            return Err(self.error(span, problem));
        }
        let relative = Path::new(file);
        if !relative
            .components()
            .all(|c| matches!(c, Component::Normal(_) | Component::CurDir))
        {
            let file = file.to_owned();
            return Err(self.error(span, Problem::OutsideDirectory { file }));
        }
        Ok(self.file.parent().unwrap_or(Path::new("")).join(relative))
    }

    fn direction(&self, value: &Value<'_>) -> Result<Direction, CampaignError> {
        match self.string(value, "direction")?.as_str() {
            "ccw" => Ok(Direction::Ccw),
            "cw" => Ok(Direction::Cw),
            other => {
                let problem = Problem::UnknownDirection {
                    found: other.to_owned(),
                };
                Err(self.error(value.span(), problem))
            }
        }
    }
}
