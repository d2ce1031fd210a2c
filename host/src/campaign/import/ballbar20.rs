//! Ballbar 20 `.b5r` files: XML with the results of one test. Where the raw samples sit is not known; results
//! are read and nothing else.
use crate::campaign::{CampaignError, Place, Problem};
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;
use std::path::Path;

/// Results of one test as Ballbar 20 computed them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ballbar20 {
    /// MACHINE_TESTED/@NAME.
    pub machine: Option<String>,
    /// PLANE/@TEST_PLANE.
    pub plane: Option<String>,
    /// DATE_STARTED, as written.
    pub started: Option<String>,
    /// FEATURE elements in file order.
    pub features: Vec<Feature>,
}

/// One result.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// NAME without `AF_`, for instance `SQUARENESS`.
    pub name: String,
    /// Value in the unit of `unit`.
    pub value: f64,
    /// Unit by the DT attribute: `um`, `mm`, `ms`, `um/m`, or the attribute itself where it is not known.
    pub unit: String,
}

impl Ballbar20 {
    /// The value of a result by name.
    pub fn get(&self, name: &str) -> Option<&Feature> {
        self.features.iter().find(|f| f.name == name)
    }
}

fn unit(dt: &str) -> String {
    match dt {
        "UT_LENGTH_UM" => "um",
        "UT_LENGTH_MM" => "mm",
        "UT_TIME_MS" => "ms",
        "UT_ANGLE_UM_M" | "UT_GRADIENT_UM_M" => "um/m",
        other => other,
    }
    .to_owned()
}

/// Reads a `.b5r` file.
///
/// # Errors
/// A file that cannot be read, is not XML, or holds no `FEATURE`.
pub fn read(path: &Path) -> Result<Ballbar20, CampaignError> {
    const EXPECTED: &str = "a Ballbar 20 .b5r file";
    let bytes = std::fs::read(path).map_err(|e| CampaignError::io(path, "read", EXPECTED, &e))?;
    if bytes.is_empty() {
        return Err(CampaignError::new(
            Place::file(path),
            Problem::Empty { expected: EXPECTED },
        ));
    }
    parse(&decode(&bytes)).map_err(|(at, text, reason)| {
        CampaignError::new(
            Place::of_byte(path, text.as_bytes(), at),
            Problem::Xml { reason },
        )
    })
}

/// UTF-16 with a mark, UTF-8, or else Latin-1.
fn decode(bytes: &[u8]) -> String {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|b| from([b[0], b[1]]));
        char::decode_utf16(units)
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect()
    };
    match bytes {
        [0xFF, 0xFE, ..] => wide(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => wide(u16::from_be_bytes),
        _ => super::layout::latin1(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)),
    }
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = element
        .attributes()
        .filter_map(Result::ok)
        .find(|a| a.key.as_ref() == name)?;
    Some(found.value.trim().to_owned())
}

fn parse(text: &str) -> Result<Ballbar20, (usize, &str, String)> {
    let mut reader = Reader::from_str(text);
    let mut found = Ballbar20::default();
    // The feature whose text is being read, and the element whose text is the date.
    let mut open: Option<(String, String, String)> = None;
    let mut date = false;
    let mut elements = 0;
    loop {
        let before = usize::try_from(reader.buffer_position()).unwrap_or(text.len());
        let event = reader
            .read_event()
            .map_err(|e| (before, text, e.to_string()))?;
        let mut finish = false;
        match &event {
            Event::Start(e) | Event::Empty(e) => {
                elements += 1;
                match e.name().as_ref() {
                    "FEATURE" => {
                        let name = attribute(e, "NAME").unwrap_or_default();
                        let dt = attribute(e, "DT").unwrap_or_default();
                        open = Some((name, dt, attribute(e, "VALUE").unwrap_or_default()));
                        finish = matches!(event, Event::Empty(_));
                    }
                    "PLANE" => found.plane = attribute(e, "TEST_PLANE").or(found.plane.take()),
                    "MACHINE_TESTED" => {
                        found.machine = attribute(e, "NAME").or(found.machine.take())
                    }
                    "DATE_STARTED" => date = matches!(event, Event::Start(_)),
                    _ => {}
                }
            }
            Event::Text(t) => {
                let t = t.trim();
                if let Some((_, _, value)) = &mut open {
                    value.push_str(t);
                } else if date && !t.is_empty() {
                    found.started = Some(t.to_owned());
                }
            }
            Event::End(e) => match e.name().as_ref() {
                "FEATURE" => finish = true,
                "DATE_STARTED" => date = false,
                _ => {}
            },
            Event::Eof => break,
            _ => {}
        }
        if finish && let Some((name, dt, value)) = open.take() {
            let number = value
                .replace(',', ".")
                .parse::<f64>()
                .ok()
                .filter(|v| v.is_finite());
            let Some(value) = number else {
                let reason = format!("FEATURE {name} is \"{value}\"; expected a number");
                return Err((before, text, reason));
            };
            let name = name.trim_start_matches("AF_").to_owned();
            found.features.push(Feature {
                name,
                value,
                unit: unit(&dt),
            });
        }
    }
    if found.features.is_empty() {
        let what = if elements == 0 {
            "not XML"
        } else {
            "no FEATURE in it"
        };
        return Err((
            0,
            text,
            format!("{what}; expected the results of a Ballbar 20 test"),
        ));
    }
    Ok(found)
}
