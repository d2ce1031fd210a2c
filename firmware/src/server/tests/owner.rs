//! Whose tables are taken, and in which order: what is refused, with which words, and what power and rot leave of it.
use super::*;
use crate::store::StoredKey;
use ed25519_compact::{KeyPair, Seed};
use giotto_shared::table::TableError;
use giotto_shared::table::image::{Binding, SIGNATURE_BYTES, attach_signature};
use giotto_shared::wire::{KeyInfo, KeyState, replacement};

fn pair(number: u8) -> KeyPair {
    KeyPair::from_seed(Seed::new([number; 32]))
}

fn public(number: u8) -> [u8; 32] {
    *pair(number).pk
}

/// A table of this name, signed with key `number` for a machine.
fn signed_for(machine: [u8; 12], number: u8, serial: u32, name: &str) -> Vec<u8> {
    let mut out = image(name);
    out.resize(MAX_IMAGE_BYTES, 0);
    let sign = |head: &[u8], body: &[u8]| *pair(number).sk.sign([head, body].concat(), None);
    let length = attach_signature(&mut out, &Binding { machine, serial }, sign).unwrap();
    out.truncate(length);
    out
}

fn signed(number: u8, serial: u32, name: &str) -> Vec<u8> {
    signed_for(BOARD.machine, number, serial, name)
}

/// The owner of key `old` hands number `epoch` of a machine to key `new`.
fn handed(machine: [u8; 12], old: u8, epoch: u32, new: u8) -> Command {
    let key = public(new);
    let word = pair(old).sk.sign(replacement(&machine, epoch, &key), None);
    Command::ReplaceKey {
        key,
        signature: Chunk::from_slice(&*word).unwrap(),
    }
}

impl Desk {
    /// Written, committed, confirmed; or the first refusal.
    fn give(&mut self, table: &[u8]) -> Result<(), Refusal> {
        assert!(self.upload(table));
        for command in [Command::WriteEnd, Command::Commit, Command::Confirm] {
            if let Some(Reply::Refused(why)) = self.ask(command) {
                return Err(why);
            }
        }
        Ok(())
    }

    fn refusal(&mut self, command: Command) -> Option<Refusal> {
        match self.ask(command) {
            Some(Reply::Refused(why)) => Some(why),
            _ => None,
        }
    }

    fn key_info(&mut self) -> KeyInfo {
        match self.ask(Command::Key) {
            Some(Reply::Key(info)) => info,
            other => panic!("{other:?}"),
        }
    }
}

/// A controller with key 1 whose table "new" has serial 5, and before it "old" had 4.
fn owned() -> Desk {
    let mut desk = boot(Cells::new(), None, Tear::Untouched);
    assert!(desk.done(Command::Provision { key: public(1) }));
    desk.give(&signed(1, 4, "old")).unwrap();
    desk.give(&signed(1, 5, "new")).unwrap();
    desk
}

