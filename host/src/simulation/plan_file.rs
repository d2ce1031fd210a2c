//! `PLAN.toml`: what `giotto simulate` runs. Units are in the names; every key may be left out but the runs.
//!
//! ```toml
//! model = "EXTENDED.toml"      # or [machine]; neither: a perfect machine
//! [campaign]
//! name = "lab"
//! machine = "two-axis, simulated"
//! [machine]                    # see `machine_spec`
//! moving_average_s = 0.04
//! both = { kv_per_s = 50.0 }
//! x = { backlash_um = 8.0 }
//! [instrument]
//! noise_um = 1.0
//! spread_um = 0.5
//! resolution_um = 0.1
//! [grid]                       # or [[run]] tables
//! radii_mm = [100.0, 150.0, 300.0]
//! feeds_mm_s = [20.0, 100.0, 700.0]
//! directions = ["ccw", "cw"]
//! order = "random"
//! ```
use super::circle::CircleTest;
use super::instrument::Instrument;
use super::machine::Machine;
use super::machine_spec::MachineSpec;
use super::plan::{Plan, PlannedTest};
use crate::model_file::ModelFile;
use crate::toml_file::{TomlFileError, TomlText};
use giotto_shared::{Direction, Frame, Plane};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const EXPECTED: &str = "a plan: [machine] or model, [instrument], and [grid] or [[run]]";
/// Most runs of a plan.
const MAX_RUNS: usize = 10_000;

/// A plan as it is written.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlanFile {
    /// Model file of the machine, relative to the plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// Names.
    pub campaign: Names,
    /// The machine, element by element.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub machine: Option<MachineSpec>,
    /// The instrument; left out: [`Instrument::ballbar`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instrument: Option<InstrumentSpec>,
    /// Every radius with every feed and direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid: Option<Grid>,
    /// Runs one by one, in this order.
    #[serde(rename = "run", skip_serializing_if = "Vec::is_empty")]
    pub runs: Vec<RunSpec>,
}

/// Names that the campaign will carry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Names {
    /// Name of the campaign.
    pub name: String,
    /// Name of the machine.
    pub machine: String,
}

impl Default for Names {
    fn default() -> Self {
        Self {
            name: "simulated".into(),
            machine: "simulated two-axis machine".into(),
        }
    }
}

/// [`Instrument`] in the units of the workshop.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(missing_docs, reason = "the fields are those of Instrument")]
pub struct InstrumentSpec {
    pub noise_um: f64,
    pub spread_um: f64,
    pub resolution_um: f64,
    pub setup_um: [f64; 2],
    pub setup_spread_um: f64,
    pub out_of_plane_mm: f64,
    pub drift_um_per_h: f64,
}

/// A grid of runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Radii, mm.
    pub radii_mm: Vec<f64>,
    /// Feeds, mm/s.
    pub feeds_mm_s: Vec<f64>,
    /// Directions.
    #[serde(default = "both_directions")]
    pub directions: Vec<Direction>,
    /// Order of the runs.
    #[serde(default)]
    pub order: Order,
    /// How often each circle is run.
    #[serde(default = "once")]
    pub repeats: usize,
    /// Planes of the circles.
    #[serde(default = "flat")]
    pub planes: Vec<Plane>,
}

/// Order of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// Shuffled by the seed, so that drift does not pass for an effect of speed.
    #[default]
    Random,
    /// As listed: radius by radius, feed by feed.
    Listed,
}

/// One run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSpec {
    /// Programmed radius, mm.
    pub radius_mm: f64,
    /// Programmed feed, mm/s.
    pub feed_mm_s: f64,
    /// Direction of travel.
    pub direction: Direction,
    /// Polar angle of the first sample, degrees.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub start_angle_deg: f64,
    /// Start since the campaign began, s; left out: after the run before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started_s: Option<f64>,
    /// Centre in the machine, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_mm: Option<[f64; 3]>,
    /// Plane of the circle.
    #[serde(default)]
    pub plane: Plane,
}

fn flat() -> Vec<Plane> {
    vec![Plane::Xy]
}

