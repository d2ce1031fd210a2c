//! Flashing with several requests on their way: one mishap at every frame in turn, both ways; a line that dies at every
//! frame; lines slow and fast.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::ticks::largest_table;
use giotto_link::flash::{Verdict, active_table};
use giotto_link::link::Link;
use giotto_link::virtual_controller::VirtualLink;
use giotto_link::{Controller, ControllerError};
use giotto_shared::table::{self, MAX_IMAGE_BYTES};
use giotto_shared::wire::{IN_FLIGHT, MAX_FRAME, Probation, SlotState};
use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A controller that outlives the line to it.
#[derive(Clone, Default)]
struct Wired(Arc<Mutex<VirtualLink>>);

impl Link for Wired {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.lock().unwrap().send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        self.0.lock().unwrap().receive(buffer, until)
    }

    fn now(&self) -> Duration {
        self.0.lock().unwrap().now()
    }
}

/// What befalls a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mishap {
    Lost,
    Damaged,
    Twice,
    /// After the next one.
    Passed,
    /// Twice, the second time after the next one.
    Echoed,
    /// Lost, and all after it.
    End,
}

/// One direction of a line.
struct Way {
    frames: usize,
    /// What happens, and to which frame; `None`: no frame of this way.
    fate: Option<(Mishap, usize)>,
    held: Vec<u8>,
    happened: Arc<AtomicUsize>,
}

impl Way {
    fn pass(&mut self, frame: &[u8]) -> Vec<u8> {
        let held = std::mem::take(&mut self.held);
        if frame.len() == 1 {
            // The zero before a frame.
            return [frame, &held].concat();
        }
        let number = self.frames;
        self.frames += 1;
        let mishap = match self.fate {
            Some((Mishap::End, from)) if number >= from => Mishap::Lost,
            Some((mishap, at)) if number == at => mishap,
            _ => return [frame, &held].concat(),
        };
        self.happened.fetch_add(1, Relaxed);
        match mishap {
            Mishap::Lost | Mishap::End => Vec::new(),
            Mishap::Damaged => {
                let mut frame = frame.to_vec();
                frame[2] ^= 0x40;
                frame
            }
            Mishap::Twice => frame.repeat(2),
            Mishap::Passed => {
                self.held = frame.to_vec();
                Vec::new()
            }
            Mishap::Echoed => {
                self.held = frame.to_vec();
                frame.to_vec()
            }
        }
    }
}

struct Line {
    inner: Wired,
    ways: [Way; 2],
    pending: VecDeque<u8>,
}

impl Line {
    /// `way` 0: to the controller, 1: to the host.
    fn new(inner: &Wired, way: usize, mishap: Mishap, at: usize) -> (Self, Arc<AtomicUsize>) {
        let happened = Arc::new(AtomicUsize::new(0));
        let ways = [0, 1].map(|index| Way {
            frames: 0,
            fate: (index == way).then_some((mishap, at)),
            held: Vec::new(),
            happened: Arc::clone(&happened),
        });
        (
            Self {
                inner: inner.clone(),
                ways,
                pending: VecDeque::new(),
            },
            happened,
        )
    }
}

fn hand_over(pending: &mut VecDeque<u8>, buffer: &mut [u8]) -> usize {
    let count = buffer.len().min(pending.len());
    for (to, from) in buffer.iter_mut().zip(pending.drain(..count)) {
        *to = from;
    }
    count
}

