//! The history of a machine: one row a campaign, one a finding, and what they do over the months.
//!
//! | file | holds |
//! |---|---|
//! | `date` | days of the calendar, found in names |
//! | `store` | the rows as two Parquet files that other tools read |
//! | `trend` | drift, step, control limits of one series |
pub mod date;
mod store;
pub mod trend;

pub use date::Date;
pub use store::{StoreError, decode_campaigns, decode_findings, encode_campaigns, encode_findings};

use crate::comparison::title;
use crate::summary::{Figure, Summary};
use crate::units;
use date::MONTH_DAYS;
use serde::Serialize;
use trend::{Change, Trend};

/// Months that a drift is carried on.
const AHEAD_MONTHS: f64 = 6.0;

/// A campaign, as it is kept.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CampaignRow {
    /// Day of the measurement.
    #[serde(serialize_with = "as_text")]
    pub date: Date,
    /// Its directory.
    pub folder: String,
    /// Its name.
    pub name: String,
    /// Machine.
    pub machine: String,
    /// SHA-256 of programmed values and samples: a campaign is diagnosed once.
    pub data_sha256: String,
    /// Number of runs.
    pub runs: i32,
    /// Whether there were enough runs to call something real.
    pub proven: bool,
    /// Noise of a sample, µm.
    pub noise_um: f64,
    /// Scatter of the size between runs, µm.
    pub spread_um: f64,
    /// Root mean square of what has no name, µm.
    pub unexplained_um: f64,
    /// Largest G of one direction, µm.
    pub g_um: f64,
    /// Largest G(b), µm; of one direction where there is no pair.
    pub g_b_um: f64,
    /// Mean of D, or of ΔR where there is no pair, µm.
    pub d_um: f64,
}

/// A finding, as it is kept.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FindingRow {
    /// Which campaign.
    pub data_sha256: String,
    /// Day of the measurement.
    #[serde(serialize_with = "as_text")]
    pub date: Date,
    /// Name in the closed list.
    pub cause: String,
    /// Where it sits.
    pub actuators: String,
    /// Contract's unit.
    pub unit: String,
    /// Value in that unit.
    pub value: f64,
    /// Lower end of its 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// What it does to the circles, µm rms.
    pub rms_um: f64,
    /// Probability that it is there.
    pub probability: f64,
}

fn as_text<S: serde::Serializer>(date: &Date, out: S) -> Result<S::Ok, S::Error> {
    out.collect_str(date)
}

/// The rows of one campaign.
pub fn rows(
    summary: &Summary,
    date: Date,
    folder: &str,
    data_sha256: &str,
) -> (CampaignRow, Vec<FindingRow>) {
    let of = |names: &[&str]| -> Vec<f64> {
        let named = |f: &&Figure| names.contains(&f.figure);
        summary
            .figures
            .iter()
            .filter(named)
            .map(|f| f.value_um)
            .collect()
    };
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let or = |first: Vec<f64>, second: &[&str]| if first.is_empty() { of(second) } else { first };
    let d = or(of(&["d"]), &["radius_error_cw", "radius_error_ccw"]);
    let campaign = CampaignRow {
        date,
        folder: folder.to_owned(),
        name: summary.name.clone(),
        machine: summary.machine.clone(),
        data_sha256: data_sha256.to_owned(),
        runs: i32::try_from(summary.runs).unwrap_or(i32::MAX),
        proven: summary.proven,
        noise_um: summary.noise_um,
        spread_um: summary.spread_um,
        unexplained_um: summary.unexplained_um,
        g_um: largest(&of(&["g_cw", "g_ccw"])),
        g_b_um: largest(&or(of(&["g_b"]), &["g_cw", "g_ccw"])),
        d_um: d.iter().sum::<f64>() / d.len().max(1) as f64,
    };
    let finding = |cause: &crate::summary::CauseFigure| FindingRow {
        data_sha256: data_sha256.to_owned(),
        date,
        cause: cause.cause.clone(),
        actuators: cause.actuators.clone(),
        unit: cause.unit.clone(),
        value: cause.value,
        low: cause.ci95[0],
        high: cause.ci95[1],
        rms_um: cause.rms_um,
        probability: cause.probability,
    };
    let findings = summary.causes.iter().map(finding).collect();
    (campaign, findings)
}

