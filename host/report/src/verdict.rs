//! The verdict in three sentences: how the worst circle looks, why, and what to do.
use super::number::{fixed, plain};
use giotto::campaign::{Campaign, Direction};
use giotto::causes::Cause;
use giotto::diagnosis::picture::RunPicture;
use giotto::diagnosis::recommendation::{self, Action};
use giotto::diagnosis::status::Status;
use giotto::diagnosis::{Diagnosis, Estimate};
use giotto::units::{self, Shown};

/// The verdict in three sentences for a person: how the worst circle looks, why, and what to do.
pub fn sentences(campaign: &Campaign, d: &Diagnosis) -> [String; 3] {
    [misfit(campaign, d), cause(d), action(d)]
}

/// The circle whose form is worst, with the noise averaged away: on a raw circle the loudest noise would win.
#[derive(Clone, Copy, Debug)]
pub struct Worst {
    /// Index of the run in the campaign.
    pub index: usize,
    /// Largest less smallest of its means of 2°, m.
    pub form_m: f64,
}

/// See [`Worst`]; nothing where no run was looked at.
pub fn worst(d: &Diagnosis) -> Option<Worst> {
    let form = |run: &RunPicture| {
        let known = || run.profile_m[0].iter().flatten().copied();
        let [low, high] = known().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        });
        (low <= high).then_some(Worst {
            index: run.index,
            form_m: high - low,
        })
    };
    let runs = d.picture.iter().filter_map(form);
    runs.max_by(|a, b| a.form_m.total_cmp(&b.form_m))
}

/// The circle that is furthest off in size, where that is more than any form, and the circle whose form is worst.
fn misfit(campaign: &Campaign, d: &Diagnosis) -> String {
    let Some(worst) = worst(d) else {
        return "No circle goes through these samples.".to_string();
    };
    let of = |index: usize| {
        let run = &campaign.runs[index];
        let way = match run.direction {
            Direction::Ccw => "counter-clockwise",
            Direction::Cw => "clockwise",
        };
        format!(
            "radius {} mm at {} mm/s {way}",
            plain(run.radius_m * 1e3),
            plain(run.feed_m_s * 1e3)
        )
    };
    let off = |size_m: f64| {
        let too = if size_m < 0.0 { "small" } else { "large" };
        format!("{} µm too {too}", fixed(size_m.abs() * 1e6, 1))
    };
    let form = format!(
        "{}, is out of round by {} µm",
        of(worst.index),
        fixed(worst.form_m * 1e6, 1)
    );
    let sizes = || d.picture.iter().map(|run| (run.index, run.size_m[0]));
    let furthest = sizes().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let own = sizes().find(|(index, _)| *index == worst.index);
    match (furthest, own) {
        (Some((index, size_m)), _) if index != worst.index && size_m.abs() > worst.form_m => {
            format!(
                "A circle of {} is {}; the one with the worst form, {form}.",
                of(index),
                off(size_m)
            )
        }
        (_, Some((_, size_m))) => format!(
            "The circle with the worst form, {form} and {}.",
            off(size_m)
        ),
        _ => format!("The circle with the worst form, {form}."),
    }
}

fn cause(d: &Diagnosis) -> String {
    let rest = if d.unexplained.present {
        format!(
            "; {} µm rms match no cause in the list",
            fixed(d.unexplained.rms_um, 2)
        )
    } else {
        String::new()
    };
    let Some(first) = d.findings.first() else {
        return if d.unexplained.present {
            let words = d.unexplained.signature.words.first();
            format!(
                "No cause in the list fits: {} µm rms have no name{}.",
                fixed(d.unexplained.rms_um, 2),
                words.map_or_else(String::new, |words| format!(", {words}"))
            )
        } else if let (None, Some(missing)) = (&d.gain, d.cannot_tell.first()) {
            // What is missing comes first, what follows from it stands further down.
            let ends = [";", ", so ", " (--"];
            let first = ends.iter().fold(missing.as_str(), |words, end| {
                words.split_once(end).map_or(words, |(before, _)| before)
            });
            format!("Nothing can be named from these runs: {first}.")
        } else {
            "Nothing was found beyond it: the simulation explains the data.".to_string()
        };
    };
    let others: Vec<String> = d.findings[1..]
        .iter()
        .take(3)
        .map(|f| format!("{} ({} %)", f.title(), fixed(f.share_percent, 0)))
        .collect();
    let more = match others.len() {
        0 => String::new(),
        _ => format!(", then {}", others.join(", ")),
    };
    let shown = shown(&first.estimate);
    let sure = match first.status {
        Status::Provisional => " provisionally",
        Status::Likely => " likely",
        Status::Certain => "",
    };
    format!(
        "{} % of what a lag does not explain is{sure} {}, {} {} (95 %: {} to {}){more}{rest}.",
        fixed(first.share_percent, 0),
        first.title(),
        shown.value,
        shown.unit,
        shown.low,
        shown.high,
    )
}

/// What the diagnosis recommends, for a person: without commands and their placeholders.
fn action(d: &Diagnosis) -> String {
    match d.recommendation.action {
        Action::Flash => {
            let what = "Write the extended model into the controller";
            match recommendation::expected_um(d) {
                Some([now, then]) if then < now => format!(
                    "{what}: circles that it has not seen are off by {} µm rms now, by {} µm with it.",
                    fixed(now, 1),
                    fixed(then, 1),
                ),
                _ => format!("{what}."),
            }
        }
        Action::Measure => "Measure what is missing first: it stands further down, under what these runs cannot tell.".into(),
        Action::Adjust | Action::Look | Action::Nothing => {
            format!("{}.", capitalised(&d.recommendation.words))
        }
    }
}

fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// An estimate in the units that a person reads, with a true minus sign.
pub fn shown(e: &Estimate) -> Shown {
    let Shown {
        value,
        low,
        high,
        unit,
    } = units::shown(e.value, e.ci95, e.unit);
    let [value, low, high] = [value, low, high].map(|text| text.replace('-', "−"));
    Shown {
        value,
        low,
        high,
        unit,
    }
}

/// Names of look-alikes for a person; what is no cause of the list stays as it is written.
pub fn look_alike(id: &str) -> String {
    Cause::from_id(id).map_or_else(
        || id.replace('_', " "),
        |cause| cause.model().words().name.to_string(),
    )
}
