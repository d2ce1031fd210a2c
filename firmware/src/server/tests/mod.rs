//! The server over a flash in memory and an engine that only remembers.
#[cfg(feature = "signed")]
mod owner;
mod power;
mod protocol;

use super::*;
use crate::store::power_cut::{PowerCut, Tear};
use crate::store::ram::RamFlash;
use giotto_shared::Direction;
use giotto_shared::model::Cumulants;
use giotto_shared::path::CircleRun;
use giotto_shared::table::{self, Limits, Table, Travel, Zone};
use giotto_shared::wire::{MotionRefusal, Pose, PositionState, Request, TableInfo};
use std::boxed::Box;
use std::string::{String, ToString};
use std::vec::Vec;

const SLOT: usize = 2048;
const ERASE: usize = 512;
const CELLS: usize = 2 * SLOT + 3 * ERASE;
const KEY: u32 = 2 * SLOT as u32;
const LAYOUT: Layout = Layout::new([0, SLOT as u32], SLOT as u32)
    .with_key(KEY)
    .with_config([KEY + ERASE as u32, KEY + 2 * ERASE as u32]);
const BOARD: Board = Board {
    name: "bench",
    build: "0",
    tick_hz: 1000,
    clock: ClockSource::Crystal,
    reset: ResetCause::Power,
    machine: [1; 12],
    step: [[1, 1]; 3],
    bears: |limits| {
        if limits.feed_m_s > 1.8 {
            Err(ConfigField::Feed)
        } else if limits.tick_hz > 4000 {
            Err(ConfigField::Rate)
        } else {
            Ok(())
        }
    },
};

type Cells = RamFlash<CELLS, ERASE>;
type Flash = PowerCut<CELLS, ERASE>;

/// An engine that does nothing but remember.
#[derive(Debug)]
struct Bench {
    table: Option<String>,
    bypass: bool,
    state: MotionState,
    runs: u32,
    tick: u32,
    held: u32,
}

impl Bench {
    fn new() -> Self {
        Self {
            table: None,
            bypass: true,
            state: MotionState::Idle,
            runs: 0,
            tick: 0,
            held: 0,
        }
    }
}

impl Motion for Bench {
    fn snapshot(&self) -> Snapshot {
        Snapshot {
            state: self.state,
            tick: self.tick,
            raw_nm: [0; 3],
            corrected_nm: [0; 3],
            tick_overruns: 0,
            offset_clamps: 0,
            slew_clamps: 0,
            dropped_set_points: 0,
            dropped_segments: 0,
            uncorrected_segments: 0,
            stops: 0,
            segments: 0,
            queued: 0,
            missing_set_points: 0,
            late_set_points: 0,
            rejected_set_points: 0,
            fault: None,
            stop_input: false,
            position: PositionState::Known,
            override_percent: 100,
        }
    }

    fn now(&self) -> u32 {
        self.tick
    }

    fn install(&mut self, image: Option<&[u8]>) -> Result<(), Refusal> {
        if self.state == MotionState::Running {
            return Err(Refusal::Motion(MotionRefusal::Busy));
        }
        self.table = image.map(|image| table::decode(image).unwrap().machine.to_string());
        Ok(())
    }

    fn bypass(&mut self, on: bool) {
        self.bypass = on;
    }

    fn run_circle(&mut self, _: &ExactCircle) -> Result<(), MotionRefusal> {
        self.state = MotionState::Running;
        self.runs += 1;
        Ok(())
    }

    fn begin(&mut self) -> Result<(), MotionRefusal> {
        self.state = MotionState::Running;
        self.runs += 1;
        Ok(())
    }

    fn append(&mut self, _: &ExactSegment, _: u32) -> Result<(), MotionRefusal> {
        Ok(())
    }

    fn begin_stream(&mut self, _: f32, _: u16) -> Result<(), MotionRefusal> {
        self.begin()
    }

    fn points(&mut self, _: &[u8]) -> Result<(), MotionRefusal> {
        Ok(())
    }

    fn end(&mut self) -> Result<(), MotionRefusal> {
        self.state = MotionState::Idle;
        Ok(())
    }

    fn stop(&mut self) {
        self.state = MotionState::Idle;
    }

    fn hold(&mut self) {
        self.held += 1;
    }

    fn configure(&mut self, _: &Config) -> Result<(), MotionRefusal> {
        Ok(())
    }

    fn pause(&mut self, _: bool) -> Result<(), MotionRefusal> {
        Ok(())
    }

    fn set_override(&mut self, _: u8) {}

    fn clear_fault(&mut self) -> Result<(), MotionRefusal> {
        Ok(())
    }

