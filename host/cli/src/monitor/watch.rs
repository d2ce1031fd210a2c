//! The line in a thread of its own, since a controller that is gone takes seconds to be given up.
use giotto_link::{Controller, ControllerError};
use giotto_shared::path::CircleRun;
use giotto_shared::wire::{Command, Identity, SetPoint, Status};
use std::sync::mpsc::{Receiver, Sender, TryRecvError};
use std::time::Duration;

/// From one attempt to open a lost line to the next.
pub(super) const RETRY: Duration = Duration::from_millis(500);
/// Longest silence: during a run the controller takes one of [`SUPERVISE_MS`] for the end of its host.
///
/// [`SUPERVISE_MS`]: giotto_shared::wire::SUPERVISE_MS
pub(super) const SILENCE: Duration = Duration::from_millis(200);
/// Set-points a second: a smooth trace, a tenth of what the line carries.
const POINTS_PER_S: u32 = 100;

/// What happened on the line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Event {
    /// It is open.
    Up(Box<Identity>),
    /// The controller's state.
    Status(Box<Status>),
    /// Set-points since the last ones.
    Points(Vec<SetPoint>),
    /// It is lost; attempts to open it go on.
    Down(String),
    /// A wish was refused.
    Refused(String),
}

/// What the person wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wish {
    Bypass(bool),
    Stop,
    Run(CircleRun),
}

/// Watches until nobody listens: `open` gives the line anew after a loss.
pub(super) fn watch(
    first: Controller,
    mut open: impl FnMut() -> Result<Controller, ControllerError>,
    interval: Duration,
    wishes: &Receiver<Wish>,
    events: &Sender<Event>,
) {
    let mut line = Some(first);
    loop {
        let told = match line.take() {
            Some(mut controller) => match serve(&mut controller, interval, wishes, events) {
                Some(reason) => events.send(Event::Down(reason)),
                None => return,
            },
            None => match open() {
                Ok(controller) => {
                    line = Some(controller);
                    continue;
                }
                Err(error) => events.send(Event::Down(error.to_string())),
            },
        };
        if told.is_err() {
            return;
        }
        std::thread::sleep(RETRY);
    }
}

/// Serves an open line until it is lost (why), or until nobody listens (nothing).
fn serve(
    controller: &mut Controller,
    interval: Duration,
    wishes: &Receiver<Wish>,
    events: &Sender<Event>,
) -> Option<String> {
    events
        .send(Event::Up(Box::new(controller.identity().clone())))
        .ok()?;
    let every = (controller.identity().tick_hz / POINTS_PER_S).clamp(1, u32::from(u16::MAX)) as u16;
    if let Err(error) = controller.command(Command::Subscribe {
        every,
        on_link: true,
    }) && super::gone(&error)
    {
        return Some(error.to_string());
    }
    let mut since = interval;
    loop {
        loop {
            let done = match wishes.try_recv() {
                Ok(Wish::Bypass(on)) => controller.command(Command::Bypass { on }),
                Ok(Wish::Stop) => controller.command(Command::Stop),
                Ok(Wish::Run(circle)) => controller.start_circle(&circle),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return None,
            };
            match done {
                Err(error) if super::gone(&error) => return Some(error.to_string()),
                Err(error) => events.send(Event::Refused(error.to_string())).ok()?,
                Ok(()) => {}
            }
        }
        match controller.status() {
            Ok(status) if since >= interval => {
                since = Duration::ZERO;
                events.send(Event::Status(Box::new(status))).ok()?;
            }
            Ok(_) => {}
            Err(error) if super::gone(&error) => return Some(error.to_string()),
            Err(error) => events.send(Event::Refused(error.to_string())).ok()?,
        }
        let pause = interval.min(SILENCE);
        if let Err(error) = controller.listen(pause) {
            return Some(error.to_string());
        }
        since += pause;
        let points: Vec<SetPoint> = controller
            .take_set_points()
            .into_iter()
            .flat_map(|b| b.points)
            .collect();
        if !points.is_empty() {
            events.send(Event::Points(points)).ok()?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_link::link::Link;
    use giotto_link::virtual_controller::VirtualLink;
    use giotto_shared::Direction;
    use std::io;
    use std::sync::mpsc::channel;

    /// A line that is pulled out after so many answers.
    struct Plug(VirtualLink, usize);

    impl Link for Plug {
        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.0.send(bytes)
        }

        fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
            self.1 = self
                .1
                .checked_sub(1)
                .ok_or_else(|| io::Error::from(io::ErrorKind::BrokenPipe))?;
            self.0.receive(buffer, until)
        }

        fn now(&self) -> Duration {
            self.0.now()
        }
    }

    fn controller(answers: usize) -> Result<Controller, ControllerError> {
        Controller::connect(Box::new(Plug(VirtualLink::new(), answers)), "plug", 1)
    }

    #[test]
    fn a_pulled_plug_is_said_and_the_watch_goes_on_when_it_is_back() {
        let (wishes, hear_wishes) = channel();
        let (tell, events) = channel();
        let mut attempts = 0;
        let open = move || {
            attempts += 1;
            if attempts == 1 {
                return Err(ControllerError::NoPort {
                    port: "plug".into(),
                });
            }
            controller(usize::MAX)
        };
        let first = controller(20).unwrap();
        let worker = std::thread::spawn(move || {
            watch(first, open, Duration::from_millis(20), &hear_wishes, &tell);
        });
        let circle = CircleRun {
            centre_m: [0.0; 3],
            radius_m: 0.02,
            feed_m_s: 0.05,
            plane: giotto_shared::Plane::Xy,
            direction: Direction::Ccw,
            laps: 2,
            start_rad: 0.0,
        };
        let mut downs = Vec::new();
        let (mut ups, mut statuses, mut points) = (0, 0, 0);
        for event in &events {
            match event {
                Event::Up(identity) => {
                    ups += 1;
                    assert_eq!(identity.board.as_str(), "virtual");
                    if ups == 2 {
                        wishes.send(Wish::Run(circle)).unwrap();
                    }
                }
                Event::Down(why) => downs.push(why),
                Event::Status(_) => statuses += 1,
                Event::Points(list) => points += list.len(),
                Event::Refused(why) => panic!("{why}"),
            }
            if points > 50 {
                break;
            }
        }
        assert_eq!((ups, downs.len()), (2, 2), "{downs:?}");
        assert!(
            downs[0].contains("plug") && statuses > 2,
            "{downs:?} {statuses}"
        );
        drop(wishes);
        drop(events);
        worker.join().unwrap();
    }
}
