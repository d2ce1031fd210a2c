//! The table parser: any bytes are a table or an error, and every table that passes may be handed to the engine.
use giotto_firmware::engine::{Config, Planner};
use giotto_shared::model::Cumulants;
use giotto_shared::table::{self, Limits, MAX_IMAGE_BYTES, Table, Travel, Zone};
use giotto_shared::term::Term;
use giotto_shared::wire::Crc32;
use giotto_shared::{Actuator, Plane};
use std::sync::OnceLock;

/// Makes length and CRC of a header right, so that what is behind it is reached.
pub fn mend(image: &mut [u8]) {
    if image.len() < 20 {
        return;
    }
    let length = image.len() as u32;
    image[..4].copy_from_slice(b"GIOT");
    image[8..12].copy_from_slice(&length.to_le_bytes());
    let crc = Crc32::new().with(&image[..12]).with(&image[16..]).value();
    image[12..16].copy_from_slice(&crc.to_le_bytes());
}

/// Reads the bytes behind the first one as a table.
pub fn run(bytes: &[u8]) {
    let Some((how, bytes)) = bytes.split_first() else {
        return;
    };
    let mut image = bytes.to_vec();
    if how & 1 == 1 {
        mend(&mut image);
    }
    let checked = table::check(&image);
    let decoded = table::decode(&image);
    assert_eq!(
        checked.is_ok(),
        decoded.is_ok(),
        "{checked:?} and {decoded:?}"
    );
    let Ok(table) = decoded else { return };
    table.validate().expect("what was decoded is valid");
    let mut again = [0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut again).expect("what was decoded can be encoded");
    assert_eq!(
        table::decode(&again[..length]).expect("and decoded again"),
        table
    );
    // Any table that passes: the engine takes it, or says which term it cannot undo.
    let config = Config::robot(1000);
    let _ = Planner::new(&config, [0; 3]).set_table(Some(&table));
}

/// Whole tables: the paper's robot; one zone with every kind of term.
pub fn tables() -> &'static [Vec<u8>; 2] {
    static TABLES: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
    TABLES.get_or_init(encoded)
}

fn encoded() -> [Vec<u8>; 2] {
    let mut zone = Zone {
        place_m: None,
        radius_m: [0.05, 0.3],
        feed_m_s: [0.02, 0.7],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 46.58e-6,
            kappa4_s4: -5.53e-6,
        },
        terms: heapless::Vec::new(),
    };
    let image = |zone: &Zone| {
        let mut table = Table::empty();
        table.limits = Limits {
            offset_m: 2e-3,
            slew_m_s: 0.1,
        };
        let _ = table.zones.push(zone.clone());
        let mut out = [0; MAX_IMAGE_BYTES];
        let length = table::encode(&table, &mut out).unwrap_or(0);
        out[..length].to_vec()
    };
    let plain = image(&zone);
    let (actuator, across) = (Actuator::Z, Actuator::X);
    let plane = Plane::Zx;
    let terms = [
        Term::RadiusOffset { offset_m: 1e-5 },
        Term::ScaleMismatch {
            plane,
            relative: 1e-4,
        },
        Term::Squareness {
            plane,
            shear_rad: 1e-4,
        },
        Term::ServoMismatch {
            plane,
            delta_tau_s: 1e-4,
        },
        Term::Backlash {
            actuator,
            step_m: 1e-5,
        },
        Term::ReversalSpike {
            actuator,
            peak_m: 5e-6,
            decay_s: 0.02,
        },
        Term::Cyclic {
            actuator,
            amplitude_m: 2e-6,
            pitch_m: 0.01,
            phase_rad: 0.5,
        },
        Term::Straightness {
            actuator,
            across,
            curvature_per_m: 1e-4,
        },
    ];
    zone.terms.extend(terms);
    zone.place_m = Some([[-1.0; 3], [1.0; 3]]);
    [plain, image(&zone)]
}

/// Tables, with and without the header made right.
pub fn seeds() -> Vec<Vec<u8>> {
    tables()
        .iter()
        .flat_map(|image| [0, 1].map(|how| [&[how], &image[..]].concat()))
        .collect()
}
