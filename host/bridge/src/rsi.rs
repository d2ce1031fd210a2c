//! KUKA's RSI: a telegram `<Rob>` in, a telegram `<Sen>` out, every cycle (4 ms with IPO_FAST, 12 ms without).
//!
//! The robot calls, and wants its `IPOC` back to the letter within the cycle. The correction goes into `RKorr` (X, Y, Z, mm) and
//! from there to the object POSCORR; A, B, C stay 0. In absolute mode (`RSI_ON(#ABSOLUTE)`, `HOLDON="1"`) a lost answer holds the
//! last correction. In relative mode (`HOLDON="0"`) a lost answer loses a part of it: it is given again when the robot has
//! counted the answer as late (`DEF_Delay`).
use crate::Place;
use crate::protocol::{Answer, Heard, Mode, Protocol, Told};
use crate::setup::Setup;
use quick_xml::events::{BytesStart, Event};
use std::collections::VecDeque;

/// What the controller knows its sensor by: `SENTYPE` of the configuration that `--program` writes.
pub(crate) const SENTYPE: &str = "ImFree";
/// Answers remembered in relative mode: more missed in a row stop the robot.
const REMEMBERED: usize = 128;
/// Digits behind the point: 0.1 µm.
const PER_MM: f64 = 1e4;

/// A session with RSI.
#[derive(Debug)]
pub(crate) struct Rsi {
    step: u32,
    relative: bool,
    /// As it came.
    ipoc: String,
    /// Relative mode: what the robot has been given in all, and each answer by its number.
    given: Place,
    sent: VecDeque<(u32, Place)>,
    missed: Option<u64>,
}

impl Rsi {
    pub(crate) fn new(setup: &Setup) -> Self {
        Self {
            // IPOC counts milliseconds; a cast saturates, and 0 would divide nothing.
            step: (setup.cycle_ms.round() as u32).max(1),
            relative: setup.mode == Mode::Relative,
            ipoc: String::new(),
            given: [0.0; 3],
            sent: VecDeque::with_capacity(REMEMBERED),
            missed: None,
        }
    }
}

/// What a telegram holds.
#[derive(Debug, Default)]
struct Telegram {
    rist: Option<Place>,
    rsol: Option<Place>,
    delay: Option<u64>,
    ipoc: Option<String>,
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<f64> {
    let value = element.try_get_attribute(name).ok()??.value;
    let number: f64 = value.trim().parse().ok()?;
    number.is_finite().then_some(number)
}

fn place(element: &BytesStart<'_>) -> Option<Place> {
    let [x, y, z] = ["X", "Y", "Z"].map(|name| attribute(element, name));
    Some([x?, y?, z?])
}

impl Telegram {
    fn read(datagram: &[u8]) -> Result<Self, &'static str> {
        const NOT_XML: &str = "what came is no RSI telegram: no XML";
        let text = std::str::from_utf8(datagram).map_err(|_| NOT_XML)?;
        let mut reader = quick_xml::Reader::from_str(text);
        let mut telegram = Self::default();
        let (mut depth, mut root, mut in_ipoc) = (0, false, false);
        loop {
            match reader.read_event() {
                Ok(Event::Start(element)) => {
                    if depth == 0 && element.name().as_ref() != "Rob" {
                        return Err("what came is no RSI telegram: its root is not <Rob>");
                    }
                    root = true;
                    depth += 1;
                    in_ipoc = element.name().as_ref() == "IPOC";
                    telegram.element(&element)?;
                }
                Ok(Event::Empty(element)) => telegram.element(&element)?,
                Ok(Event::Text(words)) if in_ipoc => {
                    telegram.ipoc = Some(words.to_string());
                }
                Ok(Event::End(_)) => {
                    depth -= 1;
                    in_ipoc = false;
                }
                Ok(Event::Eof) if root && depth == 0 => return Ok(telegram),
                Ok(Event::Eof) | Err(_) => return Err(NOT_XML),
                Ok(_) => {}
            }
        }
    }

    fn element(&mut self, element: &BytesStart<'_>) -> Result<(), &'static str> {
        match element.name().as_ref() {
            "RIst" => self.rist = Some(place(element).ok_or("RIst without X, Y and Z")?),
            "RSol" => self.rsol = Some(place(element).ok_or("RSol without X, Y and Z")?),
            // A count: saturates, and negative ones are none.
            "Delay" => self.delay = attribute(element, "D").map(|count| count as u64),
            _ => {}
        }
        Ok(())
    }
}

/// As it is written, mm.
fn rounded(value: f64) -> f64 {
    // Not −0.
    (value * PER_MM).round() / PER_MM + 0.0
}

impl Protocol for Rsi {
    fn step(&self) -> u32 {
        self.step
    }

