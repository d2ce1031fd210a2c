//! What the polar plot draws: profiles of each circle as JSON inside the page.
use super::each_cause_alone::Alone;
use super::number::{fixed, plain};
use giotto::campaign::{Campaign, Direction};
use giotto::diagnosis::Diagnosis;
use giotto::diagnosis::picture::RunPicture;
use serde::Serialize;

/// Every circle (radius and feed) with its runs.
#[derive(Debug, Serialize)]
struct Circle {
    /// Radius, mm.
    #[serde(rename = "r")]
    radius_mm: f64,
    /// What the list shows.
    label: String,
    runs: Vec<Profiles>,
}

/// Profiles of a run, µm, one value a sector of 2° from 0°.
#[derive(Debug, Serialize)]
struct Profiles {
    file: String,
    #[serde(rename = "d")]
    direction: &'static str,
    measured: Vec<Option<f64>>,
    before: Vec<Option<f64>>,
    after: Vec<Option<f64>>,
    /// What each cause with a box does to it.
    causes: Vec<Vec<Option<f64>>>,
}

/// The data of the page.
#[derive(Debug, Serialize)]
struct Data {
    /// Names of the causes that have a box.
    causes: Vec<String>,
    circles: Vec<Circle>,
    /// Index of the circle whose form is worst.
    worst: usize,
}

/// Tenths of a micrometre: the resolution of the best ballbars.
fn tenths(profile: &[Option<f64>]) -> Vec<Option<f64>> {
    profile
        .iter()
        .map(|v| v.map(|v| (v * 1e7).round() / 10.0))
        .collect()
}

/// The JSON, safe inside a `<script>` element. `worst` is the radius and feed of the circle whose form is worst, m and m/s.
pub fn json(
    campaign: &Campaign,
    d: &Diagnosis,
    alone: &Alone,
    worst: Option<(f64, f64)>,
) -> String {
    let picture: &[RunPicture] = &d.picture;
    let boxes = || d.findings.iter().zip(&alone.profiles);
    let mut circles: Vec<(f64, f64, Circle)> = Vec::new();
    for p in picture {
        let run = &campaign.runs[p.index];
        let [measured, before, after] = p.profile_m.each_ref().map(|profile| tenths(profile));
        let own = boxes().filter_map(|(_, runs)| runs.as_ref()?.get(p.index));
        let causes = own.map(|profile| tenths(profile)).collect();
        let direction = match run.direction {
            Direction::Ccw => "CCW",
            Direction::Cw => "CW",
        };
        let profiles = Profiles {
            file: run.file.clone(),
            direction,
            measured,
            before,
            after,
            causes,
        };
        match circles
            .iter_mut()
            .find(|c| c.0 == run.radius_m && c.1 == run.feed_m_s)
        {
            Some((_, _, circle)) => circle.runs.push(profiles),
            None => circles.push((
                run.radius_m,
                run.feed_m_s,
                Circle {
                    radius_mm: run.radius_m * 1e3,
                    label: format!(
                        "R {} mm, {} mm/s, {} m/s²",
                        plain(run.radius_m * 1e3),
                        plain(run.feed_m_s * 1e3),
                        fixed(run.feed_m_s.powi(2) / run.radius_m, 3)
                    ),
                    runs: vec![profiles],
                },
            )),
        }
    }
    circles.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let keys: Vec<(f64, f64)> = circles.iter().map(|c| (c.0, c.1)).collect();
    let circles: Vec<Circle> = circles.into_iter().map(|c| c.2).collect();
    let worst = worst
        .and_then(|(radius_m, feed_m_s)| keys.iter().position(|key| *key == (radius_m, feed_m_s)));
    let named = boxes().filter(|(_, runs)| runs.is_some());
    let data = Data {
        causes: named.map(|(f, _)| f.title()).collect(),
        circles,
        worst: worst.unwrap_or(0),
    };
    // Numbers and strings always serialise; `<` would let a name end the script.
    serde_json::to_string(&data)
        .unwrap_or_else(|_| "null".into())
        .replace('<', "\\u003c")
}
