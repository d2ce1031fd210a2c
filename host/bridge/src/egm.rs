//! ABB's EGM, position guidance: `EgmRobot` in, `EgmSensor` with a planned pose out, at the robot's rate (4 ms).
//!
//! The robot calls: it sends to us, and is answered where it sent from. Orientation and outer axes go back as they came. Units
//! are mm; the protocol is `abb.egm` of the RobotWare manual (crate `abbegm`).
use crate::Place;
use crate::protocol::{Answer, Heard, Protocol, Told};
use abbegm::msg::{
    EgmCartesian, EgmHeader, EgmPlanned, EgmPose, EgmQuaternion, EgmRobot, EgmSensor,
};
use abbegm::msg::{egm_header::MessageType, egm_mci_state::MciStateType};

/// `EgmMotorState.MOTORS_OFF`, `EgmRapidCtrlExecState.RAPID_STOPPED`.
const MOTORS_OFF: i32 = 2;
const RAPID_STOPPED: i32 = 1;

/// Position guidance.
#[derive(Debug)]
pub(crate) struct Egm {
    /// Ours, counted from 0 without a gap.
    seqno: u32,
    pose: Option<EgmPose>,
    stamp_ms: u32,
}

/// Reads a message of the robot.
pub(super) fn read(datagram: &[u8]) -> Result<(Told, EgmRobot), &'static str> {
    let Ok(robot) = <EgmRobot as prost::Message>::decode(datagram) else {
        return Err("what came is no EgmRobot message: the sender is no EGM");
    };
    let Some(number) = robot.header.as_ref().and_then(|header| header.seqno) else {
        return Err("an EgmRobot message without a sequence number");
    };
    if robot.has_nan() {
        return Err("an EgmRobot message with values that are no numbers");
    }
    let planned = place(robot.planned_pose());
    let measured = place(robot.feedback_pose());
    let told = Told {
        number,
        stamp_ms: robot.header.as_ref().and_then(|header| header.tm),
        planned,
        measured,
        not_ready: not_ready(&robot),
        ..Told::default()
    };
    Ok((told, robot))
}

fn place(pose: Option<&EgmPose>) -> Option<Place> {
    pose.and_then(|pose| pose.pos.as_ref())
        .map(EgmCartesian::as_mm)
}

/// What a controller says of itself; what it does not say it cannot be held against.
fn not_ready(robot: &EgmRobot) -> Option<&'static str> {
    if robot
        .motor_state
        .as_ref()
        .is_some_and(|state| state.state == MOTORS_OFF)
    {
        return Some("the robot's motors are off");
    }
    if robot
        .rapid_exec_state
        .as_ref()
        .is_some_and(|state| state.state == RAPID_STOPPED)
    {
        return Some("the RAPID program does not run");
    }
    match robot.mci_state.as_ref().map(|state| state.state) {
        None => None,
        Some(state) if state == MciStateType::MciRunning as i32 => None,
        Some(state) if state == MciStateType::MciError as i32 => {
            Some("EGM is in error (mciState MCI_ERROR): the controller's log says why")
        }
        Some(_) => Some(
            "EGM does not run (mciState is not MCI_RUNNING): EGMRunPose or EGMMoveL has not begun",
        ),
    }
}

impl Egm {
    pub(crate) const fn new() -> Self {
        Self {
            seqno: 0,
            pose: None,
            stamp_ms: 0,
        }
    }
}

impl Protocol for Egm {
    fn read(&mut self, datagram: &[u8]) -> Heard {
        match read(datagram) {
            Ok((told, robot)) => {
                self.stamp_ms = told.stamp_ms.unwrap_or(0);
                // Its own plan, or the place where it stood when it was heard first: orientation is not ours to change.
                if let Some(pose) = robot.planned_pose() {
                    self.pose = Some(pose.clone());
                } else if self.pose.is_none() {
                    self.pose = robot.feedback_pose().cloned();
                }
                Heard::Told(told)
            }
            Err(what) => Heard::Malformed(what),
        }
    }

    fn write(&mut self, answer: &Answer) -> Vec<u8> {
        let [x, y, z] = answer.target;
        let pose = EgmPose {
            pos: Some(EgmCartesian::from_mm(x, y, z)),
            ..self.pose.clone().unwrap_or_else(|| {
                EgmPose::new([x, y, z], EgmQuaternion::from_wxyz(1.0, 0.0, 0.0, 0.0))
            })
        };
        let header = EgmHeader::new(self.seqno, self.stamp_ms, MessageType::MsgtypeCorrection);
        self.seqno = self.seqno.wrapping_add(1);
        let sensor = EgmSensor {
            header: Some(header),
            planned: Some(EgmPlanned {
                cartesian: Some(pose),
                ..EgmPlanned::default()
            }),
            speed_ref: None,
        };
        prost::Message::encode_to_vec(&sensor)
    }
}
