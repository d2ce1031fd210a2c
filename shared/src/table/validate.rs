//! Every way in which a table can be wrong, each its own error. Whatever passes may be handed to the engine.
use super::{Arm, Limits, Table, Zone};
use crate::kinematics::Kinematics;
use crate::term::{Number, Term, Unfit};
use crate::{Actuator, bounds};
use serde::{Deserialize, Serialize};

/// Which number of a table an error speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the name is the field of the table")]
pub enum Field {
    LimitOffset,
    LimitSlew,
    Place,
    Radius,
    Feed,
    Kappa2,
    Kappa4,
    Term(Number),
    ArmLength,
    ArmLink,
    Orientation,
}

impl Field {
    /// The field in words, with its unit.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LimitOffset => "largest offset (m)",
            Self::LimitSlew => "largest offset rate (m/s)",
            Self::Place => "place (m)",
            Self::Radius => "radius (m)",
            Self::Feed => "feed (m/s)",
            Self::Kappa2 => "kappa2 (s^2)",
            Self::Kappa4 => "kappa4 (s^4)",
            Self::Term(number) => number.name(),
            Self::ArmLength => "length of the arm (m)",
            Self::ArmLink => "link of the arm (m)",
            Self::Orientation => "orientation of the tool (length of a quaternion)",
        }
    }
}

impl core::fmt::Display for Field {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Zone an error speaks of, 1-based in words; [`Where::HEAD`] for the table itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Where(pub Option<u8>);

impl Where {
    /// Not in a zone.
    pub const HEAD: Self = Self(None);
}

impl core::fmt::Display for Where {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.0 {
            Some(zone) => write!(f, "zone {}", u16::from(zone) + 1),
            None => f.write_str("limits"),
        }
    }
}

/// Why bytes are not a table that may be used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TableError {
    /// The first bytes are not those of a table.
    #[error("not a giotto table")]
    NotATable,
    /// Fewer bytes than the header announces.
    #[error("table cut short: {have} of {need} bytes")]
    Truncated {
        /// Bytes at hand.
        have: u32,
        /// Bytes the header needs or announces.
        need: u32,
    },
    /// The header announces more than any table has, or more bytes follow than it announces.
    #[error("table of {length} bytes, expected at most {max}")]
    TooLong {
        /// Announced or present length.
        length: u32,
        /// Longest accepted.
        max: u32,
    },
    /// Bytes changed on the way.
    #[error("table CRC is {stored:08x}, its bytes give {computed:08x}")]
    BadCrc {
        /// CRC in the header.
        stored: u32,
        /// CRC of the bytes.
        computed: u32,
    },
    /// Written by a newer giotto.
    #[error("table format {version} is newer than this build's {supported}")]
    NewerVersion {
        /// Version in the header.
        version: u16,
        /// Newest version this build reads.
        supported: u16,
    },
    /// A version that never existed.
    #[error("unknown table format {version}")]
    UnknownVersion {
        /// Version in the header.
        version: u16,
    },
    /// Same version, other contents: made by a build whose types differ.
    #[error("table schema {found:08x}, this build has {expected:08x}")]
    SchemaMismatch {
        /// Hash in the header.
        found: u32,
        /// Hash of this build.
        expected: u32,
    },
    /// A flag bit that this format does not define.
    #[error("table with unknown flags {flags:04x}")]
    UnknownFlags {
        /// The flags of the header.
        flags: u16,
    },
    /// The CRC holds but the body is no table.
    #[error("table body cannot be read")]
    Malformed,
    /// A table without zones corrects nothing.
    #[error("table without zones")]
    NoZones,
    /// NaN or infinity.
    #[error("{at}: {field} is not a finite number")]
    NonFinite {
        /// Which zone.
        at: Where,
        /// Which number.
        field: Field,
    },
    /// A number beyond the bounds of the image.
    #[error("{at}: {field} is {value}, allowed are {lo} to {hi}")]
    OutOfBounds {
        /// Which zone.
        at: Where,
        /// Which number.
        field: Field,
        /// Its value.
        value: f32,
        /// Smallest allowed.
        lo: f32,
        /// Largest allowed.
        hi: f32,
    },
    /// A range whose lower end is above its upper one.
    #[error("{at}: {field} range is empty, {lo} to {hi}")]
    EmptyRange {
        /// Which zone.
        at: Where,
        /// Which range.
        field: Field,
        /// Lower end.
        lo: f32,
        /// Upper end.
        hi: f32,
    },
    /// The controller demands a signature and the table has none.
    #[error("table is not signed, and this controller accepts signed tables only")]
    Unsigned,
    /// The signature is not that of these bytes by the provisioned key.
    #[error("table signature does not fit its bytes and the controller's key")]
    BadSignature,
    /// Written by an older giotto, whose terms had no plane.
    #[error(
        "table format {version} is older than this build's {supported}: its terms do not say which plane they are of"
    )]
    OlderVersion {
        /// Version in the header.
        version: u16,
        /// Version this build reads.
        supported: u16,
    },
    /// A joint in a term that is of slides.
    #[error("{at}: a term of slides is for {actuator}")]
    Joint {
        /// Which zone.
        at: Where,
        /// The joint.
        actuator: Actuator,
    },
    /// A sideways term that names one slide twice.
    #[error("{at}: a term shifts {actuator} across {actuator} itself")]
    SameActuator {
        /// Which zone.
        at: Where,
        /// The slide.
        actuator: Actuator,
    },
    /// A slide in a term that is of joints.
    #[error("{at}: a term of joints is for {actuator}")]
    Slide {
        /// Which zone.
        at: Where,
        /// The slide.
        actuator: Actuator,
    },
    /// A term of joints in a table without the arm that it goes through.
    #[error("{at}: a term is for a joint, and the table has no arm")]
    NoArm {
        /// Which zone.
        at: Where,
    },
    /// Signed, but for no machine in particular.
    #[error("table is signed but bound to no machine and serial")]
    Unbound,
    /// Signed for another controller.
    #[error("table is signed for another machine")]
    OtherMachine,
    /// A newer one has been confirmed before.
    #[error("table has serial {serial}, and this controller has already confirmed serial {last}")]
    OldSerial {
        /// Of the table.
        serial: u32,
        /// The highest one confirmed.
        last: u32,
    },
}

