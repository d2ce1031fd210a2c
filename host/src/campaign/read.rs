//! Reading campaigns: all at once, or run by run for those that do not fit in memory.
use super::check;
use super::error::{CampaignError, Problem};
use super::manifest::Manifest;
use super::samples::{self, Loaded};
use super::{Campaign, Frame, Note, Run};
use crate::kinematics;
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::Path;

/// Angles at which a circle of an arm is looked at: every 2°.
const CHECKED: usize = 180;

/// Reads a campaign: its directory, or its `campaign.toml`.
///
/// # Errors
/// The first problem in file order, with file, line and column.
///
/// ```
/// use giotto::campaign;
///
/// let folder = tempfile::tempdir()?;
/// std::fs::write(
///     folder.path().join("campaign.toml"),
///     "[campaign]\nname = \"lab\"\nmachine = \"mill\"\n[[run]]\nfile = \"a.csv\"\n\
///      radius_mm = 100.0\nfeed_mm_s = 50.0\ndirection = \"ccw\"\n",
/// )?;
/// let mut rows = String::from("angle_deg,deviation_um\n");
/// for degree in 0..360 {
///     let deviation_um = -25.0 + 3.0 * f64::from(2 * degree).to_radians().cos();
///     rows += &format!("{degree},{deviation_um:.3}\n");
/// }
/// std::fs::write(folder.path().join("a.csv"), rows)?;
///
/// let campaign = campaign::read(folder.path())?;
/// let run = &campaign.runs[0];
/// // Metres and radians inside, whatever the file has.
/// assert_eq!(run.radius_m, 0.1);
/// assert!((run.samples.deviation_m[0] + 22e-6).abs() < 1e-12);
/// // A file that is not there is refused with its place.
/// std::fs::remove_file(folder.path().join("a.csv"))?;
/// assert!(campaign::read(folder.path()).is_err_and(|error| error.to_string().contains("a.csv")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read(path: &Path) -> Result<Campaign, CampaignError> {
    read_with_notes(path).map(|(campaign, _)| campaign)
}

/// As [`read`], with what a reader should know of it: keys not used, samples lost, feeds exceeded.
///
/// # Errors
/// As [`read`].
pub fn read_with_notes(path: &Path) -> Result<(Campaign, Vec<Note>), CampaignError> {
    Manifest::open(path)?.read()
}

/// A run whose file contradicts its label, left out of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Mislabelled {
    /// File of the run, as the campaign names it.
    pub file: String,
    /// What contradicts what.
    pub error: CampaignError,
}

/// One run in so many may be labelled wrongly before the campaign as a whole is in doubt.
const ONE_MISLABELLED_IN: usize = 12;

impl Manifest {
    /// Reads and checks all runs, with notes.
    ///
    /// # Errors
    /// As [`read`].
    pub fn read(&self) -> Result<(Campaign, Vec<Note>), CampaignError> {
        let (campaign, notes, _) = self.read_all_but(0)?;
        Ok((campaign, notes))
    }

    /// As [`Manifest::read`], but leaves out runs whose files contradict their labels, one in twelve at most.
    ///
    /// # Errors
    /// As [`read`]; more such runs than that.
    pub fn read_labelled(&self) -> Result<(Campaign, Vec<Note>, Vec<Mislabelled>), CampaignError> {
        self.read_all_but(self.runs.len() / ONE_MISLABELLED_IN)
    }

    fn read_all_but(
        &self,
        most: usize,
    ) -> Result<(Campaign, Vec<Note>, Vec<Mislabelled>), CampaignError> {
        let loaded: Vec<Result<Loaded, CampaignError>> = self
            .runs
            .par_iter()
            .map(|entry| samples::load(entry, true))
            .collect();
        let mut together = Together::new(self);
        let mut runs = Vec::with_capacity(loaded.len());
        let mut notes = self.notes.clone();
        let mut left_out: Vec<Mislabelled> = Vec::new();
        for (index, loaded) in loaded.into_iter().enumerate() {
            let loaded = match loaded {
                Err(error) if left_out.len() < most && error.contradicts_its_label() => {
                    let file = self.runs[index].file.clone();
                    left_out.push(Mislabelled { file, error });
                    continue;
                }
                loaded => loaded?,
            };
            together.add(index, &loaded);
            notes.extend(loaded.notes);
            runs.push(loaded.run);
        }
        together.check()?;
        self.reached(&runs)?;
        Ok((
            Campaign {
                name: self.name.clone(),
                machine: self.machine.clone(),
                repeatability_m: self.repeatability_m,
                table: self.table.clone(),
                kinematics: self.kinematics,
                runs,
            },
            notes,
            left_out,
        ))
    }

