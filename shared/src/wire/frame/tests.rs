//! Whatever bytes arrive, the next whole frame is found.
use super::*;
use crate::Direction;
use crate::path::CircleRun;
use crate::wire::*;
use proptest::prelude::*;
use std::vec::Vec;

fn framed<M: Serialize>(message: &M) -> Vec<u8> {
    encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec()
}

fn request(seq: u16) -> Request {
    Request {
        session: 7,
        seq,
        command: Command::Status,
    }
}

/// Every payload found in `bytes`.
fn received(accumulator: &mut Accumulator, bytes: &[u8]) -> Vec<Request> {
    let mut found = Vec::new();
    for &byte in bytes {
        if let Some(payload) = accumulator.push(byte) {
            found.push(postcard::from_bytes(payload).unwrap());
        }
    }
    found
}

/// The largest message of each kind fits, so `TooLong` cannot occur at run time.
#[test]
fn largest_messages_fit() {
    let data = Chunk::from_slice(&[0xff; CHUNK]).unwrap();
    let command = Command::WriteChunk {
        offset: u16::MAX,
        data: data.clone(),
    };
    framed(&Request {
        session: u16::MAX,
        seq: u16::MAX,
        command,
    });
    framed(&Request {
        session: u16::MAX,
        seq: u16::MAX,
        command: Command::Provision { key: [255; 32] },
    });
    framed(&Request {
        session: u16::MAX,
        seq: u16::MAX,
        command: Command::ReplaceKey {
            key: [255; 32],
            signature: Chunk::from_slice(&[255; 64]).unwrap(),
        },
    });
    let most_nm = [i32::MIN; 3];
    let arc = ExactArc {
        centre_nm: most_nm,
        u_half_nm: most_nm,
        v_half_nm: most_nm,
        rise_nm: most_nm,
        turns: u32::MAX,
        fraction: u64::MAX,
        feed_m_s: f32::MAX,
    };
    let command = Command::Append {
        segment: ExactSegment::Arc(arc),
        tolerance_nm: u32::MAX,
    };
    framed(&Request {
        session: u16::MAX,
        seq: u16::MAX,
        command,
    });
    let reply = |reply| {
        framed(&FromController::Reply {
            session: u16::MAX,
            seq: u16::MAX,
            reply,
        })
    };
    reply(Reply::Data {
        offset: u16::MAX,
        data,
    });
    let name: heapless::String<16> = "1234567890123456".try_into().unwrap();
    reply(Reply::Key(KeyInfo {
        state: KeyState::Lost,
        key: [255; 32],
        epoch: u32::MAX,
        serial: u32::MAX,
    }));
    reply(Reply::Identity(Identity {
        board: name.clone(),
        build: name,
        protocol: u16::MAX,
        table_format: u16::MAX,
        schema_hash: u32::MAX,
        max_image_bytes: u16::MAX,
        tick_hz: u32::MAX,
        signed_only: true,
        machine: [255; 12],
    }));
    let most = u32::MAX;
    let slot = SlotState::Table(TableInfo {
        length: u16::MAX,
        crc: most,
        generation: Some(most),
    });
    reply(Reply::Status(Status {
        position: PositionState::Kept,
        reset: ResetCause::Watchdog,
        clock: ClockSource::Internal,
        worst_tick_permille: Some(u16::MAX),
        stack_left_bytes: most,
        override_percent: u8::MAX,
        motion: MotionState::Fault,
        fault: Some(FaultCause::Discontinuity),
        stop_input: true,
        bypass: true,
        active: Some(1),
        slots: [slot; 2],
        probation: Probation::FirstRun,
        queued: u8::MAX,
        tick: most,
        stack_bytes: most,
        idle_permille: Some(u16::MAX),
        raw_nm: [i32::MIN; 3],
        corrected_nm: [i32::MIN; 3],
        counters: Counters {
            tick_overruns: most,
            offset_clamps: most,
            slew_clamps: most,
            dropped_set_points: most,
            crc_errors: most,
            malformed_frames: most,
            overlong_frames: most,
            repeated_requests: most,
            lost_bytes: most,
            dropped_segments: most,
            uncorrected_segments: most,
            stops: most,
            segments: most,
            missing_set_points: most,
            late_set_points: most,
            rejected_set_points: most,
            link_losses: most,
        },
    }));
    let config = MachineConfig {
        feed_m_s: f32::MAX,
        acceleration_m_s2: f32::MAX,
        jerk_m_s3: f32::MAX,
        positioning_m_s: f32::MAX,
        offset_m: f32::MAX,
        slew_m_s: [f32::MAX; 3],
        stream_window_s: f32::MAX,
        soft_nm: [[i32::MIN, i32::MAX]; 3],
        internal_clock: true,
        tick_hz: u32::MAX,
        step: [[u32::MAX; 2]; 3],
    };
    reply(Reply::Config {
        config,
        stored: true,
    });
    let why = Refusal::Motion(MotionRefusal::OutOfBounds {
        quantity: Quantity::Override,
        value: 1.0,
        lo: 1.0,
        hi: 1.0,
    });
    let event = Event {
        tick: most,
        what: What::Refused { request: 255, why },
    };
    reply(Reply::Events {
        first: most,
        events: std::iter::repeat_n(event, EVENTS).collect(),
    });
    let point = SetPoint {
        raw_nm: [i32::MIN; 3],
        corrected_nm: [i32::MIN; 3],
    };
    framed(&FromController::SetPoints(SetPoints {
        tick: most,
        every: u16::MAX,
        last: true,
        points: heapless::Vec::from_slice(&[point; SET_POINTS]).unwrap(),
    }));
}

