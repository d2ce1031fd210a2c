//! A table from a file: a table as it is, or a model from which one is made.
use super::{Failure, Output};
use giotto::model_file::ModelFile;
use giotto::table_from_model::table_from_model;
use giotto_shared::table::{self, MAX_IMAGE_BYTES, Table, TableError, image};
use std::io::ErrorKind;
use std::path::Path;

/// Most bytes looked at: no model is longer.
const MOST: u64 = 1 << 20;

/// A table and its bytes.
pub(super) struct TableFile {
    pub(super) table: Table,
    pub(super) image: Vec<u8>,
}

/// Reads a table, or makes one of a model.
pub(super) fn read(path: &Path, out: Output) -> Result<TableFile, Failure> {
    let shown = path.display();
    let expected = "a table (TABLE.bin) or a model (MODEL.toml)";
    let metadata = std::fs::metadata(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => {
            Failure::input(format_args!("{shown}: no such file; expected {expected}"))
                .help("check the path")
        }
        _ => Failure::input(format_args!("{shown}: cannot be read: {error}")),
    })?;
    if metadata.is_dir() {
        return Err(
            Failure::input(format_args!("{shown}: is a directory; expected {expected}"))
                .help("check the path"),
        );
    }
    if metadata.len() > MOST {
        return Err(Failure::input(format_args!(
            "{shown}: {} bytes; expected {expected}",
            metadata.len()
        )));
    }
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::input(format_args!("{shown}: cannot be read: {error}")))?;
    if bytes.starts_with(&image::MAGIC) {
        let table = table::decode(&bytes).map_err(|error| bad_table(path, &error))?;
        return Ok(TableFile {
            table,
            image: bytes,
        });
    }
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Err(Failure::input(format_args!(
            "{shown}: not a giotto table; expected {expected}"
        ))
        .help("make one: giotto table MODEL.toml -o TABLE.bin"));
    }
    from_model(path, out)
}

/// Makes the table of a model.
pub(super) fn from_model(path: &Path, out: Output) -> Result<TableFile, Failure> {
    let model = ModelFile::load(path)?;
    let made = table_from_model(&model).map_err(|error| {
        Failure::input(format_args!("{}: {error}", path.display()))
            .help("check the model's coefficients and ranges; a controller has bounds of its own")
    })?;
    for cause in &made.left_out {
        out.note(format_args!(
            "note: {} cannot be corrected by a controller and is left out",
            cause.model().words().name
        ));
    }
    let image = encode(&made.table).map_err(|error| bad_table(path, &error))?;
    Ok(TableFile {
        table: made.table,
        image,
    })
}

fn encode(table: &Table) -> Result<Vec<u8>, TableError> {
    let mut bytes = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(table, &mut bytes)?;
    bytes.truncate(length);
    Ok(bytes)
}

fn bad_table(path: &Path, error: &TableError) -> Failure {
    let failure = Failure::input(format_args!("{}: {error}", path.display()));
    match error {
        TableError::NewerVersion { .. } => {
            failure.help("use the giotto that wrote it, or a newer one")
        }
        _ => failure.help("make the table anew: giotto table MODEL.toml -o TABLE.bin"),
    }
}
