//! The bytes of a table are a promise: pinned here, and every way to break them tried.
use super::*;
use crate::kinematics::{IRB1600, Kinematics, Opw, PAPER_CENTRE_M};
use crate::model::Cumulants;
use crate::table::{Arm, Field, Limits, Travel, Zone, bounds, validate::Where};
use crate::term::Term;
use crate::{Actuator, Direction, Plane};
use proptest::prelude::*;
use std::vec::Vec;

fn zone() -> Zone {
    Zone {
        place_m: None,
        radius_m: [0.05, 0.3],
        feed_m_s: [0.02, 0.7],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 46.58e-6,
            kappa4_s4: -5.5e-6,
        },
        terms: heapless::Vec::new(),
    }
}

fn table() -> Table {
    Table {
        machine: "irb1600".try_into().unwrap(),
        zones: heapless::Vec::from_slice(&[zone()]).unwrap(),
        limits: Limits {
            offset_m: 1e-3,
            slew_m_s: 0.05,
        },
        arm: None,
    }
}

fn arm() -> Arm {
    Arm {
        kinematics: Kinematics::Opw(IRB1600).map(|value| value as f32),
        home_m: Some(PAPER_CENTRE_M.map(|value| value as f32)),
    }
}

/// Every term of a joint.
fn joint_terms(actuator: Actuator) -> [Term<f32>; 6] {
    [
        Term::JointLag {
            actuator,
            delta_tau_s: 1e-3,
            delta_kappa2_s2: 1e-5,
        },
        Term::JointBacklash {
            actuator,
            play_rad: 1e-4,
            loop_s: 0.02,
        },
        Term::JointReversal {
            actuator,
            peak_rad: 1e-4,
            decay_s: 0.02,
            rise_s: 0.002,
            presliding_rad: 1e-5,
        },
        Term::JointCyclic {
            actuator,
            amplitude_rad: 1e-4,
            waves: 100.0,
            phase_rad: 0.3,
        },
        Term::JointZero {
            actuator,
            offset_rad: 1e-3,
        },
        Term::LinkLength {
            actuator,
            longer_m: 1e-3,
        },
    ]
}

/// Every term, of every actuator, pair and plane.
fn all_terms() -> Vec<Term<f32>> {
    let mut terms = [
        Term::RadiusOffset { offset_m: 1e-5 },
        Term::ScaleError { relative: 1e-5 },
    ]
    .to_vec();
    for plane in Plane::ALL {
        let [first, second] = plane.axes();
        terms.extend([
            Term::ScaleMismatch {
                plane,
                relative: 1e-5,
            },
            Term::Squareness {
                plane,
                shear_rad: 1e-5,
            },
            Term::ServoMismatch {
                plane,
                delta_tau_s: 1e-4,
            },
            Term::BandwidthMismatch {
                plane,
                delta_kappa2_s2: 1e-6,
            },
        ]);
        for (actuator, across) in [(first, second), (second, first)] {
            terms.push(Term::LateralPlay {
                actuator,
                across,
                shift_m: 1e-5,
            });
            terms.push(Term::Straightness {
                actuator,
                across,
                curvature_per_m: 1e-4,
            });
        }
    }
    for actuator in Actuator::SLIDES {
        terms.extend(own_terms(actuator));
    }
    for actuator in Actuator::JOINTS {
        terms.extend(joint_terms(actuator));
    }
    terms
}

/// Every term of one actuator alone.
fn own_terms(actuator: Actuator) -> [Term<f32>; 4] {
    [
        Term::AxisScale {
            actuator,
            relative: 1e-5,
        },
        Term::Backlash {
            actuator,
            step_m: 1e-5,
        },
        Term::ReversalSpike {
            actuator,
            peak_m: 1e-5,
            decay_s: 0.02,
        },
        Term::Cyclic {
            actuator,
            amplitude_m: 1e-6,
            pitch_m: 0.01,
            phase_rad: 1.0,
        },
    ]
}

fn bytes(table: &Table) -> Vec<u8> {
    let mut out = [0; MAX_IMAGE_BYTES];
    let length = encode(table, &mut out).unwrap();
    out[..length].to_vec()
}

