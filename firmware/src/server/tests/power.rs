//! Power fails during every byte and every erasure of everything that writes, torn in every way: the next
//! boot has the old or the new table, whole, and the one that was promised if a promise was given.
use super::*;

/// What a host does, with the table expected after it succeeded.
type Scenario = (&'static str, fn(&mut Desk) -> bool, Option<&'static str>);

const SCENARIOS: [Scenario; 4] = [
    ("flash", |desk| desk.flash("new"), Some("new")),
    (
        "write and commit, never confirm",
        |desk| desk.write(&image("new")) && desk.done(Command::Commit),
        None,
    ),
    (
        "rollback",
        |desk| desk.done(Command::Rollback),
        Some("older"),
    ),
    (
        "flash, then roll back",
        |desk| desk.flash("new") && desk.done(Command::Rollback),
        None, // back to the old one
    ),
];

fn starts() -> [(&'static str, Cells); 4] {
    let mut empty = boot(Cells::new(), None, Tear::Untouched);
    assert!(!empty.done(Command::Confirm));
    let mut one = boot(Cells::new(), None, Tear::Untouched);
    assert!(one.flash("old"));
    let mut two = boot(Cells::new(), None, Tear::Untouched);
    assert!(two.flash("older") && two.flash("old"));
    let mut rolled = boot(Cells::new(), None, Tear::Untouched);
    assert!(rolled.flash("old") && rolled.flash("older") && rolled.done(Command::Rollback));
    [
        ("empty", empty.cells()),
        ("one", one.cells()),
        ("two", two.cells()),
        ("rolled", rolled.cells()),
    ]
}

/// Boots and says which table corrects; panics if it is not one of those that were flashed.
fn booted(cells: Cells) -> Option<String> {
    let mut desk = boot(cells, None, Tear::Untouched);
    let name = desk.correcting();
    if let Some(name) = &name {
        let status = desk.status();
        let length = image(name).len();
        let slot = status.active.unwrap();
        let mut stored = std::vec![0; length];
        desk.server.store_mut().read(slot, 0, &mut stored).unwrap();
        assert_eq!(stored, image(name), "{name} is not whole");
    }
    name
}

#[test]
fn any_cut_leaves_the_old_or_the_new_table() {
    let mut boots = 0;
    for (start, cells) in starts() {
        let old = booted(cells.clone());
        for (what, act, promised) in SCENARIOS {
            if what == "rollback" && !matches!(start, "two" | "rolled") {
                continue;
            }
            if what == "flash, then roll back" && start == "empty" {
                continue;
            }
            let mut whole = boot(cells.clone(), None, Tear::Untouched);
            assert!(act(&mut whole), "{start}: {what}");
            let steps = whole.server.store_mut().flash_mut().steps();
            let new = promised.map(str::to_string);
            let finally = booted(whole.cells());
            assert_eq!(
                finally,
                if new.is_some() {
                    new.clone()
                } else {
                    old.clone()
                },
                "{start}: {what}"
            );
            for tear in Tear::ALL {
                for after in 1..=steps {
                    let mut desk = boot(cells.clone(), Some(after), tear);
                    let promise = act(&mut desk);
                    let found = booted(desk.cells());
                    boots += 1;
                    let case =
                        std::format!("{start}: {what}, cut in step {after} of {steps}, {tear:?}");
                    if promise {
                        assert_eq!(found, finally, "{case}: promised, not kept");
                    } else if what == "flash, then roll back" {
                        assert!(
                            found == old || found.as_deref() == Some("new"),
                            "{case}: {found:?}"
                        );
                    } else {
                        assert!(found == old || found == new, "{case}: {found:?}");
                    }
                }
            }
        }
    }
    assert!(boots > 3000, "{boots}");
}

/// A second cut during the repair of the first.
#[test]
fn two_cuts_in_a_row_leave_a_whole_table() {
    let [.., (_, cells)] = starts();
    let mut whole = boot(cells.clone(), None, Tear::Untouched);
    assert!(whole.flash("new"));
    let steps = whole.server.store_mut().flash_mut().steps();
    for first in 1..=steps {
        for second in (1..=steps).step_by(7) {
            let tear = Tear::ALL[(first % 4) as usize];
            let mut desk = boot(cells.clone(), Some(first), tear);
            desk.flash("new");
            let mut desk = boot(desk.cells(), Some(second), Tear::ALL[(second % 4) as usize]);
            desk.flash("newer");
            let found = booted(desk.cells());
            assert!(
                matches!(found.as_deref(), Some("old" | "new" | "newer")),
                "cuts in step {first} and {second}: {found:?}"
            );
        }
    }
}

/// After any cut the controller can be flashed again.
#[test]
fn any_cut_can_be_repaired() {
    let [.., (_, cells), _] = starts();
    for tear in Tear::ALL {
        for after in 1..=200 {
            let mut desk = boot(cells.clone(), Some(after), tear);
            desk.flash("new");
            let mut desk = desk.reboot();
            assert!(desk.flash("newest"), "cut in step {after}, {tear:?}");
            assert_eq!(booted(desk.cells()).as_deref(), Some("newest"));
        }
    }
}

#[test]
fn flash_that_does_not_read_back_is_never_committed() {
    let mut desk = boot(Cells::new(), None, Tear::Untouched);
    assert!(desk.flash("old"));
    let mut desk = Desk {
        server: stuck(desk.cells()),
        seq: 0,
    };
    assert!(desk.ask(Command::Hello).is_some() && desk.upload(&image("new")));
    let reply = desk.ask(Command::WriteEnd);
    assert!(
        matches!(reply, Some(Reply::Refused(Refusal::Flash(_)))),
        "{reply:?}"
    );
    assert!(!desk.done(Command::Commit));
    assert_eq!(booted(desk.cells()).as_deref(), Some("old"));
}

/// A controller whose flash went dead during its second erase unit.
fn stuck(cells: Cells) -> Server<Flash, Bench, Box<Buffers>> {
    Server::boot(
        BOARD,
        Flash::new(cells, Some(2), Tear::Partly),
        LAYOUT,
        Bench::new(),
        Box::default(),
    )
}
