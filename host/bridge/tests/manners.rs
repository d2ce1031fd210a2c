//! What a door refuses, holds and lets go.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may fail where it stands"
)]
mod robot;

use giotto_bridge::{Door, Kind, Mode, Motion, Path, Phase, Setup, SetupError};
use robot::bytes::{self, ABB_RUNS, AbbState};
use robot::{Place, SLEW_AND_OFFSET, table_image, table_with};
use std::time::Duration;

fn door(kind: Kind) -> Door {
    Door::new(Setup::new(kind, table_image())).unwrap()
}

fn at(cycle: u32) -> Duration {
    Duration::from_millis(u64::from(cycle) * 4)
}

/// A circle of 50 mm at 200 mm/s from rest, about the robot's own origin.
fn circle(cycle: u32) -> Place {
    let t = f64::from(cycle) * 4e-3;
    let angle = if t < 1.0 { 2.0 * t * t } else { 4.0 * t - 2.0 };
    [50.0 * (angle.cos() - 1.0), 50.0 * angle.sin(), 0.0]
}

fn words(door: &Door) -> String {
    match door.phase() {
        Phase::Refused(words) => words.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_robot_that_is_not_ready_is_waited_for_and_then_refused_with_words() {
    for (state, expected) in [
        (AbbState(2, 3, 2), "motors are off"),
        (AbbState(1, 2, 2), "EGMRunPose or EGMMoveL has not begun"),
        (AbbState(1, 1, 2), "MCI_ERROR"),
        (AbbState(1, 3, 1), "RAPID program does not run"),
    ] {
        let mut door = door(Kind::Egm);
        for cycle in 0..100 {
            let said = bytes::egm_robot(cycle, cycle * 4, [0.0; 3], Some([0.0; 3]), state);
            assert!(door.answer(&said, at(cycle)).is_empty());
        }
        let Phase::Waiting(Some(why)) = door.phase() else {
            panic!()
        };
        assert!(why.contains(expected), "{why}");
        door.silence(Duration::from_secs(61));
        assert!(words(&door).contains(expected));
        assert!(
            door.answer(
                &bytes::egm_robot(200, 800, [0.0; 3], Some([0.0; 3]), ABB_RUNS),
                at(200)
            )
            .is_empty()
        );
    }
}

#[test]
fn a_robot_that_goes_out_of_its_state_is_left_at_once() {
    let mut door = door(Kind::Egm);
    for cycle in 0..500 {
        let place = circle(cycle);
        let said = bytes::egm_robot(cycle, cycle * 4, place, Some(place), ABB_RUNS);
        assert_eq!(door.answer(&said, at(cycle)).len(), 1);
    }
    let off = bytes::egm_robot(500, 2000, circle(500), Some(circle(500)), AbbState(2, 2, 1));
    assert!(door.answer(&off, at(500)).is_empty());
    assert!(words(&door).contains("motors are off"));
}

#[test]
fn another_sender_is_refused_at_its_first_message() {
    for (kind, expected) in [
        (Kind::Egm, "no EgmRobot"),
        (Kind::EgmPath, "no EgmRobot"),
        (Kind::Rsi, "no RSI telegram"),
        (Kind::J519, "no status"),
    ] {
        let mut door = door(kind);
        assert!(door.answer(b"\xff\xffGET / HTTP/1.1", at(0)).is_empty());
        assert!(words(&door).contains(expected), "{door:?}");
    }
    // Later one such message is nothing, a hundred in a row are.
    let mut door = door(Kind::Rsi);
    assert_eq!(
        door.answer(&bytes::rob("1000", [0.0; 3], [0.0; 3], 0), at(0))
            .len(),
        1
    );
    for _ in 0..99 {
        assert!(door.answer(b"<Rob", at(1)).is_empty());
    }
    assert_eq!(*door.phase(), Phase::Guiding);
    assert_eq!(
        door.answer(&bytes::rob("1004", [0.0; 3], [0.0; 3], 0), at(1))
            .len(),
        1
    );
    for _ in 0..100 {
        door.answer(b"<Rob", at(2));
    }
    assert!(words(&door).contains("no RSI telegram"));
    assert_eq!(door.counters().malformed, 199);
}

#[test]
fn another_cycle_another_unit_and_no_path_are_noticed() {
    // RSI counts milliseconds.
    let mut rsi = door(Kind::Rsi);
    rsi.answer(&bytes::rob("1000", [0.0; 3], [0.0; 3], 0), at(0));
    rsi.answer(&bytes::rob("1006", [0.0; 3], [0.0; 3], 0), at(1));
    assert!(words(&rsi).contains("grew by 6"));
    // EGM has a clock.
    let mut egm = door(Kind::Egm);
    for cycle in 0..30 {
        egm.answer(
            &bytes::egm_robot(cycle, cycle * 24, [0.0; 3], Some([0.0; 3]), ABB_RUNS),
            at(cycle),
        );
    }
    assert!(words(&egm).contains("cycle is 24 ms"));
    // Metres where millimetres are meant.
    let mut metres = door(Kind::Egm);
    metres.answer(
        &bytes::egm_robot(0, 0, [800.0, 0.0, 600.0], Some([0.8, 0.0, 0.6]), ABB_RUNS),
        at(0),
    );
    assert!(words(&metres).contains("another unit"));
    let mut alone = door(Kind::Egm);
    alone.answer(&bytes::egm_robot(0, 0, [0.0; 3], None, ABB_RUNS), at(0));
    assert!(words(&alone).contains("--path FILE"));
}

/// A robot under position guidance plans what it is told: a correction would be added to itself for ever.
#[test]
fn a_robot_that_plans_what_it_is_told_is_noticed() {
    let mut door = door(Kind::Egm);
    let mut told = circle(0);
    for cycle in 0..2000 {
        // It moves on its own until the correction acts, then follows.
        let planned = if cycle < 400 { circle(cycle) } else { told };
        let replies = door.answer(
            &bytes::egm_robot(cycle, cycle * 4, planned, Some(planned), ABB_RUNS),
            at(cycle),
        );
        match replies.first() {
            Some(reply) => told = bytes::egm_sensor(reply).1,
            None => break,
        }
    }
    assert!(words(&door).contains("plans what it is told"));
}

/// RSI: where an answer was, and how far it is from the one before.
fn rsi_session(
    setup: Setup,
    gaps: &[std::ops::Range<u32>],
    leave: u32,
    until: u32,
) -> (Door, Vec<(u32, Place)>) {
    let mut door = Door::new(setup).unwrap();
    let mut answers = Vec::new();
    for cycle in 0..until {
        if gaps.iter().any(|gap| gap.contains(&cycle)) {
            door.silence(at(cycle));
            continue;
        }
        if cycle == leave {
            door.leave(at(cycle));
        }
        let place = circle(cycle);
        let said = bytes::rob(&(50_000 + 4 * cycle).to_string(), place, place, 0);
        for reply in door.answer(&said, at(cycle)) {
            let (ipoc, korr) = bytes::sen(&reply);
            assert_eq!(ipoc, (50_000 + 4 * cycle).to_string());
            answers.push((cycle, korr));
        }
    }
    (door, answers)
}

fn biggest_step(answers: &[(u32, Place)]) -> f64 {
    answers
        .windows(2)
        .flat_map(|two| (0..3).map(|k| (two[1].1[k] - two[0].1[k]).abs()))
        .fold(0.0, f64::max)
}

fn size(place: Place) -> f64 {
    place.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[test]
fn a_long_loss_is_held_then_ramped_out_and_begun_anew_without_a_step() {
    // 60 ms are bridged; 400 ms are not.
    let (door, answers) = rsi_session(
        Setup::new(Kind::Rsi, table_image()),
        &[800..815, 1200..1300],
        u32::MAX,
        2500,
    );
    assert!(
        biggest_step(&answers) <= SLEW_AND_OFFSET[0] * 4.0 + 1.1e-4,
        "{}",
        biggest_step(&answers)
    );
    let when = |cycle: u32| answers.iter().find(|(c, _)| *c >= cycle).unwrap().1;
    let steady = size(when(1199));
    assert!(steady > 0.2, "{steady}");
    assert!((size(when(815)) - steady).abs() < 0.02 * steady, "bridged");
    // What was held is what comes first, then it goes, then the correction is there again.
    let held = when(1300);
    for (held, before) in held.iter().zip(when(1199)) {
        assert!((held - before).abs() < 0.01, "{held} {before}");
    }
    let least = answers
        .iter()
        .filter(|(c, _)| (1300..1500).contains(c))
        .map(|(_, k)| size(*k));
    assert!(least.fold(f64::INFINITY, f64::min) < 0.6 * steady);
    assert!((size(when(2400)) - steady).abs() < 0.02 * steady);
    assert_eq!((door.counters().lost, door.counters().held), (115, 115));
}

#[test]
fn engaging_and_leaving_are_ramps_and_leave_nothing() {
    for mode in [Mode::Absolute, Mode::Relative] {
        let mut setup = Setup::new(Kind::Rsi, table_image());
        setup.mode = mode;
        let (door, mut answers) = rsi_session(setup, &[], 1500, 2500);
        assert_eq!(*door.phase(), Phase::Ended);
        if mode == Mode::Relative {
            let mut sum = [0.0; 3];
            for (_, korr) in &mut answers {
                for (sum, korr) in sum.iter_mut().zip(korr.iter_mut()) {
                    *sum += *korr;
                    *korr = *sum;
                }
            }
        }
        let (first, last) = (answers[0], answers[answers.len() - 1]);
        assert_eq!(first.1, [0.0; 3]);
        assert!(
            size(last.1) < 1e-9 && (1600..1700).contains(&last.0),
            "{last:?}"
        );
        assert!(answers.iter().any(|(_, korr)| size(*korr) > 0.2));
        // In half a second from 0.21 mm: 1.9 times the mean of 1.7 µm a cycle, and the circle's own turn.
        assert!(biggest_step(&answers) < 0.02, "{}", biggest_step(&answers));
    }
}

/// The table's rate is that from one answer to the next, also where ten cycles lie between them.
#[test]
fn the_tables_rate_holds_over_gaps() {
    // The circle asks for 0.85 mm/s.
    let setup = Setup::new(Kind::Rsi, table_with([0.9e-3, 0.004]));
    let gaps: Vec<_> = (0..15).map(|k| 600 + 50 * k..610 + 50 * k).collect();
    let (door, answers) = rsi_session(setup, &gaps, u32::MAX, 1500);
    let most = biggest_step(&answers);
    assert!(most <= 0.9 * 4e-3 + 1.1e-4 && most > 3.4e-3, "{most}");
    assert!(door.counters().limited > 50, "{door:?}");
}

#[test]
fn the_doors_own_limit_holds() {
    let mut setup = Setup::new(Kind::Rsi, table_image());
    setup.limit_mm = 0.2;
    let (door, answers) = rsi_session(setup, &[], u32::MAX, 2000);
    let most = answers
        .iter()
        .flat_map(|(_, k)| k.map(f64::abs))
        .fold(0.0, f64::max);
    assert!(most <= 0.2 && most > 0.199, "{most}");
    assert!(door.counters().limited > 500);
}

#[test]
fn a_planned_place_that_holds_the_correction_is_taken_without_it() {
    let mut setup = Setup::new(Kind::Rsi, table_image());
    let (_, plain) = rsi_session(setup.clone(), &[], u32::MAX, 1500);
    setup.planned_is_corrected = true;
    let mut door = Door::new(setup).unwrap();
    let mut korr = [0.0; 3];
    for cycle in 0..1500 {
        let mut place = circle(cycle);
        for (place, korr) in place.iter_mut().zip(korr) {
            *place += korr;
        }
        let said = bytes::rob(&(4 * cycle).to_string(), place, place, 0);
        korr = bytes::sen(&door.answer(&said, at(cycle))[0]).1;
    }
    for (a, b) in korr.iter().zip(plain.last().unwrap().1) {
        assert!((a - b).abs() < 1e-3, "{a} {b}");
    }
}

fn line(feed: f64) -> Path {
    let mut text = String::from("time_s,x_mm,y_mm\n");
    for row in 0..2000 {
        let t = f64::from(row) * 2e-3;
        let s = (t / 3.0).min(1.0);
        let share = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        text += &format!("{t:.4},{:.6},{}\n", 100.0 + feed * share, 20.0);
    }
    Path::read(&text).unwrap()
}

/// A path of ours until `leave`, on a robot that stands at `start`.
fn fanuc_session(setup: Setup, start: Place, leave: u32) -> (Door, Vec<(u32, bool, Place)>) {
    let mut door = Door::new(setup).unwrap();
    assert_eq!(door.greeting(), [[0, 0, 0, 0, 0, 0, 0, 1]]);
    let (mut commands, mut place) = (Vec::new(), start);
    for cycle in 0..2000 {
        let now = Duration::from_millis(u64::from(cycle) * 8);
        if cycle == leave {
            door.leave(now);
        }
        for reply in door.answer(&bytes::status(cycle, 0b101, cycle * 8, place), now) {
            commands.push(bytes::command(&reply));
            place = commands[commands.len() - 1].2;
        }
    }
    (door, commands)
}

#[test]
fn a_path_of_ours_begins_at_the_robots_own_place_and_ends_with_the_last_command() {
    let mut setup = Setup::new(Kind::J519, table_image());
    setup.path = Some(line(150.0));
    let (door, commands) = fanuc_session(setup.clone(), [100.9, 19.2, 0.5], u32::MAX);
    assert_eq!(*door.phase(), Phase::Ended);
    let (first, last) = (commands[0], commands[commands.len() - 1]);
    assert!(
        size([first.2[0] - 100.9, first.2[1] - 19.2, first.2[2] - 0.5]) < 1e-3,
        "{first:?}"
    );
    assert!(
        last.1 && size([last.2[0] - 250.0, last.2[1] - 20.0, last.2[2]]) < 1e-3,
        "{last:?}"
    );
    assert_eq!(commands.iter().filter(|command| command.1).count(), 1);
    // Left half-way it comes to rest on the line.
    let (door, commands) = fanuc_session(setup.clone(), [100.0, 20.0, 0.0], 300);
    assert_eq!(*door.phase(), Phase::Ended);
    let last = commands[commands.len() - 1];
    assert!(
        last.1 && last.2[0] > 150.0 && last.2[0] < 240.0 && (last.2[1] - 20.0).abs() < 1e-3,
        "{last:?}"
    );
    // Without a path it holds.
    setup.path = None;
    let (_, commands) = fanuc_session(setup.clone(), [7.0, 8.0, 9.0], 500);
    assert!(commands.iter().all(|command| command.2 == [7.0, 8.0, 9.0]));
    assert!(commands.len() > 400 && commands[commands.len() - 1].1);
    // Elsewhere it does not begin at all.
    setup.path = Some(line(150.0));
    let (door, commands) = fanuc_session(setup, [90.0, 20.0, 0.0], u32::MAX);
    assert!(commands.is_empty() && words(&door).contains("10.0 mm from the first row"));
}

#[test]
fn a_path_that_asks_for_more_than_the_robot_gives_is_refused_before_anything_moves() {
    for (motion, expected) in [
        (
            Motion {
                speed_mm_s: 50.0,
                ..Motion::default()
            },
            "speed",
        ),
        (
            Motion {
                acceleration_mm_s2: 30.0,
                ..Motion::default()
            },
            "acceleration",
        ),
        (
            Motion {
                jerk_mm_s3: 100.0,
                ..Motion::default()
            },
            "jerk",
        ),
    ] {
        let mut setup = Setup::new(Kind::J519, table_image());
        (setup.path, setup.motion) = (Some(line(150.0)), motion);
        let Err(SetupError::Path(words)) = Door::new(setup) else {
            panic!("{motion:?}")
        };
        assert!(
            words.contains(expected) && words.contains("allowed are"),
            "{words}"
        );
    }
}

#[test]
fn a_robot_that_goes_silent_on_our_path_is_an_error_and_after_its_own_an_end() {
    let mut setup = Setup::new(Kind::J519, table_image());
    setup.path = Some(line(150.0));
    let mut ours = Door::new(setup).unwrap();
    for cycle in 0..300 {
        let now = Duration::from_millis(u64::from(cycle) * 8);
        ours.answer(
            &bytes::status(cycle, 0b101, cycle * 8, [100.0, 20.0, 0.0]),
            now,
        );
    }
    ours.silence(Duration::from_secs(4));
    assert_eq!(*ours.phase(), Phase::Guiding);
    ours.silence(Duration::from_secs(5));
    assert!(words(&ours).contains("gone silent"));
    let (mut robots, _) = rsi_session(Setup::new(Kind::Rsi, table_image()), &[], u32::MAX, 500);
    robots.silence(Duration::from_secs(11));
    assert_eq!(*robots.phase(), Phase::Guiding);
    robots.silence(Duration::from_secs(13));
    assert_eq!(*robots.phase(), Phase::Ended);
}

/// Datagrams of any bytes: nothing panics, and nothing but an answer to a good one comes back.
#[test]
fn any_bytes_are_survived() {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    for kind in [Kind::Egm, Kind::EgmPath, Kind::Rsi, Kind::J519] {
        for round in 0..3000u32 {
            let mut door = door(kind);
            for cycle in 0..4 {
                let place = [rng.random_range(-1e4..1e4), f64::from(round), 0.0];
                let mut said = match kind {
                    Kind::Egm | Kind::EgmPath => {
                        bytes::egm_robot(cycle, cycle * 4, place, Some(place), ABB_RUNS)
                    }
                    Kind::Rsi => bytes::rob(&(4 * cycle).to_string(), place, place, 0),
                    Kind::J519 => bytes::status(cycle, 0b101, cycle * 8, place),
                };
                for _ in 0..rng.random_range(0..4) {
                    let at = rng.random_range(0..said.len());
                    said[at] = rng.random();
                }
                if rng.random::<f64>() < 0.2 {
                    said.truncate(rng.random_range(0..said.len()));
                }
                door.answer(&said, at(cycle));
            }
        }
    }
}