/// One quantity over the campaigns.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// `cause:backlash:x` or `figure:g_b`.
    pub id: String,
    /// Name for a person.
    pub title: String,
    /// Contract's unit.
    pub unit: String,
    /// Days of the campaigns.
    #[serde(skip)]
    pub dates: Vec<Date>,
    /// Values; 0 where a cause was not found.
    pub values: Vec<f64>,
    /// Drift, step, limits.
    pub trend: Trend,
    /// What happened, in words; empty where nothing did.
    pub words: Vec<String>,
}

/// The history of one machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct History {
    /// Machine.
    pub machine: String,
    /// Its campaigns in order of time.
    pub campaigns: Vec<CampaignRow>,
    /// Every series, what changed first.
    pub series: Vec<Series>,
}

/// The histories of all machines. `services` are days on which something was done to a machine.
pub fn histories(
    campaigns: &[CampaignRow],
    findings: &[FindingRow],
    services: &[Date],
    seed: u64,
) -> Vec<History> {
    let mut machines: Vec<&str> = campaigns.iter().map(|c| c.machine.as_str()).collect();
    machines.sort_unstable();
    machines.dedup();
    let of = |machine: &&str| {
        let own = campaigns.iter().filter(|c| c.machine == *machine).cloned();
        let mut own: Vec<CampaignRow> = own.collect();
        own.sort_by(|a, b| (a.date, &a.folder).cmp(&(b.date, &b.folder)));
        let mut series = figure_series(&own);
        series.extend(cause_series(&own, findings));
        let many = series.len();
        let series = series.into_iter().map(|s| s.look(many, services, seed));
        let mut series: Vec<Series> = series.collect();
        // What happened before what did not; within each, as it was.
        series.sort_by_key(|s| s.words.is_empty());
        History {
            machine: (*machine).to_owned(),
            campaigns: own,
            series,
        }
    };
    machines.iter().map(of).collect()
}

/// A series that has not been looked at.
struct Raw {
    id: String,
    title: String,
    unit: String,
    dates: Vec<Date>,
    values: Vec<f64>,
}

type Column = (&'static str, &'static str, fn(&CampaignRow) -> f64);

fn figure_series(campaigns: &[CampaignRow]) -> Vec<Raw> {
    let columns: [Column; 5] = [
        ("g", "largest G", |c| c.g_um),
        ("g_b", "largest G(b)", |c| c.g_b_um),
        ("d", "mean D", |c| c.d_um),
        ("spread", "scatter between runs", |c| c.spread_um),
        ("unexplained", "what has no name", |c| c.unexplained_um),
    ];
    let of = |(id, title, value): Column| Raw {
        id: format!("figure:{id}"),
        title: title.to_owned(),
        unit: "um".to_owned(),
        dates: campaigns.iter().map(|c| c.date).collect(),
        values: campaigns.iter().map(value).collect(),
    };
    columns.map(of).into()
}