/// Checks of the numbers in one place of the table.
struct Check(Where);

impl Check {
    fn within(&self, field: Field, value: f32, [lo, hi]: [f32; 2]) -> Result<(), TableError> {
        if !value.is_finite() {
            return Err(TableError::NonFinite { at: self.0, field });
        }
        if value < lo || value > hi {
            return Err(TableError::OutOfBounds {
                at: self.0,
                field,
                value,
                lo,
                hi,
            });
        }
        Ok(())
    }

    fn magnitude(&self, field: Field, value: f32, most: f32) -> Result<(), TableError> {
        self.within(field, value, [-most, most])
    }

    fn range(&self, field: Field, [lo, hi]: [f32; 2], bound: [f32; 2]) -> Result<(), TableError> {
        self.within(field, lo, bound)?;
        self.within(field, hi, bound)?;
        if lo > hi {
            return Err(TableError::EmptyRange {
                at: self.0,
                field,
                lo,
                hi,
            });
        }
        Ok(())
    }

    fn term(&self, term: &Term<f32>) -> Result<(), TableError> {
        let at = self.0;
        term.validate().map_err(|unfit| match unfit {
            Unfit::NotFinite(number) => TableError::NonFinite {
                at,
                field: Field::Term(number),
            },
            Unfit::OutOfBounds {
                number,
                value,
                lo,
                hi,
            } => TableError::OutOfBounds {
                at,
                field: Field::Term(number),
                value,
                lo,
                hi,
            },
            Unfit::Joint(actuator) => TableError::Joint { at, actuator },
            Unfit::Slide(actuator) => TableError::Slide { at, actuator },
            Unfit::Same(actuator) => TableError::SameActuator { at, actuator },
        })
    }
}

/// Longest length of an arm, m.
const ARM_MAX_M: f32 = 10.0;
/// Shortest link, m.
const LINK_MIN_M: f32 = 1.0e-3;
/// Length of a quaternion of single precision, from files that round to four digits.
const UNIT: [f32; 2] = [0.998, 1.002];

