//! Bytes of the three protocols, from their descriptions, by hand.
use super::Place;

// Protobuf: varints, 64-bit values, and messages in messages.
fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push((value as u8) | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn number(out: &mut Vec<u8>, field: u64, value: u64) {
    varint(out, field << 3);
    varint(out, value);
}

fn double(out: &mut Vec<u8>, field: u64, value: f64) {
    varint(out, (field << 3) | 1);
    out.extend(value.to_le_bytes());
}

fn inside(out: &mut Vec<u8>, field: u64, message: &[u8]) {
    varint(out, (field << 3) | 2);
    varint(out, message.len() as u64);
    out.extend(message);
}

fn pose(place: Place) -> Vec<u8> {
    let (mut pos, mut orient, mut pose) = (Vec::new(), Vec::new(), Vec::new());
    for (axis, value) in place.into_iter().enumerate() {
        double(&mut pos, axis as u64 + 1, value);
    }
    // The tool points down.
    for (axis, value) in [0.0, 1.0, 0.0, 0.0].into_iter().enumerate() {
        double(&mut orient, axis as u64 + 1, value);
    }
    inside(&mut pose, 1, &pos);
    inside(&mut pose, 2, &orient);
    pose
}

/// State of an ABB controller: motors, MCI, RAPID.
#[derive(Clone, Copy)]
pub struct AbbState(pub u64, pub u64, pub u64);

pub const ABB_RUNS: AbbState = AbbState(1, 3, 2);

/// `EgmRobot`.
pub fn egm_robot(
    seqno: u32,
    tm: u32,
    measured: Place,
    planned: Option<Place>,
    state: AbbState,
) -> Vec<u8> {
    let mut header = Vec::new();
    number(&mut header, 1, u64::from(seqno));
    number(&mut header, 2, u64::from(tm));
    number(&mut header, 3, 2);
    let mut out = Vec::new();
    inside(&mut out, 1, &header);
    let mut feedback = Vec::new();
    inside(&mut feedback, 2, &pose(measured));
    inside(&mut out, 2, &feedback);
    if let Some(place) = planned {
        let mut message = Vec::new();
        inside(&mut message, 2, &pose(place));
        inside(&mut out, 3, &message);
    }
    for (field, value) in [(4, state.0), (5, state.1), (8, state.2)] {
        let mut message = Vec::new();
        number(&mut message, 1, value);
        inside(&mut out, field, &message);
    }
    number(&mut out, 6, 0);
    out
}

enum Value<'a> {
    Number(u64),
    Double(f64),
    Bytes(&'a [u8]),
}

fn fields(mut bytes: &[u8]) -> Vec<(u64, Value<'_>)> {
    fn take(bytes: &mut &[u8]) -> u64 {
        let (mut value, mut shift) = (0u64, 0);
        loop {
            let byte = bytes[0];
            *bytes = &bytes[1..];
            value |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte < 0x80 {
                return value;
            }
        }
    }
    let mut found = Vec::new();
    while !bytes.is_empty() {
        let key = take(&mut bytes);
        let value = match key & 7 {
            0 => Value::Number(take(&mut bytes)),
            1 => {
                let (eight, rest) = bytes.split_at(8);
                bytes = rest;
                Value::Double(f64::from_le_bytes(eight.try_into().unwrap()))
            }
            2 => {
                let length = take(&mut bytes) as usize;
                let (inner, rest) = bytes.split_at(length);
                bytes = rest;
                Value::Bytes(inner)
            }
            other => panic!("wire type {other}"),
        };
        found.push((key >> 3, value));
    }
    found
}

fn message(bytes: &[u8], field: u64) -> &[u8] {
    let found = fields(bytes).into_iter().find(|(f, _)| *f == field);
    match found {
        Some((_, Value::Bytes(inner))) => inner,
        _ => panic!("no message {field}"),
    }
}

fn integer(bytes: &[u8], field: u64) -> u64 {
    let found = fields(bytes).into_iter().find(|(f, _)| *f == field);
    match found {
        Some((_, Value::Number(value))) => value,
        _ => panic!("no number {field}"),
    }
}

fn xyz(bytes: &[u8]) -> Place {
    let mut place = [f64::NAN; 3];
    for (field, value) in fields(bytes) {
        if let Value::Double(value) = value {
            place[field as usize - 1] = value;
        }
    }
    place
}

/// `EgmSensor`: its number and the planned place.
pub fn egm_sensor(bytes: &[u8]) -> (u32, Place) {
    let header = message(bytes, 1);
    assert_eq!(integer(header, 3), 3, "MSGTYPE_CORRECTION");
    let pose = message(message(bytes, 2), 2);
    // The orientation comes back.
    let orient: Vec<f64> = fields(message(pose, 2))
        .into_iter()
        .map(|(_, v)| {
            if let Value::Double(v) = v {
                v
            } else {
                f64::NAN
            }
        })
        .collect();
    assert_eq!(orient, [0.0, 1.0, 0.0, 0.0]);
    (integer(header, 1) as u32, xyz(message(pose, 1)))
}

/// `EgmSensorPathCorr`: its number and the correction in path coordinates.
pub fn egm_path_corr(bytes: &[u8]) -> (u32, Place) {
    let header = message(bytes, 1);
    assert_eq!(integer(header, 3), 4, "MSGTYPE_PATH_CORRECTION");
    (
        integer(header, 1) as u32,
        xyz(message(message(bytes, 2), 1)),
    )
}

/// A telegram of RSI.
pub fn rob(ipoc: &str, measured: Place, planned: Place, delay: u64) -> Vec<u8> {
    let axes = |[x, y, z]: Place| {
        format!("X=\"{x:.4}\" Y=\"{y:.4}\" Z=\"{z:.4}\" A=\"180.0\" B=\"0.0\" C=\"180.0\"")
    };
    format!(
        "<Rob Type=\"KUKA\"><RIst {}/><RSol {}/><Delay D=\"{delay}\"/><IPOC>{ipoc}</IPOC></Rob>",
        axes(measured),
        axes(planned)
    )
    .into_bytes()
}

/// What stands between two words.
fn cut<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let after = text
        .split_once(from)
        .unwrap_or_else(|| panic!("{from} in {text}"))
        .1;
    after
        .split_once(to)
        .unwrap_or_else(|| panic!("{to} in {text}"))
        .0
}

