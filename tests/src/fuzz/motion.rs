//! A controller that is driven: circles, programs, smooth streams that starve, stops, holds, faults, late ticks, silence,
//! declarations and resets, and of each of its set-points what [`Watch`](super::watch::Watch) asks.
use super::server::{Script, Talk, wait};
use super::watch::CENTRIPETAL_M_S2;
use giotto_shared::path::Segment;
use giotto_shared::wire::{
    Chunk, Command, ExactCircle, ExactSegment, MotionState, Reply, Status, Steps,
};
use giotto_shared::{Direction, Plane};

const TICK_S: f64 = 1.0 / super::bench::TICK_HZ as f64;

/// A smooth path for a stream, from rest: m at a time in s.
#[derive(Clone, Copy, Default)]
struct Source {
    begin_nm: [i32; 3],
    /// Swings by axis: rate, rad/s, and reach, m; or straight on, with the feed in m/s.
    swings: [(f64, f64); 3],
    straight: Option<[f64; 3]>,
    steps: Option<Steps>,
    sent: u32,
}

/// Largest acceleration of a source on an axis, m/s²: three of them are within the machine's.
const SOURCE_M_S2: f64 = 2.5;

impl Source {
    fn place_nm(&self, tick: u32) -> [i32; 3] {
        let t = f64::from(tick) * TICK_S;
        let way = |axis: usize| match self.straight {
            // With constant acceleration up to the feed.
            Some(feed) => {
                let rise = feed[axis].abs() / SOURCE_M_S2;
                let rising = t.min(rise);
                let way = 0.5 * SOURCE_M_S2 * rising * rising + feed[axis].abs() * (t - rising);
                way.copysign(feed[axis])
            }
            None => {
                let (rate, reach) = self.swings[axis];
                reach * (1.0 - (rate * t).cos())
            }
        };
        [0, 1, 2].map(|axis| self.begin_nm[axis].saturating_add((way(axis) * 1e9) as i32))
    }
}

/// A number from 0 to 1.
fn share(script: &mut Script<'_>) -> f64 {
    f64::from(script.byte().unwrap_or(77)) / 255.0
}

struct Drive {
    talk: Talk,
    source: Source,
}

impl Drive {
    fn ask(&mut self, command: Command) -> bool {
        self.talk.bench.watch().heard();
        matches!(self.talk.ask(command), Some(Reply::Done))
    }

    fn status(&mut self) -> Status {
        self.talk.bench.watch().heard();
        let status = self.talk.status().expect("it says how it is");
        // A fault ends what is open, and whatever slows down comes to rest in it.
        let over = matches!(status.motion, MotionState::Stopping | MotionState::Fault);
        assert!(
            status.fault.is_none() || over,
            "runs on in a fault: {status:?}"
        );
        status
    }

    /// Something new runs if it was accepted.
    fn run(&mut self, command: Command, circle: bool) -> bool {
        let accepted = self.ask(command);
        if accepted {
            let watch = self.talk.bench.watch();
            watch.stops(false);
            watch.circle = circle;
        }
        accepted
    }

    fn circle(&mut self, script: &mut Script<'_>, how: u8) {
        let radius_m = 0.01 + 0.3 * share(script);
        let fastest = (CENTRIPETAL_M_S2 * radius_m).sqrt().min(1.0);
        let mut centre = || ((share(script) - 0.5) * 1e9) as i32;
        let run = ExactCircle {
            centre_nm: [centre(), centre(), centre()],
            radius_half_nm: (radius_m * 2e9) as i32,
            feed_m_s: (0.98 * fastest * (0.1 + 0.9 * share(script))) as f32,
            plane: Plane::ALL[usize::from(how % 3)],
            direction: if how & 4 == 0 {
                Direction::Cw
            } else {
                Direction::Ccw
            },
            laps: if how == 15 { 10_000 } else { 1 },
            start: u32::from(how) << 28,
        };
        self.run(Command::RunCircle(run), true);
    }

