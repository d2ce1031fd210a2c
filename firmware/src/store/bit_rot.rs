//! Random sequences of what is done to a store, with cells that lose or gain a bit between them, and resets: whatever is booted was
//! once stored, whole.
extern crate std;
use super::ram::RamFlash;
use super::{ImageBuffer, Layout, Store};
use crate::engine::Config;
use giotto_shared::model::Cumulants;
use giotto_shared::table::{self, Limits, MAX_IMAGE_BYTES, Table, Terms, Travel, Zone};
use giotto_shared::wire::{MachineConfig, SlotState};
use proptest::prelude::*;
use std::vec::Vec;

const SIZE: usize = 5120;
const ERASE: usize = 512;
const LAYOUT: Layout = Layout::new([0, 2048], 2048).with_config([4096, 4608]);

type Cells = RamFlash<SIZE, ERASE>;

#[derive(Clone, Debug)]
enum Act {
    /// A table of this number into the slot that does not boot, and whether it is confirmed.
    Flash(u8, bool),
    /// The other table is confirmed anew.
    RollBack,
    Configure(u8),
    /// A bit of a cell turns over.
    Rot(usize, u8),
    Reset,
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        3 => (0..6u8, any::<bool>()).prop_map(|(number, confirmed)| Act::Flash(number, confirmed)),
        1 => Just(Act::RollBack),
        3 => (0..9u8).prop_map(Act::Configure),
        2 => (0..SIZE, 0..8u8).prop_map(|(cell, bit)| Act::Rot(cell, bit)),
        2 => Just(Act::Reset),
    ]
}

fn image(number: u8) -> Vec<u8> {
    let zone = Zone {
        place_m: None,
        radius_m: [0.05, 0.3],
        feed_m_s: [0.02, 0.1 * f32::from(number + 1)],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 4e-5,
            kappa4_s4: -5e-6,
        },
        terms: Terms::new(),
    };
    let table = Table {
        machine: heapless::String::new(),
        zones: [zone].into_iter().collect(),
        limits: Limits {
            offset_m: 1e-3,
            slew_m_s: 0.05,
        },
        arm: None,
    };
    let mut bytes = std::vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

fn config(number: u8) -> MachineConfig {
    MachineConfig {
        feed_m_s: 0.1 * f32::from(number + 1),
        ..Config::robot(1000).said()
    }
}

/// What is there is something that was once put there.
fn sound(store: &mut Store<Cells>, buffer: &mut ImageBuffer, tables: &[u8], configs: &[u8]) {
    for slot in store.confirmed().into_iter().flatten() {
        let loaded = store.load(slot, buffer).unwrap().to_vec();
        let known = tables.iter().any(|number| image(*number) == loaded);
        assert!(known, "slot {slot} boots what was never stored");
    }
    if let Some(found) = store.config(&Config::robot(1000).said()) {
        let known = configs.iter().any(|number| config(*number) == found);
        assert!(known, "{found:?} was never stored");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn what_boots_was_once_stored_whole(acts in proptest::collection::vec(act(), 1..60)) {
        let mut buffer = [0; MAX_IMAGE_BYTES];
        let mut store = Store::open(Cells::new(), LAYOUT, &mut buffer);
        let (mut tables, mut configs, mut rotten) = (Vec::new(), Vec::new(), false);
        for act in acts {
            match act {
                Act::Flash(number, confirmed) => {
                    let slot = store.confirmed()[0].map_or(0, |slot| 1 - slot);
                    let bytes = image(number);
                    buffer[..bytes.len()].copy_from_slice(&bytes);
                    // A slot is erased first: what has rotted there is gone.
                    store.write(slot, bytes.len(), &mut buffer).unwrap();
                    tables.push(number);
                    let written = matches!(store.state(slot), SlotState::Table(_));
                    prop_assert!(written);
                    if confirmed {
                        store.confirm(slot, false, &mut buffer).unwrap();
                        prop_assert_eq!(store.confirmed()[0], Some(slot));
                    }
                }
                Act::RollBack => {
                    if let [_, Some(other)] = store.confirmed() {
                        // Refused once sixteen confirmations are full, or where a cell is spoilt.
                        let _ = store.confirm(other, false, &mut buffer);
                    }
                }
                Act::Configure(number) => {
                    let kept = store.keep_config(&config(number));
                    configs.push(number);
                    if !rotten {
                        kept.unwrap();
                        prop_assert_eq!(store.config(&Config::robot(1000).said()), Some(config(number)));
                    }
                }
                Act::Rot(cell, bit) => {
                    store.flash_mut().bytes_mut()[cell] ^= 1 << bit;
                    rotten = true;
                }
                Act::Reset => {}
            }
            // As a boot finds it.
            let cells = store.into_flash();
            store = Store::open(cells, LAYOUT, &mut buffer);
            sound(&mut store, &mut buffer, &tables, &configs);
        }
    }
}
