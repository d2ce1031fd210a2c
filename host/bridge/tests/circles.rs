//! 100,000 cycles of each door with 1 % loss, jitter and reordering, against a simulated robot, in virtual time.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may fail where it stands"
)]
mod robot;

use giotto_bridge::{Door, Kind, Mode, Motion, Path, Phase, Setup};
use robot::net::Net;
use robot::{Ballbar, INNER_S, Place, Program, SLEW_AND_OFFSET, Servos, bare, bytes, table_image};
use std::time::{Duration, Instant};

const CYCLES: u64 = 100_000;

/// What one run showed.
struct Shown {
    before: f64,
    after: f64,
    /// Datagrams that came within their cycle, and of those the ones answered.
    in_time: u64,
    answered: u64,
    /// Largest step of a correction, mm.
    step: f64,
    /// Of an answer: half are faster, and 999 of 1000, s.
    took_s: [f64; 2],
    door: Door,
}

impl Shown {
    fn reduction(&self) -> f64 {
        1.0 - self.after / self.before
    }

    fn print(&self, name: &str) {
        println!(
            "{name}: radius error {:.1} -> {:.2} um ({:.2} %), answered {} of {} ({:.3} %), largest step {:.4} mm, answers in {:.0} us, 999 of 1000 in {:.0} us, {:?}",
            1e3 * self.before,
            1e3 * self.after,
            -100.0 * self.reduction(),
            self.answered,
            self.in_time,
            100.0 * self.answered as f64 / self.in_time as f64,
            self.step,
            1e6 * self.took_s[0],
            1e6 * self.took_s[1],
            self.door.counters()
        );
    }
}

/// The robot's side of a door.
trait Side {
    /// The datagram of a cycle.
    fn say(&mut self, cycle: u64, planned: Place, measured: Place) -> Vec<u8>;
    /// An answer came; the cycle that it answers, if the robot can tell.
    fn hear(&mut self, cycle: u64, answer: &[u8]) -> Option<u64>;
    /// The cycle ends; what the servos are to follow now.
    fn command(&mut self, planned: Place, time_s: f64) -> Place;
    /// Largest step of a correction so far, mm.
    fn step(&self) -> f64;
}

/// Runs a robot against a door for so many cycles; `late_s`: how late its path is.
fn run(mut side: impl Side, setup: Setup, program: &Program, seed: u64, late_s: f64) -> Shown {
    let cycle_s = setup.cycle_ms * 1e-3;
    let mut door = Door::new(setup).unwrap();
    let (mut there, mut back) = (Net::new(seed, cycle_s), Net::new(seed + 1, cycle_s));
    let (mut servos, mut ballbar) = (Servos::new([0.0; 3]), Ballbar::default());
    let (mut place, mut in_time, mut answered, mut times) = ([0.0; 3], 0, 0, Vec::new());
    let inner = (cycle_s / INNER_S).round() as u64;
    for cycle in 0..CYCLES {
        let now_s = cycle as f64 * cycle_s;
        let said = side.say(cycle, program.at(now_s), place);
        there.send(now_s, said.clone());
        for (at_s, datagram) in there.arrived(now_s + cycle_s) {
            let begun = Instant::now();
            let replies = door.answer(&datagram, Duration::from_secs_f64(at_s));
            times.push(begun.elapsed().as_secs_f64());
            // The newest datagram is this cycle's, if it came.
            let newest = replies.last().and_then(|reply| side.hear(cycle, reply));
            let current = datagram == said;
            in_time += u64::from(current);
            answered += u64::from(current && newest == Some(cycle));
            for reply in replies {
                back.send(at_s, reply);
            }
        }
        for (_, answer) in back.arrived(now_s + cycle_s) {
            side.hear(u64::MAX, &answer);
        }
        for step in 0..inner {
            let time_s = now_s + step as f64 * INNER_S;
            place = servos.step(side.command(program.at(time_s), time_s));
            ballbar.see(program, time_s - late_s, place);
        }
        // The first datagrams may be lost.
        assert!(
            cycle < 5 || *door.phase() == Phase::Guiding,
            "cycle {cycle}: {door:?}"
        );
    }
    Shown {
        before: bare(program),
        after: ballbar.error(),
        in_time,
        answered,
        step: side.step(),
        took_s: took(times),
        door,
    }
}

