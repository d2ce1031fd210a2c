//! The server's state machine, with the engine behind it: a conversation of frames, raw bytes, time and resets.
use super::bench::{Bench, Flash};
use giotto_shared::path::Segment;
use giotto_shared::wire::{
    self, Accumulator, CHUNK, Chunk, Command, ExactCircle, ExactSegment, FromController, MAX_FRAME, Reply,
    Request, Status, crc32,
};

/// Reads a conversation.
struct Script<'a>(&'a [u8]);

impl<'a> Script<'a> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn some(&mut self, count: usize) -> &'a [u8] {
        let (some, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        some
    }
}

struct Talk {
    bench: Bench,
    seq: u16,
}

impl Talk {
    /// The reply in what came back.
    fn send(&mut self, bytes: &[u8]) -> Option<Reply> {
        let mut last = None;
        for &byte in bytes {
            if let Some(frame) = self.bench.receive(byte) {
                let mut accumulator = Accumulator::new();
                let payload = frame.iter().find_map(|&byte| accumulator.push(byte).map(<[u8]>::to_vec));
                let payload = payload.expect("a reply is a whole frame");
                last = match postcard::from_bytes(&payload).expect("a reply can be read") {
                    FromController::Reply { reply, .. } => Some(reply),
                    FromController::SetPoints(_) => None,
                };
            }
        }
        last
    }

    fn payload(&mut self, payload: &[u8]) -> Option<Reply> {
        let mut content = payload.to_vec();
        content.extend(crc32(payload).to_le_bytes());
        let mut frame = vec![0; cobs::max_encoding_length(content.len()) + 1];
        let length = cobs::encode(&content, &mut frame);
        frame.truncate(length + 1);
        self.send(&frame)
    }

    fn ask(&mut self, command: Command) -> Option<Reply> {
        self.seq = self.seq.wrapping_add(1);
        let mut frame = [0; MAX_FRAME];
        let request = Request { session: 1, seq: self.seq, command };
        let frame = wire::encode(&request, &mut frame).expect("a request fits").to_vec();
        self.send(&frame)
    }

    fn status(&mut self) -> Status {
        match self.ask(Command::Status) {
            Some(Reply::Status(status)) => status,
            other => panic!("no status: {other:?}"),
        }
    }

    fn upload(&mut self, image: &[u8]) {
        self.ask(Command::WriteBegin { length: image.len() as u16, crc: crc32(image) });
        for (index, piece) in image.chunks(CHUNK).enumerate() {
            let data = Chunk::from_slice(piece).expect("a chunk fits");
            self.ask(Command::WriteChunk { offset: (index * CHUNK) as u16, data });
        }
        self.ask(Command::WriteEnd);
    }
}

/// Holds the conversation and looks at the state after each step.
pub fn run(bytes: &[u8]) {
    let mut script = Script(bytes);
    let mut talk = Talk { bench: Bench::boot(Flash::new()), seq: 0 };
    talk.ask(Command::Hello);
    while let Some(step) = script.byte() {
        match step % 14 {
            0 => drop(talk.send(script.some(usize::from(step) / 4))),
            1 => {
                let length = script.byte().unwrap_or(0);
                drop(talk.payload(script.some(usize::from(length) % 200)));
            }
            2 => {
                // A command of ours with any content.
                talk.seq = talk.seq.wrapping_add(1);
                let mut payload = postcard::to_stdvec(&(1_u16, talk.seq)).unwrap_or_default();
                let length = script.byte().unwrap_or(0);
                payload.extend(script.some(usize::from(length) % 64));
                drop(talk.payload(&payload));
            }
            3 => talk.bench.ticks(usize::from(script.byte().unwrap_or(1)) * 8, step > 250),
            4 => {
                let seeds = super::table::tables();
                let mut image = seeds[usize::from(script.byte().unwrap_or(0)) % seeds.len()].clone();
                if let (Some(at), Some(value)) = (script.byte(), script.byte()) {
                    // Half the time as it is.
                    if at & 1 == 0 {
                        let at = usize::from(at) * 7 % image.len();
                        image[at] ^= value;
                        super::table::mend(&mut image);
                    }
                }
                talk.upload(&image);
            }
            5 => drop(talk.ask(Command::Commit)),
            6 => drop(talk.ask(Command::Confirm)),
            7 => drop(talk.ask(Command::Rollback)),
            8 => drop(talk.ask(Command::Bypass { on: step > 128 })),
            9 => {
                let mut number = || f32::from(script.byte().unwrap_or(1)) / 255.0;
                let run = ExactCircle {
                    centre_nm: [((number() - 0.5) * 1e9) as i32, 0, 0],
                    radius_half_nm: (number() * 2e9) as i32,
                    feed_m_s: 2.0 * number(),
                    direction: if step > 128 {
                        giotto_shared::Direction::Cw
                    } else {
                        giotto_shared::Direction::Ccw
                    },
                    laps: 1,
                    start: (number() * 4e9) as u32,
                };
                drop(talk.ask(Command::RunCircle(run)));
            }
            12 => {
                let mut coordinate = || (i32::from(script.byte().unwrap_or(9)) - 128) * 3_000_000;
                let place = [coordinate(), coordinate(), 0];
                let segment = match step / 14 {
                    0..6 => ExactSegment::Line { to_nm: place, feed_m_s: 0.5 },
                    6..8 => ExactSegment::Dwell { time_s: 0.01 },
                    // From where it stands, if nothing is in the queue.
                    _ => {
                        let centre_m = place.map(|nm| f64::from(nm) * 1e-9);
                        let (normal, sweep_rad) = ([0.0, 0.0, 1.0], f64::from(step) / 40.0);
                        let arc = Segment::Arc { centre_m, normal, sweep_rad, rise_m: 0.01, feed_m_s: 0.3 };
                        arc.exact(talk.status().raw_nm).unwrap_or(ExactSegment::Dwell { time_s: f32::NAN })
                    }
                };
                drop(talk.ask(Command::Append { segment, tolerance_nm: u32::from(step) << 12 }));
            }
            13 => drop(talk.ask(if step > 100 { Command::Begin } else { Command::End })),
            10 if step > 200 => talk.bench.set_stop_input(step > 230),
            10 => drop(talk.ask(Command::Stop)),
            _ => {
                talk = Talk { bench: talk.bench.reset(), seq: 0 };
            }
        }
        // A hello opens the session again if a stranger has it, or a reset was asked for.
        talk.seq = talk.seq.wrapping_add(1);
        talk.ask(Command::Hello);
        if !matches!(talk.ask(Command::Status), Some(Reply::Status(_))) {
            talk = Talk { bench: talk.bench.reset(), seq: 0 };
            talk.ask(Command::Hello);
        }
        let status = talk.status();
        talk.bench.check(&status);
    }
}

/// A flash and a run; a run, a stop and a reset; a program.
pub fn seeds() -> Vec<Vec<u8>> {
    vec![
        vec![4, 0, 1, 1, 5, 6, 9, 128, 100, 60, 0, 3, 255, 3, 255, 10, 3, 255, 11],
        vec![9, 128, 30, 20, 7, 3, 200, 10, 3, 100, 8, 3, 1, 255, 3, 9],
        vec![111, 12, 200, 90, 12, 100, 100, 3, 255, 250, 12, 1, 3, 255, 13, 3, 255, 3, 255],
        vec![4, 1, 1, 1, 5, 11, 4, 0, 1, 1, 5, 6, 4, 1, 1, 1, 5, 6, 7, 7, 11],
    ]
}
