//! Campaigns of circular tests: what was measured, checked at the border, in SI units.
//!
//! | file | holds |
//! |---|---|
//! | `manifest` | `campaign.toml`, strictly |
//! | `blocks` | large files in blocks of whole lines, on all cores |
//! | `table` | the numbers of a contract's CSV, fast |
//! | `decimal` | plain decimals, fast |
//! | `similar_decimals` | decimals that look like the one above, faster |
//! | `run_file` | a run's file, own or foreign: its columns in SI |
//! | `clock`, `thinned` | time stamps and other rows, seen once and forgotten |
//! | `column_sums` | sums and bounds of long columns, fast |
//! | `samples` | columns → one turn of polar samples |
//! | `steady` | how long a turn takes without its start, stop and pauses |
//! | `outliers` | dust and held values |
//! | `check` | whether numbers can be what the campaign says they are |
//! | `read`, `write` | whole campaigns; run by run where memory counts |
//! | `edit` | changes of runs, checked |
//! | `import` | foreign files |
//! | `error` | everything a campaign is refused for, with its place |
mod blocks;
mod check;
mod clock;
mod column_sums;
mod decimal;
pub mod edit;
mod error;
pub mod import;
mod left_out;
mod manifest;
mod outliers;
mod plane_view;
mod read;
mod run_file;
mod samples;
mod similar_decimals;
mod steady;
mod table;
#[cfg(test)]
mod tests;
mod thinned;
mod write;

pub use check::sample_noise;
pub use error::{CampaignError, Place, Problem};
pub use giotto_shared::{Direction, Frame, Plane};
pub use manifest::{Entry, Manifest, SHORTEST_ARC_DEG};
pub use plane_view::Tilt;
pub use read::{Mislabelled, Together, read, read_with_notes};
pub use samples::{Loaded, Location};
pub(crate) use table::is_contract_header;
pub use write::replace;
pub use write::write;

use crate::kinematics::Kinematics;
use std::f64::consts::TAU;
use std::fmt;

/// Something odd but possible, for the person who reads the result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Where.
    pub at: Place,
    /// What.
    pub text: String,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "note: {}: {}", self.at, self.text)
    }
}

/// A set of circular tests of one machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Campaign {
    /// Name of the campaign.
    pub name: String,
    /// Machine under test.
    pub machine: String,
    /// Known scatter of the size between runs of one circle, m, if the campaign states it.
    pub repeatability_m: Option<f64>,
    /// SHA-256 of the correction table that was at work, if one was.
    pub table: Option<String>,
    /// The arm, if the machine is one: without it the axes are slides.
    pub kinematics: Option<Kinematics>,
    /// The runs in file order; the order of time is that of `started_s`.
    pub runs: Vec<Run>,
}

/// One circular test.
///
/// ```
/// use giotto::simulation::{self, Plan};
/// # use std::path::Path;
/// # let plan = Plan::parse("[grid]\nradii_mm = [100.0]\nfeeds_mm_s = [50.0]\ndirections = [\"cw\"]", Path::new("plan.toml"))?;
/// let campaign = simulation::campaign(&plan, 1);
///
/// let run = &campaign.runs[0];
/// assert_eq!(run.omega_rad_s(), 0.05 / 0.1);
/// assert_eq!(run.sign(), -1.0);
/// // A turn of 2π·100 mm at 50 mm/s.
/// assert!((run.turn_s().unwrap() - 12.566).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// File name as the campaign gives it; identifies the run.
    pub file: String,
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed (TCP speed), m/s.
    pub feed_m_s: f64,
    /// Direction of travel.
    pub direction: Direction,
    /// Polar angle of the first sample, rad.
    pub start_angle_rad: f64,
    /// Start since the campaign began, s.
    pub started_s: Option<f64>,
    /// Temperature of the machine, °C.
    pub temperature_c: Option<f64>,
    /// Programmed centre in the machine, m.
    pub centre_m: Option<[f64; 3]>,
    /// How the circle lies in the machine.
    pub frame: Frame,
    /// Runs of one set-up share their centre offset; `None`: the data decide whether the centre holds.
    pub setup: Option<String>,
    /// What the instrument recorded.
    pub samples: Samples,
}

/// One turn of samples. All vectors have the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Polar angle of each sample about the nominal centre, rad, unwrapped: grows CCW, falls CW.
    /// Inferred at a constant rate over the measured turn where the instrument gives time only.
    pub angle_rad: Vec<f64>,
    /// Measured distance from the centre of measurement minus programmed radius, m.
    pub deviation_m: Vec<f64>,
    /// Time since the first sample, s, where recorded.
    pub time_s: Option<Vec<f64>>,
    /// Whether the angle was inferred from time (a ballbar) rather than measured.
    pub angle_inferred: bool,
}

impl Run {
    /// Angular rate ω = f/R of the programmed circle, rad/s.
    pub fn omega_rad_s(&self) -> f64 {
        self.feed_m_s / self.radius_m
    }

    /// `d`: +1.0 CCW, −1.0 CW.
    pub fn sign(&self) -> f64 {
        f64::from(self.direction.sign())
    }

    /// Duration of one turn, s; `None` without time stamps. Where the angle was inferred the recorded lap is
    /// the turn (n samples last n spacings; of an arc its share), else it follows from the angle that was covered, without the
    /// start, the stop and the pauses.
    pub fn turn_s(&self) -> Option<f64> {
        let time = self.samples.time_s.as_ref()?;
        let (first, last) = (time.first()?, time.last()?);
        let n = time.len() as f64;
        if n < 2.0 {
            return None;
        }
        if self.samples.angle_inferred {
            let lap = (last - first) * n / (n - 1.0);
            return Some(self.samples.arc_rad().map_or(lap, |arc| lap * TAU / arc));
        }
        let angle = self.samples.angle_rad.iter();
        steady::turn_s(&angle.copied().zip(time.iter().copied()).collect::<Vec<_>>())
    }
}

impl Samples {
    /// Angle covered, rad, counting one spacing for the last sample; `None` for a whole turn.
    pub fn covered_rad(&self) -> Option<f64> {
        let (covered, spacing) = self.extent()?;
        (covered < TAU - 2.0 * spacing - 1f64.to_radians()).then_some(covered)
    }

    /// The same where it is too little to stand for the turn: of measured angles as much may be missing at the seam as anywhere
    /// else.
    pub fn arc_rad(&self) -> Option<f64> {
        let covered = self.covered_rad()?;
        let (_, spacing) = self.extent()?;
        let hole = check::LARGEST_GAP_DEG.to_radians();
        (self.angle_inferred || covered < TAU - 2.0 * spacing - hole).then_some(covered)
    }

    /// Angle covered with one spacing for the last sample, and the spacing, rad.
    fn extent(&self) -> Option<(f64, f64)> {
        let n = self.angle_rad.len() as f64;
        let span = (self.angle_rad.last()? - self.angle_rad.first()?).abs();
        let spacing = span / (n - 1.0).max(1.0);
        Some((span + spacing, spacing))
    }
}