    fn append(&mut self, script: &mut Script<'_>, how: u8) {
        let place_m = [0, 1, 2].map(|_| (share(script) - 0.5) * 0.8);
        let feed_m_s = 0.05 + 0.95 * share(script);
        let segment = match how % 4 {
            0 => Some(ExactSegment::Dwell {
                time_s: (0.2 * feed_m_s) as f32,
            }),
            1 | 2 => Some(ExactSegment::Line {
                to_nm: place_m.map(|m| (m * 1e9) as i32),
                feed_m_s: feed_m_s as f32,
            }),
            _ => {
                let here_nm = self.status().raw_nm;
                let here_m = here_nm.map(|nm| f64::from(nm) * 1e-9);
                let [x, y, _] = place_m.map(|m| 0.2 * m + 0.001);
                let arc = Segment::Arc {
                    centre_m: [here_m[0] + x, here_m[1] + y, here_m[2]],
                    normal: [0.0, 0.0, 1.0],
                    sweep_rad: 12.0 * (feed_m_s - 0.5),
                    rise_m: 0.05 * place_m[2],
                    feed_m_s,
                };
                arc.exact(here_nm).ok()
            }
        };
        if let Some(segment) = segment {
            self.ask(Command::Append {
                segment,
                tolerance_nm: 0,
            });
        }
    }

    fn begin_stream(&mut self, script: &mut Script<'_>, how: u8) {
        let begin_nm = self.status().raw_nm;
        let mut swing = || {
            let rate = 1.0 + 14.0 * share(script);
            let reach = (0.5 / rate).min(SOURCE_M_S2 / (rate * rate));
            (rate, reach * share(script))
        };
        let swings = [swing(), swing(), swing()];
        let outward = begin_nm.map(|nm| if nm < 0 { -0.9 } else { 0.9 });
        self.source = Source {
            begin_nm,
            swings,
            straight: match how {
                0..4 => Some([outward[0], 0.0, 0.0]),
                4..6 => Some([0.0, 0.3, outward[2]]),
                _ => None,
            },
            steps: None,
            sent: 0,
        };
        let ahead = 1 + u16::from(how) * 4;
        let feed_m_s = 1.0;
        if self.run(Command::BeginStream { feed_m_s, ahead }, false) {
            self.source.steps = Some(Steps::from(begin_nm));
        }
    }

    fn points(&mut self, script: &mut Script<'_>) {
        let Some(before) = self.source.steps else {
            return;
        };
        let fault = self.status().motion == MotionState::Fault;
        let (mut steps, mut bytes, mut sent) = (before, Chunk::new(), self.source.sent);
        for _ in 0..1 + (share(script) * 39.0) as u32 {
            if !steps.write(self.source.place_nm(sent), &mut bytes) {
                break;
            }
            sent += 1;
        }
        if self.ask(Command::Points { steps: bytes }) {
            assert!(!fault, "set-points are taken in a fault");
            (self.source.steps, self.source.sent) = (Some(steps), sent);
        }
    }

    fn clear(&mut self) {
        let state = self.status().motion;
        let cleared = self.ask(Command::ClearFault);
        let rests = matches!(state, MotionState::Fault | MotionState::Idle);
        assert_eq!(cleared, rests, "in {state:?}");
        self.talk.bench.ticks(2, false);
        let still = self.status();
        assert!(!rests || still.fault.is_none(), "{still:?}");
    }

    fn declare(&mut self, script: &mut Script<'_>, how: u8) {
        const NEAR_THE_END_NM: i32 = 2_000_000_000;
        let [x, y, z] = [0, 1, 2].map(|_| (4e8 * (share(script) - 0.5)) as i32);
        let place_nm = match how % 4 {
            0 => [NEAR_THE_END_NM + x / 4, y, -NEAR_THE_END_NM - z / 4],
            1 => [-NEAR_THE_END_NM, y, NEAR_THE_END_NM],
            _ => [x, y, z],
        };
        if self.ask(Command::Declare { place_nm }) {
            // From the next tick on.
            self.talk.bench.watch().elsewhere();
        }
    }

    fn feed(&mut self, how: u8) {
        match how {
            0..5 => drop(self.ask(Command::Pause)),
            5..11 => drop(self.ask(Command::Resume)),
            _ => drop(self.ask(Command::Override {
                percent: 10 + how * 8,
            })),
        }
    }

