//! The rows as Parquet: columns with names and units, uncompressed, readable by pandas, DuckDB, Polars and the like.
use super::date::Date;
use super::{CampaignRow, FindingRow};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::{Field, Row};
use parquet::schema::parser::parse_message_type;
use std::fs::File;
use std::sync::Arc;

/// Why a store cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// What the format says.
    #[error("{0}")]
    Parquet(#[from] ParquetError),
    /// A column is missing or of another type.
    #[error(
        "row {row}: expected a column {column} ({kind}); this is no history of giotto, or of another version"
    )]
    Column {
        /// Row, from 1.
        row: usize,
        /// Column.
        column: &'static str,
        /// Its type.
        kind: &'static str,
    },
}

/// A column with its name.
enum Column {
    Date(&'static str, Vec<i32>),
    Text(&'static str, Vec<String>),
    Whole(&'static str, Vec<i32>),
    Flag(&'static str, Vec<bool>),
    Real(&'static str, Vec<f64>),
}

impl Column {
    fn schema(&self) -> String {
        match self {
            Self::Date(name, _) => format!("required int32 {name} (DATE);"),
            Self::Text(name, _) => format!("required binary {name} (STRING);"),
            Self::Whole(name, _) => format!("required int32 {name};"),
            Self::Flag(name, _) => format!("required boolean {name};"),
            Self::Real(name, _) => format!("required double {name};"),
        }
    }
}

fn encode(name: &str, columns: &[Column]) -> Result<Vec<u8>, StoreError> {
    let fields: String = columns.iter().map(Column::schema).collect();
    let schema = Arc::new(parse_message_type(&format!(
        "message {name} {{ {fields} }}"
    ))?);
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(Vec::new(), schema, properties)?;
    let mut group = file.next_row_group()?;
    for column in columns {
        let Some(mut out) = group.next_column()? else {
            break;
        };
        match column {
            Column::Date(_, values) | Column::Whole(_, values) => {
                out.typed::<Int32Type>().write_batch(values, None, None)?;
            }
            Column::Text(_, values) => {
                let bytes: Vec<ByteArray> = values
                    .iter()
                    .map(|v| ByteArray::from(v.as_bytes().to_vec()))
                    .collect();
                out.typed::<ByteArrayType>()
                    .write_batch(&bytes, None, None)?;
            }
            Column::Flag(_, values) => {
                out.typed::<BoolType>().write_batch(values, None, None)?;
            }
            Column::Real(_, values) => {
                out.typed::<DoubleType>().write_batch(values, None, None)?;
            }
        }
        out.close()?;
    }
    group.close()?;
    Ok(file.into_inner()?)
}

/// The campaigns as a Parquet file.
///
/// # Errors
/// Those of the format; in memory there are none.
pub fn encode_campaigns(rows: &[CampaignRow]) -> Result<Vec<u8>, StoreError> {
    let text = |of: fn(&CampaignRow) -> &str| rows.iter().map(|r| of(r).to_owned()).collect();
    let real = |of: fn(&CampaignRow) -> f64| rows.iter().map(of).collect();
    encode(
        "campaign",
        &[
            Column::Date("date", rows.iter().map(|r| r.date.days).collect()),
            Column::Text("folder", text(|r| &r.folder)),
            Column::Text("name", text(|r| &r.name)),
            Column::Text("machine", text(|r| &r.machine)),
            Column::Text("data_sha256", text(|r| &r.data_sha256)),
            Column::Whole("runs", rows.iter().map(|r| r.runs).collect()),
            Column::Flag("proven", rows.iter().map(|r| r.proven).collect()),
            Column::Real("noise_um", real(|r| r.noise_um)),
            Column::Real("spread_um", real(|r| r.spread_um)),
            Column::Real("unexplained_um", real(|r| r.unexplained_um)),
            Column::Real("g_um", real(|r| r.g_um)),
            Column::Real("g_b_um", real(|r| r.g_b_um)),
            Column::Real("d_um", real(|r| r.d_um)),
        ],
    )
}

/// The findings as a Parquet file.
///
/// # Errors
/// As [`encode_campaigns`].
pub fn encode_findings(rows: &[FindingRow]) -> Result<Vec<u8>, StoreError> {
    let text = |of: fn(&FindingRow) -> &str| rows.iter().map(|r| of(r).to_owned()).collect();
    let real = |of: fn(&FindingRow) -> f64| rows.iter().map(of).collect();
    encode(
        "finding",
        &[
            Column::Text("data_sha256", text(|r| &r.data_sha256)),
            Column::Date("date", rows.iter().map(|r| r.date.days).collect()),
            Column::Text("cause", text(|r| &r.cause)),
            Column::Text("actuators", text(|r| &r.actuators)),
            Column::Text("unit", text(|r| &r.unit)),
            Column::Real("value", real(|r| r.value)),
            Column::Real("low", real(|r| r.low)),
            Column::Real("high", real(|r| r.high)),
            Column::Real("rms_um", real(|r| r.rms_um)),
            Column::Real("probability", real(|r| r.probability)),
        ],
    )
}

/// A row whose columns are asked for by name.
struct Named {
    row: Row,
    number: usize,
}

impl Named {
    fn get<T>(
        &self,
        column: &'static str,
        kind: &'static str,
        read: impl Fn(&Field) -> Option<T>,
    ) -> Result<T, StoreError> {
        let found = self.row.get_column_iter().find(|(name, _)| *name == column);
        found
            .and_then(|(_, field)| read(field))
            .ok_or(StoreError::Column {
                row: self.number,
                column,
                kind,
            })
    }

    fn text(&self, column: &'static str) -> Result<String, StoreError> {
        self.get(column, "text", |field| match field {
            Field::Str(text) => Some(text.clone()),
            _ => None,
        })
    }

    fn real(&self, column: &'static str) -> Result<f64, StoreError> {
        self.get(column, "number", |field| match field {
            Field::Double(value) => Some(*value),
            _ => None,
        })
    }

    fn date(&self) -> Result<Date, StoreError> {
        self.get("date", "day", |field| match field {
            Field::Date(days) => Some(Date { days: *days }),
            _ => None,
        })
    }
}

fn decode<T>(
    file: File,
    read: impl Fn(&Named) -> Result<T, StoreError>,
) -> Result<Vec<T>, StoreError> {
    let reader = SerializedFileReader::new(file)?;
    let mut out = Vec::new();
    for (at, row) in reader.get_row_iter(None)?.enumerate() {
        let named = Named {
            row: row?,
            number: at + 1,
        };
        out.push(read(&named)?);
    }
    Ok(out)
}

/// The campaigns of a Parquet file; further columns are passed over.
///
/// # Errors
/// A file that is no Parquet, and a column that is missing.
pub fn decode_campaigns(file: File) -> Result<Vec<CampaignRow>, StoreError> {
    decode(file, |row| {
        Ok(CampaignRow {
            date: row.date()?,
            folder: row.text("folder")?,
            name: row.text("name")?,
            machine: row.text("machine")?,
            data_sha256: row.text("data_sha256")?,
            runs: row.get("runs", "whole number", |field| match field {
                Field::Int(value) => Some(*value),
                _ => None,
            })?,
            proven: row.get("proven", "true or false", |field| match field {
                Field::Bool(value) => Some(*value),
                _ => None,
            })?,
            noise_um: row.real("noise_um")?,
            spread_um: row.real("spread_um")?,
            unexplained_um: row.real("unexplained_um")?,
            g_um: row.real("g_um")?,
            g_b_um: row.real("g_b_um")?,
            d_um: row.real("d_um")?,
        })
    })
}

/// The findings of a Parquet file.
///
/// # Errors
/// As [`decode_campaigns`].
pub fn decode_findings(file: File) -> Result<Vec<FindingRow>, StoreError> {
    decode(file, |row| {
        Ok(FindingRow {
            data_sha256: row.text("data_sha256")?,
            date: row.date()?,
            cause: row.text("cause")?,
            actuators: row.text("actuators")?,
            unit: row.text("unit")?,
            value: row.real("value")?,
            low: row.real("low")?,
            high: row.real("high")?,
            rms_um: row.real("rms_um")?,
            probability: row.real("probability")?,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Seek, SeekFrom, Write};

    fn file(bytes: &[u8]) -> File {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file
    }

    fn campaign() -> CampaignRow {
        CampaignRow {
            date: Date::new(2026, 5, 14).unwrap(),
            folder: "2026-05-14 mill".into(),
            name: "Fräse \"2\"".into(),
            machine: "mill".into(),
            data_sha256: "ab".repeat(32),
            runs: 24,
            proven: true,
            noise_um: 1.0,
            spread_um: 0.5,
            unexplained_um: 0.0,
            g_um: 12.25,
            g_b_um: 20.5,
            d_um: -277.125,
        }
    }

    #[test]
    fn rows_come_back_as_they_were() {
        let row = campaign();
        let bytes = encode_campaigns(&[row.clone(), row.clone()]).unwrap();
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
        assert_eq!(
            decode_campaigns(file(&bytes)).unwrap(),
            [row.clone(), row.clone()]
        );
        let finding = FindingRow {
            data_sha256: row.data_sha256,
            date: row.date,
            cause: "backlash".into(),
            actuators: "x".into(),
            unit: "mm".into(),
            value: 0.012,
            low: 0.011,
            high: 0.013,
            rms_um: 3.0,
            probability: 0.999,
        };
        let bytes = encode_findings(std::slice::from_ref(&finding)).unwrap();
        assert_eq!(decode_findings(file(&bytes)).unwrap(), [finding]);
        assert_eq!(
            decode_findings(file(&encode_findings(&[]).unwrap())).unwrap(),
            []
        );
    }

    #[test]
    fn what_is_no_store_is_refused() {
        let bytes = encode_campaigns(&[campaign()]).unwrap();
        assert!(matches!(
            decode_findings(file(&bytes)),
            Err(StoreError::Column {
                row: 1,
                column: "cause",
                ..
            })
        ));
        assert!(decode_campaigns(file(b"time_s,x_mm\n")).is_err());
        assert!(decode_campaigns(file(&bytes[..bytes.len() / 2])).is_err());
    }
}