/// Gives changed bytes a CRC that holds again.
fn reseal(image: &mut [u8]) {
    let crc = crc_of(image);
    image[12..16].copy_from_slice(&crc.to_le_bytes());
}

#[test]
fn golden_bytes() {
    #[rustfmt::skip]
    let expected: [u8; 65] = [
        0x47, 0x49, 0x4f, 0x54,                         // "GIOT"
        3, 0,                                           // format 3
        0, 0,                                           // flags
        65, 0, 0, 0,                                    // length
        0, 0, 0, 0,                                     // CRC (below)
        0, 0, 0, 0,                                     // schema (below)
        7, b'i', b'r', b'b', b'1', b'6', b'0', b'0',    // machine
        1,                                              // one zone
        0,                                              // place: anywhere
        0xcd, 0xcc, 0x4c, 0x3d, 0x9a, 0x99, 0x99, 0x3e, // radius 0.05 to 0.3
        0x0a, 0xd7, 0xa3, 0x3c, 0x33, 0x33, 0x33, 0x3f, // feed 0.02 to 0.7
        0,                                              // both directions
        0xe5, 0x5e, 0x43, 0x38,                         // kappa2 46.58e-6
        0xa4, 0x8c, 0xb8, 0xb6,                         // kappa4 -5.5e-6
        0,                                              // no terms
        0x6f, 0x12, 0x83, 0x3a, 0xcd, 0xcc, 0x4c, 0x3d, // offset 1e-3, slew 0.05
        0,                                              // no arm
    ];
    let image = bytes(&table());
    assert_eq!(image[..12], expected[..12]);
    assert_eq!(image[20..], expected[20..]);
    // An independent CRC-32 (zlib's, of the same bytes), so that neither crate nor layout can drift.
    assert_eq!(
        image[12..16],
        GOLDEN_CRC.to_le_bytes(),
        "{:08x}",
        crc_of(&image)
    );
    assert_eq!(SCHEMA_HASH, GOLDEN_SCHEMA, "{SCHEMA_HASH:08x}");
}

/// `zlib.crc32` of the golden image without its CRC field.
const GOLDEN_CRC: u32 = 0x37ed_5ac0;
/// `zlib.crc32` of `schema.txt`.
const GOLDEN_SCHEMA: u32 = 0x8920_dec8;

/// A table of the format before, as it stands in the flash of a controller: its bytes are read, and have no arm.
#[test]
fn tables_without_arm_are_still_read() {
    let mut image = bytes(&table());
    image.pop();
    image[4] = 2;
    image[8] = 64;
    image[16..20].copy_from_slice(&0xd668_0447u32.to_le_bytes());
    let crc = crc_of(&image);
    // zlib's, of the bytes that format 2 pinned.
    assert_eq!(crc, 0x37d9_bd46);
    image[12..16].copy_from_slice(&crc.to_le_bytes());
    assert_eq!(decode(&image), Ok(table()));
}

#[test]
fn an_arm_that_is_none_is_refused() {
    let refused = |change: &dyn Fn(&mut Opw<f32>)| {
        let mut wrong = arm();
        if let Kinematics::Opw(opw) = &mut wrong.kinematics {
            change(opw);
        }
        let mut table = table();
        table.arm = Some(wrong);
        table.validate().unwrap_err()
    };
    let field = |error| match error {
        TableError::NonFinite { field, .. } | TableError::OutOfBounds { field, .. } => field,
        other => panic!("{other}"),
    };
    assert_eq!(field(refused(&|o| o.a1_m = f32::NAN)), Field::ArmLength);
    assert_eq!(field(refused(&|o| o.tool_m[1] = 20.0)), Field::ArmLength);
    assert_eq!(field(refused(&|o| o.c3_m = 0.0)), Field::ArmLink);
    assert_eq!(
        field(refused(&|o| o.orientation = [0.7; 4])),
        Field::Orientation
    );
    let mut table = table();
    table.arm = Some(Arm {
        kinematics: Kinematics::Slides,
        home_m: None,
    });
    assert_eq!(table.validate(), Err(TableError::Malformed));
}