    fn table(&mut self, how: u8) {
        match how {
            0..4 => {
                let tables = super::table::tables();
                self.talk
                    .upload(&tables[usize::from(how) % tables.len()].clone());
                self.ask(Command::Commit);
                self.ask(Command::Confirm);
            }
            4..8 => drop(self.ask(Command::Bypass {
                on: how.is_multiple_of(2),
            })),
            8 => drop(self.ask(Command::Rollback)),
            _ => {}
        }
    }

    /// A stop is a stop whoever asks for it.
    fn stop(&mut self) {
        self.ask(Command::Stop);
        self.talk.bench.watch().stops(true);
    }

    /// A reset where the power stays: the machine stands where it stood.
    fn reset(mut self) -> Self {
        let rests = matches!(
            self.talk.bench.state(),
            MotionState::Idle | MotionState::Fault
        );
        if !rests {
            return self;
        }
        let mut talk = self.talk.reset();
        talk.bench.watch().restarted();
        let source = Source::default();
        Self { talk, source }
    }
}

/// Drives it and looks; how many requests and ticks that were.
pub fn drive(bytes: &[u8]) -> u64 {
    let mut script = Script(bytes);
    let mut talk = Talk::new(false);
    talk.bench.watched = true;
    let source = Source::default();
    let mut drive = Drive { talk, source };
    drive.ask(Command::Hello);
    while let Some(step) = script.byte() {
        let how = step / 16;
        match step % 16 {
            0 | 1 => {
                let ticks = wait(script.byte().unwrap_or(1));
                drive.talk.bench.ticks(ticks, false);
            }
            // As long as a dead host is.
            2 if how == 15 => drive.talk.bench.ticks(1600, false),
            2 => drive.talk.bench.ticks(1 + usize::from(how), how == 14),
            3 => drive.circle(&mut script, how),
            4 => drop(drive.run(Command::Begin, false)),
            5 => drive.append(&mut script, how),
            6 => drop(drive.ask(Command::End)),
            7 => drive.begin_stream(&mut script, how),
            8 | 9 => {
                drive.points(&mut script);
                drive.talk.bench.ticks(usize::from(how), false);
            }
            10 if how > 12 => drive.talk.bench.set_stop_input(how > 13),
            10 => drive.stop(),
            11 => drive.feed(how),
            12 => drive.clear(),
            13 => drive.declare(&mut script, how),
            14 => drive.table(how),
            _ if how > 10 => drive = drive.reset(),
            _ => drop(drive.status()),
        }
    }
    // Whatever is left runs out without its host.
    drive.talk.bench.ticks(1600, false);
    drive.talk.bench.watch().counted
}

/// Drives it and looks.
pub fn run(bytes: &[u8]) {
    drive(bytes);
}

/// A circle that is stopped, and one without its host; a program; a stream that starves, is cleared and goes on; one at the end of
/// the coordinates; a reset elsewhere.
pub fn seeds() -> Vec<Vec<u8>> {
    vec![
        vec![3 + 64, 90, 128, 128, 128, 200, 0, 200, 10, 0, 250, 12, 251],
        vec![14, 64 + 14, 243, 250, 128, 128, 128, 255, 0, 255, 242, 242],
        vec![
            4, 21, 20, 200, 128, 250, 53, 90, 90, 30, 200, 0, 255, 6, 0, 255, 251, 0, 100,
        ],
        vec![
            7 + 128,
            90,
            200,
            60,
            100,
            128,
            200,
            120,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 160,
            255,
            0,
            255,
            8,
            50,
            12,
            0,
            200,
            12,
            7 + 128,
            90,
            200,
            60,
            100,
            128,
            200,
            8,
            200,
            0,
            255,
        ],
        vec![
            13,
            128,
            128,
            128,
            2,
            7,
            1,
            1,
            1,
            1,
            1,
            1,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 240,
            255,
            8 + 240,
            255,
            0,
            255,
        ],
        vec![
            13 + 32,
            20,
            250,
            90,
            0,
            3,
            251,
            0,
            60,
            3,
            128,
            128,
            128,
            128,
            100,
            0,
            255,
            0,
            255,
            0,
            255,
            251,
            0,
            60,
        ],
    ]
}
