//! Requests and replies, one at a time. Each request is repeated until it is answered; the controller sees to it that
//! it happens once.
use super::error::ControllerError;
use super::link::Link;
use giotto_shared::table::SCHEMA_HASH;
use giotto_shared::wire::{
    self, Accumulator, Command, FromController, Identity, KeyInfo, MAX_FRAME, PROTOCOL_VERSION,
    Refusal, Reply, Request, SUPERVISE_MS, SetPoints, Status,
};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// After so long without an answer a request is sent again.
pub(super) const REPEAT_AFTER: Duration = Duration::from_millis(300);
/// After so long the controller is given up: erasing the sector of a large flash takes up to 2 s.
pub(super) const GIVE_UP_AFTER: Duration = Duration::from_secs(5);
/// As above, for the first request: who does not answer now will not.
const GIVE_UP_HELLO_AFTER: Duration = Duration::from_secs(3);

/// A controller on the other end of a link, its session open.
pub struct Controller {
    link: Box<dyn Link>,
    name: String,
    accumulator: Accumulator,
    session: u16,
    seq: u16,
    /// Bytes received and not yet looked at.
    pending: std::collections::VecDeque<u8>,
    pub(super) set_points: Vec<SetPoints>,
    identity: Identity,
    repeats: u32,
    supervise_ms: u16,
    /// Set by whoever wants the run that is recorded to stop.
    pub(super) wish: Option<Arc<AtomicBool>>,
    /// It was.
    pub(super) stopped: bool,
    /// Stops that the controller had counted when recording began.
    pub(super) stops_before: u32,
}

impl std::fmt::Debug for Controller {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Controller")
            .field("port", &self.name)
            .field("identity", &self.identity)
            .finish()
    }
}

/// What came in: an answer of this session, or a batch of set-points that has been put away.
pub(super) enum Arrival {
    /// With the number of the request.
    Reply(u16, Result<Reply, Refusal>),
    SetPoints,
}

impl Controller {
    /// Opens a session over `link`; `session` should differ from client to client.
    ///
    /// # Errors
    /// [`ControllerError::NoAnswer`], [`ControllerError::OtherProtocol`], [`ControllerError::OtherSchema`].
    pub fn connect(link: Box<dyn Link>, name: &str, session: u16) -> Result<Self, ControllerError> {
        let nobody = Identity {
            board: heapless::String::new(),
            build: heapless::String::new(),
            protocol: 0,
            table_format: 0,
            schema_hash: 0,
            max_image_bytes: 0,
            tick_hz: 0,
            signed_only: false,
            machine: [0; 12],
        };
        let mut controller = Self {
            link,
            name: name.to_owned(),
            accumulator: Accumulator::new(),
            session,
            seq: 0,
            pending: std::collections::VecDeque::new(),
            set_points: Vec::new(),
            identity: nobody,
            repeats: 0,
            supervise_ms: SUPERVISE_MS,
            wish: None,
            stopped: false,
            stops_before: 0,
        };
        controller.hello()?;
        Ok(controller)
    }

    fn hello(&mut self) -> Result<(), ControllerError> {
        let Reply::Identity(identity) = self.exchange(Command::Hello, GIVE_UP_HELLO_AFTER)? else {
            return Err(ControllerError::WrongReply);
        };
        let (port, theirs) = (self.name.clone(), identity.protocol);
        if theirs != PROTOCOL_VERSION {
            return Err(ControllerError::OtherProtocol {
                port,
                theirs,
                ours: PROTOCOL_VERSION,
            });
        }
        let theirs = identity.schema_hash;
        if theirs != SCHEMA_HASH {
            return Err(ControllerError::OtherSchema {
                port,
                theirs,
                ours: SCHEMA_HASH,
            });
        }
        self.identity = identity;
        // A hello sets it back.
        if self.supervise_ms == SUPERVISE_MS {
            return Ok(());
        }
        self.command(Command::Supervise {
            after_ms: self.supervise_ms,
        })
    }

    /// Who it is.
    pub const fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The name it was opened by.
    pub fn port(&self) -> &str {
        &self.name
    }

    /// The link's clock.
    pub(super) fn now(&self) -> Duration {
        self.link.now()
    }

    /// How long the controller may not hear from us during a run before it finishes the segment in hand and starts
    /// nothing else; `None`: for ever.
    ///
    /// # Errors
    /// Those of the link.
    pub fn supervise(&mut self, after: Option<Duration>) -> Result<(), ControllerError> {
        self.supervise_ms = after.map_or(0, |after| {
            u16::try_from(after.as_millis()).unwrap_or(u16::MAX)
        });
        self.command(Command::Supervise {
            after_ms: self.supervise_ms,
        })
    }

    /// Lets time pass on the link without a word, as a host that has died.
    ///
    /// # Errors
    /// Those of the link.
    pub fn stay_silent(&mut self, time: Duration) -> Result<(), ControllerError> {
        let until = self.now() + time;
        while self.now() < until && self.arrival(until)?.is_some() {}
        Ok(())
    }

    /// Requests that had to be sent again, so far.
    pub const fn repeats(&self) -> u32 {
        self.repeats
    }

    /// State and slots.
    ///
    /// # Errors
    /// [`ControllerError::NoAnswer`], [`ControllerError::Lost`].
    pub fn status(&mut self) -> Result<Status, ControllerError> {
        match self.ask(Command::Status)? {
            Reply::Status(status) => Ok(status),
            _ => Err(ControllerError::WrongReply),
        }
    }

