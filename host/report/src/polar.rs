//! What the polar plot draws: profiles of each circle as JSON inside the page.
use super::number::{fixed, plain};
use giotto::campaign::{Campaign, Direction};
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
}

/// The JSON, safe inside a `<script>` element.
pub fn json(campaign: &Campaign, picture: &[RunPicture]) -> String {
    let mut circles: Vec<(f64, f64, Circle)> = Vec::new();
    for p in picture {
        let run = &campaign.runs[p.index];
        let [measured, before, after] = p.profile_m.each_ref().map(|profile| {
            // Tenths of a micrometre: the resolution of the best ballbars.
            profile
                .iter()
                .map(|v| v.map(|v| (v * 1e7).round() / 10.0))
                .collect()
        });
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
    let circles: Vec<Circle> = circles.into_iter().map(|c| c.2).collect();
    // Numbers and strings always serialise; `<` would let a name end the script.
    serde_json::to_string(&circles)
        .unwrap_or_else(|_| "[]".into())
        .replace('<', "\\u003c")
}