/// Everything that is not the owner's newest table for this machine.
fn foreign() -> [(&'static str, Vec<u8>, TableError); 6] {
    let mut altered = signed(1, 9, "altered");
    let other = signed(1, 9, "another");
    let signature = altered.len() - SIGNATURE_BYTES;
    let foreign_signature: [u8; SIGNATURE_BYTES] =
        other[other.len() - SIGNATURE_BYTES..].try_into().unwrap();
    altered.truncate(signature);
    altered.resize(MAX_IMAGE_BYTES, 0);
    let bound = Binding {
        machine: BOARD.machine,
        serial: 9,
    };
    let length = attach_signature(&mut altered, &bound, |_, _| foreign_signature).unwrap();
    altered.truncate(length);
    let old = |serial| TableError::OldSerial { serial, last: 5 };
    [
        ("unsigned", image("plain"), TableError::Unsigned),
        ("replayed", signed(1, 4, "old"), old(4)),
        ("replayed, the newest", signed(1, 5, "new"), old(5)),
        (
            "another machine's",
            signed_for([2; 12], 1, 9, "theirs"),
            TableError::OtherMachine,
        ),
        (
            "another key's",
            signed(2, 9, "forged"),
            TableError::BadSignature,
        ),
        ("altered", altered, TableError::BadSignature),
    ]
}

#[test]
fn only_the_owners_newer_tables_for_this_machine_are_taken() {
    let mut desk = owned();
    for (what, table, why) in foreign() {
        assert_eq!(desk.give(&table), Err(Refusal::Table(why)), "{what}");
        assert_eq!(desk.correcting().as_deref(), Some("new"), "{what}");
    }
    // All the same after a reset, with the serial kept.
    let mut desk = desk.reboot();
    assert_eq!(desk.key_info().serial, 5);
    for (what, table, why) in foreign() {
        assert_eq!(desk.give(&table), Err(Refusal::Table(why)), "{what}");
    }
    desk.give(&signed(1, 6, "newer")).unwrap();
    assert_eq!(desk.correcting().as_deref(), Some("newer"));
    // Back to the table in the other slot, and its serial is no way back for others.
    assert!(desk.done(Command::Rollback));
    assert_eq!(desk.correcting().as_deref(), Some("new"));
    let why = TableError::OldSerial { serial: 6, last: 6 };
    let replayed = desk.give(&signed(1, 6, "newer"));
    assert_eq!(replayed, Err(Refusal::Table(why)));
    assert_eq!(desk.reboot().correcting().as_deref(), Some("new"));
}

/// A table on probation that is not confirmed spends no serial: it may come again.
#[test]
fn a_probation_spends_no_serial() {
    let mut desk = owned();
    let table = signed(1, 6, "newer");
    assert!(desk.write(&table) && desk.done(Command::Commit));
    let mut desk = desk.reboot();
    assert_eq!(desk.correcting().as_deref(), Some("new"));
    desk.give(&table).unwrap();
    assert_eq!(desk.key_info().serial, 6);
}

#[test]
fn the_key_is_handed_on_by_its_owner_alone() {
    let mut desk = owned();
    let here = BOARD.machine;
    let nobody = Some(Refusal::NotTheOwner);
    // By a stranger, for another machine, for another time, without a signature, by provisioning.
    assert_eq!(desk.refusal(handed(here, 2, 1, 2)), nobody);
    assert_eq!(desk.refusal(handed([2; 12], 1, 1, 2)), nobody);
    assert_eq!(desk.refusal(handed(here, 1, 2, 2)), nobody);
    let (key, signature) = (public(2), Chunk::new());
    assert_eq!(desk.refusal(Command::ReplaceKey { key, signature }), nobody);
    let provisioned = desk.refusal(Command::Provision { key });
    assert_eq!(provisioned, Some(Refusal::KeyProvisioned));
    assert_eq!(desk.key_info().key, public(1));
    // By the owner: tables of the key before correct no more, serials go on.
    let word = handed(here, 1, 1, 2);
    assert!(desk.done(word.clone()));
    let info = desk.key_info();
    assert_eq!((info.key, info.epoch, info.serial), (public(2), 2, 5));
    assert_eq!(desk.correcting(), None);
    let why = Err(Refusal::Table(TableError::BadSignature));
    assert_eq!(desk.give(&signed(1, 9, "before")), why);
    let why = Err(Refusal::Table(TableError::OldSerial { serial: 5, last: 5 }));
    assert_eq!(desk.give(&signed(2, 5, "low")), why);
    desk.give(&signed(2, 6, "after")).unwrap();
    let mut desk = desk.reboot();
    assert_eq!(desk.correcting().as_deref(), Some("after"));
    // Back to the first key, and the first word is no word any more.
    assert!(desk.done(handed(here, 2, 2, 1)));
    assert_eq!(desk.refusal(word), nobody);
    assert_eq!(desk.key_info().epoch, 3);
}

#[test]
fn nothing_is_handed_on_where_there_is_no_key() {
    let mut desk = boot(Cells::new(), None, Tear::Untouched);
    let replaced = desk.refusal(handed(BOARD.machine, 1, 1, 2));
    assert_eq!(replaced, Some(Refusal::NoKey));
    assert_eq!(desk.key_info().state, KeyState::None);
    desk.give(&image("plain")).unwrap();
    // An unsigned table does not outlive the first key.
    assert!(desk.done(Command::Provision { key: public(1) }));
    assert_eq!(desk.correcting(), None);
}

/// All that is kept of the key is lost, copies and all: no table is taken, none corrects, and the key comes back by the table that it
/// has signed alone.
#[test]
fn a_controller_whose_key_is_lost_is_not_open() {
    for lost in [0xff, 0x00, 0x5a] {
        let mut cells = owned().cells();
        cells.bytes_mut()[2 * SLOT..].fill(lost);
        let mut desk = boot(cells, None, Tear::Untouched);
        assert_eq!(desk.key_info().state, KeyState::Lost);
        assert_eq!(desk.correcting(), None);
        for (what, table, _) in foreign() {
            assert_eq!(desk.give(&table), Err(Refusal::KeyLost), "{what}");
        }
        assert_eq!(desk.give(&signed(1, 9, "true")), Err(Refusal::KeyLost));
        let handed_on = desk.refusal(handed(BOARD.machine, 1, 1, 2));
        assert_eq!(handed_on, Some(Refusal::KeyLost));
        let stranger = desk.refusal(Command::Provision { key: public(2) });
        assert_eq!(stranger, Some(Refusal::NotTheOwner));
        assert!(!desk.done(Command::Rollback));
        assert_eq!(desk.correcting(), None);
        if lost != 0xff {
            // No blank cell is left for it.
            continue;
        }
        assert!(desk.done(Command::Provision { key: public(1) }));
        assert_eq!(desk.correcting().as_deref(), Some("new"));
        assert_eq!(desk.key_info().serial, 5);
        let mut desk = desk.reboot();
        let why = TableError::OldSerial { serial: 5, last: 5 };
        assert_eq!(desk.give(&signed(1, 5, "new")), Err(Refusal::Table(why)));
    }
}

/// Power fails in every byte and erasure of a table's way to its confirmation, torn in every way: after the boot either the table
/// before corrects and the new one may come again, or the new one does and may not.
#[test]
fn a_cut_never_leaves_a_serial_behind_its_table() {
    let cells = owned().cells();
    let table = signed(1, 6, "newer");
    let mut counted = boot(cells.clone(), None, Tear::Untouched);
    counted.give(&table).unwrap();
    let steps = counted.server.store_mut().flash_mut().steps();
    let mut new = 0;
    for tear in Tear::ALL {
        for after in (1..=steps).rev().take(320) {
            let mut cut = boot(cells.clone(), Some(after), tear);
            let given = cut.give(&table).is_ok();
            let mut desk = cut.reboot();
            let what = std::format!("{after} {tear:?}");
            match desk.correcting().as_deref() {
                Some("newer") => {
                    new += 1;
                    assert_eq!(desk.key_info().serial, 6, "{what}");
                    let why = TableError::OldSerial { serial: 6, last: 6 };
                    let replayed = desk.give(&table);
                    assert_eq!(replayed, Err(Refusal::Table(why)), "{what}");
                }
                Some("new") => {
                    assert!(!given, "{what}");
                    assert_eq!(desk.key_info().serial, 5, "{what}");
                    desk.give(&table).unwrap();
                }
                other => panic!("{what}: {other:?}"),
            }
            assert_eq!(
                desk.server.store_mut().key(),
                StoredKey::Key(crate::store::Owner {
                    epoch: 1,
                    serial: 6,
                    key: public(1)
                }),
                "{what}"
            );
        }
    }
    assert!(new > 100, "{new} cuts left the new table");
}
