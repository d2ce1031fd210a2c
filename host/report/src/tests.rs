//! The page as a document: complete, closed in itself, and safe with what campaigns may be called.
use super::html;
use giotto::campaign::Campaign;
use giotto::diagnosis::{Diagnosis, Options, diagnose};
use giotto::simulation::machine::PositionLoop;
use giotto::simulation::{CircleTest, Instrument, Machine, Plan, PlannedTest, campaign};
use giotto_shared::Direction;
use quick_xml::events::Event;

const HOSTILE: &str =
    "</script><script>alert('x')</script>\"&<img src=x onerror=alert(1)>{{ name }}";

fn measured(radii_m: &[f64], feeds_m_s: &[f64], samples: usize) -> (Campaign, Diagnosis) {
    let mut tests = Vec::new();
    for &radius_m in radii_m {
        for &feed_m_s in feeds_m_s {
            for direction in [Direction::Ccw, Direction::Cw] {
                let test = CircleTest {
                    samples: Some(samples),
                    ..CircleTest::new(radius_m, feed_m_s, direction)
                };
                tests.push(PlannedTest { test, timed: false });
            }
        }
    }
    let servo = PositionLoop {
        kv_per_s: 40.0,
        feed_forward: 0.0,
    };
    let plan = Plan {
        name: HOSTILE.into(),
        machine_name: HOSTILE.into(),
        machine: Machine {
            servo: [servo; 3],
            squareness_rad: [60e-6, 0.0, 0.0],
            ..Machine::default()
        },
        instrument: Instrument::ballbar(),
        tests,
        shuffle: true,
    };
    let mut campaign = campaign(&plan, 5);
    campaign.runs[0].file = format!("{HOSTILE}.csv");
    let diagnosis = diagnose(&campaign, &Options::default()).unwrap();
    (campaign, diagnosis)
}

