//! UDP and the clock: the only place that has either.
use crate::door::{Door, Phase};
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

/// How long is waited for a datagram before time is said to go by.
const WAIT: Duration = Duration::from_millis(50);
/// How often a robot is asked that has not answered yet.
const AGAIN: Duration = Duration::from_millis(500);
/// Longest datagram of a UDP socket.
const LONGEST: usize = 65_535;

/// Guides one robot until the session has ended.
///
/// `robot` is asked where we have to call; elsewhere the first that sends is the robot, and nobody else is answered. `each` is
/// called after each datagram and each silence of 50 ms, and says whether to go on: `false` takes the correction out and ends.
/// Times are taken when a datagram has been received; the answer is on its way before `each` is called.
///
/// Gives the robot's address, where one was answered.
///
/// # Errors
/// Those of the socket, but for a robot that is not there yet.
pub fn guide(
    socket: &UdpSocket,
    door: &mut Door,
    robot: Option<SocketAddr>,
    each: &mut dyn FnMut(&Door) -> bool,
) -> io::Result<Option<SocketAddr>> {
    let started = Instant::now();
    let mut robot = robot;
    let mut asked: Option<Instant> = None;
    let mut bytes = vec![0; LONGEST];
    socket.set_read_timeout(Some(WAIT))?;
    while !matches!(door.phase(), Phase::Ended | Phase::Refused(_)) {
        if let Some(to) = robot
            && asked.is_none_or(|asked| asked.elapsed() >= AGAIN)
        {
            for greeting in door.greeting() {
                send(socket, &greeting, to)?;
            }
            asked = Some(Instant::now());
        }
        match socket.recv_from(&mut bytes) {
            Ok((length, from)) if robot.is_none_or(|robot| robot == from) => {
                let datagram = bytes.get(..length).unwrap_or_default();
                for reply in door.answer(datagram, started.elapsed()) {
                    send(socket, &reply, from)?;
                }
                // Who was answered is the robot.
                if door.counters().answered > 0 {
                    robot = Some(from);
                }
            }
            // Somebody else.
            Ok(_) => {}
            Err(error) if is_nothing(&error) => door.silence(started.elapsed()),
            Err(error) => return Err(error),
        }
        if !each(door) {
            door.leave(started.elapsed());
        }
    }
    if let Some(to) = robot {
        for farewell in door.farewell() {
            send(socket, &farewell, to)?;
        }
    }
    Ok(robot.filter(|_| door.counters().answered > 0))
}

/// No datagram came, or the last one found nobody there.
fn is_nothing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock
            | ErrorKind::TimedOut
            | ErrorKind::Interrupted
            | ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
    )
}

fn send(socket: &UdpSocket, bytes: &[u8], to: SocketAddr) -> io::Result<()> {
    match socket.send_to(bytes, to) {
        Err(error) if !is_nothing(&error) => Err(error),
        _ => Ok(()),
    }
}
