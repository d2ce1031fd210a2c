//! Changes of a campaign's runs, checked as an import is: what would not be read is not written.
use super::error::{CampaignError, Place, Problem};
use super::{Direction, Manifest, Plane, write};
use std::path::Path;
use toml_edit::{ArrayOfTables, DocumentMut, Table, value};

/// What becomes of a run; `None` leaves it as it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    /// Programmed radius, m.
    pub radius_m: Option<f64>,
    /// Programmed feed, m/s.
    pub feed_m_s: Option<f64>,
    /// Direction of travel.
    pub direction: Option<Direction>,
    /// Polar angle of the first sample, rad.
    pub start_angle_rad: Option<f64>,
    /// Start since the campaign began, s.
    pub started_s: Option<f64>,
    /// Temperature, °C.
    pub temperature_c: Option<f64>,
    /// Programmed centre, m.
    pub centre_m: Option<[f64; 3]>,
    /// Plane of the circle.
    pub plane: Option<Plane>,
    /// Set-up that the run belongs to.
    pub setup: Option<String>,
}

/// Changes what the campaign in `dir` says of a run, and gives it back as it is then read.
///
/// # Errors
/// A run that the campaign does not list, and whatever the changed run would be refused for; the campaign is then as it was.
///
/// ```
/// use giotto::campaign::{self, edit::{Change, set}};
/// use giotto::simulation::{self, Plan};
/// # use std::path::Path;
/// # let plan = Plan::parse("[grid]\nradii_mm = [100.0]\nfeeds_mm_s = [50.0]", Path::new("plan.toml"))?;
/// # let folder = tempfile::tempdir()?;
/// # campaign::write(&simulation::campaign(&plan, 1), folder.path())?;
///
/// // The wrong feed was noted down.
/// let change = Change { feed_m_s: Some(0.06), ..Change::default() };
/// let manifest = set(folder.path(), "run000.csv", &change)?;
/// assert_eq!(manifest.runs[0].feed_m_s, 0.06);
/// // A run that the campaign does not list is refused.
/// assert!(set(folder.path(), "run999.csv", &change).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn set(dir: &Path, file: &str, change: &Change) -> Result<Manifest, CampaignError> {
    edit(dir, file, |list, index| {
        if let Some(table) = list.get_mut(index) {
            change.write(table);
        }
        Some(index)
    })
}

/// Takes a run off the list of the campaign in `dir`; its file stays.
///
/// # Errors
/// A run that the campaign does not list, or that is its last one.
pub fn remove(dir: &Path, file: &str) -> Result<Manifest, CampaignError> {
    edit(dir, file, |list, index| {
        list.remove(index);
        None
    })
}

impl Change {
    fn write(&self, table: &mut Table) {
        let plain = |v: f64| value((v * 1e9).round() / 1e9);
        let numbers = [
            ("radius_mm", self.radius_m.map(|v| v * 1e3)),
            ("feed_mm_s", self.feed_m_s.map(|v| v * 1e3)),
            ("start_angle_deg", self.start_angle_rad.map(f64::to_degrees)),
            ("started_s", self.started_s),
            ("temperature_c", self.temperature_c),
        ];
        for (key, number) in numbers {
            if let Some(number) = number {
                table[key] = plain(number);
            }
        }
        if let Some(direction) = self.direction {
            table["direction"] = value(match direction {
                Direction::Ccw => "ccw",
                Direction::Cw => "cw",
            });
        }
        if let Some(centre) = self.centre_m {
            let mm = centre.map(|c| (c * 1e12).round() / 1e9);
            table["centre_mm"] = value(mm.into_iter().collect::<toml_edit::Array>());
        }
        if let Some(plane) = self.plane {
            table["plane"] = value(plane.name());
        }
        if let Some(setup) = &self.setup {
            table["setup"] = value(setup);
        }
    }
}