fn took(mut times: Vec<f64>) -> [f64; 2] {
    times.sort_unstable_by(f64::total_cmp);
    [times[times.len() / 2], times[times.len() * 999 / 1000]]
}

fn far(a: Place, b: Place) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

fn check(shown: &Shown, name: &str, bar: f64) {
    shown.print(name);
    assert!(shown.in_time as f64 > 0.98 * CYCLES as f64);
    // On whatever computer, next to other tests.
    assert!(shown.took_s[0] < 200e-6, "{:?}", shown.took_s);
    assert!(shown.answered as f64 >= 0.999 * shown.in_time as f64);
    assert!(shown.reduction() >= bar, "{}", shown.reduction());
    let counters = shown.door.counters();
    assert!(counters.lost > 800 && counters.lost < 1300, "{counters:?}");
    assert!(
        counters.reordered > 200 && counters.malformed == 0,
        "{counters:?}"
    );
}

/// KUKA: an answer with the IPOC of its cycle acts from the next on; others count as late.
struct Kuka {
    first: u64,
    step_ms: u64,
    relative: bool,
    sent: std::collections::HashMap<u64, Vec<u8>>,
    ipoc: u64,
    next: Option<Place>,
    total: Place,
    last_total: Place,
    late: u64,
    biggest: f64,
    cycle: u64,
}

impl Kuka {
    fn new(step_ms: u64, relative: bool) -> Self {
        Self {
            first: 4_208_163_634,
            step_ms,
            relative,
            sent: Default::default(),
            ipoc: 0,
            next: None,
            total: [0.0; 3],
            last_total: [0.0; 3],
            late: 0,
            biggest: 0.0,
            cycle: u64::MAX,
        }
    }
}

impl Side for Kuka {
    fn say(&mut self, cycle: u64, planned: Place, measured: Place) -> Vec<u8> {
        if cycle != self.cycle {
            // The cycle before has ended.
            let begun = self.cycle != u64::MAX;
            self.cycle = cycle;
            match self.next.take() {
                Some(korr) if self.relative => {
                    for (total, korr) in self.total.iter_mut().zip(korr) {
                        *total += korr;
                    }
                }
                Some(korr) => self.total = korr,
                None => self.late += u64::from(begun),
            }
            self.biggest = self.biggest.max(far(self.total, self.last_total));
            self.last_total = self.total;
            self.ipoc = self.first + cycle * self.step_ms;
        }
        bytes::rob(&self.ipoc.to_string(), measured, planned, self.late)
    }

    fn hear(&mut self, cycle: u64, answer: &[u8]) -> Option<u64> {
        let (ipoc, korr) = bytes::sen(answer);
        let ipoc: u64 = ipoc.parse().unwrap();
        // Never one that was not sent, never two different answers to one.
        assert!(ipoc <= self.ipoc && (ipoc - self.first).is_multiple_of(self.step_ms));
        if cycle != u64::MAX {
            let before = self.sent.insert(ipoc, answer.to_vec());
            assert!(before.is_none(), "IPOC {ipoc} was answered twice");
        } else if ipoc == self.ipoc {
            self.next = Some(korr);
        }
        Some((ipoc - self.first) / self.step_ms)
    }

    fn command(&mut self, planned: Place, _: f64) -> Place {
        // What came in this cycle acts from the next one on.
        let mut command = planned;
        for (command, total) in command.iter_mut().zip(self.total) {
            *command += total;
        }
        command
    }

    fn step(&self) -> f64 {
        self.biggest
    }
}