#[test]
fn golden_frame() {
    let run = CircleRun {
        centre_m: [-0.29, 0.0, 0.0],
        radius_m: 0.1,
        feed_m_s: 0.5,
        plane: crate::Plane::Xy,
        direction: Direction::Cw,
        laps: 2,
        start_rad: core::f64::consts::FRAC_PI_2,
    };
    let command = Command::RunCircle(run.exact().unwrap());
    let frame = framed(&Request {
        session: 1,
        seq: 300,
        command,
    });
    #[rustfmt::skip]
    let payload = [
        1,                                              // session
        0xac, 0x02,                                     // sequence 300
        10,                                             // run circle
        0xff, 0xb1, 0xc8, 0x94, 0x02, 0, 0,             // centre -290 mm, 0, 0 in nanometres
        0x80, 0x88, 0xde, 0xbe, 0x01,                   // radius 100 mm in half nanometres
        0, 0, 0, 0x3f,                                  // feed 0.5 m/s
        0, 1, 2,                                        // plane XY, clockwise, two laps
        0x80, 0x80, 0x80, 0x80, 0x04,                   // from a quarter turn
    ];
    let mut accumulator = Accumulator::new();
    let found = frame
        .iter()
        .find_map(|&byte| accumulator.push(byte).map(<[u8]>::to_vec))
        .unwrap();
    assert_eq!(found, payload);
}

#[test]
fn next_frame_is_found_after_an_overlong_one() {
    let mut accumulator = Accumulator::new();
    let mut bytes = std::vec![0x55; 3 * MAX_FRAME];
    // The tail of an overlong frame looks like a whole one and must not be taken for it.
    bytes.extend(framed(&request(1)));
    bytes.extend(framed(&request(2)));
    assert_eq!(received(&mut accumulator, &bytes), [request(2)]);
    assert_eq!(
        accumulator.counts(),
        FrameCounts {
            overlong: 1,
            ..FrameCounts::default()
        }
    );
}

#[test]
fn longest_frame_is_not_overlong() {
    let mut accumulator = Accumulator::new();
    let longest: heapless::Vec<u8, 256> = heapless::Vec::from_slice(&[1; MAX_PAYLOAD - 2]).unwrap();
    let frame = framed(&longest);
    assert_eq!(frame.len(), MAX_FRAME);
    assert!(frame.iter().any(|&byte| accumulator.push(byte).is_some()));
}

#[test]
fn changed_frames_are_counted_and_dropped() {
    let mut accumulator = Accumulator::new();
    let mut bytes = framed(&request(1));
    bytes[2] ^= 0x10;
    bytes.extend([1, 0]); // too short for a CRC
    bytes.extend(framed(&request(2)));
    assert_eq!(received(&mut accumulator, &bytes), [request(2)]);
    assert_eq!(
        accumulator.counts(),
        FrameCounts {
            crc_errors: 1,
            malformed: 1,
            overlong: 0
        }
    );
}

proptest! {
    #[test]
    fn frame_after_any_bytes_is_found(noise in proptest::collection::vec(any::<u8>(), 0..1000), seq: u16) {
        let mut accumulator = Accumulator::new();
        for byte in noise {
            accumulator.push(byte);
        }
        accumulator.push(0);
        prop_assert_eq!(received(&mut accumulator, &framed(&request(seq))), [request(seq)]);
    }

    /// COBS in place against the `cobs` crate.
    #[test]
    fn frames_are_cobs(payload in proptest::collection::vec(prop_oneof![Just(0u8), any::<u8>()], 0..MAX_PAYLOAD - 2)) {
        let payload: heapless::Vec<u8, 256> = heapless::Vec::from_slice(&payload).unwrap();
        let mut content = [0; MAX_PAYLOAD + 4];
        let length = postcard::to_slice(&payload, &mut content).unwrap().len();
        let crc = crc32(&content[..length]).to_le_bytes();
        content[length..length + 4].copy_from_slice(&crc);
        let mut expected = [0; MAX_FRAME];
        let end = cobs::encode(&content[..length + 4], &mut expected);
        prop_assert_eq!(framed(&payload), &expected[..=end]);
    }

    #[test]
    fn any_payload_survives(payload in proptest::collection::vec(any::<u8>(), 0..MAX_PAYLOAD - 2)) {
        let payload: heapless::Vec<u8, 256> = heapless::Vec::from_slice(&payload).unwrap();
        let mut accumulator = Accumulator::new();
        let found = framed(&payload).iter().find_map(|&byte| accumulator.push(byte).map(<[u8]>::to_vec));
        let back: heapless::Vec<u8, 256> = postcard::from_bytes(&found.unwrap()).unwrap();
        prop_assert_eq!(back, payload);
    }

    #[test]
    fn no_single_bit_flip_passes(at in 0usize..64, bit in 0u8..8) {
        let mut frame = framed(&request(9));
        let at = at % frame.len();
        frame[at] ^= 1 << bit;
        let mut accumulator = Accumulator::new();
        prop_assert_eq!(received(&mut accumulator, &frame), []);
    }
}