/// Edits the list of runs, checks the campaign as it would be, and writes it.
fn edit(
    dir: &Path,
    file: &str,
    change: impl FnOnce(&mut ArrayOfTables, usize) -> Option<usize>,
) -> Result<Manifest, CampaignError> {
    let before = Manifest::open(dir)?;
    let path = before.path.clone();
    let unknown = || {
        let problem = Problem::UnknownRun {
            file: file.to_owned(),
            runs: before.runs.iter().map(|r| r.file.clone()).collect(),
        };
        CampaignError::new(Place::file(&path), problem)
    };
    let index = before
        .runs
        .iter()
        .position(|r| r.file == file)
        .ok_or_else(unknown)?;
    let toml = |reason: String| CampaignError::new(Place::file(&path), Problem::Toml { reason });
    let text = std::fs::read_to_string(&path)
        .map_err(|e| CampaignError::io(&path, "read", "a campaign.toml", &e))?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut document: DocumentMut = text
        .parse()
        .map_err(|e: toml_edit::TomlError| toml(e.message().to_owned()))?;
    let list = document
        .get_mut("run")
        .and_then(|runs| runs.as_array_of_tables_mut());
    let list = list.ok_or_else(|| {
        toml("`run` is an inline list, which is not edited; write [[run]] tables".to_owned())
    })?;
    let changed = change(list, index);
    let text = document.to_string();
    let after = Manifest::parse(&path, &text)?;
    if let Some(index) = changed {
        after.load(index)?;
    }
    write::replace(&path, &text)?;
    Ok(after)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Two runs of positions, one each way.
    fn campaign() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let mut toml = "[campaign]\nname = \"c\"\n# by hand\n".to_owned();
        for (name, sign) in [("a.csv", 1.0), ("b.csv", -1.0)] {
            let mut text = "x_mm,y_mm\n".to_owned();
            for k in 0..200 {
                let (sin, cos) = (sign * TAU * f64::from(k) / 200.0).sin_cos();
                let noise = f64::from((k * 7919) % 101) * 1e-5;
                text += &format!(
                    "{:.6},{:.6}\n",
                    (100.0 + noise) * cos,
                    (100.0 + noise) * sin
                );
            }
            std::fs::write(dir.path().join(name), text).unwrap();
            let direction = if sign > 0.0 { "ccw" } else { "cw" };
            toml += &format!(
                "[[run]]\nfile = \"{name}\"\nradius_mm = 100.0\nfeed_mm_s = 50.0\ndirection = \"{direction}\"\n"
            );
        }
        std::fs::write(dir.path().join("campaign.toml"), toml).unwrap();
        dir
    }

    #[test]
    fn a_run_is_changed_and_what_its_samples_contradict_is_not_written() {
        let dir = campaign();
        let toml = dir.path().join("campaign.toml");
        let change = Change {
            feed_m_s: Some(0.08),
            plane: Some(Plane::Zx),
            setup: Some("B".to_owned()),
            ..Change::default()
        };
        let after = set(dir.path(), "b.csv", &change).unwrap();
        assert_eq!(after.runs[1].feed_m_s, 0.08);
        assert_eq!(
            (after.runs[1].plane, after.runs[0].plane),
            (Some(Plane::Zx), None)
        );
        let text = std::fs::read_to_string(&toml).unwrap();
        assert!(
            text.contains("# by hand") && text.contains("setup = \"B\""),
            "{text}"
        );
        for wrong in [
            Change {
                direction: Some(Direction::Ccw),
                ..Change::default()
            },
            Change {
                radius_m: Some(0.05),
                ..Change::default()
            },
            Change {
                feed_m_s: Some(-1.0),
                ..Change::default()
            },
        ] {
            assert!(set(dir.path(), "b.csv", &wrong).is_err(), "{wrong:?}");
        }
        let refused = set(dir.path(), "c.csv", &Change::default()).unwrap_err();
        assert!(refused.to_string().contains("a.csv, b.csv"), "{refused}");
        assert_eq!(std::fs::read_to_string(&toml).unwrap(), text);
        assert_eq!(remove(dir.path(), "a.csv").unwrap().runs.len(), 1);
        assert!(dir.path().join("a.csv").exists());
        // A campaign without runs is none.
        assert!(remove(dir.path(), "b.csv").is_err());
    }
}