    /// Refuses a circle on which the arm cannot stand; runs of one circle are looked at once.
    fn reached(&self, runs: &[Run]) -> Result<(), CampaignError> {
        let Some(kinematics) = &self.kinematics else {
            return Ok(());
        };
        let mut seen: Vec<([f64; 3], Frame, f64)> = Vec::new();
        for (entry, run) in self.runs.iter().zip(runs) {
            let circle = (run.centre_m.unwrap_or_default(), run.frame, run.radius_m);
            if seen.contains(&circle) {
                continue;
            }
            let (centre_m, frame, radius_m) = circle;
            kinematics::walk(kinematics, centre_m, frame, radius_m, CHECKED).map_err(
                |(angle_rad, reason)| {
                    let problem = Problem::OutOfReach {
                        radius_mm: radius_m * 1e3,
                        centre_mm: centre_m.map(|c| c * 1e3),
                        angle_deg: angle_rad.to_degrees().round(),
                        reason,
                    };
                    CampaignError::new(entry.listed(), problem)
                },
            )?;
            seen.push(circle);
        }
        Ok(())
    }

    /// Reads and checks run `index` without keeping its time stamps. What only shows across runs is for
    /// [`Together`] to say.
    ///
    /// # Errors
    /// Whatever keeps the file from being this run.
    pub fn load(&self, index: usize) -> Result<Loaded, CampaignError> {
        samples::load(&self.runs[index], false)
    }
}

/// Checks across the runs of a campaign, in constant memory a run.
#[derive(Debug)]
pub struct Together<'a> {
    manifest: &'a Manifest,
    seen: Vec<(usize, Seen)>,
}

#[derive(Debug)]
struct Seen {
    fingerprint: Option<u64>,
    laps: Option<u32>,
    rows: usize,
    /// Measured over programmed duration of the turn.
    slow: Option<(f64, f64)>,
}

impl<'a> Together<'a> {
    /// For the runs of this campaign.
    pub fn new(manifest: &'a Manifest) -> Self {
        Self {
            manifest,
            seen: Vec::with_capacity(manifest.runs.len()),
        }
    }

    /// Takes note of run `index`.
    pub fn add(&mut self, index: usize, loaded: &Loaded) {
        let run = &loaded.run;
        let slow = loaded
            .turn_s
            .map(|turn| (turn, turn / (TAU * run.radius_m / run.feed_m_s)));
        let seen = Seen {
            fingerprint: loaded.fingerprint,
            laps: loaded.laps,
            rows: run.samples.deviation_m.len(),
            slow,
        };
        self.seen.push((index, seen));
    }

    /// # Errors
    /// A file measured once and listed as two runs; several laps in one file.
    pub fn check(mut self) -> Result<(), CampaignError> {
        self.seen.sort_by_key(|(index, _)| *index);
        // A controller that slows down does so by degrees; a file of two laps lasts exactly two.
        let by_degrees = self.seen.iter().any(|(_, s)| {
            s.slow.is_some_and(|(_, ratio)| {
                ratio > 1.05 && (ratio / ratio.round() - 1.0).abs() > 0.05
            })
        });
        let mut known: HashMap<u64, usize> = HashMap::new();
        for (index, seen) in &self.seen {
            let entry = &self.manifest.runs[*index];
            if let (Some(laps), Some((turn_s, _)), false) = (seen.laps, seen.slow, by_degrees) {
                return Err(check::several_laps(entry, turn_s, seen.rows, laps));
            }
            let Some(print) = seen.fingerprint else {
                continue;
            };
            if let Some(first) = known.insert(print, *index) {
                let other = self.manifest.runs[first].file.clone();
                return Err(CampaignError::new(
                    entry.row(0),
                    Problem::DuplicateData { other },
                ));
            }
        }
        Ok(())
    }
}