/// Elements and attributes of the page; scripts and style are text.
fn elements(page: &str) -> Vec<(String, Vec<(String, String)>)> {
    let mut text = String::new();
    let mut rest = page;
    while let Some(at) = ["<script", "<style"]
        .iter()
        .filter_map(|tag| rest.find(tag))
        .min()
    {
        let end = if rest[at..].starts_with("<script") {
            "</script>"
        } else {
            "</style>"
        };
        let open = at + rest[at..].find('>').unwrap() + 1;
        let close = open + rest[open..].find(end).unwrap();
        text.push_str(&rest[..open]);
        rest = &rest[close..];
        let past = rest.find('>').unwrap() + 1;
        text.push_str(&rest[..past]);
        rest = &rest[past..];
    }
    text.push_str(rest);
    let mut reader = quick_xml::Reader::from_str(&text);
    reader.config_mut().check_end_names = true;
    let mut out = Vec::new();
    let mut depth = 0;
    loop {
        match reader.read_event().unwrap() {
            Event::Start(e) => {
                depth += 1;
                out.push(element(&e));
            }
            Event::Empty(e) => out.push(element(&e)),
            Event::End(_) => depth -= 1,
            Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!(depth, 0, "an element is open at the end");
    out
}

fn element(e: &quick_xml::events::BytesStart<'_>) -> (String, Vec<(String, String)>) {
    let attributes = e
        .attributes()
        .map(|a| a.unwrap())
        .map(|a| (a.key.as_ref().to_string(), a.value.to_string()))
        .collect();
    (e.name().as_ref().to_string(), attributes)
}

#[test]
fn the_page_is_well_formed_names_cannot_break_out_and_nothing_is_fetched() {
    let (campaign, diagnosis) = measured(&[0.1, 0.2], &[0.02, 0.1, 0.2], 400);
    let page = html(&campaign, &diagnosis).unwrap();
    for scheme in [
        "http:", "https:", "//cdn", "url(", "@import", "fetch(", "XMLHttp",
    ] {
        assert!(!page.contains(scheme), "{scheme}");
    }
    assert_eq!(
        page.matches("<script").count(),
        2,
        "the data and the plot, no more"
    );
    assert!(!page.contains("<img"));
    assert!(
        page.contains("&lt;img src=x"),
        "the name is shown as it is written"
    );
    let elements = elements(&page);
    for (name, attributes) in &elements {
        for (key, value) in attributes {
            assert!(!key.starts_with("on"), "{name} {key}={value}");
            assert!(key != "src", "{name} {key}={value}");
            assert!(
                key != "href" || value.starts_with('#'),
                "{name} {key}={value}"
            );
        }
    }
    let get = |e: &[(String, String)], key: &str| {
        e.iter().find(|(k, _)| k == key).map(|(_, v)| v.clone())
    };
    let ids: Vec<String> = elements.iter().filter_map(|(_, a)| get(a, "id")).collect();
    let mut once = ids.clone();
    once.sort();
    once.dedup();
    assert_eq!(once.len(), ids.len(), "an id stands twice");
    for (name, attributes) in &elements {
        for key in ["aria-labelledby", "href"] {
            if let Some(target) = get(attributes, key) {
                let target = target.trim_start_matches('#').to_string();
                assert!(ids.contains(&target), "{name} {key} {target}");
            }
        }
    }
    let count = |tag: &str| elements.iter().filter(|(name, _)| name == tag).count();
    assert_eq!(
        count("table"),
        count("caption"),
        "every table has a caption"
    );
    assert_eq!(count("h1"), 1);
}

#[test]
fn the_page_says_what_the_diagnosis_says() {
    let (campaign, diagnosis) = measured(&[0.1, 0.2], &[0.02, 0.1, 0.2], 400);
    let page = html(&campaign, &diagnosis).unwrap();
    let first = &diagnosis.findings[0];
    let words = first.cause.model().words();
    assert_eq!(words.id, "squareness");
    for said in [words.what, words.usual, words.adjust] {
        assert!(page.contains(&super::number::escape(said)), "{said}");
    }
    assert!(page.contains(&super::verdict::shown(&first.estimate).value));
    assert!(page.contains(&super::data_hash(&campaign)));
    let mut other = campaign.clone();
    other.runs[3].samples.deviation_m[7] += 1e-12;
    assert_ne!(super::data_hash(&other), super::data_hash(&campaign));
}

#[test]
fn a_poor_campaign_gets_a_page_that_says_what_is_missing() {
    let (campaign, shown) = measured(&[0.1], &[0.1], 400);
    // The pair shows what is hidden, for an instrument set up with care …
    let page = html(&campaign, &shown).unwrap();
    assert_eq!(shown.findings[0].cause.id(), "squareness");
    assert!(page.contains("provisional") && page.contains("one radius"));
    // … and nothing for one whose sizes scatter by 50 µm.
    let options = Options {
        repeatability_m: Some(50e-6),
        ..Options::default()
    };
    let diagnosis = diagnose(&campaign, &options).unwrap();
    let page = html(&campaign, &diagnosis).unwrap();
    let sentences = super::verdict::sentences(&campaign, &diagnosis);
    assert!(
        page.contains("Nothing can be named from these runs"),
        "{sentences:?} {:?} {:?}",
        diagnosis.cannot_tell,
        diagnosis.recommendation
    );
    assert!(page.contains("one radius"));
    elements(&page);
}

/// A loud round circle has a larger range than an oval one, and no worse form.
#[test]
fn the_worst_form_is_not_the_loudest_noise() {
    let (mut campaign, _) = measured(&[0.1, 0.2], &[0.02, 0.1, 0.2], 1800);
    let index = |campaign: &Campaign, radius_m: f64, feed_m_s: f64| {
        let same =
            |run: &giotto::campaign::Run| run.radius_m == radius_m && run.feed_m_s == feed_m_s;
        campaign.runs.iter().position(same).unwrap()
    };
    let loud = index(&campaign, 0.1, 0.02);
    for (k, value) in campaign.runs[loud]
        .samples
        .deviation_m
        .iter_mut()
        .enumerate()
    {
        *value += if k % 2 == 0 { 30e-6 } else { -30e-6 };
    }
    let diagnosis = diagnose(&campaign, &Options::default()).unwrap();
    let worst = super::verdict::worst(&diagnosis).unwrap();
    assert_ne!(worst.index, loud);
    // The oval of the squareness grows with the radius: 60 µm/m over 0.2 m.
    assert_eq!(campaign.runs[worst.index].radius_m, 0.2);
    assert!((worst.form_m - 12e-6).abs() < 3e-6, "{}", worst.form_m);
    let [circle, ..] = super::verdict::sentences(&campaign, &diagnosis);
    assert!(
        circle.contains("radius 200 mm") && circle.contains("too small"),
        "{circle}"
    );
}

#[test]
fn seventy_eight_runs_stay_far_below_three_megabytes() {
    let feeds: Vec<f64> = (1..=13).map(|i| 0.05 * f64::from(i)).collect();
    let (campaign, diagnosis) = measured(&[0.1, 0.15, 0.3], &feeds, 250);
    assert_eq!(campaign.runs.len(), 78);
    let page = html(&campaign, &diagnosis).unwrap();
    assert!(page.len() < 1_000_000, "{}", page.len());
}
