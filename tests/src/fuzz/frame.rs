//! The frame decoder and what is in the frames: any bytes are survived, and what is understood is written the same.
use giotto_shared::wire::{
    self, Accumulator, Command, FromController, MAX_FRAME, MAX_PAYLOAD, Request,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// What can be read from a payload can be written, and is then read as the same.
fn round_trip<M: Serialize + DeserializeOwned>(payload: &[u8]) {
    let Ok(message) = postcard::from_bytes::<M>(payload) else {
        return;
    };
    let mut frame = [0; MAX_FRAME];
    let frame = wire::encode(&message, &mut frame).expect("what was read fits into a frame");
    let mut accumulator = Accumulator::new();
    let back = frame
        .iter()
        .find_map(|&byte| accumulator.push(byte).map(<[u8]>::to_vec));
    let back = back.expect("a frame just written is whole");
    let again = postcard::from_bytes::<M>(&back).expect("a message just written can be read");
    // Compared as bytes: NaN is not itself.
    let mut twice = [0; MAX_FRAME];
    let twice = wire::encode(&again, &mut twice).expect("as before");
    assert_eq!(frame, twice);
}

/// Feeds the bytes to a decoder.
pub fn run(bytes: &[u8]) {
    let mut accumulator = Accumulator::new();
    let mut zeros = 0;
    for &byte in bytes {
        zeros += u32::from(byte == 0);
        if let Some(payload) = accumulator.push(byte) {
            assert!(payload.len() <= MAX_PAYLOAD);
            let payload = payload.to_vec();
            round_trip::<Request>(&payload);
            round_trip::<FromController>(&payload);
        }
    }
    let counts = accumulator.counts();
    assert!(counts.crc_errors + counts.malformed + counts.overlong <= zeros);
    // Whatever came before, the next whole frame after a zero is found.
    accumulator.push(0);
    let request = Request {
        session: 1,
        seq: 2,
        command: Command::Status,
    };
    let mut frame = [0; MAX_FRAME];
    let frame = wire::encode(&request, &mut frame).expect("it fits");
    let found = frame.iter().any(|&byte| accumulator.push(byte).is_some());
    assert!(found, "a whole frame was not found");
}

/// A request, a reply, two in a row.
pub fn seeds() -> Vec<Vec<u8>> {
    let mut out = [0; MAX_FRAME];
    let mut frame = |command: Command| {
        let request = Request {
            session: 1,
            seq: 2,
            command,
        };
        wire::encode(&request, &mut out)
            .map(|frame| frame.to_vec())
            .unwrap_or_default()
    };
    let hello = frame(Command::Hello);
    let provision = frame(Command::Provision { key: [7; 32] });
    vec![hello.clone(), [hello, provision].concat()]
}
