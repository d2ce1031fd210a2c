//! A table in the form that the tick runs: inverse and merged terms of each zone, in double precision, SI.
use crate::stencil::Inverse;
use giotto_shared::bounds::{OFFSET_MAX_M, SLEW_MAX_M_S};
use giotto_shared::kinematics::Kinematics;
use giotto_shared::law::{Common, Profile};
use giotto_shared::model::Cumulants;
use giotto_shared::table::{self, Arm, MAX_ZONES, Table, TableError, Travel, Zone};
use giotto_shared::term::{ProfileError, Term};

/// Why a table cannot be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LawError {
    /// Its bytes or numbers.
    Table(TableError),
    /// A term of a zone (from 0) that cannot be undone together with those before it.
    Term(usize, ProfileError),
    /// The table before is still being exchanged for the one in use.
    Busy,
}

/// One zone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ZoneLaw {
    pub(crate) inverse: Inverse,
    pub(crate) profile: Profile<f64>,
    /// Whether any profile term is there at all.
    pub(crate) has_terms: bool,
    /// The arm that is corrected through its joints, with what they have in common.
    pub(crate) arm: Option<ArmZone>,
    place_m: Option<[[f64; 2]; 3]>,
    pub(crate) radius_m: [f64; 2],
    feed_m_s: f64,
    travel: Travel,
}

/// What the path does at the place that is corrected.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Here {
    pub(crate) place_m: [f64; 3],
    pub(crate) speed_m_s: f64,
    pub(crate) centripetal_m_s2: f64,
    /// Turns counter-clockwise (`true`) or clockwise in the coordinate plane nearest to that of the turn; `None`: straight.
    pub(crate) ccw: Option<bool>,
}

/// Below this acceleration across the path it is straight, m/s².
pub(crate) const STRAIGHT_M_S2: f64 = 1e-3;
/// What feeds may be beyond a zone's and still count as meant, share.
const SLACK: f64 = 0.02;

/// An arm as a zone sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArmZone {
    pub(crate) kinematics: Kinematics<f64>,
    pub(crate) home_m: Option<[f64; 3]>,
    pub(crate) common: Common<f64>,
}

impl ArmZone {
    fn new(arm: &Arm, cumulants: &Cumulants<f64>) -> Self {
        Self {
            kinematics: arm.kinematics.map(f64::from),
            home_m: arm.home_m.map(|home| home.map(f64::from)),
            common: Common::new(cumulants),
        }
    }
}

impl ZoneLaw {
    fn new(zone: &Zone, arm: Option<&Arm>, index: usize) -> Result<Self, LawError> {
        let mut profile = Profile::default();
        for (at, term) in zone.terms.iter().enumerate() {
            let term: Term<f64> = term.map(f64::from);
            term.add_to(&mut profile)
                .map_err(|reason| LawError::Term(index, ProfileError { index: at, reason }))?;
        }
        let place_m = zone.place_m.map(|[[x0, y0, z0], [x1, y1, z1]]| {
            [[x0, x1], [y0, y1], [z0, z1]].map(|range| range.map(f64::from))
        });
        let cumulants = Cumulants {
            kappa2_s2: f64::from(zone.cumulants.kappa2_s2),
            kappa4_s4: f64::from(zone.cumulants.kappa4_s4),
        };
        Ok(Self {
            inverse: Inverse::new(&cumulants),
            arm: arm.map(|arm| ArmZone::new(arm, &cumulants)),
            profile,
            has_terms: !zone.terms.is_empty(),
            place_m,
            radius_m: zone.radius_m.map(f64::from),
            feed_m_s: f64::from(zone.feed_m_s[1]),
            travel: zone.travel,
        })
    }

    /// Where errors of position are counted from: the middle of the zone's place, if it has one.
    pub(crate) fn reference_m(&self) -> Option<[f64; 3]> {
        self.place_m
            .map(|place| place.map(|[low, high]| 0.5 * (low + high)))
    }

    /// Whether the zone holds here. A stream has no segments, so that nobody says which circle is meant: as in the engine's
    /// stream mode place and feed choose, the feed where the path turns. How hard it turns is the guard's to bound: corners
    /// are sharper than any circle that was measured, and need the correction most.
    fn fits(&self, here: &Here) -> bool {
        let inside = |(value, [low, high]): (f64, [f64; 2])| {
            let slack = 1e-6 * value.abs();
            value >= low - slack && value <= high + slack
        };
        let place = self
            .place_m
            .is_none_or(|place| here.place_m.into_iter().zip(place).all(inside));
        if !place || here.centripetal_m_s2 < STRAIGHT_M_S2 {
            return place;
        }
        let travel = match (self.travel, here.ccw) {
            (Travel::Both, _) | (_, None) => true,
            (Travel::Ccw, Some(ccw)) => ccw,
            (Travel::Cw, Some(ccw)) => !ccw,
        };
        travel && here.speed_m_s <= self.feed_m_s * (1.0 + SLACK)
    }
}

/// A whole table.
#[derive(Clone, Debug)]
pub struct Law {
    zones: [Option<ZoneLaw>; MAX_ZONES],
    /// Bounds of table and image, the harder of each.
    pub(crate) offset_m: f64,
    pub(crate) slew_m_s: f64,
}

impl Law {
    /// No zones: corrects nothing.
    pub const fn none() -> Self {
        Self {
            zones: [None; MAX_ZONES],
            offset_m: 0.0,
            slew_m_s: 0.0,
        }
    }

    /// From the bytes of a table, checked as a board checks them.
    ///
    /// # Errors
    /// [`LawError`]; the law is as it was.
    pub fn load(&mut self, image: &[u8], place: &mut Table) -> Result<(), LawError> {
        table::decode_into(image, place).map_err(LawError::Table)?;
        let mut zones = [None; MAX_ZONES];
        for (index, (built, zone)) in zones.iter_mut().zip(&place.zones).enumerate() {
            *built = Some(ZoneLaw::new(zone, place.arm.as_ref(), index)?);
        }
        *self = Self {
            zones,
            offset_m: f64::from(place.limits.offset_m.min(OFFSET_MAX_M)),
            slew_m_s: f64::from(place.limits.slew_m_s.min(SLEW_MAX_M_S)),
        };
        Ok(())
    }

    /// Longest lag of a zone, s.
    pub(crate) fn lag_s(&self) -> f64 {
        let lags = self.zones.iter().flatten().map(|zone| zone.inverse.lag_s);
        lags.fold(0.0, f64::max)
    }

    /// The first zone that holds here.
    pub(crate) fn choose(&self, here: &Here) -> Option<usize> {
        self.zones
            .iter()
            .position(|zone| zone.as_ref().is_some_and(|zone| zone.fits(here)))
    }

    pub(crate) fn zone(&self, index: usize) -> Option<&ZoneLaw> {
        self.zones.get(index).and_then(Option::as_ref)
    }
}