/// An arm is needed.
pub(super) fn no_arm(of_arm: Option<u8>) -> Result<(), TableError> {
    of_arm.map_or(Ok(()), |zone| {
        Err(TableError::NoArm {
            at: Where(Some(zone)),
        })
    })
}

impl Arm {
    /// Checks lengths and orientation.
    ///
    /// # Errors
    /// [`TableError::NonFinite`], [`TableError::OutOfBounds`]; [`TableError::Malformed`] for slides.
    pub fn validate(&self) -> Result<(), TableError> {
        let check = Check(Where::HEAD);
        let length = |value| check.magnitude(Field::ArmLength, value, ARM_MAX_M);
        let link = |value| check.within(Field::ArmLink, value, [LINK_MIN_M, ARM_MAX_M]);
        match &self.kinematics {
            Kinematics::Slides => return Err(TableError::Malformed),
            Kinematics::Scara(scara) => {
                link(scara.l1_m)?;
                link(scara.l2_m)?;
            }
            Kinematics::Opw(opw) => {
                let beside = [opw.a1_m, opw.a2_m, opw.b_m, opw.c1_m, opw.c4_m];
                beside.into_iter().chain(opw.tool_m).try_for_each(length)?;
                link(opw.c2_m)?;
                link(opw.c3_m)?;
                let square: f32 = opw.orientation.iter().map(|part| part * part).sum();
                check.within(Field::Orientation, libm::sqrtf(square), UNIT)?;
            }
        }
        let mut home = self.home_m.iter().flatten();
        home.try_for_each(|place| check.magnitude(Field::Place, *place, bounds::PLACE_MAX_M))
    }
}

impl Limits {
    /// Checks the bounds of the table against those of the image.
    pub fn validate(&self) -> Result<(), TableError> {
        let check = Check(Where::HEAD);
        check.within(
            Field::LimitOffset,
            self.offset_m,
            [0.0, bounds::OFFSET_MAX_M],
        )?;
        check.within(Field::LimitSlew, self.slew_m_s, [0.0, bounds::SLEW_MAX_M_S])
    }
}

impl Zone {
    pub(super) fn validate(&self, index: usize) -> Result<(), TableError> {
        let check = Check(Where(Some(index as u8)));
        if let Some([lo, hi]) = self.place_m {
            for (lo, hi) in lo.into_iter().zip(hi) {
                check.range(
                    Field::Place,
                    [lo, hi],
                    [-bounds::PLACE_MAX_M, bounds::PLACE_MAX_M],
                )?;
            }
        }
        check.range(
            Field::Radius,
            self.radius_m,
            [bounds::RADIUS_MIN_M, bounds::RADIUS_MAX_M],
        )?;
        check.range(
            Field::Feed,
            self.feed_m_s,
            [bounds::FEED_MIN_M_S, bounds::FEED_MAX_M_S],
        )?;
        check.magnitude(
            Field::Kappa2,
            self.cumulants.kappa2_s2,
            bounds::KAPPA2_MAX_S2,
        )?;
        check.magnitude(
            Field::Kappa4,
            self.cumulants.kappa4_s4,
            bounds::KAPPA4_MAX_S4,
        )?;
        self.terms.iter().try_for_each(|term| check.term(term))
    }
}

impl Table {
    /// Checks every number against the bounds of the image; the first that fails is named.
    ///
    /// # Errors
    /// [`TableError::NoZones`], [`TableError::NonFinite`], [`TableError::OutOfBounds`], [`TableError::EmptyRange`].
    pub fn validate(&self) -> Result<(), TableError> {
        self.limits.validate()?;
        if self.zones.is_empty() {
            return Err(TableError::NoZones);
        }
        let mut zones = self.zones.iter().enumerate();
        zones.try_for_each(|(index, zone)| zone.validate(index))?;
        if let Some(arm) = &self.arm {
            return arm.validate();
        }
        let mut zones = self.zones.iter();
        let of_arm = zones.position(|zone| zone.terms.iter().any(Term::is_of_arm));
        no_arm(of_arm.map(|zone| zone as u8))
    }
}
