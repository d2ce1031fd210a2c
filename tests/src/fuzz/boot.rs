//! The flash image at boot: whatever it holds, the controller boots, corrects with whole tables only, and can be flashed.
use super::bench::{Bench, FLASH, Flash, message_in};
use giotto_shared::wire::{
    self, CHUNK, Chunk, Command, Crc32, FromController, MAX_FRAME, Reply, Request, Status, crc32,
};

fn ask(bench: &mut Bench, seq: &mut u16, command: Command) -> Reply {
    *seq += 1;
    let mut frame = [0; MAX_FRAME];
    let request = Request {
        session: 1,
        seq: *seq,
        command,
    };
    let frame = wire::encode(&request, &mut frame).expect("a request fits");
    let mut answers = frame
        .iter()
        .filter_map(|&byte| bench.receive(byte).map(message_in));
    match answers.next() {
        Some(FromController::Reply { reply, .. }) => reply,
        other => panic!("no answer, or what nobody has asked for: {other:?}"),
    }
}

fn status(bench: &mut Bench, seq: &mut u16) -> Status {
    match ask(bench, seq, Command::Status) {
        Reply::Status(status) => status,
        other => panic!("{other:?}"),
    }
}

/// Boots from these bytes, the rest of the flash blank; the first byte says how they are laid out.
pub fn run(bytes: &[u8]) {
    let Some((how, bytes)) = bytes.split_first() else {
        return;
    };
    let mut flash = Flash::new();
    let cells = flash.bytes_mut();
    let half = FLASH / 9 * 4;
    let (first, second) = bytes.split_at(bytes.len().min(if how & 1 == 0 {
        bytes.len()
    } else {
        bytes.len() / 2
    }));
    for (base, part) in [(0, first), (half, second)] {
        let mut part = part.to_vec();
        if how & 2 != 0 {
            super::table::mend(&mut part);
        }
        for (cell, byte) in cells[base..].iter_mut().zip(part) {
            *cell = byte;
        }
    }
    if how & 4 != 0 {
        // A confirmation that fits the table in the first slot.
        let crc = [12, 13, 14, 15].map(|at| cells[at]);
        let generation = u32::from(how >> 3).to_le_bytes();
        let check = Crc32::new().with(&generation).with(&crc).value();
        let record = [generation, check.to_le_bytes()].concat();
        cells[half - 128..half - 120].copy_from_slice(&record);
    }
    let mut bench = Bench::boot(flash);
    let mut seq = 0;
    let signed = match ask(&mut bench, &mut seq, Command::Hello) {
        Reply::Identity(identity) => identity.signed_only,
        other => panic!("{other:?}"),
    };
    let now = status(&mut bench, &mut seq);
    bench.check(&now);
    bench.ticks(20, false);
    // And it can be flashed, unless what it holds says that it takes signed tables only.
    let table = &super::table::tables()[0];
    ask(
        &mut bench,
        &mut seq,
        Command::WriteBegin {
            length: table.len() as u16,
            crc: crc32(table),
        },
    );
    for (index, piece) in table.chunks(CHUNK).enumerate() {
        let data = Chunk::from_slice(piece).expect("a chunk fits");
        ask(
            &mut bench,
            &mut seq,
            Command::WriteChunk {
                offset: (index * CHUNK) as u16,
                data,
            },
        );
    }
    let written = ask(&mut bench, &mut seq, Command::WriteEnd);
    assert_eq!(
        matches!(written, Reply::Written { .. }),
        !signed,
        "{written:?}"
    );
    if !signed {
        assert_eq!(ask(&mut bench, &mut seq, Command::Commit), Reply::Done);
        assert_eq!(ask(&mut bench, &mut seq, Command::Confirm), Reply::Done);
        let now = status(&mut bench, &mut seq);
        assert!(!now.bypass && now.active.is_some());
        bench.check(&now);
        let mut bench = bench.reset();
        let mut seq = 0;
        ask(&mut bench, &mut seq, Command::Hello);
        let after = status(&mut bench, &mut seq);
        assert_eq!((after.active, after.bypass), (now.active, false));
    }
}

/// A table in each slot, confirmed or not.
pub fn seeds() -> Vec<Vec<u8>> {
    let [plain, full] = super::table::tables();
    [0_u8, 1, 2, 3, 6, 7, 15]
        .iter()
        .map(|how| [&[*how], &plain[..], &full[..]].concat())
        .collect()
}
