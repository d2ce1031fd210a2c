//! The table as the planner uses it: each zone's operator and merged terms, checked once.
use giotto_shared::law::{Common, Operator, Profile};
use giotto_shared::table::{Arm, Limits, MAX_ZONES, Table, Travel, Zone};
use giotto_shared::term::{self, ProfileError};

/// Why a table cannot be used. Zones count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZoneError {
    /// A number of this zone, or of the limits (`None`), is not finite, or a limit is not positive.
    Value(Option<usize>),
    /// A term of this zone.
    Term(usize, ProfileError),
}

/// What a segment asks the table.
pub(crate) struct Asked<'a> {
    /// Places that an arm has to reach.
    pub(crate) path_m: &'a [[f32; 3]],
    /// Centre of an arc, middle of a line.
    pub(crate) place_m: [f32; 3],
    pub(crate) radius_m: Option<f32>,
    pub(crate) feed_m_s: f32,
    pub(crate) ccw: Option<bool>,
}

/// A zone ready for use.
#[derive(Clone, Debug)]
pub(crate) struct Built {
    pub(crate) operator: Operator<f32>,
    /// κ3/6, s³, assumed (see [`third_of_lag_and_average`](giotto_shared::model::Cumulants::third_of_lag_and_average)): used where the feed changes on an arc.
    pub(crate) third_s3: f32,
    /// `None`: no profile terms.
    pub(crate) profile: Option<Profile<f32>>,
    /// Where position errors are counted from: the middle of the zone's place.
    pub(crate) reference_m: Option<[f32; 3]>,
    /// What all joints of an arm have in common.
    pub(crate) common: Common<f32>,
    /// Tells the zones of all tables apart; never 0.
    pub(crate) number: u16,
}

impl Built {
    /// Merges the terms of zone `index`.
    fn new(zone: &Zone, index: usize) -> Result<Self, ZoneError> {
        let cumulants = zone.cumulants;
        let bounds = [zone.radius_m, zone.feed_m_s];
        let numbers = bounds.iter().flatten();
        if !(numbers.copied().all(f32::is_finite)
            && cumulants.kappa2_s2.is_finite()
            && cumulants.kappa4_s4.is_finite()
            && zone
                .place_m
                .iter()
                .flatten()
                .flatten()
                .all(|v| v.is_finite()))
        {
            return Err(ZoneError::Value(Some(index)));
        }
        let profile = if zone.terms.is_empty() {
            None
        } else {
            Some(term::merged(&zone.terms).map_err(|e| ZoneError::Term(index, e))?)
        };
        let reference_m = zone.place_m.map(|[[x0, y0, z0], [x1, y1, z1]]| {
            [0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1)]
        });
        let third_s3 = cumulants.third_of_lag_and_average() / 6.0;
        Ok(Self {
            operator: Operator::new(&cumulants),
            common: Common::new(&cumulants),
            number: 0,
            third_s3,
            profile,
            reference_m,
        })
    }
}

/// The table in use. A zone is built when a segment asks for it: eight built zones take three times the memory of
/// the table.
#[derive(Clone, Debug)]
pub(crate) struct Zones {
    table: Table,
    /// Tables so far.
    tables: u16,
}

impl Default for Zones {
    fn default() -> Self {
        Self {
            table: Table::empty(),
            tables: 0,
        }
    }
}

impl Zones {
    /// Lets `fill` write a table in place and checks it. On an error no table is in use.
    pub(crate) fn load<E: From<ZoneError>>(
        &mut self,
        fill: impl FnOnce(&mut Table) -> Result<(), E>,
    ) -> Result<(), E> {
        let loaded = fill(&mut self.table).and_then(|()| Ok(check(&self.table)?));
        self.tables = self.tables.wrapping_add(1);
        if loaded.is_err() {
            self.clear();
        }
        loaded
    }

    /// No table.
    pub(crate) fn clear(&mut self) {
        self.table.zones.clear();
        self.table.arm = None;
        self.table.limits = Limits {
            offset_m: 0.0,
            slew_m_s: 0.0,
        };
    }

    /// The first zone that fits.
    pub(crate) fn choose(&self, asked: &Asked<'_>) -> Option<Built> {
        let mut zones = self.table.zones.iter();
        let index = zones.position(|zone| fits(zone, asked))?;
        if !self.arm().is_none_or(|arm| reaches(arm, asked.path_m)) {
            return None;
        }
        // Checked when it was loaded.
        let built = Built::new(self.table.zones.get(index)?, 0).ok()?;
        let of_table = self.tables.wrapping_mul(MAX_ZONES as u16);
        Some(Built {
            number: of_table.wrapping_add(index as u16).max(1),
            ..built
        })
    }

    /// The arm that the table corrects through its joints.
    pub(crate) const fn arm(&self) -> Option<&Arm> {
        self.table.arm.as_ref()
    }

    /// The table's limits; 0 without a table.
    pub(crate) fn limits(&self) -> Limits {
        self.table.limits
    }
}

/// Whether a table can be used.
pub(crate) fn check(table: &Table) -> Result<(), ZoneError> {
    let limit = |v: f32| v.is_finite() && v > 0.0;
    if !(limit(table.limits.offset_m) && limit(table.limits.slew_m_s)) {
        return Err(ZoneError::Value(None));
    }
    // An arm that cannot stand where its zeros and lengths are counted from is none.
    let stands = |arm: &Arm| {
        arm.home_m
            .is_none_or(|home| arm.kinematics.angles(home).is_ok())
    };
    if !table.arm.as_ref().is_none_or(stands) {
        return Err(ZoneError::Value(None));
    }
    table
        .zones
        .iter()
        .enumerate()
        .try_for_each(|(index, zone)| Built::new(zone, index).map(drop))
}

/// Whether an arm can stand at all of these places.
fn reaches(arm: &Arm, path_m: &[[f32; 3]]) -> bool {
    let kinematics = &arm.kinematics;
    path_m.iter().all(|place| kinematics.angles(*place).is_ok())
}

fn fits(zone: &Zone, asked: &Asked<'_>) -> bool {
    // Programmed values and bounds are rounded to single precision: a bound that was meant to be met is met.
    let inside = |value: f32, [low, high]: [f32; 2]| {
        let slack = 1e-6 * value.abs();
        value >= low - slack && value <= high + slack
    };
    let travel = match (zone.travel, asked.ccw) {
        (Travel::Both, _) | (_, None) => true,
        (Travel::Ccw, Some(ccw)) => ccw,
        (Travel::Cw, Some(ccw)) => !ccw,
    };
    let place = zone.place_m.is_none_or(|[low, high]| {
        asked
            .place_m
            .iter()
            .zip(low)
            .zip(high)
            .all(|((&c, low), high)| inside(c, [low, high]))
    });
    let radius = asked
        .radius_m
        .is_none_or(|radius| inside(radius, zone.radius_m));
    travel && place && radius && inside(asked.feed_m_s, zone.feed_m_s)
}
