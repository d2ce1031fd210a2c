//! Where a command writes: checked before the work begins, written whole at its end.
use super::Failure;
use super::failure::cannot_write;
use giotto::whole_file;
use giotto_shared::table::image;
use std::io::Read;
use std::path::{Path, PathBuf};

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A page: report, comparison, history.
    Html,
    /// A drawing.
    Svg,
    /// A model, fitted or extended.
    Model,
    /// The runs that `giotto simulate` reads.
    Plan,
    /// The `campaign.toml` of a campaign.
    Campaign,
    /// A TOML file of something else.
    OtherToml,
    /// A table for the controller.
    Table,
    /// Set-points or measurements.
    Csv,
    /// A program of a machine tool or a robot, or other text.
    Text,
    /// A table in Parquet.
    Parquet,
    /// A page for a printer.
    Pdf,
    /// Anything else.
    Other,
}

/// Most bytes of an existing file that are looked at.
const LOOKED_AT: u64 = 1 << 20;

impl Kind {
    /// For a person.
    const fn words(self) -> &'static str {
        match self {
            Self::Html => "an HTML page",
            Self::Svg => "an SVG drawing",
            Self::Model => "a model",
            Self::Plan => "a plan",
            Self::Campaign => "the manifest of a campaign",
            Self::OtherToml => "a TOML file",
            Self::Table => "a controller's table",
            Self::Csv => "a CSV file",
            Self::Text => "a program or text",
            Self::Parquet => "a Parquet file",
            Self::Pdf => "a PDF file",
            Self::Other => "a file of another kind",
        }
    }

    /// What these bytes are; the name decides between kinds of text. `None`: empty, so nothing is lost with it.
    fn of(bytes: &[u8], path: &Path) -> Option<Self> {
        if bytes.is_empty() {
            return None;
        }
        for (magic, kind) in [
            (&image::MAGIC[..], Self::Table),
            (b"PAR1", Self::Parquet),
            (b"%PDF-", Self::Pdf),
        ] {
            if bytes.starts_with(magic) {
                return Some(kind);
            }
        }
        let Ok(text) = std::str::from_utf8(bytes) else {
            return Some(Self::Other);
        };
        if text.contains('\0') {
            return Some(Self::Other);
        }
        let start = text.trim_start().to_ascii_lowercase();
        if start.starts_with("<!doctype html") || start.starts_with("<html") {
            return Some(Self::Html);
        }
        if start.starts_with("<svg") || (start.starts_with("<?xml") && start.contains("<svg")) {
            return Some(Self::Svg);
        }
        if let Ok(document) = text.parse::<toml_edit::DocumentMut>()
            && !document.is_empty()
        {
            return Some(Self::of_toml(&document));
        }
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        Some(match extension.to_ascii_lowercase().as_str() {
            "csv" => Self::Csv,
            "toml" => Self::OtherToml,
            "json" | "html" | "svg" | "bin" | "parquet" | "rs" | "py" | "md" => Self::Other,
            _ => Self::Text,
        })
    }

    fn of_toml(document: &toml_edit::DocumentMut) -> Self {
        let runs_have = |key: &str| {
            document
                .get("run")
                .and_then(|runs| runs.as_array_of_tables())
                .is_some_and(|runs| runs.iter().any(|run| run.contains_key(key)))
        };
        if document.contains_key("servo") && document.contains_key("format") {
            Self::Model
        } else if runs_have("file") {
            Self::Campaign
        } else if document.contains_key("campaign")
            && ["run", "grid", "machine"]
                .iter()
                .any(|key| document.contains_key(key))
        {
            Self::Plan
        } else {
            Self::OtherToml
        }
    }
}

/// A place that may be written.
#[derive(Clone, Debug)]
pub struct Destination(PathBuf);