    fn read(&mut self, datagram: &[u8]) -> Heard {
        let telegram = match Telegram::read(datagram) {
            Ok(telegram) => telegram,
            Err(what) => return Heard::Malformed(what),
        };
        let Some(ipoc) = telegram.ipoc else {
            return Heard::Malformed("an RSI telegram without IPOC");
        };
        let Ok(count) = ipoc.trim().parse::<u64>() else {
            return Heard::Malformed("an RSI telegram whose IPOC is no number");
        };
        self.ipoc = ipoc;
        Heard::Told(Told {
            // Differences are what counts, and they wrap alike.
            number: count as u32,
            planned: telegram.rsol,
            measured: telegram.rist,
            missed: telegram.delay,
            ..Told::default()
        })
    }

    fn taken(&mut self, told: &Told, _cycles: u32) {
        let (Some(now), Some(before)) = (told.missed, self.missed) else {
            self.missed = told.missed;
            return;
        };
        self.missed = Some(now);
        // A robot that was switched on again counts from 0.
        let missed = u32::try_from(now.saturating_sub(before)).unwrap_or(u32::MAX);
        for (number, increment) in &self.sent {
            let ago = told.number.wrapping_sub(*number) / self.step;
            if self.relative && (1..=missed).contains(&ago) {
                for (given, increment) in self.given.iter_mut().zip(increment) {
                    *given -= increment;
                }
            }
        }
    }

    fn write(&mut self, answer: &Answer) -> Vec<u8> {
        let mut out = answer.offset.map(rounded);
        if self.relative {
            for (out, given) in out.iter_mut().zip(&mut self.given) {
                *out = rounded(*out - *given);
                *given = rounded(*given + *out);
            }
            if self.sent.len() >= REMEMBERED {
                self.sent.pop_front();
            }
            self.sent.push_back((answer.number, out));
        }
        let [x, y, z] = out;
        format!(
            "<Sen Type=\"{SENTYPE}\"><RKorr X=\"{x:.4}\" Y=\"{y:.4}\" Z=\"{z:.4}\" A=\"0.0000\" B=\"0.0000\" C=\"0.0000\"/><IPOC>{}</IPOC></Sen>",
            self.ipoc
        )
        .into_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kind;

    fn telegram(ipoc: &str, delay: u64) -> String {
        format!(
            "<Rob Type=\"KUKA\"><RIst X=\"1.5\" Y=\"-2\" Z=\"3\" A=\"0\" B=\"0\" C=\"0\"/><RSol X=\"1\" Y=\"2\" Z=\"3\"/><Delay D=\"{delay}\"/><IPOC>{ipoc}</IPOC></Rob>"
        )
    }

    #[test]
    fn ipoc_comes_back_to_the_letter() {
        let mut rsi = Rsi::new(&Setup::new(Kind::Rsi, Vec::new()));
        for ipoc in ["0000123456", "4208163634", " 77 ", "18446744073709551615"] {
            let Heard::Told(told) = rsi.read(telegram(ipoc, 2).as_bytes()) else {
                panic!("{ipoc}")
            };
            assert_eq!(told.measured, Some([1.5, -2.0, 3.0]));
            assert_eq!(
                (told.planned, told.missed),
                (Some([1.0, 2.0, 3.0]), Some(2))
            );
            let answer = Answer {
                offset: [0.12345, -0.00001, 0.0],
                ..Answer::default()
            };
            let text = String::from_utf8(rsi.write(&answer)).unwrap();
            assert_eq!(
                text,
                format!(
                    "<Sen Type=\"ImFree\"><RKorr X=\"0.1235\" Y=\"0.0000\" Z=\"0.0000\" A=\"0.0000\" B=\"0.0000\" C=\"0.0000\"/><IPOC>{ipoc}</IPOC></Sen>"
                )
            );
        }
    }

    #[test]
    fn what_is_no_telegram_is_said() {
        let mut rsi = Rsi::new(&Setup::new(Kind::Rsi, Vec::new()));
        let whole = telegram("1", 0);
        for text in [
            "",
            "<Sen Type=\"ImFree\"><IPOC>1</IPOC></Sen>",
            "<Rob Type=\"KUKA\"><RIst X=\"1\"/><IPOC>1</IPOC></Rob>",
            "<Rob Type=\"KUKA\"><IPOC>one</IPOC></Rob>",
            "<Rob Type=\"KUKA\"></Rob>",
            &whole[..whole.len() - 3],
        ] {
            assert!(
                matches!(rsi.read(text.as_bytes()), Heard::Malformed(_)),
                "{text}"
            );
        }
    }
}