#[test]
fn rsi_at_4_ms_absolute() {
    let program = Program::lasting(395.0, 3.0);
    let setup = Setup::new(Kind::Rsi, table_image());
    let shown = run(Kuka::new(4, false), setup, &program, 11, 0.0);
    check(&shown, "rsi 4 ms absolute", 0.95);
    // A lost answer holds the last: two steps come at once when the next is heard.
    assert!(shown.step <= 2.0 * SLEW_AND_OFFSET[0], "{}", shown.step);
    assert!(shown.door.missed().unwrap() > 500);
}

#[test]
fn rsi_at_12_ms_relative() {
    let program = Program::lasting(1190.0, 3.0);
    let mut setup = Setup::new(Kind::Rsi, table_image());
    (setup.cycle_ms, setup.dead_time_ms, setup.mode) = (12.0, 12.0, Mode::Relative);
    let shown = run(Kuka::new(12, true), setup, &program, 12, 0.0);
    check(&shown, "rsi 12 ms relative", 0.95);
}

/// ABB under position guidance: follows what it is told, in a straight line from one answer to the next.
struct Abb {
    plans: bool,
    from: Place,
    to: Place,
    cycle: u64,
    cycle_s: f64,
    sensor: Option<u32>,
    heard: u64,
    biggest: f64,
    last: Option<Place>,
}

impl Abb {
    fn new(plans: bool) -> Self {
        Self {
            plans,
            from: [0.0; 3],
            to: [0.0; 3],
            cycle: 0,
            cycle_s: 4e-3,
            sensor: None,
            heard: 0,
            biggest: 0.0,
            last: None,
        }
    }
}

impl Side for Abb {
    fn say(&mut self, cycle: u64, planned: Place, measured: Place) -> Vec<u8> {
        self.cycle = cycle;
        let planned = if self.plans { planned } else { self.to };
        let seqno = (cycle as u32).wrapping_add(u32::MAX - 1000);
        bytes::egm_robot(
            seqno,
            cycle as u32 * 4,
            measured,
            Some(planned),
            bytes::ABB_RUNS,
        )
    }

    fn hear(&mut self, cycle: u64, answer: &[u8]) -> Option<u64> {
        let (seqno, place) = bytes::egm_sensor(answer);
        if cycle != u64::MAX {
            // What is sent counts up by one, whatever is lost.
            assert_eq!(seqno, self.sensor.map_or(0, |last| last + 1));
            self.sensor = Some(seqno);
            if let Some(last) = self.last {
                self.biggest = self.biggest.max(far(place, last));
            }
            self.last = Some(place);
            return Some(cycle);
        }
        if u64::from(seqno) >= self.heard {
            self.heard = u64::from(seqno);
            (self.from, self.to) = (self.to, place);
        }
        None
    }

    fn command(&mut self, _: Place, time_s: f64) -> Place {
        let share = ((time_s - self.cycle as f64 * self.cycle_s) / self.cycle_s).clamp(0.0, 1.0);
        let mut command = self.from;
        for (command, to) in command.iter_mut().zip(self.to) {
            *command += share * (to - *command);
        }
        if share >= 0.99 - INNER_S / self.cycle_s {
            self.from = self.to;
        }
        command
    }

    fn step(&self) -> f64 {
        self.biggest
    }
}

#[test]
fn egm_follows_what_the_robot_plans() {
    let program = Program::lasting(395.0, 3.0);
    let setup = Setup::new(Kind::Egm, table_image());
    let late_s = Door::new(setup.clone()).unwrap().latency_s();
    let shown = run(Abb::new(true), setup, &program, 13, late_s);
    check(&shown, "egm, the robot's path", 0.95);
    // 300 mm/s over at most a few lost cycles, and the correction's own.
    assert!(
        shown.step < 6.0 * (0.3 + SLEW_AND_OFFSET[0]) * 4.0,
        "{}",
        shown.step
    );
}