/// First byte of each variant, written out: a term that moves changes the meaning of every table.
#[test]
fn discriminants_are_pinned() {
    fn first<T: serde::Serialize>(value: T) -> u8 {
        postcard::to_slice(&value, &mut [0; 32]).unwrap()[0]
    }
    for term in all_terms() {
        let expected = match term {
            Term::RadiusOffset { .. } => 0,
            Term::ScaleError { .. } => 1,
            Term::AxisScale { .. } => 2,
            Term::ScaleMismatch { .. } => 3,
            Term::Squareness { .. } => 4,
            Term::ServoMismatch { .. } => 5,
            Term::BandwidthMismatch { .. } => 6,
            Term::Backlash { .. } => 7,
            Term::LateralPlay { .. } => 8,
            Term::ReversalSpike { .. } => 9,
            Term::Cyclic { .. } => 10,
            Term::Straightness { .. } => 11,
            Term::JointLag { .. } => 12,
            Term::JointBacklash { .. } => 13,
            Term::JointReversal { .. } => 14,
            Term::JointCyclic { .. } => 15,
            Term::JointZero { .. } => 16,
            Term::LinkLength { .. } => 17,
        };
        assert_eq!(first(term), expected, "{term:?}");
    }
    let actuators = Actuator::SLIDES.into_iter().chain(Actuator::JOINTS);
    assert_eq!(
        actuators.map(first).collect::<Vec<_>>(),
        [0, 1, 2, 3, 4, 5, 6, 7, 8]
    );
    assert_eq!([Plane::Xy, Plane::Yz, Plane::Zx].map(first), [0, 1, 2]);
    assert_eq!(first(Travel::Cw), 2);
    assert_eq!(first(Direction::Cw), 1);
}

#[test]
fn largest_table_fits_exactly() {
    let mut longest = zone();
    longest.place_m = Some([[-1.0; 3], [1.0; 3]]);
    let longest_term = joint_terms(Actuator::Joint6)[2];
    longest.terms.resize(MAX_TERMS, longest_term).unwrap();
    let mut table = table();
    table.machine = "12345678901234567890123456789012".try_into().unwrap();
    table.zones.clear();
    table.zones.resize(MAX_ZONES, longest).unwrap();
    table.arm = Some(arm());
    let image = bytes(&table);
    let trailer = BINDING_BYTES + SIGNATURE_BYTES;
    assert_eq!(image.len(), MAX_IMAGE_BYTES - trailer);
    assert_eq!(decode(&image), Ok(table.clone()));
    assert_eq!(check(&image), Ok(()));
    // Zone by zone is what postcard makes of the whole.
    assert_eq!(
        postcard::from_bytes::<Table>(&image[HEADER_BYTES..]),
        Ok(table)
    );
}

#[test]
fn every_term_survives_the_trip() {
    for term in all_terms() {
        let mut table = table();
        table.zones[0].terms.push(term).unwrap();
        table.arm = Some(arm());
        assert_eq!(decode(&bytes(&table)), Ok(table));
    }
}

#[test]
fn each_breakage_has_its_own_error() {
    let good = bytes(&table());
    let have = good.len() as u32;
    let broken = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut image = good.clone();
        change(&mut image);
        decode(&image).unwrap_err()
    };
    assert_eq!(broken(&|b| b.clear()), TableError::NotATable);
    assert_eq!(broken(&|b| b[0] = b'g'), TableError::NotATable);
    assert_eq!(
        broken(&|b| b.truncate(10)),
        TableError::Truncated { have: 10, need: 20 }
    );
    assert_eq!(
        broken(&|b| b.truncate(40)),
        TableError::Truncated {
            have: 40,
            need: have
        }
    );
    assert_eq!(
        broken(&|b| b.push(0)),
        TableError::TooLong {
            length: have + 1,
            max: have
        }
    );
    assert_eq!(
        broken(&|b| b[9] = 0xff),
        TableError::TooLong {
            length: 0xff00 + have,
            max: MAX_IMAGE_BYTES as u32
        }
    );
    assert!(matches!(broken(&|b| b[30] ^= 1), TableError::BadCrc { .. }));
    let newer = |b: &mut Vec<u8>| {
        b[4] = 9;
        reseal(b);
    };
    assert_eq!(
        broken(&newer),
        TableError::NewerVersion {
            version: 9,
            supported: 3
        }
    );
    // The same byte changed on the way, not by a newer giotto.
    assert!(matches!(broken(&|b| b[4] = 9), TableError::BadCrc { .. }));
    let edit = |at: usize, value: u8| {
        broken(&move |b: &mut Vec<u8>| {
            b[at] = value;
            reseal(b);
        })
    };
    assert_eq!(edit(4, 0), TableError::UnknownVersion { version: 0 });
    let older = edit(4, 1);
    assert_eq!(
        older,
        TableError::OlderVersion {
            version: 1,
            supported: 3
        }
    );
    assert_eq!(edit(6, 2), TableError::UnknownFlags { flags: 2 });
    assert!(matches!(
        edit(16, !good[16]),
        TableError::SchemaMismatch { .. }
    ));
    assert_eq!(edit(20, 200), TableError::Malformed);
    assert_eq!(edit(28, 0), TableError::NoZones);
    assert_eq!(edit(28, 2), TableError::Malformed); // a zone missing
}