/// A series for each cause that was ever found, over the campaigns that could have found it.
fn cause_series(campaigns: &[CampaignRow], findings: &[FindingRow]) -> Vec<Raw> {
    let own: Vec<&CampaignRow> = campaigns.iter().filter(|c| c.proven).collect();
    let value = |campaign: &CampaignRow, like: &FindingRow| {
        let found = findings.iter().find(|f| {
            f.data_sha256 == campaign.data_sha256
                && f.cause == like.cause
                && f.actuators == like.actuators
        });
        found.map_or(0.0, |f| f.value)
    };
    let mut out: Vec<Raw> = Vec::new();
    for like in findings {
        let id = format!("cause:{}:{}", like.cause, like.actuators);
        let here = own.iter().any(|c| c.data_sha256 == like.data_sha256);
        if !here || out.iter().any(|raw| raw.id == id) {
            continue;
        }
        let name = crate::causes::Cause::from_id(&like.cause).map_or_else(
            || like.cause.replace('_', " "),
            |c| c.model().words().name.to_owned(),
        );
        out.push(Raw {
            id,
            title: title(&name, &like.actuators),
            unit: like.unit.clone(),
            dates: own.iter().map(|c| c.date).collect(),
            values: own.iter().map(|c| value(c, like)).collect(),
        });
    }
    out
}

impl Raw {
    fn look(self, many: usize, services: &[Date], seed: u64) -> Series {
        let first = self.dates.first().map_or(0, |d| d.days);
        let months: Vec<f64> = self
            .dates
            .iter()
            .map(|d| f64::from(d.days - first) / MONTH_DAYS)
            .collect();
        let trend = trend::look(&months, &self.values, many, seed);
        let words = words(&self, &months, &trend, services);
        Series {
            id: self.id,
            title: self.title,
            unit: self.unit,
            dates: self.dates,
            values: self.values,
            trend,
            words,
        }
    }
}

fn words(raw: &Raw, months: &[f64], trend: &Trend, services: &[Date]) -> Vec<String> {
    let say = |v: f64| {
        let shown = units::shown(v, [v; 2], &raw.unit);
        format!("{} {}", shown.value, shown.unit)
    };
    let mut out = Vec::new();
    match trend.change {
        Some(Change::Drift { per_month, ci95 }) => {
            let shown = units::shown(per_month.abs(), ci95, &raw.unit);
            let [last, limits] = [raw.dates.len().saturating_sub(1); 2];
            let now = trend.limits.get(limits).map_or(0.0, |l| l[0]);
            let then = Date {
                days: raw.dates.get(last).map_or(0, |d| d.days)
                    + (AHEAD_MONTHS * MONTH_DAYS).round() as i32,
            };
            // Away from zero is worse, whatever the sign.
            let verb = if now * per_month >= 0.0 {
                "grows"
            } else {
                "shrinks"
            };
            out.push(format!(
                "{} {verb} by {} {} a month (95 %: {} to {}); {} now, {} by {} if it goes on.",
                raw.title,
                shown.value,
                shown.unit,
                shown.low,
                shown.high,
                say(now),
                say(now + AHEAD_MONTHS * per_month),
                then.month()
            ));
        }
        Some(Change::Step { at, size, ci95 }) => {
            let shown = units::shown(size, ci95, &raw.unit);
            let ends = at
                .checked_sub(1)
                .and_then(|k| Some((raw.dates.get(k)?, raw.dates.get(at)?)));
            let when = ends.map_or_else(String::new, |(before, after)| {
                let service = services.iter().find(|s| *s > before && *s <= after);
                match service {
                    Some(service) => format!(" with the service of {service}"),
                    None => format!(" between {before} and {after}"),
                }
            });
            let level = |k: usize| trend.limits.get(k).map_or(0.0, |l| l[0]);
            out.push(format!(
                "{} stepped{when} by {} {} (95 %: {} to {}): {} before, {} since.",
                raw.title,
                shown.value,
                shown.unit,
                shown.low,
                shown.high,
                say(level(0)),
                say(level(months.len().saturating_sub(1)))
            ));
        }
        None => {}
    }
    for &k in &trend.outside {
        if let (Some(date), Some(value), Some(limits)) =
            (raw.dates.get(k), raw.values.get(k), trend.limits.get(k))
        {
            out.push(format!(
                "{} was {} on {date}, outside its control limits ({} to {}).",
                raw.title,
                say(*value),
                say(limits[1]),
                say(limits[2])
            ));
        }
    }
    out
}