/// The program begins when the robot has come to its first row and the engine rests there: 1 s, and the ramp's half.
fn ours(kind: Kind, seconds: f64) -> (Program, Setup) {
    let program = Program::lasting(seconds, 3.0);
    let mut setup = Setup::new(kind, table_image());
    setup.path = Some(Path::read(&program.csv(2e-3)).unwrap());
    setup.motion = Motion {
        speed_mm_s: 320.0,
        acceleration_mm_s2: 1500.0,
        jerk_mm_s3: 20_000.0,
    };
    (program, setup)
}

#[test]
fn egm_follows_a_path_of_ours() {
    // 1 % of the cycles pass without an answer, and the path waits for them: it is slower by as much.
    let (program, setup) = ours(Kind::Egm, 380.0);
    let step = setup.motion.speed_mm_s * 4e-3;
    let shown = free(Abb::new(false), setup, &program, 14);
    shown.print("egm, our path");
    assert!(shown.reduction() >= 0.95, "{}", shown.reduction());
    assert!(shown.answered as f64 >= 0.999 * shown.in_time as f64);
    assert!(shown.step <= step, "{}", shown.step);
    assert_eq!(shown.door.counters().limited, 0);
}

/// FANUC: wants each number once, in order, within its limits.
struct Fanuc {
    first: u32,
    buffer: std::collections::BTreeMap<u32, Place>,
    now: Place,
    from: Place,
    cycle: u64,
}

impl Side for Fanuc {
    fn say(&mut self, cycle: u64, _: Place, measured: Place) -> Vec<u8> {
        if cycle != self.cycle {
            self.cycle = cycle;
            self.from = self.now;
            // Eight cycles of commands are kept before they act, so that one that was lost can be made up for.
            let due = self.first.wrapping_add((cycle as u32).wrapping_sub(8));
            if let Some(place) = self.buffer.remove(&due) {
                self.now = place;
            }
        }
        let seq = self.first.wrapping_add(cycle as u32);
        bytes::status(seq, 0b0101, cycle as u32 * 8, measured)
    }

    fn hear(&mut self, cycle: u64, answer: &[u8]) -> Option<u64> {
        let (seq, _, place) = bytes::command(answer);
        if cycle == u64::MAX {
            self.buffer.insert(seq, place);
        }
        Some(u64::from(seq.wrapping_sub(self.first)))
    }

    fn command(&mut self, _: Place, time_s: f64) -> Place {
        let share = ((time_s - self.cycle as f64 * 8e-3) / 8e-3).clamp(0.0, 1.0);
        let mut command = self.from;
        for (command, to) in command.iter_mut().zip(self.now) {
            *command += share * (to - *command);
        }
        command
    }

    fn step(&self) -> f64 {
        0.0
    }
}

/// As [`run`], for a path whose time is the door's: circles are recognised by their place.
fn free(mut side: impl Side, setup: Setup, program: &Program, seed: u64) -> Shown {
    let cycle_s = setup.cycle_ms * 1e-3;
    let mut door = Door::new(setup).unwrap();
    let (mut there, mut back) = (Net::new(seed, cycle_s), Net::new(seed + 1, cycle_s));
    let mut servos = Servos::new([0.0; 3]);
    let (mut place, mut in_time, mut answered, mut times) = ([0.0; 3], 0, 0, Vec::new());
    let inner = (cycle_s / INNER_S).round() as u64;
    let mut track = Vec::new();
    for cycle in 0..CYCLES {
        let now_s = cycle as f64 * cycle_s;
        let said = side.say(cycle, [0.0; 3], place);
        there.send(now_s, said.clone());
        for (at_s, datagram) in there.arrived(now_s + cycle_s) {
            let begun = Instant::now();
            let replies = door.answer(&datagram, Duration::from_secs_f64(at_s));
            times.push(begun.elapsed().as_secs_f64());
            let (current, mut newest) = (datagram == said, None);
            for reply in replies {
                newest = side.hear(cycle, &reply);
                back.send(at_s, reply);
            }
            in_time += u64::from(current);
            answered += u64::from(current && newest == Some(cycle));
        }
        for (_, answer) in back.arrived(now_s + cycle_s) {
            side.hear(u64::MAX, &answer);
        }
        for step in 0..inner {
            place = servos.step(side.command([0.0; 3], now_s + step as f64 * INNER_S));
            track.push(place);
        }
        if *door.phase() != Phase::Guiding {
            assert_eq!(*door.phase(), Phase::Ended, "cycle {cycle}");
            break;
        }
    }
    Shown {
        before: bare(program),
        after: by_place(program, &track),
        in_time,
        answered,
        step: side.step(),
        took_s: took(times),
        door,
    }
}