#[test]
fn each_bad_number_is_named() {
    let wrong = |change: &dyn Fn(&mut Table)| {
        let mut table = table();
        change(&mut table);
        encode(&table, &mut [0; MAX_IMAGE_BYTES]).unwrap_err()
    };
    let at = Where(Some(0));
    let nan = |at, field| TableError::NonFinite { at, field };
    assert_eq!(wrong(&|t| t.zones.clear()), TableError::NoZones);
    assert_eq!(
        wrong(&|t| t.limits.offset_m = f32::NAN),
        nan(Where::HEAD, Field::LimitOffset)
    );
    assert_eq!(
        wrong(&|t| t.limits.offset_m = 0.1),
        TableError::OutOfBounds {
            at: Where::HEAD,
            field: Field::LimitOffset,
            value: 0.1,
            lo: 0.0,
            hi: bounds::OFFSET_MAX_M
        }
    );
    assert_eq!(
        wrong(&|t| t.limits.slew_m_s = f32::INFINITY),
        nan(Where::HEAD, Field::LimitSlew)
    );
    assert_eq!(
        wrong(&|t| t.zones[0].cumulants.kappa4_s4 = f32::NAN),
        nan(at, Field::Kappa4)
    );
    assert_eq!(
        wrong(&|t| t.zones[0].radius_m = [0.3, 0.05]),
        TableError::EmptyRange {
            at,
            field: Field::Radius,
            lo: 0.3,
            hi: 0.05
        }
    );
    let field_of = |error| match error {
        TableError::OutOfBounds {
            at: place, field, ..
        } if place == at => field,
        other => panic!("{other}"),
    };
    assert_eq!(
        field_of(wrong(&|t| t.zones[0].radius_m[1] = 1.5)),
        Field::Radius
    );
    assert_eq!(
        field_of(wrong(&|t| t.zones[0].feed_m_s[0] = 0.0)),
        Field::Feed
    );
    assert_eq!(
        field_of(wrong(&|t| t.zones[0].cumulants.kappa2_s2 = -0.1)),
        Field::Kappa2
    );
    assert_eq!(
        field_of(wrong(&|t| t.zones[0].place_m = Some([[-1e6; 3]; 2]))),
        Field::Place
    );
}

/// Every number of every term, made not finite and made huge, is refused.
#[test]
fn no_number_of_a_term_goes_unchecked() {
    for term in all_terms() {
        let mut body = [0; 32];
        let length = postcard::to_slice(&term, &mut body).unwrap().len();
        // The rest are the tag and a byte each for actuators and plane.
        let numbers = (length - 1) / 4;
        for number in 0..numbers {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e6, -1e6] {
                let mut changed = body;
                let end = length - 4 * (numbers - 1 - number);
                changed[end - 4..end].copy_from_slice(&bad.to_le_bytes());
                let mut table = table();
                table.zones[0]
                    .terms
                    .push(postcard::from_bytes(&changed[..length]).unwrap())
                    .unwrap();
                let refused = table.validate();
                assert!(refused.is_err(), "{term:?} number {number} = {bad}");
            }
        }
    }
}