fn both_directions() -> Vec<Direction> {
    vec![Direction::Ccw, Direction::Cw]
}

fn once() -> usize {
    1
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde wants a reference")]
fn is_zero(v: &f64) -> bool {
    *v == 0.0
}

impl Plan {
    /// Reads a plan and the model it names.
    ///
    /// # Errors
    /// Whatever keeps either file from being used, with file, line and column.
    pub fn load(file: &Path) -> Result<Self, TomlFileError> {
        let text = TomlText::read(file, EXPECTED)?;
        let dir = file.parent().unwrap_or(Path::new("."));
        Self::of_text(&text, |model| ModelFile::load(&dir.join(model)))
    }

    /// As [`Self::load`], of a text; `file` is the name it goes by in errors and what a model is relative to.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, TomlFileError> {
        let dir = file.parent().unwrap_or(Path::new("."));
        Self::of_text(&TomlText::new(file, text, EXPECTED), |model| {
            ModelFile::load(&dir.join(model))
        })
    }

    fn of_text(
        text: &TomlText,
        load: impl Fn(&Path) -> Result<ModelFile, TomlFileError>,
    ) -> Result<Self, TomlFileError> {
        let plan: PlanFile = text.parse()?;
        let machine = match (&plan.machine, &plan.model) {
            (Some(_), Some(_)) => {
                return Err(text.missed(
                    &["model"],
                    "`model` and [machine] both say what the machine is",
                    "one",
                ));
            }
            (None, None) => Machine::default(),
            (Some(spec), None) => spec.machine().map_err(|e| {
                let path: Vec<&str> = std::iter::once("machine")
                    .chain(e.name.split('.'))
                    .collect();
                text.value_error(&path, e.value, e.allowed)
            })?,
            (None, Some(file)) => {
                let model = load(file)?;
                let machine = Machine::from_model(&model);
                machine.map_err(|e| {
                    text.missed(&["model"], format!("{}: {e}", file.display()), e.allowed)
                })?
            }
        };
        let instrument = match plan.instrument {
            Some(spec) => spec.instrument(text)?,
            None => Instrument::ballbar(),
        };
        let (tests, shuffle) = match (&plan.grid, plan.runs.as_slice()) {
            (None, []) => {
                return Err(text.missed(
                    &[],
                    "the plan has no runs",
                    "a [grid] or at least one [[run]]",
                ));
            }
            (Some(_), [_, ..]) => {
                return Err(text.missed(
                    &["run"],
                    "[grid] and [[run]] both say what to run",
                    "one of them",
                ));
            }
            (Some(grid), []) => (grid.tests(text)?, grid.order == Order::Random),
            (None, runs) => {
                let test = |(i, run): (usize, &RunSpec)| run.test(text, i);
                (
                    runs.iter()
                        .enumerate()
                        .map(test)
                        .collect::<Result<_, _>>()?,
                    false,
                )
            }
        };
        if tests.len() > MAX_RUNS {
            let found = format!("the plan has {} runs", tests.len());
            return Err(text.missed(&["grid"], found, format!("at most {MAX_RUNS}")));
        }
        let Names {
            name,
            machine: machine_name,
        } = plan.campaign;
        Ok(Self {
            name,
            machine_name,
            machine,
            instrument,
            tests,
            shuffle,
        })
    }
}

impl InstrumentSpec {
    fn instrument(self, text: &TomlText) -> Result<Instrument, TomlFileError> {
        let sizes = [
            ("noise_um", self.noise_um),
            ("spread_um", self.spread_um),
            ("resolution_um", self.resolution_um),
            ("setup_spread_um", self.setup_spread_um),
        ];
        for (key, value) in sizes {
            if !(0.0..=1e4).contains(&value) {
                return Err(text.value_error(&["instrument", key], value, "0 to 10000"));
            }
        }
        let anywhere = [
            ("setup_um", self.setup_um[0], 1e4),
            ("setup_um", self.setup_um[1], 1e4),
            ("out_of_plane_mm", self.out_of_plane_mm, 1e2),
            ("drift_um_per_h", self.drift_um_per_h, 1e5),
        ];
        for (key, value, most) in anywhere {
            if value.abs() > most || value.is_nan() {
                return Err(text.value_error(
                    &["instrument", key],
                    value,
                    format!("-{most} to {most}"),
                ));
            }
        }
        Ok(Instrument {
            noise_m: self.noise_um * 1e-6,
            spread_m: self.spread_um * 1e-6,
            resolution_m: self.resolution_um * 1e-6,
            setup_m: self.setup_um.map(|v| v * 1e-6),
            setup_spread_m: self.setup_spread_um * 1e-6,
            out_of_plane_m: self.out_of_plane_mm * 1e-3,
            drift_m_s: self.drift_um_per_h * 1e-6 / 3600.0,
        })
    }
}