impl Destination {
    /// Checks the place before any work is done: it is none of `inputs`, what stands there is of the same kind, may be
    /// written, and its directory exists. Inside a campaign's directory nothing is written over its files.
    ///
    /// # Errors
    /// The reason (exit 3).
    pub fn new(path: &Path, kind: Kind, inputs: &[&Path]) -> Result<Self, Failure> {
        let shown = path.display();
        if let Some(input) = inputs.iter().find(|input| same_file(path, input)) {
            return Err(Failure::input(format_args!(
                "{shown}: is the input {}; it would be lost",
                input.display()
            ))
            .help("give another path for the output"));
        }
        for folder in inputs.iter().filter(|input| input.is_dir()) {
            if path.exists() && runs_of(folder).iter().any(|file| same_file(path, file)) {
                return Err(Failure::input(format_args!(
                    "{shown}: belongs to the campaign {}; it would be lost",
                    folder.display()
                ))
                .help("give another path for the output"));
            }
        }
        let failed = |error: std::io::Error| cannot_write(path, &error);
        match std::fs::metadata(path) {
            Ok(found) if found.is_dir() => Err(failed(std::io::Error::new(
                std::io::ErrorKind::IsADirectory,
                "is a directory",
            ))),
            Ok(found) if found.is_file() => {
                if found.permissions().readonly() {
                    return Err(failed(std::io::Error::new(
                        std::io::ErrorKind::PermissionDenied,
                        "the file is marked read-only",
                    )));
                }
                let mut bytes = Vec::new();
                std::fs::File::open(path)
                    .and_then(|file| file.take(LOOKED_AT).read_to_end(&mut bytes))
                    .map_err(failed)?;
                match Kind::of(&bytes, path) {
                    Some(other) if other != kind => Err(Failure::input(format_args!(
                        "{shown}: holds {}, and {} was to be written; it is left as it is",
                        other.words(),
                        kind.words()
                    ))
                    .help("give another path for the output, or remove this file first")),
                    _ => Ok(Self(path.to_path_buf())),
                }
            }
            Ok(_) => Ok(Self(path.to_path_buf())),
            Err(_) => {
                let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
                if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
                    return Err(failed(std::io::Error::new(
                        std::io::ErrorKind::NotFound,
                        format!("{} is no directory", folder.display()),
                    )));
                }
                Ok(Self(path.to_path_buf()))
            }
        }
    }

    /// The same for an option that may be missing.
    pub fn maybe(
        path: Option<&Path>,
        kind: Kind,
        inputs: &[&Path],
    ) -> Result<Option<Self>, Failure> {
        path.map(|path| Self::new(path, kind, inputs)).transpose()
    }

    /// Refuses two results in one file, before either is made.
    ///
    /// # Errors
    /// Two of the places are the same (exit 2).
    pub fn apart(places: &[Option<&Path>]) -> Result<(), Failure> {
        let whole = |path: &Path| std::path::absolute(path).ok();
        let given: Vec<&Path> = places.iter().flatten().copied().collect();
        for (k, place) in given.iter().enumerate() {
            let same = |other: &&Path| same_file(place, other) || whole(place) == whole(other);
            if given[..k].iter().any(same) {
                return Err(Failure::usage(format_args!(
                    "{}: two results cannot go into one file",
                    place.display()
                ))
                .help("give each a path of its own"));
            }
        }
        Ok(())
    }

    /// The place.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes the file whole.
    ///
    /// # Errors
    /// What the operating system says (exit 3); an older file is then as it was.
    pub fn write(&self, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
        whole_file::write(&self.0, bytes.as_ref()).map_err(|error| cannot_write(&self.0, &error))
    }
}

/// The files of a campaign's directory: its manifest and its runs.
fn runs_of(folder: &Path) -> Vec<PathBuf> {
    let manifest = folder.join("campaign.toml");
    let runs = std::fs::read_to_string(&manifest)
        .ok()
        .and_then(|text| text.parse::<toml_edit::DocumentMut>().ok())
        .and_then(|document| {
            let runs = document.get("run")?.as_array_of_tables()?;
            let file = |run: &toml_edit::Table| Some(folder.join(run.get("file")?.as_str()?));
            Some(runs.iter().filter_map(file).collect::<Vec<_>>())
        });
    std::iter::once(manifest)
        .chain(runs.unwrap_or_default())
        .collect()
}

fn same_file(a: &Path, b: &Path) -> bool {
    match (std::fs::canonicalize(a), std::fs::canonicalize(b)) {
        // A device such as /dev/stdin is nothing that can be lost.
        (Ok(a), Ok(b)) => a == b && a.is_file(),
        _ => false,
    }
}

/// A path as a shell takes it.
pub fn quoted(path: impl AsRef<Path>) -> String {
    let name = path.as_ref().to_string_lossy();
    let plain = |c: char| c.is_alphanumeric() || "-_.+/:\\@%,=".contains(c);
    if !name.is_empty() && name.chars().all(plain) {
        name.into_owned()
    } else {
        format!("'{}'", name.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_told_by_what_is_in_the_file() {
        let model = "format = 1\ncampaign = \"a\"\n[servo]\nkind = \"lag\"\nkv_per_s = 40.0\n";
        let campaign = "[campaign]\nname = \"a\"\n[[run]]\nfile = \"a.csv\"\n";
        let plan = "# words\n[campaign]\nname = \"a\"\n[[run]]\nradius_mm = 100.0\n";
        for (text, name, kind) in [
            (model, "a", Some(Kind::Model)),
            (campaign, "a", Some(Kind::Campaign)),
            (plan, "a", Some(Kind::Plan)),
            (
                "[package]\nname = \"a\"\n",
                "Cargo.toml",
                Some(Kind::OtherToml),
            ),
            ("<!DOCTYPE html><p>", "a", Some(Kind::Html)),
            ("<svg xmlns=\"\">", "a", Some(Kind::Svg)),
            ("G0 X20 Y0\nG3 I-20 F1500\n", "plate.nc", Some(Kind::Text)),
            ("time_s,x_mm\n0,0\n", "a.csv", Some(Kind::Csv)),
            ("fn main() {}\n", "a.rs", Some(Kind::Other)),
            ("\u{0}\u{1}", "a", Some(Kind::Other)),
            ("PAR1...", "a", Some(Kind::Parquet)),
            ("", "a", None),
        ] {
            assert_eq!(Kind::of(text.as_bytes(), Path::new(name)), kind, "{text}");
        }
    }

    #[test]
    fn paths_are_quoted_where_a_shell_would_take_them_apart() {
        assert_eq!(quoted("a/b-1.toml"), "a/b-1.toml");
        assert_eq!(quoted("my part.toml"), "'my part.toml'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
        assert_eq!(quoted("$(rm)"), "'$(rm)'");
    }
}
