//! What a machine makes of set-points: the contour error, corrected and not, through the simulated machine of the host.
//!
//! The machine is a position loop behind a moving average, the same on both axes, as fast as machines are that are asked for
//! 5 m/s² and 100 m/s³. It knows nothing of the correction, and the table nothing of it but its two cumulants.
use giotto::simulation::machine::{AccDec, PositionLoop};
use giotto::simulation::{Hold, Machine, SetPoints, drive};
use giotto_link::Recording;
use giotto_shared::Frame;
use giotto_shared::model::Cumulants;
use giotto_shared::table::{self, Limits, MAX_IMAGE_BYTES, Table, Travel, Zone};

/// Time constant of the position loop, and length of the moving average, s.
const LAG_S: f64 = 0.008;
const AVERAGE_S: f64 = 0.016;
/// Set-points of rest behind the last one, in which the machine arrives.
const ARRIVAL: usize = 300;

/// The machine.
fn machine() -> Machine {
    let servo = [PositionLoop {
        kv_per_s: 1.0 / LAG_S,
        feed_forward: 0.0,
    }; 3];
    Machine {
        acc_dec: AccDec::MovingAverage(AVERAGE_S),
        servo,
        ..Machine::default()
    }
}

/// A table that corrects this machine.
pub fn table() -> Vec<u8> {
    let (t2, m2) = (LAG_S * LAG_S, AVERAGE_S * AVERAGE_S);
    let zone = Zone {
        place_m: None,
        radius_m: [0.001, 1.0],
        feed_m_s: [0.001, 1.0],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: (t2 + m2 / 12.0) as f32,
            kappa4_s4: (6.0 * t2 * t2 - m2 * m2 / 120.0) as f32,
        },
        terms: table::Terms::new(),
    };
    let mut table = Table {
        limits: Limits {
            offset_m: 5e-3,
            slew_m_s: 0.1,
        },
        ..Table::empty()
    };
    table.machine = "contour".chars().collect();
    let _ = table.zones.push(zone); // an empty list takes one
    let mut bytes = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap_or(0);
    bytes.truncate(length);
    bytes
}

/// Largest distances of the machine's path from the programmed one, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// With the corrected set-points.
    pub corrected: f64,
    /// With the programmed ones.
    pub uncorrected: f64,
}

impl Errors {
    /// What is left, as a share.
    pub fn left(&self) -> f64 {
        self.corrected / self.uncorrected
    }
}

/// The errors of a recorded run; `distance` is that of a point from the programmed path, m.
pub fn errors(recording: &Recording, distance: &dyn Fn([f64; 2]) -> f64) -> Errors {
    let largest = |pick: fn(&giotto_link::SetPointRecord) -> [f64; 3]| {
        let mut position_m: Vec<[f64; 3]> = recording.points.iter().map(pick).collect();
        let end = position_m.last().copied().unwrap_or_default();
        position_m.extend([end; ARRIVAL]);
        let set_points = SetPoints {
            dt_s: recording.dt_s,
            position_m: &position_m,
            centre_m: [0.0; 3],
            frame: Frame::default(),
            started_s: 0.0,
            hold: Hold::Cubic,
        };
        let path = drive(&machine(), &set_points).position_m;
        path.into_iter()
            .map(|[x, y, _]| distance([x, y]).abs())
            .fold(0.0, f64::max)
    };
    Errors {
        corrected: largest(|point| point.corrected_m),
        uncorrected: largest(|point| point.programmed_m),
    }
}
