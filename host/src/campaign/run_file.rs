//! The file of a run, the contract's own or a foreign one: what its columns hold, and its rows in SI.
use super::import::{Quantity, Slice};
use super::manifest::Entry;
use super::table::{self, Batch, Column, Table, Unit};
use super::{CampaignError, Place};
use std::path::PathBuf;

const MM: f64 = 1e-3;
const UM: f64 = 1e-6;

/// What a column holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field {
    pub(super) quantity: Quantity,
    /// Factor to SI that is still to be applied.
    factor: f64,
    /// Its name in words.
    pub(super) name: &'static str,
}

/// A run's file, open.
pub(super) enum RunFile<'a> {
    Own(Table),
    Foreign(PathBuf, &'a Slice),
}

impl Entry {
    /// The place of a field of a row, for checks that know only these.
    pub(super) fn place(&self, row: usize, field: usize) -> Place {
        match &self.slice {
            None => table::place(&self.path, row, field),
            Some(_) => self.row(row),
        }
    }

    /// The place of a row.
    pub(super) fn row(&self, row: usize) -> Place {
        Place::at(
            &self.path,
            self.slice.as_ref().map_or(row + 2, |slice| slice.line(row)),
            1,
        )
    }
}

impl<'a> RunFile<'a> {
    pub(super) fn open(entry: &'a Entry) -> Result<Self, CampaignError> {
        Ok(match &entry.slice {
            None => Self::Own(Table::open(&entry.path)?),
            Some(slice) => Self::Foreign(entry.path.clone(), slice),
        })
    }

    pub(super) fn fields(&self) -> Vec<Field> {
        match self {
            Self::Own(table) => table
                .header
                .iter()
                .map(|&column| Field::own(column))
                .collect(),
            Self::Foreign(_, slice) => slice.quantities().into_iter().map(Field::foreign).collect(),
        }
    }

    /// Rows to expect, unless they come at once; for a slice, those that there are.
    pub(super) fn rows(&self) -> Option<usize> {
        match self {
            Self::Own(table) => table.rows(),
            Self::Foreign(_, slice) => Some(slice.rows),
        }
    }

    /// Walks the rows in SI: `prepare` works on blocks of columns on all cores, `take` gets what it made in order.
    pub(super) fn walk<T: Send>(
        self,
        prepare: impl Fn(Batch) -> T + Sync,
        take: impl FnMut(T) -> Result<(), CampaignError>,
    ) -> Result<(), CampaignError> {
        let factors: Vec<f64> = self.fields().iter().map(|f| f.factor).collect();
        match self {
            Self::Foreign(path, slice) => slice.walk_all(&path, prepare, take),
            Self::Own(table) => table.walk(&factors, prepare, take),
        }
    }
}

impl Field {
    fn own(column: Column) -> Self {
        let (quantity, factor) = match column {
            Column::Time => (Quantity::Time, 1.0),
            Column::Angle => (Quantity::Angle, std::f64::consts::PI / 180.0),
            Column::Deviation(Unit::Um) => (Quantity::Deviation, UM),
            Column::Deviation(Unit::Mm) => (Quantity::Deviation, MM),
            Column::Radius => (Quantity::Radius, MM),
            Column::Position(axis) => (Quantity::Position(axis), MM),
        };
        Self {
            quantity,
            factor,
            name: column.name(),
        }
    }

    fn foreign(quantity: Quantity) -> Self {
        Self {
            quantity,
            factor: 1.0,
            name: match quantity {
                Quantity::Radius => "radius_mm",
                other => other.name(),
            },
        }
    }
}