impl Link for Line {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let bytes = self.ways[0].pass(bytes);
        self.inner.send(&bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        while self.pending.is_empty() {
            let mut bytes = [0; 4096];
            let count = self.inner.receive(&mut bytes, until)?;
            if count == 0 {
                return Ok(0);
            }
            for frame in bytes[..count].split_inclusive(|byte| *byte == 0) {
                self.pending.extend(self.ways[1].pass(frame));
            }
        }
        Ok(hand_over(&mut self.pending, buffer))
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}

/// The largest table, named.
fn table(name: &str) -> Vec<u8> {
    let mut table = table::decode(&largest_table()).unwrap();
    table.machine = name.try_into().unwrap();
    let mut bytes = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

fn connect(controller: &Wired, session: u16) -> Controller {
    Controller::connect(Box::new(controller.clone()), "sim", session).unwrap()
}

/// A controller with this table in slot 0.
fn with_table(image: &[u8]) -> Wired {
    let controller = Wired::default();
    connect(&controller, 1).flash(image, &mut |_| {}).unwrap();
    controller
}

/// Whatever happens to one frame, the table is flashed, and each step of it has happened once.
#[test]
fn one_mishap_at_every_frame_in_turn() {
    let (old, new) = (table("old"), table("new"));
    for mishap in [
        Mishap::Lost,
        Mishap::Damaged,
        Mishap::Twice,
        Mishap::Passed,
        Mishap::Echoed,
    ] {
        for way in [0, 1] {
            let mut frames = 0;
            for at in 0.. {
                let controller = with_table(&old);
                let (line, happened) = Line::new(&controller, way, mishap, at);
                let what = format!("{mishap:?}, way {way}, frame {at}");
                let mut client = Controller::connect(Box::new(line), "sim", 2).unwrap();
                let flashed = client.flash(&new, &mut |_| {}).expect(&what);
                assert_eq!((flashed.slot, flashed.generation), (1, 2), "{what}");
                assert_eq!(
                    client.verify(&new).unwrap(),
                    Verdict::Same { slot: 1 },
                    "{what}"
                );
                let status = client.status().unwrap();
                assert_eq!(status.probation, Probation::None, "{what}");
                let generation = |slot: usize| match status.slots[slot] {
                    SlotState::Table(info) => info.generation,
                    _ => None,
                };
                assert_eq!([generation(0), generation(1)], [Some(1), Some(2)], "{what}");
                let mishaps = happened.load(Relaxed);
                if mishaps == 0 {
                    frames = at;
                    break;
                }
                // An answer that is lost may be made up for by the next one.
                let lost = way == 0 && matches!(mishap, Mishap::Lost | Mishap::Damaged);
                assert!(client.repeats() > 0 || !lost, "{what}");
            }
            // Hello, nine pieces out, nine back and again for the comparison, the steps between.
            assert!(frames > 30, "{frames}");
        }
    }
}

/// The line dies at every frame in turn: the host is told, and the controller corrects with one of both tables, whole.
#[test]
fn a_line_that_dies_leaves_a_whole_table() {
    let (old, new) = (table("old"), table("new"));
    for way in [0, 1] {
        let mut outcomes = [0; 2];
        for at in 1.. {
            let controller = with_table(&old);
            let (line, happened) = Line::new(&controller, way, Mishap::End, at);
            let mut client = Controller::connect(Box::new(line), "sim", 2).unwrap();
            let flashed = client.flash(&new, &mut |_| {});
            if happened.load(Relaxed) == 0 {
                flashed.unwrap();
                break;
            }
            assert!(
                matches!(flashed, Err(ControllerError::NoAnswer { .. })),
                "{flashed:?}"
            );
            let mut client = connect(&controller, 3);
            client.reset().unwrap();
            let (slot, _) = active_table(&client.status().unwrap()).unwrap();
            let image = if slot == 0 { &old } else { &new };
            assert_eq!(
                client.verify(image).unwrap(),
                Verdict::Same { slot },
                "way {way}, frame {at}"
            );
            outcomes[usize::from(slot)] += 1;
            // And nothing is in the way of the next one.
            client.flash(&new, &mut |_| {}).unwrap();
        }
        // Only once the confirmation has arrived is it the new one: its answer or those of two statuses are lost then.
        assert!(
            outcomes[0] > 20 && (1..=2).contains(&outcomes[1]),
            "{outcomes:?}"
        );
    }
}

/// A serial line with a rate, both ways.
struct Serial {
    inner: VirtualLink,
    bytes_per_s: f64,
    /// Time up to which bytes have been carried.
    carried: Duration,
    /// Parts of a byte.
    credit: f64,
    queues: [VecDeque<u8>; 2],
    longest: Arc<AtomicUsize>,
}

impl Serial {
    fn new(baud: f64) -> (Self, Arc<AtomicUsize>) {
        let longest = Arc::new(AtomicUsize::new(0));
        let serial = Self {
            inner: VirtualLink::new(),
            bytes_per_s: baud / 10.0,
            carried: Duration::ZERO,
            credit: 0.0,
            queues: [VecDeque::new(), VecDeque::new()],
            longest: Arc::clone(&longest),
        };
        (serial, longest)
    }
}

impl Link for Serial {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.queues[0].extend(bytes);
        self.longest.fetch_max(self.queues[0].len(), Relaxed);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        let mut at_host = VecDeque::new();
        while at_host.is_empty() && self.now() < until {
            // A millisecond of the line, then one of the controller.
            self.credit += self.bytes_per_s * (self.now() - self.carried).as_secs_f64();
            self.carried = self.now();
            let whole = self.credit as usize;
            self.credit -= whole as f64;
            let next = self.now() + Duration::from_millis(1);
            let [out, back] = &mut self.queues;
            let out: Vec<u8> = out.drain(..whole.min(out.len())).collect();
            self.inner.send(&out)?;
            let mut bytes = [0; 4096];
            let count = self.inner.receive(&mut bytes, next)?;
            at_host.extend(back.drain(..whole.min(back.len()).min(buffer.len())));
            back.extend(&bytes[..count]);
        }
        Ok(hand_over(&mut at_host, buffer))
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}

/// At the usual rate of the link, and one that still carries a frame within the host's patience: several requests are on
/// their way, never more than a controller has room for, and none is sent twice.
#[test]
fn what_is_on_its_way_fits_the_controller() {
    for baud in [460_800.0, 115_200.0, 9600.0] {
        let (line, longest) = Serial::new(baud);
        let mut client = Controller::connect(Box::new(line), "sim", 1).unwrap();
        client.flash(&largest_table(), &mut |_| {}).unwrap();
        let longest = longest.load(Relaxed);
        assert!(
            (3 * MAX_FRAME..=IN_FLIGHT).contains(&longest),
            "{baud} baud: {longest}"
        );
        assert_eq!(client.repeats(), 0, "{baud} baud");
    }
}

/// A frame takes twice the host's patience, and everything is asked for too early.
#[test]
fn a_line_slower_than_patience_is_still_a_line() {
    let (line, _) = Serial::new(2400.0);
    let mut client = Controller::connect(Box::new(line), "sim", 1).unwrap();
    client.flash(&largest_table(), &mut |_| {}).unwrap();
    assert_eq!(
        client.verify(&largest_table()).unwrap(),
        Verdict::Same { slot: 0 }
    );
    assert!(client.repeats() > 0);
}