    /// Whose tables it takes.
    ///
    /// # Errors
    /// [`ControllerError::NoAnswer`], [`ControllerError::Lost`].
    pub fn key_info(&mut self) -> Result<KeyInfo, ControllerError> {
        match self.ask(Command::Key)? {
            Reply::Key(info) => Ok(info),
            _ => Err(ControllerError::WrongReply),
        }
    }

    /// A command that is answered by "done".
    ///
    /// # Errors
    /// [`ControllerError::Refused`] and those of the link.
    pub fn command(&mut self, command: Command) -> Result<(), ControllerError> {
        match self.ask(command)? {
            Reply::Done => Ok(()),
            _ => Err(ControllerError::WrongReply),
        }
    }

    /// Warm reset; returns when the controller answers again.
    ///
    /// # Errors
    /// [`ControllerError::Refused`] while a run is in progress; [`ControllerError::NoAnswer`].
    pub fn reset(&mut self) -> Result<(), ControllerError> {
        self.command(Command::Reset)?;
        self.set_points.clear();
        self.hello()
    }

    /// Asks, repeats, and returns the answer.
    pub(super) fn ask(&mut self, command: Command) -> Result<Reply, ControllerError> {
        self.exchange(command, GIVE_UP_AFTER)
    }

    fn exchange(
        &mut self,
        command: Command,
        give_up_after: Duration,
    ) -> Result<Reply, ControllerError> {
        let (seq, frame) = self.next_frame(command)?;
        let give_up_at = self.link.now() + give_up_after;
        let mut attempts = 0;
        while attempts == 0 || self.link.now() < give_up_at {
            self.send_frame(seq, &frame, attempts > 0)?;
            attempts += 1;
            let until = give_up_at.min(self.link.now() + REPEAT_AFTER);
            while let Some(arrival) = self.arrival(until)? {
                match arrival {
                    Arrival::Reply(answered, reply) if answered == seq => {
                        return reply.map_err(ControllerError::Refused);
                    }
                    // To an earlier request, sent twice or given up.
                    Arrival::Reply(..) | Arrival::SetPoints => {}
                }
            }
        }
        Err(self.no_answer(give_up_after))
    }

    pub(super) fn no_answer(&self, waited: Duration) -> ControllerError {
        ControllerError::NoAnswer {
            port: self.name.clone(),
            waited,
        }
    }

    /// Number of the next request.
    pub(super) const fn next_seq(&self) -> u16 {
        self.seq.wrapping_add(1)
    }

    /// Number and frame of the next request.
    pub(super) fn next_frame(&self, command: Command) -> Result<(u16, Vec<u8>), ControllerError> {
        let seq = self.next_seq();
        let request = Request {
            session: self.session,
            seq,
            command,
        };
        let mut buffer = [0; MAX_FRAME];
        let frame = wire::encode(&request, &mut buffer).map_err(|_| ControllerError::WrongReply)?;
        Ok((seq, frame.to_vec()))
    }

    /// Sends the frame of request `seq`; `again`: something was not answered.
    pub(super) fn send_frame(
        &mut self,
        seq: u16,
        frame: &[u8],
        again: bool,
    ) -> Result<(), ControllerError> {
        self.seq = seq;
        self.repeats += u32::from(again);
        // A zero first: it closes whatever a disturbed line has left open.
        self.send(&[0])?;
        self.send(frame)
    }

    /// Waits for a batch of set-points (put away in `set_points`); `false`: none came in time.
    pub(super) fn wait_for_set_points(&mut self, time: Duration) -> Result<bool, ControllerError> {
        let until = self.link.now() + time;
        while let Some(arrival) = self.arrival(until)? {
            if matches!(arrival, Arrival::SetPoints) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Listens for set-points for so long; they wait for [`Self::take_set_points`].
    ///
    /// # Errors
    /// [`ControllerError::Lost`].
    pub fn listen(&mut self, time: Duration) -> Result<(), ControllerError> {
        let until = self.link.now() + time;
        while self.link.now() < until {
            self.arrival(until)?;
        }
        Ok(())
    }

    /// The set-points that have come in since the last call.
    pub fn take_set_points(&mut self) -> Vec<SetPoints> {
        std::mem::take(&mut self.set_points)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), ControllerError> {
        self.link
            .send(bytes)
            .map_err(|error| lost(&self.name, &error))
    }

    /// The next message that is for us.
    pub(super) fn arrival(&mut self, until: Duration) -> Result<Option<Arrival>, ControllerError> {
        loop {
            while let Some(byte) = self.pending.pop_front() {
                let Some(payload) = self.accumulator.push(byte) else {
                    continue;
                };
                match postcard::from_bytes(payload) {
                    Ok(FromController::Reply {
                        session,
                        seq,
                        reply,
                    }) if session == self.session => {
                        let reply = match reply {
                            Reply::Refused(refusal) => Err(refusal),
                            reply => Ok(reply),
                        };
                        return Ok(Some(Arrival::Reply(seq, reply)));
                    }
                    Ok(FromController::SetPoints(batch)) => {
                        self.set_points.push(batch);
                        return Ok(Some(Arrival::SetPoints));
                    }
                    // An answer to another client, or a message of another build.
                    Ok(FromController::Reply { .. }) | Err(_) => {}
                }
            }
            let mut buffer = [0; 4096];
            let count = self
                .link
                .receive(&mut buffer, until)
                .map_err(|error| lost(&self.name, &error))?;
            if count == 0 {
                return Ok(None);
            }
            self.pending.extend(&buffer[..count]);
        }
    }
}

fn lost(port: &str, error: &std::io::Error) -> ControllerError {
    ControllerError::Lost {
        port: port.to_owned(),
        reason: error.to_string(),
    }
}
