//! A foreign file by its first lines: its layout, and where its rows begin. A text that is not read as it stands (UTF-16, XML,
//! rows without the time that the lines above them give) is brought into that shape in memory.
use super::detect::{Detected, Format, detect};
use super::layout::{Head, Layout, Quantity, latin1, split};
use super::plain_text;
use super::rows::{EXPECTED, Slice};
use super::xml;
use crate::campaign::samples::FEWEST;
use crate::campaign::{CampaignError, Place, Problem};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// Bytes in which the header and the shape of the rows are looked for.
const HEAD: u64 = 1 << 16;

/// How a file is to be read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading<'a> {
    pub(super) format: Format,
    pub(super) columns: Option<&'a str>,
    /// Lengths without angles are a turn of evenly spaced readings: the angle of the first (rad) and the sense of travel.
    pub(super) even: Option<(f64, f64)>,
}

/// All rows of a file, of the layout that its first lines show.
pub(super) fn rows_of(path: &Path, reading: Reading<'_>) -> Result<Slice, CampaignError> {
    let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED, &e);
    if path.is_dir() {
        return Err(CampaignError::new(
            Place::file(path),
            Problem::IsDirectory { expected: EXPECTED },
        ));
    }
    let mut head = Vec::new();
    let file = std::fs::File::open(path).map_err(io)?;
    file.take(HEAD).read_to_end(&mut head).map_err(io)?;
    if head.is_empty() {
        return Err(CampaignError::new(
            Place::file(path),
            Problem::Empty { expected: EXPECTED },
        ));
    }
    let mut text: Option<Arc<[u8]>> = None;
    if let Some(order) = wide(&head) {
        let bytes = std::fs::read(path).map_err(io)?;
        text = Some(narrow(&bytes, order).into_bytes().into());
    }
    if let Some(plain) = text.as_deref().and_then(plain_text::of) {
        text = Some(plain.into());
    } else if text.is_none() && plain_text::of(&head).is_some() {
        // Groups that begin behind the head are rare and refused by their row.
        let bytes = std::fs::read(path).map_err(io)?;
        text = plain_text::of(&bytes).map(Into::into);
    }
    let first = text.as_deref().unwrap_or(&head).trim_ascii_start();
    if first.starts_with(b"<") && reading.format != Format::B5r {
        let bytes = match &text {
            Some(text) => text.to_vec(),
            None => std::fs::read(path).map_err(io)?,
        };
        text = xml::table(&latin1(&bytes))
            .map(|table| table.into_bytes().into())
            .or(text);
    }
    if let Some(text) = &text {
        head = text[..text.len().min(HEAD as usize)].to_vec();
    }
    let lines = Head::of(&head, head.len() as u64 == HEAD);
    let layout = layout(path, &lines, reading)?;
    let mark = if head.starts_with(b"\xEF\xBB\xBF") {
        3
    } else {
        0
    };
    let ends = memchr::memchr_iter(b'\n', &head).map(|at| at + 1);
    let start = ends.take(layout.skip).last().unwrap_or(mark);
    let slice = Slice {
        first_line: layout.skip + 1,
        layout,
        bytes: [start as u64, u64::MAX],
        rows: 0,
        scatter: None,
        text,
        left_out: Arc::default(),
        skipped: Arc::default(),
    };
    with_angles(path, slice, reading).and_then(|slice| with_time(path, slice, &lines))
}

