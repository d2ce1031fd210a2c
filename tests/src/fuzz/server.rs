//! The server's state machine, with the engine behind it: a conversation of frames, raw bytes, time and resets.
use super::bench::{Bench, Flash, message_in};
use giotto_shared::wire::{
    self, CHUNK, CRC, Chunk, CircleRun, Command, FromController, MAX_FRAME, Reply, Request, Status,
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
    /// Everything the controller has said, if that is wanted.
    transcript: Option<Vec<u8>>,
}

impl Talk {
    fn new(thorough: bool) -> Self {
        let transcript = None;
        let mut talk = Self { bench: Bench::boot(Flash::new()), seq: 0, transcript };
        talk.bench.thorough = thorough;
        talk
    }

    /// Takes the power away and opens the session again.
    fn reset(self) -> Self {
        let mut talk = Self { bench: self.bench.reset(), seq: 0, ..self };
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
        content.extend(CRC.checksum(payload).to_le_bytes());
        let mut frame = vec![0; cobs::max_encoding_length(content.len()) + 1];
        let length = cobs::encode(&content, &mut frame);
        frame.truncate(length + 1);
        self.send(&frame)
    }

    fn ask(&mut self, command: Command) -> Option<Reply> {
        self.seq = self.seq.wrapping_add(1);
        let mut frame = [0; MAX_FRAME];
        let request = Request { session: 1, seq: self.seq, command };
        self.send(wire::encode(&request, &mut frame).expect("a request fits"))
    }

    fn status(&mut self) -> Option<Status> {
        match self.ask(Command::Status) {
            Some(Reply::Status(status)) => Some(status),
            _ => None,
        }
    }

    fn upload(&mut self, image: &[u8]) {
        self.ask(Command::WriteBegin { length: image.len() as u16, crc: CRC.checksum(image) });
        for (index, piece) in image.chunks(CHUNK).enumerate() {
            let data = Chunk::from_slice(piece).expect("a chunk fits");
            self.ask(Command::WriteChunk { offset: (index * CHUNK) as u16, data });
        }
        self.ask(Command::WriteEnd);
    }
}

/// Ticks of a wait: as many lengths of a few ticks as of a thousand, up to two thousand.
fn wait(byte: u8) -> usize {
    let (doublings, part) = (usize::from(byte) / 23, usize::from(byte) % 23);
    ((23 + part) << doublings) / 23
}

/// Holds the conversation and looks at the state after each step.
pub fn run(bytes: &[u8]) {
    hold(Talk::new(false), bytes);
}

fn hold(mut talk: Talk, bytes: &[u8]) -> Talk {
    let mut script = Script(bytes);
    talk.ask(Command::Hello);
    while let Some(step) = script.byte() {
        match step % 13 {
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
            3 => talk.bench.ticks(wait(script.byte().unwrap_or(1)), step > 240),
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
                let number = |byte: Option<u8>| f64::from(byte.unwrap_or(1)) / 255.0;
                let run = CircleRun {
                    centre_m: [number(script.byte()) - 0.5, 0.0, 0.0],
                    radius_m: number(script.byte()),
                    feed_m_s: 2.0 * number(script.byte()),
                    direction: if step > 128 {
                        giotto_shared::Direction::Cw
                    } else {
                        giotto_shared::Direction::Ccw
                    },
                    laps: 1,
                    start_rad: 6.0 * number(script.byte()),
                };
                drop(talk.ask(Command::RunCircle(run)));
            }
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
        talk.bench.check(&status.expect("a controller that was reset says how it is"));
    }
    talk
}

/// A flash and a run; a run, a stop and a reset.
pub fn seeds() -> Vec<Vec<u8>> {
    vec![
        vec![4, 0, 1, 1, 5, 6, 9, 128, 100, 60, 0, 3, 255, 3, 255, 10, 3, 255, 12],
        vec![9, 128, 30, 20, 7, 3, 200, 10, 3, 100, 8, 3, 1, 255, 3, 9],
        vec![4, 1, 1, 1, 5, 12, 4, 0, 1, 1, 5, 6, 4, 1, 1, 1, 5, 6, 7, 7, 12],
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
        let server = TARGETS.iter().find(|target| target.name == "server").unwrap();
        let noise = Noise::new(server);
        for seed in 0..3000 {
            let bytes = noise.bytes(seed);
            let transcript = |thorough| {
                let mut talk = Talk::new(thorough);
                talk.transcript = Some(Vec::new());
                hold(talk, &bytes).transcript
            };
            assert!(transcript(true) == transcript(false), "seed {seed}: {bytes:02x?}");
        }
    }
}
