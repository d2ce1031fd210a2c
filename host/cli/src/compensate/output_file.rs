//! Where a program goes: whole or not at all, and over nothing that is no program.
use crate::Failure;
use crate::failure::cannot_write;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A place that may be written.
pub(super) struct OutputFile<'a> {
    named: &'a Path,
    /// Behind links.
    real: PathBuf,
    /// A pipe or a device: written as it goes.
    streams: bool,
}

impl<'a> OutputFile<'a> {
    /// Refuses the inputs, folders and files of another kind.
    pub(super) fn at(path: &'a Path, inputs: &[&Path]) -> Result<Self, Failure> {
        let refused = |what: &str| {
            Failure::input(format_args!(
                "{}: {what}; expected the name of a new program, or of one that may be replaced",
                path.display()
            ))
            .help("choose another path with -o")
        };
        let real = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        if inputs
            .iter()
            .any(|input| std::fs::canonicalize(input).is_ok_and(|input| input == real))
        {
            return Err(refused("is read by this command"));
        }
        let found = std::fs::metadata(&real).ok();
        let streams = found.as_ref().is_some_and(|m| !m.is_file() && !m.is_dir());
        if let Some(found) = found.filter(|_| !streams) {
            let program = |bytes: &[u8]| {
                bytes.is_empty()
                    || (!bytes.contains(&0)
                        && (giotto_nc::rapid::is_rapid(bytes) || giotto_nc::is_program(bytes))
                        && !looks_like_data(bytes))
            };
            if found.is_dir() {
                return Err(refused("cannot write: it is a folder"));
            }
            if found.permissions().readonly() {
                return Err(refused("cannot write: it is read-only"));
            }
            if !std::fs::read(&real).is_ok_and(|bytes| program(&bytes)) {
                return Err(refused("is there already and is no program"));
            }
        }
        Ok(Self {
            named: path,
            real,
            streams,
        })
    }

    /// Writes beside it and puts it in its place at the end.
    pub(super) fn write(
        &self,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let failed = |e: io::Error| cannot_write(self.named, &e);
        if self.streams {
            let file = std::fs::OpenOptions::new()
                .write(true)
                .open(&self.real)
                .map_err(failed)?;
            let mut file = BufWriter::new(file);
            fill(&mut file).map_err(failed)?;
            return file.flush().map_err(failed);
        }
        let dir = self
            .real
            .parent()
            .filter(|p| !p.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        let beside = tempfile::NamedTempFile::new_in(dir).map_err(failed)?;
        let mut file = BufWriter::with_capacity(1 << 16, beside);
        fill(&mut file).map_err(failed)?;
        let beside = file.into_inner().map_err(|e| failed(e.into_error()))?;
        // A temporary file is private; a program keeps the rights of the one it replaces, or is like any other file.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let rights = std::fs::metadata(&self.real)
                .map_or(std::fs::Permissions::from_mode(0o644), |m| m.permissions());
            beside.as_file().set_permissions(rights).map_err(failed)?;
        }
        beside
            .persist(&self.real)
            .map_err(|e| cannot_write(self.named, &e.error))?;
        Ok(())
    }
}

/// A table of settings or of numbers: TOML's heads, JSON's brackets, a header with commas.
fn looks_like_data(bytes: &[u8]) -> bool {
    let mut lines = bytes
        .split(|b| *b == b'\n')
        .map(<[u8]>::trim_ascii)
        .filter(|line| !line.is_empty());
    let Some(first) = lines.next() else {
        return false;
    };
    let setting = |line: &[u8]| {
        line.first().is_some_and(u8::is_ascii_lowercase) && line.windows(3).any(|w| w == b" = ")
    };
    matches!(first.first(), Some(b'{' | b'[' | b'<'))
        || first.contains(&b',') && !first.contains(&b'(') && !first.contains(&b';')
        || setting(first)
}