fn layout(path: &Path, lines: &Head, reading: Reading<'_>) -> Result<Layout, CampaignError> {
    let refuse = |problem| Err(CampaignError::new(Place::at(path, 1, 1), problem));
    match detect(lines, reading) {
        Err(reason) => refuse(Problem::Columns {
            reason,
            example: super::columns::example(lines),
        }),
        Ok(Detected::Results) => refuse(Problem::ResultsOnly),
        Ok(Detected::Table(mut layout)) => {
            if layout.width == 0 && layout.format != Format::SpatialAnalyzer {
                layout.width = split(lines.line(layout.skip), layout.separator).len();
            }
            Ok(*layout)
        }
        Ok(Detected::Unknown { .. }) if is_names_alone(lines) => refuse(Problem::TooFew {
            found: 0,
            expected: FEWEST,
        }),
        Ok(Detected::Unknown { names }) => refuse(Problem::UnknownFormat {
            found: crate::campaign::table::shorten(lines.line(0)),
            wanted: reading.format.to_string(),
            example: super::columns::example(lines),
            names,
        }),
    }
}

/// Whether there are names of columns, and nothing below them.
fn is_names_alone(lines: &Head) -> bool {
    let mut filled = lines.lines.iter().filter(|line| !line.trim().is_empty());
    let first = filled.next();
    filled.next().is_none() && first.is_some_and(|line| line.contains([',', ';', '\t']))
}

/// The order of bytes of UTF-16: by its mark, or by every second byte being zero.
fn wide(head: &[u8]) -> Option<fn([u8; 2]) -> u16> {
    match head {
        [0xFF, 0xFE, ..] => return Some(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => return Some(u16::from_be_bytes),
        _ => {}
    }
    let pairs = head.chunks_exact(2).take(64);
    let all = |k: usize| pairs.len() >= 8 && pairs.clone().all(|pair| pair[k] == 0);
    if all(1) {
        Some(u16::from_le_bytes)
    } else if all(0) {
        Some(u16::from_be_bytes)
    } else {
        None
    }
}

fn narrow(bytes: &[u8], order: fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|b| order([b[0], b[1]]));
    char::decode_utf16(units)
        .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
        .filter(|c| *c != '\u{feff}')
        .collect()
}

/// The rows of a slice as text.
fn rows_text(path: &Path, slice: &Slice) -> Result<String, CampaignError> {
    let bytes = slice.read(path, slice.bytes)?;
    Ok(latin1(&bytes))
}

/// Puts even angles before lengths that have neither angle nor time.
fn with_angles(path: &Path, slice: Slice, reading: Reading<'_>) -> Result<Slice, CampaignError> {
    let fields = &slice.layout.fields;
    let radial = fields
        .iter()
        .find(|f| matches!(f.1, Quantity::Deviation | Quantity::Radius))
        .copied();
    let alone = !fields
        .iter()
        .any(|f| matches!(f.1, Quantity::Angle | Quantity::Position(_)));
    let (Some((start_rad, sign)), Some((at, quantity, factor)), true) =
        (reading.even, radial, alone)
    else {
        return Ok(slice);
    };
    let text = rows_text(path, &slice)?;
    let rows: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
    let step_deg = sign * 360.0 / rows.len().max(1) as f64;
    let mut table = String::with_capacity(text.len() + 16 * rows.len());
    for (k, row) in rows.iter().enumerate() {
        let field = split(row, slice.layout.separator)
            .get(at)
            .copied()
            .unwrap_or("");
        let angle_deg = start_rad.to_degrees() + step_deg * k as f64;
        table += &format!("{angle_deg:.9};{}\n", field.replace(',', "."));
    }
    let degree = std::f64::consts::PI / 180.0;
    let value = |row: &&str| {
        let field = split(row, slice.layout.separator)
            .get(at)?
            .replace(',', ".");
        field.parse::<f64>().ok()
    };
    let values: Vec<f64> = rows.iter().filter_map(value).map(|v| v * factor).collect();
    if let Some(apart_m) = apart(&values) {
        let problem = Problem::Open {
            apart_um: (apart_m * 1e8).round() / 1e2,
        };
        return Err(CampaignError::new(
            Place::at(path, slice.first_line, 1),
            problem,
        ));
    }
    let fields = vec![(0, Quantity::Angle, degree), (1, quantity, factor)];
    let mut layout = Layout {
        width: 2,
        notes: slice.layout.notes.clone(),
        ..Layout::new(slice.layout.format, b';', slice.layout.skip, fields)
    };
    layout
        .notes
        .push("angles taken as even over one turn".to_owned());
    Ok(Slice {
        layout,
        bytes: [0, u64::MAX],
        text: Some(table.into_bytes().into()),
        ..slice
    })
}

