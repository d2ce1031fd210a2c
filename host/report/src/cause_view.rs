//! What the page says of one cause, and the pictures of each alone and of what has no name.
use super::each_cause_alone::Alone;
use super::number::{fixed, number, plain};
use super::page_content::ways;
use super::portrait::{self, Curve};
use super::verdict::{self, look_alike};
use giotto::campaign::{Campaign, Run};
use giotto::diagnosis::picture::RunPicture;
use giotto::diagnosis::{Diagnosis, Finding};
use serde::Serialize;

#[derive(Debug, Serialize)]
pub(super) struct CauseView<'a> {
    name: String,
    value: String,
    low: String,
    high: String,
    unit: String,
    share: String,
    share_number: f64,
    probability: String,
    rms: String,
    params: Vec<[String; 2]>,
    what: &'static str,
    usual: &'static str,
    adjust: &'static str,
    /// What to turn, which way and how far.
    remedy: &'a str,
    /// The largest thing it does, and where.
    effect: String,
    look_alikes: Vec<String>,
    next: String,
    compensable: bool,
    why_not: Option<&'static str>,
    /// The cause alone on the circle where it does most, and which that is.
    picture: Option<[String; 2]>,
}

pub(super) fn cause<'a>(
    campaign: &Campaign,
    alone: &Alone,
    at: usize,
    f: &'a Finding,
) -> CauseView<'a> {
    let words = f.cause.model().words();
    let shown = verdict::shown(&f.estimate);
    CauseView {
        name: f.title(),
        value: shown.value,
        low: shown.low,
        high: shown.high,
        unit: shown.unit,
        share: fixed(f.share_percent, 0),
        share_number: f.share_percent,
        probability: fixed(f.probability, 3),
        rms: fixed(f.rms_um, 2),
        params: f
            .params
            .iter()
            .filter_map(|(name, value)| parameter(name, *value))
            .collect(),
        picture: alone_on_circle(campaign, alone, at, f),
        what: words.what,
        usual: words.usual,
        adjust: words.adjust,
        remedy: &f.remedy,
        effect: effect(f),
        look_alikes: f
            .indistinguishable_from
            .iter()
            .map(|id| look_alike(id))
            .collect(),
        next: f.next_measurement.clone(),
        compensable: f.compensable,
        why_not: words.not_compensable,
    }
}

/// Most that a cause does to a circle, and to which.
fn effect(f: &Finding) -> String {
    let most = f.effect_um;
    if most.max <= 0.0 {
        return String::new();
    }
    format!(
        "up to {} µm, at radius {} mm and {} mm/s",
        fixed(most.max, 1),
        plain(most.radius_mm),
        plain(most.feed_mm_s)
    )
}

/// A further parameter of a cause in words; one that only the simulation understands is left to the model's file.
fn parameter(name: &str, value: f64) -> Option<[String; 2]> {
    let (words, factor, unit) = match name {
        "pitch_m" => ("pitch", 1e3, "mm"),
        "pitch_mm" => ("pitch", 1.0, "mm"),
        "decay_s" => ("dies away in", 1e3, "ms"),
        "rise_s" => ("rises in", 1e3, "ms"),
        "presliding_m" => ("begins after", 1e6, "µm of travel"),
        "presliding_mm" => ("begins after", 1e3, "µm of travel"),
        "play_m" => ("play", 1e6, "µm"),
        "play_mm" => ("play", 1e3, "µm"),
        "phase_rad" => ("phase", 180.0 / std::f64::consts::PI, "°"),
        _ => return None,
    };
    Some([
        words.to_string(),
        format!("{} {unit}", number(value * factor)),
    ])
}

/// Profiles of both directions at the circle where a cause does most.
fn alone_on_circle(
    campaign: &Campaign,
    alone: &Alone,
    at: usize,
    f: &Finding,
) -> Option<[String; 2]> {
    let (index, most_m) = alone.largest(at)?;
    let runs = alone.profiles.get(at)?.as_ref()?;
    let chosen = &campaign.runs[index];
    let same = |run: &Run| run.radius_m == chosen.radius_m && run.feed_m_s == chosen.feed_m_s;
    let mut curves: Vec<Curve<'_>> = Vec::new();
    for (run, profile) in campaign.runs.iter().zip(runs).filter(|(run, _)| same(run)) {
        let class = ways(run.direction);
        if !curves.iter().any(|c| c.0 == class) {
            curves.push((class, profile));
        }
    }
    let where_ = format!(
        "Alone it makes up to {} µm, at radius {} mm and {} mm/s",
        fixed(most_m * 1e6, 1),
        plain(chosen.radius_m * 1e3),
        plain(chosen.feed_m_s * 1e3)
    );
    let words = format!("{} alone on the circle. {where_}.", f.title());
    Some([
        portrait::svg(&format!("alone-{at}"), &words, &curves),
        where_,
    ])
}

/// What is left of the circle where most is left.
pub(super) fn unexplained(campaign: &Campaign, d: &Diagnosis) -> Option<String> {
    let worst = d
        .picture
        .iter()
        .max_by(|a, b| a.rms_m[1].total_cmp(&b.rms_m[1]))?;
    let run = &campaign.runs[worst.index];
    let of = |p: &&RunPicture| {
        let other = &campaign.runs[p.index];
        other.radius_m == run.radius_m && other.feed_m_s == run.feed_m_s
    };
    let mut curves: Vec<Curve<'_>> = Vec::new();
    for p in d.picture.iter().filter(of) {
        let class = ways(campaign.runs[p.index].direction);
        if !curves.iter().any(|c| c.0 == class) {
            curves.push((class, &p.profile_m[2]));
        }
    }
    let words = format!(
        "What has no name, at radius {} mm and {} mm/s.",
        plain(run.radius_m * 1e3),
        plain(run.feed_m_s * 1e3)
    );
    Some(portrait::svg("no-name", &words, &curves))
}
