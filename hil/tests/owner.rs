//! Whose tables the image takes, in the emulator: what is not its owner's newest one for this machine is refused, after a reset and
//! after the key is lost as well. Needs the emulator: `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto_firmware::store::{Layout, Owner, Store, ram::RamFlash};
use giotto_hil::ticks::largest_table;
use giotto_link::emulator::{Emulator, Pace, Setup};
use giotto_link::signing::SigningKey;
use giotto_link::{Board, Controller, ControllerError, image};
use giotto_shared::table::image::{Binding, MachineId};
use giotto_shared::table::{MAX_IMAGE_BYTES, TableError};
use giotto_shared::wire::{Command, KeyState, Refusal};

const MACHINE: MachineId = *b"the emulator";
/// Where the board has its flash stand-in, its erase units, and behind them its number.
const WINDOW: u32 = 0x0010_0000;
const UNIT: u32 = 4096;
const UNITS: usize = 5;
const NUMBER: u32 = WINDOW + UNITS as u32 * UNIT;
const LAYOUT: Layout = Layout::new([0, UNIT], UNIT)
    .with_key(2 * UNIT)
    .with_config([3 * UNIT, 4 * UNIT]);
type Window = RamFlash<{ UNITS * UNIT as usize }, { UNIT as usize }>;

fn signed_for(machine: MachineId, key: &SigningKey, serial: u32) -> Vec<u8> {
    let bound = Binding { machine, serial };
    key.sign(&largest_table(), &bound).unwrap()
}

fn signed(key: &SigningKey, serial: u32) -> Vec<u8> {
    signed_for(MACHINE, key, serial)
}

/// The image that checks signatures, with this flash (blank where there is none).
fn boot(window: Option<&mut Window>) -> Controller {
    let mut note = |note: &str| eprintln!("{note}");
    let board = Board::Mps2An386;
    let image = image::ensure_with(board, &["signed"], &mut note).unwrap();
    let mut memory: Vec<(u32, &[u8])> = vec![(NUMBER, &MACHINE)];
    if let Some(window) = window {
        memory.push((WINDOW, window.bytes_mut()));
    }
    let setup = Setup {
        memory: &memory,
        held: false,
    };
    let emulator =
        Emulator::start_with(&setup, board, Some(&image), Pace::Stepped, &mut note).unwrap();
    let link = Box::new(emulator.into_link().unwrap());
    let controller = Controller::connect(link, "qemu", 1).unwrap();
    assert_eq!(controller.identity().machine, MACHINE);
    controller
}

fn refusal<T: std::fmt::Debug>(result: Result<T, ControllerError>) -> Refusal {
    match result {
        Err(ControllerError::Refused(why)) => why,
        other => panic!("{other:?}"),
    }
}

/// What checks a signature is the deepest that there is, at boot as well: it has left something of the stack, which the board says a few
/// times a second.
fn has_stack_left(controller: &mut Controller) {
    let mut left = 0;
    for _ in 0..600 {
        left = controller.status().unwrap().stack_left_bytes;
    }
    assert!(left > 512, "{left} bytes of stack left");
}

/// All are refused; which words they get, if the controller has its key.
fn refuses_all(controller: &mut Controller, key: &SigningKey, last: u32) {
    let stranger = SigningKey::generate();
    let next = last + 1;
    let cases = [
        (largest_table(), TableError::Unsigned),
        (signed(&stranger, next), TableError::BadSignature),
        (signed_for([9; 12], key, next), TableError::OtherMachine),
        (
            signed(key, last),
            TableError::OldSerial { serial: last, last },
        ),
        (signed(key, 1), TableError::OldSerial { serial: 1, last }),
    ];
    for (table, why) in cases {
        let lost = controller.key_info().unwrap().state == KeyState::Lost;
        let expected = if lost {
            Refusal::KeyLost
        } else {
            Refusal::Table(why)
        };
        let found = refusal(controller.flash(&table, &mut |_| {}));
        assert_eq!(found, expected);
        // And there are words for what to do next.
        assert!(ControllerError::Refused(found).help().is_some());
    }
}

