//! Requests in and out of order, uploads good and bad, probation.
use super::*;
use giotto_shared::table::TableError;
use giotto_shared::wire::{ConfigField, MachineConfig, MotionState, STEP_MOST, SlotState};
use proptest::prelude::*;

fn fresh() -> Desk {
    boot(Cells::new(), None, Tear::Untouched)
}

fn refused(reply: Option<Reply>) -> Refusal {
    match reply {
        Some(Reply::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    }
}

#[test]
fn boots_in_bypass_without_a_table() {
    let mut desk = fresh();
    let status = desk.status();
    assert!(status.bypass);
    assert_eq!((status.active, status.slots), (None, [SlotState::Empty; 2]));
    assert_eq!(
        refused(desk.ask(Command::Bypass { on: false })),
        Refusal::NoTable
    );
    assert_eq!(refused(desk.ask(Command::Commit)), Refusal::NothingToCommit);
    assert_eq!(
        refused(desk.ask(Command::Confirm)),
        Refusal::NothingToConfirm
    );
    assert_eq!(
        refused(desk.ask(Command::Rollback)),
        Refusal::NothingToRollBack
    );
}

#[test]
fn flashed_table_survives_a_reset_and_bypass_does_not() {
    let mut desk = fresh();
    assert!(desk.flash("a") && desk.done(Command::Bypass { on: true }));
    assert!(desk.status().bypass);
    let mut desk = desk.reboot();
    let status = desk.status();
    assert_eq!(
        (status.bypass, status.active, status.probation),
        (false, Some(0), Probation::None)
    );
    assert_eq!(desk.correcting().as_deref(), Some("a"));
    let crc = table::Header::read(&image("a")).unwrap().crc;
    let info = TableInfo {
        length: image("a").len() as u16,
        crc,
        generation: Some(1),
    };
    assert_eq!(status.slots, [SlotState::Table(info), SlotState::Empty]);
}

#[test]
fn without_confirmation_the_last_good_table_returns() {
    let mut desk = fresh();
    assert!(desk.flash("a") && desk.write(&image("b")));
    assert_eq!(desk.correcting().as_deref(), Some("a"));
    assert!(desk.done(Command::Commit));
    assert_eq!(desk.status().probation, Probation::Fresh);
    assert_eq!(desk.correcting().as_deref(), Some("b"));
    assert!(desk.done(circle()));
    assert_eq!(refused(desk.ask(Command::Commit)), Refusal::Busy);
    assert_eq!(refused(desk.ask(Command::Rollback)), Refusal::Busy);
    assert!(desk.done(Command::Stop));
    assert_eq!(refused(desk.ask(circle())), Refusal::ProbationOver);
    assert_eq!(desk.server.motion_mut().runs, 1);
    assert_eq!(desk.reboot().correcting().as_deref(), Some("a"));
}

#[test]
fn confirmed_during_its_first_run_it_stays() {
    let mut desk = fresh();
    assert!(desk.flash("a") && desk.write(&image("b")) && desk.done(Command::Commit));
    assert!(desk.done(circle()) && desk.done(Command::Confirm) && desk.done(Command::Stop));
    assert!(desk.done(circle()));
    assert_eq!(desk.reboot().correcting().as_deref(), Some("b"));
}

#[test]
fn rollback_goes_back_and_forth_and_survives_a_reset() {
    let mut desk = fresh();
    assert!(desk.flash("a") && desk.flash("b"));
    for (expected, generation) in [("a", 3), ("b", 4), ("a", 5)] {
        assert!(desk.done(Command::Rollback));
        assert_eq!(desk.correcting().as_deref(), Some(expected));
        desk = desk.reboot();
        assert_eq!(desk.correcting().as_deref(), Some(expected));
        let status = desk.status();
        let slot = status.slots[usize::from(status.active.unwrap())];
        assert!(matches!(slot, SlotState::Table(info) if info.generation == Some(generation)));
    }
}

#[test]
fn rollback_on_probation_returns_at_once() {
    let mut desk = fresh();
    assert!(desk.flash("a") && desk.write(&image("b")) && desk.done(Command::Commit));
    assert!(desk.done(Command::Rollback));
    assert_eq!(desk.correcting().as_deref(), Some("a"));
    assert_eq!(
        refused(desk.ask(Command::Rollback)),
        Refusal::NothingToRollBack
    );
}

#[test]
fn a_new_upload_ends_a_probation() {
    let mut desk = fresh();
    assert!(desk.flash("a") && desk.write(&image("b")) && desk.done(Command::Commit));
    assert!(desk.write(&image("c")));
    assert_eq!(desk.correcting().as_deref(), Some("a"));
    assert!(desk.done(Command::Commit) && desk.done(Command::Confirm));
    assert_eq!(desk.reboot().correcting().as_deref(), Some("c"));
}

#[test]
fn a_bad_table_never_touches_the_flash() {
    let mut desk = fresh();
    assert!(desk.flash("a"));
    let steps = desk.server.store_mut().flash_mut().steps();
    let mut out_of_bounds = image("b");
    let end = out_of_bounds.len();
    out_of_bounds[end - 8..end - 4].copy_from_slice(&1.0_f32.to_le_bytes());
    assert!(desk.upload(&out_of_bounds));
    assert!(matches!(
        refused(desk.ask(Command::WriteEnd)),
        Refusal::Table(TableError::BadCrc { .. })
    ));
    let crc = {
        let mut bytes = out_of_bounds[..12].to_vec();
        bytes.extend(&out_of_bounds[16..]);
        wire::crc32(&bytes)
    };
    out_of_bounds[12..16].copy_from_slice(&crc.to_le_bytes());
    assert!(desk.upload(&out_of_bounds));
    let refusal = refused(desk.ask(Command::WriteEnd));
    assert!(
        matches!(refusal, Refusal::Table(TableError::OutOfBounds { .. })),
        "{refusal}"
    );
    assert_eq!(refused(desk.ask(Command::WriteEnd)), Refusal::NoUpload);
    assert_eq!(refused(desk.ask(Command::Commit)), Refusal::NothingToCommit);
    assert_eq!(desk.server.store_mut().flash_mut().steps(), steps);
    assert_eq!(desk.correcting().as_deref(), Some("a"));
}

#[test]
fn uploads_are_in_order_and_whole() {
    let mut desk = fresh();
    let chunk = |offset, count: usize| Command::WriteChunk {
        offset,
        data: Chunk::from_slice(&[0; CHUNK][..count]).unwrap(),
    };
    assert_eq!(refused(desk.ask(chunk(0, 1))), Refusal::NoUpload);
    let too_long = Command::WriteBegin {
        length: u16::MAX,
        crc: 0,
    };
    assert_eq!(
        refused(desk.ask(too_long)),
        Refusal::UploadTooLong {
            max: MAX_IMAGE_BYTES as u16
        }
    );
    assert!(
        desk.done(Command::WriteBegin {
            length: 100,
            crc: 0
        }) && desk.done(chunk(0, 60))
    );
    assert_eq!(
        refused(desk.ask(chunk(50, 10))),
        Refusal::OutOfOrder { expected: 60 }
    );
    assert_eq!(
        refused(desk.ask(chunk(60, 41))),
        Refusal::UploadTooLong { max: 100 }
    );
    assert_eq!(
        refused(desk.ask(Command::WriteEnd)),
        Refusal::UploadIncomplete
    );
}

#[test]
fn a_repeated_request_happens_once() {
    let mut desk = fresh();
    assert!(desk.flash("a") && desk.flash("b"));
    desk.seq += 1;
    let rollback = frame(1, desk.seq, Command::Rollback);
    for _ in 0..3 {
        assert_eq!(desk.send(&rollback), Some(Reply::Done));
    }
    assert_eq!(desk.correcting().as_deref(), Some("a"));
    assert_eq!(desk.status().counters.repeated_requests, 2);
    // Late, after a newer one: neither done nor answered.
    assert_eq!(desk.send(&rollback), None);
    assert_eq!(desk.correcting().as_deref(), Some("a"));
}

/// Of several requests on their way one is lost: those after it are refused, come again under new numbers, and nothing
/// that is late counts.
#[test]
fn a_gap_in_a_series_is_closed_under_new_numbers() {
    let mut desk = fresh();
    let image = image("a");
    let piece = |seq, from: usize, to: usize| {
        let data = Chunk::from_slice(&image[from..to]).unwrap();
        frame(
            1,
            seq,
            Command::WriteChunk {
                offset: from as u16,
                data,
            },
        )
    };
    let (first, second, third) = (20, 40, image.len());
    assert!(desk.done(Command::WriteBegin {
        length: third as u16,
        crc: wire::crc32(&image)
    }));
    assert_eq!(desk.send(&piece(11, 0, first)), Some(Reply::Done));
    // 12 is lost.
    assert_eq!(
        refused(desk.send(&piece(13, second, third))),
        Refusal::OutOfOrder {
            expected: first as u16
        }
    );
    assert_eq!(desk.send(&piece(12, first, second)), None);
    assert_eq!(desk.send(&piece(14, first, second)), Some(Reply::Done));
    assert_eq!(desk.send(&piece(15, second, third)), Some(Reply::Done));
    // Its answer is lost: what is expected next tells.
    assert_eq!(
        refused(desk.send(&piece(16, second, third))),
        Refusal::OutOfOrder {
            expected: third as u16
        }
    );
    assert_eq!(desk.send(&piece(11, 0, first)), None);
    desk.seq = 16;
    assert!(
        desk.done(Command::WriteEnd) && desk.done(Command::Commit) && desk.done(Command::Confirm)
    );
    assert_eq!(desk.reboot().correcting().as_deref(), Some("a"));
}

#[test]
fn strangers_and_newer_hosts_are_told() {
    let mut desk = fresh();
    assert_eq!(
        refused(desk.send(&frame(2, 1, Command::Rollback))),
        Refusal::NoSession
    );
    assert!(matches!(desk.ask(Command::Status), Some(Reply::Status(_))));
    assert!(matches!(
        desk.send(&frame(2, 1, Command::Hello)),
        Some(Reply::Identity(_))
    ));
    assert_eq!(refused(desk.ask(Command::Status)), Refusal::NoSession);
    let unknown = wire::encode(&(2_u16, 2_u16, 99_u8), &mut [0; MAX_FRAME])
        .unwrap()
        .to_vec();
    assert_eq!(refused(desk.send(&unknown)), Refusal::NotUnderstood);
}

/// Whoever sees the need may stop; the session of whoever runs it goes on.
#[test]
fn a_stranger_may_stop_and_nothing_else() {
    let mut desk = fresh();
    assert!(desk.done(circle()));
    assert_eq!(desk.status().motion, MotionState::Running);
    for command in [Command::Status, Command::Reset, Command::Begin] {
        let said = desk.send(&frame(0, 1, command));
        assert_eq!(refused(said), Refusal::NoSession);
    }
    assert_eq!(desk.status().motion, MotionState::Running);
    let said = desk.send(&frame(0, 1, Command::Stop));
    assert_eq!(said, Some(Reply::Done));
    assert_ne!(desk.status().motion, MotionState::Running);
}

/// A feed that the outputs could not follow is no limit to be set.
#[test]
fn limits_beyond_the_outputs_are_refused() {
    let mut desk = fresh();
    let Some(Reply::Config { config, .. }) = desk.ask(Command::Config) else {
        panic!("no limits");
    };
    let fast = |feed_m_s: f32| Command::Configure(MachineConfig { feed_m_s, ..config });
    assert!(desk.done(fast(1.75)));
    assert_eq!(
        refused(desk.ask(fast(1.85))),
        Refusal::Config(ConfigField::Feed)
    );
}

/// Each number of each axis, and what only the board can say no to: refused by its name, and nothing of it is used.
#[test]
fn limits_out_of_range_are_refused_by_name() {
    let mut desk = fresh();
    let Some(Reply::Config { config, .. }) = desk.ask(Command::Config) else {
        panic!("no limits");
    };
    let mut wrong = Vec::new();
    for axis in 0..3 {
        for slew_m_s in [0.0, -0.1, f32::NAN, 1.1] {
            let mut said = config;
            said.slew_m_s[axis] = slew_m_s;
            wrong.push((said, ConfigField::Slew));
        }
        for step in [[0, 1], [1, 0], [STEP_MOST + 1, 1], [1, STEP_MOST + 1]] {
            let mut said = config;
            said.step[axis] = step;
            wrong.push((said, ConfigField::Step));
        }
    }
    // The last one is the board's own bound.
    for tick_hz in [0, 249, 20_001, u32::MAX, 4001] {
        let said = MachineConfig { tick_hz, ..config };
        wrong.push((said, ConfigField::Rate));
    }
    for (said, field) in wrong {
        let why = refused(desk.ask(Command::Configure(said)));
        assert_eq!(why, Refusal::Config(field), "{said:?}");
        let found = desk.ask(Command::Config);
        assert!(matches!(found, Some(Reply::Config { config: now, .. }) if now == config));
    }
    let mut said = config;
    (said.slew_m_s, said.tick_hz) = ([0.1, 0.2, 0.3], 4000);
    said.step = [[3125, 2], [25_000, 1], [1, STEP_MOST]];
    assert!(desk.done(Command::Configure(said)) && desk.done(Command::SaveConfig));
    let mut desk = desk.reboot();
    let found = desk.ask(Command::Config);
    assert!(matches!(found, Some(Reply::Config { config, stored: true }) if config == said));
}

#[test]
fn runs_out_of_bounds_are_refused() {
    let Command::RunCircle(good) = circle() else {
        panic!()
    };
    let bad = [
        ExactCircle {
            radius_half_nm: 0,
            ..good
        },
        ExactCircle {
            radius_half_nm: -200_000_000,
            ..good
        },
        ExactCircle {
            radius_half_nm: i32::MAX,
            ..good
        },
        ExactCircle {
            feed_m_s: 0.0,
            ..good
        },
        ExactCircle {
            feed_m_s: f32::NAN,
            ..good
        },
        ExactCircle { laps: 0, ..good },
        ExactCircle {
            radius_half_nm: 20_000_000,
            feed_m_s: 1.0,
            ..good
        },
    ];
    let mut desk = fresh();
    for run in bad {
        let refusal = refused(desk.ask(Command::RunCircle(run)));
        assert!(
            matches!(refusal, Refusal::Motion(MotionRefusal::OutOfBounds { .. })),
            "{refusal}"
        );
    }
    assert_eq!(desk.server.motion_mut().runs, 0);
}

#[test]
fn read_back_stays_inside_the_slot() {
    let mut desk = fresh();
    assert!(desk.flash("a"));
    let read = |slot, offset, length| Command::ReadBack {
        slot,
        offset,
        length,
    };
    match desk.ask(read(0, 0, 16)) {
        Some(Reply::Data { offset: 0, data }) => assert_eq!(data, image("a")[..16]),
        other => panic!("{other:?}"),
    }
    for (slot, offset, length) in [(2, 0, 1), (0, 2040, 16), (0, 0, 200), (1, u16::MAX, 1)] {
        assert_eq!(
            refused(desk.ask(read(slot, offset, length))),
            Refusal::NoSuchPlace
        );
    }
}

/// The silence that is allowed, to the tick; the default comes back with a hello.
#[test]
fn a_silent_host_ends_what_waits_and_is_counted() {
    let mut desk = fresh();
    assert!(desk.done(circle()));
    let after = |desk: &mut Desk, ticks: u32| {
        desk.server.motion_mut().tick += ticks;
        desk.server.supervise();
        desk.server.motion_mut().held
    };
    assert_eq!(after(&mut desk, 999), 0);
    assert_eq!(desk.status().counters.link_losses, 0);
    assert_eq!(after(&mut desk, 999), 0);
    assert_eq!(after(&mut desk, 1), 1);
    assert_eq!(after(&mut desk, 1999), 1);
    assert_eq!(desk.server.motion_mut().runs, 1);
    assert_eq!(desk.server.motion_mut().state, MotionState::Running);
    // What is not at its end two seconds later is stopped.
    assert_eq!(after(&mut desk, 1), 1);
    assert_eq!(desk.server.motion_mut().state, MotionState::Idle);
    assert_eq!(desk.status().counters.link_losses, 1);
    assert!(desk.done(circle()));
    // Heard in time, it goes on.
    assert_eq!(after(&mut desk, 1000), 2);
    assert!(matches!(desk.ask(Command::Hello), Some(Reply::Identity(_))));
    assert_eq!(after(&mut desk, 900), 2);
    assert!(matches!(desk.ask(Command::Hello), Some(Reply::Identity(_))));
    assert_eq!(after(&mut desk, 900), 2);
    assert!(matches!(desk.ask(Command::Hello), Some(Reply::Identity(_))));
    assert_eq!(after(&mut desk, 900), 2);
    assert_eq!(desk.server.motion_mut().state, MotionState::Running);
    assert!(desk.done(Command::Supervise { after_ms: 0 }));
    assert_eq!(after(&mut desk, 1_000_000), 2);
    assert!(matches!(desk.ask(Command::Hello), Some(Reply::Identity(_))));
    assert_eq!(after(&mut desk, 1000), 3);
    // At rest nothing can be left alone.
    assert!(desk.done(Command::Stop));
    assert_eq!(after(&mut desk, 10_000), 3);
}

proptest! {
    /// Any bytes, among them whole requests in any order: no panic, and never a correction without a table.
    #[test]
    fn any_bytes_leave_a_whole_table(
        pieces in proptest::collection::vec((0u8..12, any::<u16>(), proptest::collection::vec(any::<u8>(), 0..40)), 0..60)
    ) {
        let mut desk = fresh();
        prop_assert!(desk.flash("a"));
        for (kind, number, bytes) in pieces {
            let slot = (number % 3) as u8;
            let data = Chunk::from_slice(&bytes).unwrap();
            let command = match kind {
                0 => Command::WriteBegin { length: number % 100, crc: wire::crc32(&bytes) },
                1 => Command::WriteChunk { offset: number % 100, data },
                2 => Command::WriteEnd,
                3 => Command::Commit,
                4 => Command::Confirm,
                5 => Command::Rollback,
                6 => Command::Bypass { on: number % 2 == 0 },
                7 => circle(),
                8 => Command::Stop,
                9 => Command::ReadBack { slot, offset: number, length: slot },
                _ => {
                    desk.send(&bytes);
                    desk.send(&[0]);
                    continue;
                }
            };
            desk.ask(command);
            prop_assert_eq!(desk.correcting(), Some("a".to_string()));
        }
        prop_assert_eq!(desk.reboot().correcting(), Some("a".to_string()));
    }
}
