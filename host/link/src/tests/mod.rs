//! The client against the virtual controller, in simulated time.
use super::*;
use giotto::model_file::{FORMAT, ModelFile, Servo, Valid};
use giotto::table_from_model::table_from_model;
use giotto_shared::Direction;
use giotto_shared::table::{self, MAX_IMAGE_BYTES};
use giotto_shared::wire::{Command, MotionState, Refusal, SlotState};

fn sim() -> Controller {
    open(&Port::Sim, &OpenOptions::default(), &mut |_| {}).unwrap()
}

/// Table of the paper's robot with another κ for each `scale`.
fn image(scale: f64) -> Vec<u8> {
    let model = ModelFile {
        format: FORMAT,
        campaign: "lab".to_owned(),
        machine: "irb1600".to_owned(),
        servo: Servo::Beta {
            beta1_s2: -23.29e-6 * scale,
            beta2_s4: -0.23e-6,
            half_width95: [0.0; 2],
        },
        valid: Valid {
            radius_mm: [50.0, 300.0],
            feed_mm_s: [20.0, 700.0],
            centre_mm: None,
        },
        kinematics: None,
        effects: Vec::new(),
        delay_s: None,
    };
    let mut out = [0; MAX_IMAGE_BYTES];
    let length = table::encode(&table_from_model(&model).unwrap().table, &mut out).unwrap();
    out[..length].to_vec()
}

#[test]
fn flash_verify_reset_verify() {
    let mut controller = sim();
    assert_eq!(
        controller.verify(&image(1.0)).unwrap(),
        flash::Verdict::None
    );
    let mut steps = Vec::new();
    let flashed = controller
        .flash(&image(1.0), &mut |step| steps.push(step))
        .unwrap();
    assert_eq!((flashed.slot, flashed.generation), (0, 1));
    assert_eq!(steps.last(), Some(&flash::Progress::Confirmed));
    for _ in 0..2 {
        assert_eq!(
            controller.verify(&image(1.0)).unwrap(),
            flash::Verdict::Same { slot: 0 }
        );
        assert!(matches!(
            controller.verify(&image(1.1)).unwrap(),
            flash::Verdict::Differs { slot: 0, .. }
        ));
        controller.reset().unwrap();
    }
}

#[test]
fn a_bad_file_is_never_sent() {
    let mut controller = sim();
    controller.flash(&image(1.0), &mut |_| {}).unwrap();
    let mut bad = image(1.1);
    bad[30] ^= 1;
    let mut sent = 0;
    assert!(matches!(
        controller.flash(&bad, &mut |_| sent += 1),
        Err(ControllerError::Table(_))
    ));
    assert_eq!(sent, 0);
    assert_eq!(
        controller.verify(&image(1.0)).unwrap(),
        flash::Verdict::Same { slot: 0 }
    );
}

#[test]
fn rollback_and_bypass() {
    let mut controller = sim();
    let refused = controller.command(Command::Bypass { on: false });
    assert!(matches!(
        refused,
        Err(ControllerError::Refused(Refusal::NoTable))
    ));
    controller.flash(&image(1.0), &mut |_| {}).unwrap();
    controller.flash(&image(1.1), &mut |_| {}).unwrap();
    controller.command(Command::Rollback).unwrap();
    assert_eq!(
        controller.verify(&image(1.0)).unwrap(),
        flash::Verdict::Same { slot: 0 }
    );
    controller.command(Command::Bypass { on: true }).unwrap();
    let status = controller.status().unwrap();
    assert!(status.bypass && matches!(status.slots[1], SlotState::Table(_)));
    assert_eq!(status.motion, MotionState::Idle);
}

/// Radius of the corrected set-points while the programmed ones are at constant feed.
fn radii(recording: &Recording, radius_m: f64) -> Vec<f64> {
    let turn = recording.points.iter().filter(|point| {
        let [x, y, _] = point.programmed_m;
        (x.hypot(y) - radius_m).abs() < 1e-8
    });
    let middle: Vec<f64> = turn
        .map(|point| point.corrected_m[0].hypot(point.corrected_m[1]))
        .collect();
    let quarter = middle.len() / 4;
    middle[quarter..3 * quarter].to_vec()
}

