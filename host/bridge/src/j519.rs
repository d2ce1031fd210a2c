//! FANUC's stream motion (J519): a status in, a command out, every 8 ms (4, 2 on newer controllers). Big-endian.
//!
//! ```text
//! any      type u32 · version u32
//! start    0 · 1                             asks the controller to send its status
//! stop     2 · 1
//! status   0 · v · seq u32 · state u8 · io type u8, index u16, mask u16, value u16 · time u32 (ms)
//!          · pose f32[9] · joints f32[9] · current f32[9]
//! command  1 · 1 · seq u32 · last u8 · io type u8, index u16, mask u16 · joints? u8 · io type u8, index u16, mask u16, value u16
//!          · unused u16 · pose f32[9]
//! ```
//! We call. Every number has to be commanded, once: a status that was lost is made up for with the next. Pose: X, Y, Z in mm,
//! W, P, R in degrees, three outer axes; what is not corrected stays as it was when the first status came.
use crate::protocol::{Answer, Heard, Protocol, Told};

const VERSION: u32 = 1;
const START: u32 = 0;
const STATUS: u32 = 0;
const COMMAND: u32 = 1;
const STOP: u32 = 2;
const STATUS_BYTES: usize = 132;
/// Bits of the state.
const WAITS: u8 = 1;
const READY: u8 = 1 << 2;

/// A session of stream motion.
#[derive(Debug)]
pub(crate) struct J519 {
    pose: Option<[f32; 9]>,
    commands: bool,
}

impl J519 {
    pub(crate) const fn new() -> Self {
        Self {
            pose: None,
            commands: false,
        }
    }
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    four.try_into().ok().map(u32::from_be_bytes)
}

fn nine_at(bytes: &[u8], at: usize) -> Option<[f32; 9]> {
    let mut nine = [0.0; 9];
    for (index, value) in nine.iter_mut().enumerate() {
        *value = u32_at(bytes, at + 4 * index).map(f32::from_bits)?;
    }
    nine.iter().all(|value| value.is_finite()).then_some(nine)
}

fn head(kind: u32) -> Vec<u8> {
    [kind.to_be_bytes(), VERSION.to_be_bytes()].concat()
}

impl Protocol for J519 {
    fn answers_each(&self) -> bool {
        true
    }

    fn read(&mut self, datagram: &[u8]) -> Heard {
        match u32_at(datagram, 0) {
            Some(STATUS) if datagram.len() == STATUS_BYTES => {}
            // Answers to questions that another program may have asked.
            Some(3 | 4 | 6) => return Heard::Aside,
            _ => return Heard::Malformed("what came is no status of stream motion"),
        }
        let (Some(number), Some(state), Some(time_ms)) = (
            u32_at(datagram, 8),
            datagram.get(12).copied(),
            u32_at(datagram, 20),
        ) else {
            return Heard::Malformed("what came is no status of stream motion");
        };
        let Some(pose) = nine_at(datagram, 24) else {
            return Heard::Malformed("a status whose pose is no numbers");
        };
        self.pose.get_or_insert(pose);
        let not_ready = if state & READY == 0 {
            Some("the robot is not ready (SYSRDY is off): alarm, emergency stop, or motors off")
        } else if state & WAITS == 0 && !self.commands {
            Some("the robot does not wait for commands: its program has not come to IBGN start")
        } else {
            None
        };
        let [x, y, z, ..] = pose.map(f64::from);
        Heard::Told(Told {
            number,
            stamp_ms: Some(time_ms),
            measured: Some([x, y, z]),
            not_ready,
            // It says so at its own end, or between two moves.
            idle: state & WAITS == 0,
            ..Told::default()
        })
    }

    fn write(&mut self, answer: &Answer) -> Vec<u8> {
        self.commands = true;
        let mut pose = self.pose.unwrap_or_default();
        for (pose, target) in pose.iter_mut().zip(answer.target) {
            *pose = target as f32;
        }
        let mut out = head(COMMAND);
        out.extend(answer.number.to_be_bytes());
        out.push(u8::from(answer.last));
        // Reads no signal; the pose is Cartesian; writes no signal.
        out.extend([0; 13]);
        out.extend([0xff; 2]);
        out.extend(pose.iter().flat_map(|value| value.to_be_bytes()));
        out
    }

    fn greeting(&self) -> Vec<Vec<u8>> {
        vec![head(START)]
    }

    fn farewell(&self) -> Vec<Vec<u8>> {
        vec![head(STOP)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_byte_by_byte() {
        let mut j519 = J519::new();
        let answer = Answer {
            number: 0x0102_0304,
            target: [1.0, -2.0, 0.5],
            offset: [0.0; 3],
            last: true,
        };
        let bytes = j519.write(&answer);
        assert_eq!(bytes.len(), 64);
        assert_eq!(bytes[..13], [0, 0, 0, 1, 0, 0, 0, 1, 1, 2, 3, 4, 1]);
        assert!(bytes[13..26].iter().all(|byte| *byte == 0));
        assert_eq!(bytes[26..28], [0xff; 2]);
        assert_eq!(
            bytes[28..40],
            [0x3f, 0x80, 0, 0, 0xc0, 0, 0, 0, 0x3f, 0, 0, 0]
        );
        assert_eq!(j519.greeting(), [[0, 0, 0, 0, 0, 0, 0, 1]]);
        assert_eq!(j519.farewell(), [[0, 0, 0, 2, 0, 0, 0, 1]]);
    }
    /// A status and the command to the same pose as the crate `fanuc_ucl` 2.0.2 writes them.
    #[test]
    fn the_same_bytes_as_by_others() {
        let bytes = |hex: &str| -> Vec<u8> {
            (0..hex.len() / 2)
                .map(|k| u8::from_str_radix(&hex[2 * k..2 * k + 2], 16).unwrap())
                .collect()
        };
        let pose = "444b2000c22100004422800043340000bf00000041400000";
        let status = format!(
            "0000000000000001_01020304_05_00_0000_0000_0000_0a0b0c0d_{pose}_{}_3f800000400000004040000040800000\
             40a0000040c00000_{}",
            "0".repeat(24),
            "0".repeat(96)
        );
        let mut j519 = J519::new();
        let Heard::Told(told) = j519.read(&bytes(&status.replace('_', ""))) else {
            panic!()
        };
        assert_eq!(
            (told.number, told.stamp_ms),
            (0x0102_0304, Some(0x0a0b_0c0d))
        );
        assert_eq!(told.measured, Some([812.5, -40.25, 650.0]));
        assert!(told.not_ready.is_none() && !told.idle);
        let answer = Answer {
            target: [812.5, -40.25, 650.0],
            last: true,
            ..Answer::default()
        };
        let command = format!(
            "0000000100000001_00000000_01_00_0000_0000_00_00_0000_0000_0000_ffff_{pose}_{}",
            "0".repeat(24)
        );
        assert_eq!(j519.write(&answer), bytes(&command.replace('_', "")));
    }
}
