//! The server's state machine, with the engine behind it: a conversation of frames, raw bytes, time and resets.
use super::bench::{Bench, Flash, message_in};
use giotto_shared::path::Segment;
use giotto_shared::wire::{
    self, CHUNK, Chunk, Command, ExactCircle, ExactSegment, FromController, MAX_FRAME, POINTS,
    Reply, Request, Status, Steps, crc32,
};

/// Reads a conversation.
pub(super) struct Script<'a>(pub(super) &'a [u8]);

impl<'a> Script<'a> {
    pub(super) fn byte(&mut self) -> Option<u8> {
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

/// A client, and its controller.
pub(super) struct Talk {
    pub(super) bench: Bench,
    seq: u16,
    /// Set-points of a stream so far.
    steps: Steps,
    /// Everything the controller has said, if that is wanted.
    transcript: Option<Vec<u8>>,
}

impl Talk {
    pub(super) fn new(thorough: bool) -> Self {
        let transcript = None;
        let mut talk = Self {
            bench: Bench::boot(Flash::new()),
            seq: 0,
            steps: Steps::from([0; 3]),
            transcript,
        };
        talk.bench.thorough = thorough;
        talk
    }

    /// Takes the power away and opens the session again.
    pub(super) fn reset(self) -> Self {
        let mut talk = Self {
            bench: self.bench.reset(),
            seq: 0,
            ..self
        };
        talk.ask(Command::Hello);
        talk
    }

    /// The reply in what came back.
    fn send(&mut self, bytes: &[u8]) -> Option<Reply> {
        let mut last = None;
        for &byte in bytes {
            if let Some(frame) = self.bench.receive(byte) {
                last = match message_in(frame) {
                    FromController::Reply { reply, .. } => Some(reply),
                    FromController::SetPoints(_) => None,
                };
                if let Some(transcript) = &mut self.transcript {
                    transcript.extend_from_slice(frame);
                }
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

    pub(super) fn ask(&mut self, command: Command) -> Option<Reply> {
        self.seq = self.seq.wrapping_add(1);
        let mut frame = [0; MAX_FRAME];
        let request = Request {
            session: 1,
            seq: self.seq,
            command,
        };
        self.send(wire::encode(&request, &mut frame).expect("a request fits"))
    }

    pub(super) fn status(&mut self) -> Option<Status> {
        match self.ask(Command::Status) {
            Some(Reply::Status(status)) => Some(status),
            _ => None,
        }
    }

    pub(super) fn upload(&mut self, image: &[u8]) {
        self.ask(Command::WriteBegin {
            length: image.len() as u16,
            crc: crc32(image),
        });
        for (index, piece) in image.chunks(CHUNK).enumerate() {
            let data = Chunk::from_slice(piece).expect("a chunk fits");
            self.ask(Command::WriteChunk {
                offset: (index * CHUNK) as u16,
                data,
            });
        }
        self.ask(Command::WriteEnd);
    }

    /// Opens a stream (0), or goes on with it: at a constant rate, faster, or at once somewhere else.
    fn stream(&mut self, how: u8, places: usize) {
        if how == 0 {
            let here_nm = self.status().map_or([0; 3], |status| status.raw_nm);
            self.steps = Steps::from(here_nm);
            self.ask(Command::BeginStream {
                feed_m_s: 0.5,
                ahead: places as u16,
            });
            return;
        }
        let mut steps = Chunk::new();
        for _ in 0..places {
            let Steps {
                place_nm: [x, y, z],
                ..
            } = self.steps;
            let [dx, dy] = match how {
                1..12 => [i32::from(how) * 10_000, -3_000],
                12 => [600_000, 0],
                13 => [i32::MAX, 0],
                _ => [0, 0],
            };
            if !self
                .steps
                .write([x.wrapping_add(dx), y.wrapping_add(dy), z], &mut steps)
            {
                break;
            }
        }
        self.ask(Command::Points { steps });
    }
}

/// Ticks of a wait: as many lengths of a few ticks as of hundreds, up to 566, which is 2.3 s.
pub(super) fn wait(byte: u8) -> usize {
    let (doublings, part) = (usize::from(byte) / 28, usize::from(byte) % 28);
    ((28 + part) << doublings) / 28
}

/// Holds the conversation and looks at the state after each step.
pub fn run(bytes: &[u8]) {
    hold(Talk::new(false), bytes);
}

fn hold(mut talk: Talk, bytes: &[u8]) -> Talk {
    let mut script = Script(bytes);
    talk.ask(Command::Hello);
    while let Some(step) = script.byte() {
        match step % 16 {
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
            3 => talk
                .bench
                .ticks(wait(script.byte().unwrap_or(1)), step > 240),
            4 => {
                let seeds = super::table::tables();
                let which = usize::from(script.byte().unwrap_or(0)) % seeds.len();
                let mut image = seeds[which].clone();
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
                    plane: giotto_shared::Plane::ALL[usize::from(step % 3)],
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
            13 => {
                let mut coordinate = || (i32::from(script.byte().unwrap_or(9)) - 128) * 3_000_000;
                let place = [coordinate(), coordinate(), 0];
                let segment = match step / 16 {
                    0..6 => ExactSegment::Line {
                        to_nm: place,
                        feed_m_s: 0.5,
                    },
                    6..8 => ExactSegment::Dwell { time_s: 0.01 },
                    // From where it stands, if nothing is in the queue.
                    _ => {
                        let centre_m = place.map(|nm| f64::from(nm) * 1e-9);
                        let (normal, sweep_rad) = ([0.0, 0.0, 1.0], f64::from(step) / 40.0);
                        let arc = Segment::Arc {
                            centre_m,
                            normal,
                            sweep_rad,
                            rise_m: 0.01,
                            feed_m_s: 0.3,
                        };
                        let here_nm = talk.status().map_or([0; 3], |status| status.raw_nm);
                        arc.exact(here_nm)
                            .unwrap_or(ExactSegment::Dwell { time_s: f32::NAN })
                    }
                };
                drop(talk.ask(Command::Append {
                    segment,
                    tolerance_nm: u32::from(step) << 12,
                }));
            }
            14 => drop(talk.ask(if step > 100 {
                Command::Begin
            } else {
                Command::End
            })),
            15 => talk.stream(
                step / 16,
                usize::from(script.byte().unwrap_or(8)) % (2 * POINTS),
            ),
            10 if step > 200 => talk.bench.set_stop_input(step > 230),
            10 => drop(talk.ask(Command::Stop)),
            11 => drop(talk.ask(Command::Hello)),
            _ => talk = talk.reset(),
        }
        talk.seq = talk.seq.wrapping_add(1);
        let mut status = talk.status();
        // A stranger may have the session: a hello opens it again, or else a reset does.
        if status.is_none() {
            talk.ask(Command::Hello);
            status = talk.status();
        }
        if status.is_none() {
            talk = talk.reset();
            status = talk.status();
        }
        talk.bench
            .check(&status.expect("a controller that was reset says how it is"));
    }
    talk
}

/// A flash and a run; a run, a stop and a reset; a program.
pub fn seeds() -> Vec<Vec<u8>> {
    vec![
        vec![
            4, 0, 1, 1, 5, 6, 9, 128, 100, 60, 0, 3, 255, 3, 255, 10, 3, 255, 12,
        ],
        vec![9, 128, 30, 20, 7, 3, 200, 10, 3, 100, 8, 3, 1, 255, 3, 9],
        vec![
            110, 13, 200, 90, 13, 100, 100, 3, 255, 253, 13, 1, 3, 255, 14, 3, 255, 3, 255,
        ],
        vec![
            15, 20, 31, 25, 47, 25, 3, 100, 79, 30, 79, 30, 14, 3, 255, 3, 255, 15, 9, 31, 40, 3,
            255, 3, 255,
        ],
        vec![
            4, 1, 1, 1, 5, 12, 4, 0, 1, 1, 5, 6, 4, 1, 1, 1, 5, 6, 7, 7, 12,
        ],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzz::TARGETS;
    use crate::noise::Noise;

    /// A rest that passes at once is one whose ticks are all made: every byte that the controller says is the same.
    #[test]
    fn rests_that_are_skipped_change_nothing() {
        let server = TARGETS
            .iter()
            .find(|target| target.name == "server")
            .unwrap();
        let noise = Noise::new(server);
        for seed in 0..3000 {
            let bytes = noise.bytes(seed);
            let transcript = |thorough| {
                let mut talk = Talk::new(thorough);
                talk.transcript = Some(Vec::new());
                hold(talk, &bytes).transcript
            };
            assert!(
                transcript(true) == transcript(false),
                "seed {seed}: {bytes:02x?}"
            );
        }
    }
}