/// The corrected circle is the larger one that the paper's model asks for (Eq. 15), bypassed it is the programmed one.
#[test]
fn circles_are_corrected_unless_bypassed() {
    let (radius, feed) = (0.15, 0.6);
    let mut controller = sim();
    controller.flash(&image(1.0), &mut |_| {}).unwrap();
    let wanted = circle(radius, feed, Direction::Cw, 2);
    let w2: f64 = (feed / radius) * (feed / radius);
    let expected = radius * (1.0 + 23.29e-6 * w2 + (23.29e-6 * 23.29e-6 + 0.23e-6) * w2 * w2);
    for radius in radii(&controller.run_circle(&wanted, 1).unwrap(), radius) {
        assert!((radius - expected).abs() < 1e-7, "{radius} {expected}");
    }
    controller.command(Command::Bypass { on: true }).unwrap();
    let recording = controller.run_circle(&wanted, 1).unwrap();
    let end = recording.points.len() - 1;
    assert!(
        recording.points[300..]
            .iter()
            .all(|point| point.programmed_m == point.corrected_m)
    );
    // Two laps at constant feed, entry and exit, and the approach from the origin.
    let turns_s = 2.0 * std::f64::consts::TAU * radius / feed;
    assert!(recording.points[end].time_s > turns_s && recording.points[end].time_s < turns_s + 3.0);
}

/// Every seventh set-point is every seventh of all of them.
#[test]
fn a_coarse_record_is_a_thinned_one() {
    let wanted = circle(0.1, 0.5, Direction::Ccw, 1);
    let fine = sim().run_circle(&wanted, 1).unwrap();
    let coarse = sim().run_circle(&wanted, 7).unwrap();
    assert_eq!(coarse.dt_s, 0.007);
    let thinned = fine.points.iter().step_by(7);
    for (a, b) in thinned.zip(&coarse.points) {
        assert_eq!(
            (a.programmed_m, a.corrected_m),
            (b.programmed_m, b.corrected_m)
        );
    }
    assert_eq!(fine.points.len().div_ceil(7), coarse.points.len() - 1);
}

#[test]
fn a_second_run_waits_for_the_first() {
    let mut controller = sim();
    controller
        .start_circle(&circle(0.1, 0.1, Direction::Ccw, 1))
        .unwrap();
    let refused = controller.start_circle(&circle(0.1, 0.1, Direction::Ccw, 1));
    assert!(matches!(
        refused,
        Err(ControllerError::Refused(Refusal::Busy))
    ));
    assert!(matches!(
        controller.reset(),
        Err(ControllerError::Refused(Refusal::Busy))
    ));
    controller.command(Command::Stop).unwrap();
    let mut polls = 0;
    while controller.status().unwrap().motion != MotionState::Idle {
        polls += 1;
        assert!(polls < 2000, "does not stop");
    }
    controller
        .run_circle(&circle(0.1, 0.4, Direction::Ccw, 1), 1)
        .unwrap();
}

fn table_refusal(result: Result<flash::Flashed, ControllerError>) -> table::TableError {
    match result {
        Err(ControllerError::Refused(Refusal::Table(error))) => error,
        other => panic!("{other:?}"),
    }
}