    fn declare(&mut self, _: Pose) -> Result<(), MotionRefusal> {
        Ok(())
    }

    fn subscribe(&mut self, _: u16) {}

    fn set_points_waiting(&self) -> usize {
        0
    }

    fn next_set_point(&mut self) -> Option<TimedSetPoint> {
        None
    }
}

/// A controller on the bench with a host beside it.
struct Desk {
    server: Server<Flash, Bench, Box<Buffers>>,
    seq: u16,
}

/// Boots a controller whose flash has these cells.
fn boot(cells: Cells, after: Option<u32>, tear: Tear) -> Desk {
    let server = Server::boot(
        BOARD,
        Flash::new(cells, after, tear),
        LAYOUT,
        Bench::new(),
        Box::default(),
    );
    let mut desk = Desk { server, seq: 0 };
    assert!(matches!(desk.ask(Command::Hello), Some(Reply::Identity(_))));
    desk
}

fn frame(session: u16, seq: u16, command: Command) -> Vec<u8> {
    wire::encode(
        &Request {
            session,
            seq,
            command,
        },
        &mut [0; MAX_FRAME],
    )
    .unwrap()
    .to_vec()
}

fn reply_in(frame: &[u8]) -> (u16, u16, Reply) {
    let mut accumulator = Accumulator::new();
    let payload = frame
        .iter()
        .find_map(|&byte| accumulator.push(byte).map(<[u8]>::to_vec))
        .unwrap();
    match postcard::from_bytes(&payload).unwrap() {
        FromController::Reply {
            session,
            seq,
            reply,
        } => (session, seq, reply),
        other => panic!("{other:?}"),
    }
}

impl Desk {
    fn send(&mut self, bytes: &[u8]) -> Option<Reply> {
        let mut last = None;
        for &byte in bytes {
            if let Some(reply) = self.server.receive(byte) {
                last = Some(reply_in(reply).2);
            }
        }
        last
    }

    fn ask(&mut self, command: Command) -> Option<Reply> {
        self.seq += 1;
        self.send(&frame(1, self.seq, command))
    }

    fn done(&mut self, command: Command) -> bool {
        matches!(self.ask(command), Some(Reply::Done | Reply::Written { .. }))
    }

    fn upload(&mut self, image: &[u8]) -> bool {
        let crc = wire::crc32(image);
        let chunks = image.chunks(CHUNK).enumerate();
        self.done(Command::WriteBegin {
            length: image.len() as u16,
            crc,
        }) && chunks.into_iter().all(|(index, data)| {
            let offset = (index * CHUNK) as u16;
            self.done(Command::WriteChunk {
                offset,
                data: Chunk::from_slice(data).unwrap(),
            })
        })
    }

    fn write(&mut self, image: &[u8]) -> bool {
        self.upload(image) && self.done(Command::WriteEnd)
    }

    fn flash(&mut self, name: &str) -> bool {
        self.write(&image(name)) && self.done(Command::Commit) && self.done(Command::Confirm)
    }

    fn status(&mut self) -> Status {
        match self.ask(Command::Status) {
            Some(Reply::Status(status)) => status,
            other => panic!("{other:?}"),
        }
    }

    /// Name of the table that corrects.
    fn correcting(&mut self) -> Option<String> {
        let bench = self.server.motion_mut();
        assert!(bench.table.is_some() || bench.bypass, "no table, no bypass");
        bench.table.clone()
    }

    fn cells(self) -> Cells {
        self.server.into_parts().0.into_cells()
    }

    fn reboot(self) -> Self {
        boot(self.cells(), None, Tear::Untouched)
    }
}

fn image(name: &str) -> Vec<u8> {
    let zone = Zone {
        place_m: None,
        radius_m: [0.05, 0.3],
        feed_m_s: [0.02, 0.7],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 4e-5,
            kappa4_s4: -5e-6,
        },
        terms: heapless::Vec::new(),
    };
    let table = Table {
        machine: name.try_into().unwrap(),
        zones: heapless::Vec::from_slice(&[zone]).unwrap(),
        limits: Limits {
            offset_m: 1e-3,
            slew_m_s: 0.05,
        },
        arm: None,
    };
    let mut out = [0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut out).unwrap();
    out[..length].to_vec()
}

fn circle() -> Command {
    let run = CircleRun {
        centre_m: [0.0; 3],
        radius_m: 0.1,
        feed_m_s: 0.2,
        plane: giotto_shared::Plane::Xy,
        direction: Direction::Ccw,
        laps: 1,
        start_rad: 0.0,
    };
    Command::RunCircle(run.exact().unwrap())
}