/// Radius (mm) and feed (mm/s) as a machine could run them.
fn in_range(value: f64) -> bool {
    (1e-2..=1e5).contains(&value)
}
const RANGE: &str = "0.01 to 100000";

impl Grid {
    fn tests(&self, text: &TomlText) -> Result<Vec<PlannedTest>, TomlFileError> {
        for (key, list) in [
            ("radii_mm", &self.radii_mm),
            ("feeds_mm_s", &self.feeds_mm_s),
        ] {
            if list.is_empty() {
                return Err(text.missed(
                    &["grid", key],
                    format!("`grid.{key}` is empty"),
                    "at least one number",
                ));
            }
            if let Some(i) = list.iter().position(|v| !in_range(*v)) {
                return Err(text.value_error(&["grid", key, &i.to_string()], list[i], RANGE));
            }
        }
        if self.directions.is_empty() || self.planes.is_empty() || self.repeats == 0 {
            let key = match (self.repeats, self.planes.len()) {
                (0, _) => "repeats",
                (_, 0) => "planes",
                _ => "directions",
            };
            return Err(text.missed(
                &["grid", key],
                format!("`grid.{key}` leaves no runs"),
                "at least one",
            ));
        }
        let mut tests = Vec::new();
        for radius in &self.radii_mm {
            for feed in &self.feeds_mm_s {
                for direction in self
                    .directions
                    .iter()
                    .flat_map(|d| std::iter::repeat_n(*d, self.repeats))
                {
                    for plane in &self.planes {
                        let test = CircleTest {
                            frame: Frame::of(*plane),
                            ..CircleTest::new(radius * 1e-3, feed * 1e-3, direction)
                        };
                        tests.push(PlannedTest { test, timed: false });
                    }
                }
                if tests.len() > MAX_RUNS {
                    return Ok(tests);
                }
            }
        }
        Ok(tests)
    }
}

impl RunSpec {
    fn test(&self, text: &TomlText, index: usize) -> Result<PlannedTest, TomlFileError> {
        let index = index.to_string();
        for (key, value) in [("radius_mm", self.radius_mm), ("feed_mm_s", self.feed_mm_s)] {
            if !in_range(value) {
                return Err(text.value_error(&["run", &index, key], value, RANGE));
            }
        }
        if !(-360.0..=360.0).contains(&self.start_angle_deg) {
            return Err(text.value_error(
                &["run", &index, "start_angle_deg"],
                self.start_angle_deg,
                "-360 to 360",
            ));
        }
        let started = self.started_s.unwrap_or(0.0);
        if !(0.0..=1e9).contains(&started) {
            return Err(text.value_error(&["run", &index, "started_s"], started, "0 to 1e9"));
        }
        let centre = self.centre_mm.unwrap_or_default();
        if let Some(c) = centre.iter().find(|c| !(-1e6..=1e6).contains(*c)) {
            return Err(text.value_error(&["run", &index, "centre_mm"], c, "-1e6 to 1e6"));
        }
        let test = CircleTest {
            start_angle_rad: self.start_angle_deg.to_radians(),
            started_s: started,
            centre_m: centre.map(|c| c * 1e-3),
            frame: Frame::of(self.plane),
            ..CircleTest::new(self.radius_mm * 1e-3, self.feed_mm_s * 1e-3, self.direction)
        };
        Ok(PlannedTest {
            test,
            timed: self.started_s.is_some(),
        })
    }
}