/// Off until a key is provisioned; from then on, and after a reset, only what it has signed, for this machine, in order.
#[test]
fn only_signed_tables_once_a_key_is_provisioned() {
    use crate::signing::SigningKey;
    use giotto_shared::wire::KeyState;
    use table::image::Binding;
    let (key, other) = (SigningKey::generate(), SigningKey::generate());
    let bound = |serial| Binding {
        machine: crate::virtual_controller::MACHINE,
        serial,
    };
    let signed = |value, serial| key.sign(&image(value), &bound(serial)).unwrap();
    let mut controller = sim();
    controller.flash(&image(1.0), &mut |_| {}).unwrap();
    controller.flash(&signed(1.1, 3), &mut |_| {}).unwrap();
    controller.flash(&image(1.2), &mut |_| {}).unwrap();
    let provision = |key: &SigningKey| Command::Provision { key: key.public() };
    controller.command(provision(&key)).unwrap();
    // The unsigned table in use is gone, the signed one before it is back.
    let same = flash::Verdict::Same { slot: 1 };
    assert_eq!(controller.verify(&signed(1.1, 3)).unwrap(), same);
    controller.reset().unwrap();
    assert!(controller.identity().signed_only);
    let info = controller.key_info().unwrap();
    assert_eq!((info.state, info.serial), (KeyState::Kept, 3));
    let refused = |controller: &mut Controller, image: &[u8]| {
        table_refusal(controller.flash(image, &mut |_| {}))
    };
    let good = signed(1.3, 4);
    let strange = other.sign(&image(1.3), &bound(4)).unwrap();
    let theirs = Binding {
        machine: [7; 12],
        serial: 4,
    };
    let theirs = key.sign(&image(1.3), &theirs).unwrap();
    let old = table::TableError::OldSerial { serial: 3, last: 3 };
    for (image, why) in [
        (image(1.3), table::TableError::Unsigned),
        (strange, table::TableError::BadSignature),
        (theirs, table::TableError::OtherMachine),
        (signed(1.1, 3), old),
    ] {
        assert_eq!(refused(&mut controller, &image), why);
    }
    // Altered after it was signed, its CRC set right.
    let mut altered = image(1.4);
    altered.resize(table::MAX_IMAGE_BYTES, 0);
    let signature = good[good.len() - table::image::SIGNATURE_BYTES..].try_into();
    let length =
        table::image::attach_signature(&mut altered, &bound(4), |_, _| signature.unwrap()).unwrap();
    let why = refused(&mut controller, &altered[..length]);
    assert_eq!(why, table::TableError::BadSignature);
    assert_eq!(controller.verify(&signed(1.1, 3)).unwrap(), same);
    // The same key again changes nothing, another one is refused.
    controller.command(provision(&key)).unwrap();
    let again = controller.command(provision(&other));
    assert!(matches!(
        again,
        Err(ControllerError::Refused(Refusal::KeyProvisioned))
    ));
    controller.flash(&good, &mut |_| {}).unwrap();
    let same = flash::Verdict::Same { slot: 0 };
    assert_eq!(controller.verify(&good).unwrap(), same);
    // Handed on by its owner.
    let machine = controller.identity().machine;
    let word = other.hand_over(&machine, 1, &other.public());
    assert!(controller.command(word).is_err());
    let word = key.hand_over(&machine, 1, &other.public());
    controller.command(word).unwrap();
    assert_eq!(controller.status().unwrap().active, None);
    let mine = other.sign(&image(1.3), &bound(5)).unwrap();
    controller.flash(&mine, &mut |_| {}).unwrap();
}

/// A rate that is stored is the one of the next start; the machine goes as far in the same time.
#[test]
fn a_stored_rate_counts_from_the_next_start_on() {
    let mut controller = sim();
    let (mut config, _) = controller.config().unwrap();
    assert_eq!(config.tick_hz, 1000);
    config.tick_hz = 2500;
    controller.command(Command::Configure(config)).unwrap();
    controller.command(Command::SaveConfig).unwrap();
    assert_eq!(controller.identity().tick_hz, 1000);
    controller.reset().unwrap();
    assert_eq!(controller.identity().tick_hz, 2500);
    let recording = controller
        .run_circle(&circle(0.1, 0.2, Direction::Ccw, 1), 1)
        .unwrap();
    assert_eq!(recording.dt_s, 0.0004);
    let time_s = recording.points.last().unwrap().time_s;
    // A turn takes π s; its ramps and the way to it the rest.
    assert!((3.2..6.0).contains(&time_s), "{time_s}");
}