/// Radius errors of circles found one after the other: each begins and ends with a rest at the origin.
fn by_place(program: &Program, track: &[Place]) -> f64 {
    let mut at = 0;
    let mut errors = Vec::new();
    for circle in &program.0 {
        let away = |place: &Place| place[0].abs() > 1.0;
        let Some(start) = track[at..].iter().position(away) else {
            break;
        };
        let start = at + start;
        let span =
            (std::f64::consts::TAU * circle.radius * circle.laps / circle.feed / INNER_S) as usize;
        // The steady middle: well behind the rise and before the fall, whole laps or not.
        let (from, to) = (start + span / 4, start + 3 * span / 4);
        if to + span / 2 >= track.len() {
            break;
        }
        let [cx, cy, _] = circle.centre();
        let radii = track[from..to].iter().map(|p| (p[0] - cx).hypot(p[1] - cy));
        errors.push(radii.sum::<f64>() / (to - from) as f64 - circle.radius);
        let rest = track[to..].windows(400).position(|w| {
            let [first, .., last] = w else { return false };
            far(*first, [0.0; 3]) < 0.5 && far(*first, *last) < 1e-4
        });
        let Some(rest) = rest else { break };
        at = to + rest;
    }
    assert!(errors.len() >= 5, "{} circles", errors.len());
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn j519_gets_each_number_once_and_keeps_its_limits() {
    let (program, setup) = ours(Kind::J519, 780.0);
    let motion = setup.motion;
    let side = Fanuc {
        first: u32::MAX - 500,
        buffer: Default::default(),
        now: [0.0; 3],
        from: [0.0; 3],
        cycle: u64::MAX,
    };
    let sent = std::rc::Rc::new(std::cell::RefCell::new(Vec::new()));
    let shown = free(
        Watched {
            side,
            sent: sent.clone(),
        },
        setup,
        &program,
        15,
    );
    shown.print("j519, our path");
    assert!(shown.reduction() >= 0.95, "{}", shown.reduction());
    assert!(shown.answered as f64 >= 0.999 * shown.in_time as f64);
    let sent = sent.borrow();
    assert!(sent.len() > 90_000);
    let mut most = [0.0f64; 3];
    for four in sent.windows(4) {
        let [(n0, a), (n1, b), (n2, c), (n3, d)] = four else {
            panic!()
        };
        assert_eq!(
            [
                n1.wrapping_sub(*n0),
                n2.wrapping_sub(*n1),
                n3.wrapping_sub(*n2)
            ],
            [1; 3]
        );
        let norm = |w: [f64; 4], power: i32| {
            (0..3)
                .map(|k| (w[0] * a[k] + w[1] * b[k] + w[2] * c[k] + w[3] * d[k]).powi(2))
                .sum::<f64>()
                .sqrt()
                / 8e-3f64.powi(power)
        };
        most[0] = most[0].max(norm([0.0, 0.0, -1.0, 1.0], 1));
        most[1] = most[1].max(norm([0.0, 1.0, -2.0, 1.0], 2));
        most[2] = most[2].max(norm([-1.0, 3.0, -3.0, 1.0], 3));
    }
    println!("j519: speed, acceleration, jerk {most:.0?}");
    assert!(
        most[0] <= motion.speed_mm_s && most[1] <= motion.acceleration_mm_s2,
        "{most:?}"
    );
    assert!(most[2] <= motion.jerk_mm_s3, "{most:?}");
}

/// Keeps every command in the order of sending.
struct Watched {
    side: Fanuc,
    sent: std::rc::Rc<std::cell::RefCell<Vec<(u32, Place)>>>,
}

impl Side for Watched {
    fn say(&mut self, cycle: u64, planned: Place, measured: Place) -> Vec<u8> {
        self.side.say(cycle, planned, measured)
    }

    fn hear(&mut self, cycle: u64, answer: &[u8]) -> Option<u64> {
        if cycle != u64::MAX {
            let (seq, _, place) = bytes::command(answer);
            self.sent.borrow_mut().push((seq, place));
        }
        self.side.hear(cycle, answer)
    }

    fn command(&mut self, planned: Place, time_s: f64) -> Place {
        self.side.command(planned, time_s)
    }

    fn step(&self) -> f64 {
        0.0
    }
}

/// ABB on a path of its own, corrected across it.
struct AbbPath {
    program: Program,
    cycle: u64,
    sensor: Option<u32>,
    heard: u32,
    corr: f64,
    up: f64,
    now: [f64; 2],
    biggest: f64,
    last: Option<f64>,
}

impl Side for AbbPath {
    fn say(&mut self, cycle: u64, planned: Place, measured: Place) -> Vec<u8> {
        if cycle != self.cycle {
            self.cycle = cycle;
            self.now = [self.corr, self.up];
        }
        bytes::egm_robot(
            cycle as u32,
            cycle as u32 * 48,
            measured,
            Some(planned),
            bytes::ABB_RUNS,
        )
    }

    fn hear(&mut self, cycle: u64, answer: &[u8]) -> Option<u64> {
        let (seqno, [along, across, up]) = bytes::egm_path_corr(answer);
        assert_eq!(along, 0.0);
        if cycle != u64::MAX {
            assert_eq!(seqno, self.sensor.map_or(0, |last| last + 1));
            self.sensor = Some(seqno);
            if let Some(last) = self.last {
                self.biggest = self.biggest.max((across - last).abs());
            }
            self.last = Some(across);
            return Some(cycle);
        }
        if seqno >= self.heard {
            (self.heard, self.corr, self.up) = (seqno, across, up);
        }
        None
    }

    fn command(&mut self, planned: Place, time_s: f64) -> Place {
        let (a, b) = (
            self.program.at(time_s - 1e-4),
            self.program.at(time_s + 1e-4),
        );
        let (tx, ty) = (b[0] - a[0], b[1] - a[1]);
        let length = tx.hypot(ty);
        if length == 0.0 {
            return planned;
        }
        // The tool points down: across is to the right of the path.
        let [x, y, z] = planned;
        let [across, up] = self.now;
        [x + across * ty / length, y - across * tx / length, z - up]
    }

    fn step(&self) -> f64 {
        self.biggest
    }
}

#[test]
fn egm_path_corrects_across_the_path() {
    // 48 ms a cycle: long circles, so that what is steady outweighs what begins and ends.
    let program = Program::lasting(4795.0, 8.0);
    let side = AbbPath {
        program: Program(program.0.clone()),
        cycle: u64::MAX,
        sensor: None,
        heard: 0,
        corr: 0.0,
        up: 0.0,
        now: [0.0; 2],
        biggest: 0.0,
        last: None,
    };
    let setup = Setup::new(Kind::EgmPath, table_image());
    let shown = run(side, setup, &program, 16, 0.0);
    check(&shown, "egm-path", 0.90);
    assert!(
        shown.step <= SLEW_AND_OFFSET[0] * 48.0 + 1e-9,
        "{}",
        shown.step
    );
}