/// How far the ends of evenly spaced readings are apart where they should meet, if that is more than noise and form explain.
fn apart(values: &[f64]) -> Option<f64> {
    const ROWS: usize = 12;
    if values.len() < 6 * ROWS {
        return None;
    }
    // A straight line through the readings next to the seam, up to half a step beyond the last of them.
    let seam = |part: &mut dyn Iterator<Item = &f64>| {
        let y: Vec<f64> = part.take(ROWS).copied().collect();
        let mean = y.iter().sum::<f64>() / ROWS as f64;
        let middle = (ROWS as f64 - 1.0) / 2.0;
        let moment: f64 = y
            .iter()
            .enumerate()
            .map(|(k, v)| (k as f64 - middle) * v)
            .sum();
        let squares: f64 = (0..ROWS).map(|k| (k as f64 - middle).powi(2)).sum();
        mean - moment / squares * (middle + 0.5)
    };
    let distance = (seam(&mut values.iter()) - seam(&mut values.iter().rev())).abs();
    let [low, high] = values
        .iter()
        .fold([f64::MAX, f64::MIN], |[l, h], v| [l.min(*v), h.max(*v)]);
    let allowed = 4.0 * crate::campaign::sample_noise(values) + 0.03 * (high - low);
    (distance > allowed).then_some(distance)
}

/// Puts the time before rows that have none, where the lines above them give the period of sampling.
fn with_time(path: &Path, slice: Slice, head: &Head) -> Result<Slice, CampaignError> {
    let layout = &slice.layout;
    let timed = |f: &(usize, Quantity, f64)| {
        matches!(f.1, Quantity::Time | Quantity::Stamp(_) | Quantity::Angle)
    };
    let Some(period_s) = period_s(head, layout.skip).filter(|_| !layout.fields.iter().any(timed))
    else {
        return Ok(slice);
    };
    let text = rows_text(path, &slice)?;
    let separator = char::from(layout.separator);
    let mut table = String::with_capacity(text.len() * 2);
    for (k, row) in text.lines().enumerate() {
        let time = format!("{:.9}", period_s * k as f64);
        let time = if layout.decimal_comma {
            time.replace('.', ",")
        } else {
            time
        };
        table += &format!("{time}{separator}{row}\n");
    }
    let mut layout = layout.clone();
    layout.fields.iter_mut().for_each(|f| f.0 += 1);
    layout.fields.push((0, Quantity::Time, 1.0));
    layout.width += usize::from(layout.width > 0);
    let period_ms = (period_s * 1e9).round() / 1e6;
    layout
        .notes
        .push(format!("one row every {period_ms} ms, as its head says"));
    Ok(Slice {
        layout,
        bytes: [0, u64::MAX],
        text: Some(table.into_bytes().into()),
        ..slice
    })
}

/// `Sampling period is 50000000 ns` and its like.
fn period_s(head: &Head, rows: usize) -> Option<f64> {
    head.lines[..rows.min(head.lines.len())]
        .iter()
        .find_map(|line| {
            let lower = line.to_lowercase();
            let at = [
                "sampling period",
                "sample period",
                "sampling interval",
                "sample interval",
            ]
            .iter()
            .find_map(|word| lower.find(word))?;
            let words: Vec<&str> = lower[at..]
                .split([' ', ',', ';', ':', '=', '\t', '[', ']', '(', ')'])
                .filter(|w| !w.is_empty())
                .collect();
            let value = words.iter().find_map(|w| w.parse::<f64>().ok())?;
            let unit = words.iter().skip(2).find_map(|w| super::layout::unit(w))?;
            (value > 0.0 && value.is_finite()).then_some(value * unit)
        })
}