#[test]
fn terms_of_joints_and_of_one_slide_twice_are_refused() {
    let refused = |term| {
        let mut table = table();
        table.zones[0].terms.push(term).unwrap();
        table.validate().unwrap_err()
    };
    let at = Where(Some(0));
    for actuator in Actuator::JOINTS {
        for term in own_terms(actuator) {
            assert_eq!(refused(term), TableError::Joint { at, actuator });
        }
        for term in joint_terms(actuator) {
            assert_eq!(refused(term), TableError::NoArm { at });
        }
    }
    for actuator in Actuator::SLIDES {
        for term in joint_terms(actuator) {
            assert_eq!(refused(term), TableError::Slide { at, actuator });
        }
    }
    let (actuator, across) = (Actuator::Z, Actuator::Z);
    let same = TableError::SameActuator { at, actuator };
    let (shift_m, curvature_per_m) = (1e-5, 1e-4);
    assert_eq!(
        refused(Term::LateralPlay {
            actuator,
            across,
            shift_m
        }),
        same
    );
    assert_eq!(
        refused(Term::Straightness {
            actuator,
            across,
            curvature_per_m
        }),
        same
    );
}

#[test]
fn binding_and_signature_travel_outside_the_body() {
    let mut out = [0; MAX_IMAGE_BYTES];
    let plain = encode(&table(), &mut out).unwrap();
    assert_eq!(signed_parts(&out[..plain]), None);
    assert_eq!(binding(&out[..plain]), None);
    let bound = Binding {
        machine: *b"twelve bytes",
        serial: 0x0102_0304,
    };
    let signed = attach_signature(&mut out, &bound, |head, body| {
        assert_eq!(head, [3, 0, 3, 0]);
        assert_eq!(body.len(), plain - 16 + BINDING_BYTES);
        assert!(body.ends_with(b"twelve bytes\x04\x03\x02\x01"));
        [7; SIGNATURE_BYTES]
    });
    let image = &out[..signed.unwrap()];
    assert_eq!(image.len(), plain + BINDING_BYTES + SIGNATURE_BYTES);
    assert_eq!(decode(image), Ok(table()));
    let signature = signed_parts(image).unwrap().signature;
    assert_eq!(signature, &[7; SIGNATURE_BYTES]);
    assert_eq!(binding(image), Some(bound));
    // Another signature takes the place of the first.
    let later = Binding { serial: 9, ..bound };
    let again = attach_signature(&mut out, &later, |_, _| [8; SIGNATURE_BYTES]);
    assert_eq!(again, Ok(plain + BINDING_BYTES + SIGNATURE_BYTES));
    assert_eq!(binding(&out[..again.unwrap()]), Some(later));
}

/// Signed before tables were bound: read, and bound to nothing.
#[test]
fn a_signature_without_a_binding_is_read() {
    let mut out = [0; MAX_IMAGE_BYTES];
    let length = encode(&table(), &mut out).unwrap() + SIGNATURE_BYTES;
    write_header(&mut out[..length], FLAG_SIGNED);
    assert_eq!(decode(&out[..length]), Ok(table()));
    assert!(signed_parts(&out[..length]).is_some());
    assert_eq!(binding(&out[..length]), None);
    // Nothing is bound that is not signed.
    write_header(&mut out[..length], FLAG_BOUND);
    let flags = FLAG_BOUND;
    assert_eq!(
        decode(&out[..length]),
        Err(TableError::UnknownFlags { flags })
    );
}

proptest! {
    #[test]
    fn any_bytes_are_refused_or_valid(mut bytes in proptest::collection::vec(any::<u8>(), 0..400), seal: bool) {
        if seal && bytes.len() >= HEADER_BYTES {
            bytes[..4].copy_from_slice(&MAGIC);
            bytes[4..8].copy_from_slice(&[2, 0, 0, 0]);
            let length = bytes.len() as u32;
            bytes[8..12].copy_from_slice(&length.to_le_bytes());
            bytes[16..20].copy_from_slice(&SCHEMA_HASH.to_le_bytes());
            reseal(&mut bytes);
        }
        if let Ok(table) = decode(&bytes) {
            prop_assert_eq!(table.validate(), Ok(()));
        }
    }

    #[test]
    fn no_flipped_bit_goes_unseen(at in 0usize..64 * 8) {
        let mut image = bytes(&table());
        image[at / 8] ^= 1 << (at % 8);
        prop_assert!(decode(&image).is_err());
    }
}