#[test]
fn the_image_takes_its_owners_newer_tables_alone() {
    let (key, heir) = (SigningKey::generate(), SigningKey::generate());
    let mut controller = boot(None);
    let provision = |key: &SigningKey| Command::Provision { key: key.public() };
    controller.command(provision(&key)).unwrap();
    for serial in [1, 2] {
        let table = signed(&key, serial);
        controller.flash(&table, &mut |_| {}).unwrap();
    }
    refuses_all(&mut controller, &key, 2);
    controller.reset().unwrap();
    let info = controller.key_info().unwrap();
    assert_eq!((info.state, info.serial), (KeyState::Kept, 2));
    assert!(controller.status().unwrap().active.is_some());
    refuses_all(&mut controller, &key, 2);
    // Its owner alone hands it on.
    let by_a_stranger = controller.command(heir.hand_over(&MACHINE, 1, &heir.public()));
    assert_eq!(refusal(by_a_stranger), Refusal::NotTheOwner);
    let provisioned = controller.command(provision(&heir));
    assert_eq!(refusal(provisioned), Refusal::KeyProvisioned);
    let word = key.hand_over(&MACHINE, 1, &heir.public());
    controller.command(word).unwrap();
    let before = controller.flash(&signed(&key, 3), &mut |_| {});
    assert_eq!(refusal(before), Refusal::Table(TableError::BadSignature));
    controller.flash(&signed(&heir, 3), &mut |_| {}).unwrap();
    controller.reset().unwrap();
    has_stack_left(&mut controller);
    assert_eq!(controller.key_info().unwrap().epoch, 2);
    assert!(controller.status().unwrap().active.is_some());
}

/// A flash with an owner whose table is confirmed.
fn owned(key: &SigningKey, serial: u32) -> Window {
    let mut buffer = [0; MAX_IMAGE_BYTES];
    let mut store = Store::open(Window::new(), LAYOUT, &mut buffer);
    let owner = Owner {
        epoch: 1,
        serial,
        key: key.public(),
    };
    store.keep_owner(&owner).unwrap();
    let table = signed(key, serial);
    buffer[..table.len()].copy_from_slice(&table);
    store.write(0, table.len(), &mut buffer).unwrap();
    store.confirm(0, true, &mut buffer).unwrap();
    store.into_flash()
}

/// The unit of the key is lost, or one of the two beside the configuration: nothing happens.
#[test]
fn the_image_finds_its_key_when_a_unit_is_lost() {
    let key = SigningKey::generate();
    let mut whole = owned(&key, 7);
    for unit in 2..UNITS {
        let mut window = whole.clone();
        let place = unit * UNIT as usize..(unit + 1) * UNIT as usize;
        window.bytes_mut()[place].fill(0xff);
        let mut controller = boot(Some(&mut window));
        let info = controller.key_info().unwrap();
        assert_eq!((info.state, info.serial), (KeyState::Kept, 7), "{unit}");
        has_stack_left(&mut controller);
        refuses_all(&mut controller, &key, 7);
    }
    assert!(boot(Some(&mut whole)).status().unwrap().active.is_some());
}

/// All of them are lost: nothing is taken, nothing corrects, and the key that a table there is signed with alone brings it back.
#[test]
fn the_image_is_not_open_when_its_key_is_lost() {
    let key = SigningKey::generate();
    let mut window = owned(&key, 7);
    window.bytes_mut()[2 * UNIT as usize..].fill(0xff);
    let mut controller = boot(Some(&mut window));
    assert_eq!(controller.key_info().unwrap().state, KeyState::Lost);
    assert_eq!(controller.status().unwrap().active, None);
    refuses_all(&mut controller, &key, 7);
    let own = controller.flash(&signed(&key, 8), &mut |_| {});
    assert_eq!(refusal(own), Refusal::KeyLost);
    let stranger = SigningKey::generate().public();
    let stranger = controller.command(Command::Provision { key: stranger });
    assert_eq!(refusal(stranger), Refusal::NotTheOwner);
    let key_again = Command::Provision { key: key.public() };
    controller.command(key_again).unwrap();
    assert!(controller.status().unwrap().active.is_some());
    refuses_all(&mut controller, &key, 7);
    controller.flash(&signed(&key, 8), &mut |_| {}).unwrap();
}