/// A `<Sen>`: IPOC and RKorr.
pub fn sen(bytes: &[u8]) -> (String, Place) {
    let text = std::str::from_utf8(bytes).unwrap();
    assert_eq!(cut(text, "<Sen Type=\"", "\""), "ImFree");
    let korr = cut(text, "<RKorr ", "/>");
    let place = ["X=\"", "Y=\"", "Z=\""].map(|axis| cut(korr, axis, "\"").parse().unwrap());
    (cut(text, "<IPOC>", "</IPOC>").to_owned(), place)
}

/// A status of stream motion.
pub fn status(seq: u32, state: u8, time_ms: u32, place: Place) -> Vec<u8> {
    let mut out = vec![0, 0, 0, 0, 0, 0, 0, 1];
    out.extend(seq.to_be_bytes());
    out.extend([state, 0, 0, 0, 0, 0, 0, 0]);
    out.extend(time_ms.to_be_bytes());
    let [x, y, z] = place.map(|c| c as f32);
    for value in [x, y, z, 180.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        .into_iter()
        .chain([0.0; 18])
    {
        out.extend(f32::to_be_bytes(value));
    }
    assert_eq!(out.len(), 132);
    out
}

/// A command of stream motion: number, whether it is the last, place.
pub fn command(bytes: &[u8]) -> (u32, bool, Place) {
    assert_eq!(bytes.len(), 64);
    assert_eq!(bytes[..8], [0, 0, 0, 1, 0, 0, 0, 1]);
    assert_eq!(bytes[18], 0, "a pose, no joints");
    let float = |at: usize| f64::from(f32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()));
    assert_eq!(
        [float(40), float(44)],
        [180.0, 0.0],
        "the orientation stays"
    );
    (
        u32::from_be_bytes(bytes[8..12].try_into().unwrap()),
        bytes[12] == 1,
        [float(28), float(32), float(36)],
    )
}
