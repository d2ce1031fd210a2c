//! Whose turn it is: new requests, repeated ones, and those that come too late. Numbers may be left out: a host that has
//! several requests on their way sends what was lost of them under new ones.
use giotto_shared::wire::{self, Command, FromController, MAX_FRAME, Reply};

/// Session and sequence number of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    session: u16,
    seq: u16,
}

/// The head can be read, the command not: a newer host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotUnderstood;

/// Reads a request; `None` if not even its head can be read.
#[inline(never)]
pub(super) fn read(payload: &[u8]) -> Option<(Head, Result<Command, NotUnderstood>)> {
    let (session, rest) = wire::take::<u16>(payload)?;
    let (seq, rest) = wire::take::<u16>(rest)?;
    let command = match wire::take::<Command>(rest) {
        Some((command, [])) => Ok(command),
        _ => Err(NotUnderstood),
    };
    Some((Head { session, seq }, command))
}

/// Number of a request, as in the protocol; 255 if it cannot be read.
pub(super) fn number(payload: &[u8]) -> u8 {
    let number = || {
        let (_, rest) = wire::take::<u16>(payload)?;
        let (_, rest) = wire::take::<u16>(rest)?;
        wire::take::<u32>(rest)
    };
    number().map_or(u8::MAX, |(number, _)| number.min(255) as u8)
}

/// Obeyed whoever has the session.
pub(super) const fn from_anyone(command: &Command) -> bool {
    matches!(
        command,
        Command::Stop | Command::Pause | Command::Resume | Command::Override { .. }
    )
}

/// What to do with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// Carry it out.
    New,
    /// It was the last one: send the same reply.
    Repeated,
    /// A newer one was carried out already: no reply.
    Late,
    /// Not of the session that is open.
    Unknown,
}

/// The session that is open.
#[derive(Debug)]
pub(super) struct Session {
    last: Option<Head>,
    repeated: u32,
    malformed: u32,
}

impl Session {
    pub(super) const fn new() -> Self {
        Self {
            last: None,
            repeated: 0,
            malformed: 0,
        }
    }

    /// The request with this head is the one whose reply is remembered.
    pub(super) const fn answered(&mut self, head: Head) {
        self.last = Some(head);
    }

    pub(super) const fn repeated(&self) -> u32 {
        self.repeated
    }

    pub(super) const fn malformed(&self) -> u32 {
        self.malformed
    }

    pub(super) const fn count_malformed(&mut self) {
        self.malformed = self.malformed.wrapping_add(1);
    }

    /// `opens`: the request is a hello, which opens a session.
    pub(super) fn turn(&mut self, head: Head, opens: bool) -> Turn {
        let same_session = self.last.filter(|last| last.session == head.session);
        let Some(last) = same_session else {
            return if opens { Turn::New } else { Turn::Unknown };
        };
        // Sequence numbers wrap; less than half the circle ahead is newer.
        match head.seq.wrapping_sub(last.seq) {
            0 => {
                self.repeated = self.repeated.wrapping_add(1);
                Turn::Repeated
            }
            ahead if ahead < 0x8000 => Turn::New,
            _ => Turn::Late,
        }
    }
}

/// Frames a reply.
#[inline(never)]
pub(super) fn frame(head: Head, reply: Reply, out: &mut [u8; MAX_FRAME]) -> Option<&[u8]> {
    let Head { session, seq } = head;
    let message = FromController::Reply {
        session,
        seq,
        reply,
    };
    wire::encode(&message, out).ok().map(|frame| &*frame)
}
