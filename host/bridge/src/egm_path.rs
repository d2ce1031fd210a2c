//! ABB's EGM, path correction: `EgmRobot` in, `EgmSensorPathCorr` out, every 48 ms (24 is accepted in the wild).
//!
//! The path is the robot's (`EGMMoveL`, `EGMMoveC`); what goes out is the correction across it, in path coordinates: x along the
//! path (always 0), z as near to the tool's z as that lets, y across, so that the three are right-handed: with the tool pointing
//! down, to the right as seen along the path. For whole circles at one feed that is all there is; where a circle begins or
//! ends and where the feed changes the door is too slow.
use crate::Place;
use crate::egm;
use crate::protocol::{Answer, Heard, Mode, Protocol, Told};
use crate::setup::Setup;
use abbegm::msg::{
    EgmCartesian, EgmHeader, EgmPathCorr, EgmSensorPathCorr, egm_header::MessageType,
};

/// Way between two places below which a path has no direction, mm.
const STANDING_MM: f64 = 1e-3;

/// Path correction.
#[derive(Debug)]
pub(crate) struct EgmPath {
    seqno: u32,
    stamp_ms: u32,
    cycle_s: f64,
    lead_s: f64,
    left_handed: bool,
    relative: bool,
    /// Tool's z in the robot's frame.
    tool: Place,
    /// The last three places, the newest first, and the time from each to the one after it, s.
    places: Vec<(Place, f64)>,
    /// What the robot has been told in relative mode, by axis of the frame.
    given: Place,
}

fn dot(a: Place, b: Place) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross([ax, ay, az]: Place, [bx, by, bz]: Place) -> Place {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

fn less(a: Place, b: Place) -> Place {
    let ([ax, ay, az], [bx, by, bz]) = (a, b);
    [ax - bx, ay - by, az - bz]
}

fn unit(a: Place) -> Option<Place> {
    let length = dot(a, a).sqrt();
    (length > 0.0).then(|| a.map(|c| c / length))
}

/// Third column of a rotation: where the tool's z points.
fn tool_z([w, x, y, z]: [f64; 4]) -> Place {
    [
        2.0 * (x * z + w * y),
        2.0 * (y * z - w * x),
        1.0 - 2.0 * (x * x + y * y),
    ]
}

impl EgmPath {
    pub(crate) fn new(setup: &Setup) -> Self {
        Self {
            seqno: 0,
            stamp_ms: 0,
            cycle_s: setup.cycle_ms * 1e-3,
            lead_s: setup.dead_time_ms * 1e-3,
            left_handed: setup.left_handed,
            relative: setup.mode == Mode::Relative,
            tool: [0.0, 0.0, -1.0],
            places: Vec::with_capacity(3),
            given: [0.0; 3],
        }
    }

    /// Direction of the path where the answer will act: the newest chord, turned by the time from its middle until then.
    fn along(&self) -> Option<Place> {
        let [(newest, _), (middle, first_s), rest @ ..] = self.places.as_slice() else {
            return None;
        };
        let chord = less(*newest, *middle);
        if dot(chord, chord) < STANDING_MM * STANDING_MM {
            return None;
        }
        let along = unit(chord)?;
        let Some((oldest, second_s)) = rest.first() else {
            return Some(along);
        };
        let Some(before) = unit(less(*middle, *oldest)) else {
            return Some(along);
        };
        // On a circle two chords differ by the turn from the middle of one to the middle of the other.
        let Some(aside) = unit(less(along, before.map(|c| c * dot(before, along)))) else {
            return Some(along);
        };
        let turn = dot(along, aside).atan2(dot(along, before));
        let rate = turn / (0.5 * (first_s + second_s));
        let angle = turn + rate * (0.5 * first_s + self.lead_s);
        let (sin, cos) = angle.sin_cos();
        let mut turned = [0.0; 3];
        for ((turned, before), aside) in turned.iter_mut().zip(before).zip(aside) {
            *turned = cos * before + sin * aside;
        }
        Some(turned)
    }

    /// An offset in path coordinates.
    fn in_path(&self, offset: Place) -> Place {
        let across = self
            .along()
            .and_then(|along| Some((along, unit(cross(self.tool, along))?)));
        let Some((along, across)) = across else {
            return [0.0; 3];
        };
        let up = cross(along, across);
        let y = dot(offset, across);
        [0.0, if self.left_handed { -y } else { y }, dot(offset, up)]
    }
}

impl Protocol for EgmPath {
    fn read(&mut self, datagram: &[u8]) -> Heard {
        match egm::read(datagram) {
            Ok((told, robot)) => {
                self.stamp_ms = told.stamp_ms.unwrap_or(0);
                let pose = robot.planned_pose().or(robot.feedback_pose());
                if let Some(orient) = pose.and_then(|pose| pose.orient.as_ref()) {
                    self.tool = tool_z(orient.as_wxyz());
                }
                Heard::Told(told)
            }
            Err(what) => Heard::Malformed(what),
        }
    }

    fn taken(&mut self, told: &Told, cycles: u32) {
        if let Some(place) = told.planned.or(told.measured) {
            if let Some((_, since_s)) = self.places.first_mut() {
                *since_s = f64::from(cycles) * self.cycle_s;
            }
            // The time is that from this place to the next.
            self.places.insert(0, (place, 0.0));
            self.places.truncate(3);
        }
    }

    fn write(&mut self, answer: &Answer) -> Vec<u8> {
        let mut offset = answer.offset;
        if self.relative {
            offset = less(offset, self.given);
            self.given = answer.offset;
        }
        let [x, y, z] = self.in_path(offset);
        let header = EgmHeader::new(
            self.seqno,
            self.stamp_ms,
            MessageType::MsgtypePathCorrection,
        );
        self.seqno = self.seqno.wrapping_add(1);
        let message = EgmSensorPathCorr {
            header: Some(header),
            path_corr: Some(EgmPathCorr {
                pos: EgmCartesian::from_mm(x, y, z),
                age: 0,
            }),
        };
        prost::Message::encode_to_vec(&message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kind;

    /// A tool that points down: across is to the right of the path, so that outward on a circle counter-clockwise is +y.
    #[test]
    fn across_is_where_the_answer_will_act() {
        let setup = Setup::new(Kind::EgmPath, Vec::new());
        let mut door = EgmPath::new(&setup);
        assert_eq!(tool_z([0.0, 1.0, 0.0, 0.0]), [0.0, 0.0, -1.0]);
        assert_eq!(door.in_path([1.0, 0.0, 0.0]), [0.0; 3]);
        let omega = 3.0;
        let at = |t: f64| [50.0 * (omega * t).cos(), 50.0 * (omega * t).sin(), 7.0];
        let mut last = 0.0;
        // One datagram is lost between the second and the third.
        for (t, cycles) in [(0.0, 1), (0.048, 1), (0.144, 2), (0.192, 1)] {
            let told = Told {
                planned: Some(at(t)),
                ..Told::default()
            };
            door.taken(&told, cycles);
            last = t;
        }
        let then = omega * (last + 0.048);
        let [x, y, z] = door.in_path([then.cos(), then.sin(), 0.5]);
        assert!(
            x == 0.0 && (y - 1.0).abs() < 1e-6 && (z + 0.5).abs() < 1e-9,
            "{y} {z}"
        );
        door.left_handed = true;
        let [_, y, _] = door.in_path([then.cos(), then.sin(), 0.0]);
        assert!((y + 1.0).abs() < 1e-6);
    }
}
