//! Files that are written whole or not at all: beside their place, then renamed into it.
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Writes `bytes` to `path`. A reader sees the old file or the new one, never a part; after an error the old file is
/// as it was and nothing lies beside it. A device or a pipe is written to directly, since it must not be replaced.
/// A link is followed.
///
/// # Errors
/// What the operating system says; a file that is marked read-only is refused.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    with(path, |out| out.write_all(bytes))
}

/// As [`write()`], for contents that are made while they are written.
///
/// # Errors
/// As [`write()`], and those of `fill`.
///
/// ```
/// use giotto::whole_file;
/// use std::io::Error;
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("model.toml");
/// whole_file::write(&file, b"old")?;
/// // A writer that fails half-way leaves the file as it was.
/// let failed = whole_file::with(&file, |out| {
///     out.write_all(b"half of the n")?;
///     Err(Error::other("the disk is gone"))
/// });
/// assert!(failed.is_err());
/// assert_eq!(std::fs::read(&file)?, b"old");
/// assert_eq!(std::fs::read_dir(folder.path())?.count(), 1);
/// # Ok::<(), Error>(())
/// ```
pub fn with(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let Some(target) = target(path)? else {
        let mut out = io::BufWriter::new(std::fs::OpenOptions::new().write(true).open(path)?);
        fill(&mut out)?;
        return out.flush();
    };
    let permissions = match std::fs::metadata(&target) {
        Ok(found) if found.permissions().readonly() => {
            return Err(io::Error::new(
                io::ErrorKind::PermissionDenied,
                "the file is marked read-only",
            ));
        }
        Ok(found) => Some(found.permissions()),
        Err(_) => None,
    };
    let folder = target
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let file = tempfile::NamedTempFile::new_in(folder)?;
    let mut out = io::BufWriter::new(file);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    match permissions {
        Some(permissions) => file.as_file().set_permissions(permissions)?,
        None => make_public(file.as_file())?,
    }
    file.persist(&target).map_err(|failed| failed.error)?;
    Ok(())
}

/// The regular file to be made or replaced; `None` for a device or a pipe.
fn target(path: &Path) -> io::Result<Option<PathBuf>> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_file() => std::fs::canonicalize(path).map(Some),
        Ok(found) if found.is_dir() => Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a directory",
        )),
        Ok(_) => Ok(None),
        Err(_) => Ok(Some(path.to_path_buf())),
    }
}

/// A temporary file is private by default; a result is to be shared like any other file.
pub(crate) fn make_public(file: &std::fs::File) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        file.set_permissions(std::fs::Permissions::from_mode(0o644))?;
    }
    #[cfg(not(unix))]
    let _ = file;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> usize {
        std::fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result");
        write(&path, b"old").unwrap();
        let failed = with(&path, |out| {
            out.write_all(b"half of the n")?;
            Err(io::Error::other("full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "full");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), 1);
        write(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), 1);
    }

    #[test]
    fn read_only_files_and_directories_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result");
        write(&path, b"old").unwrap();
        let mut permissions = std::fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).unwrap();
        assert_eq!(
            write(&path, b"new").unwrap_err().kind(),
            io::ErrorKind::PermissionDenied
        );
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert!(write(folder.path(), b"new").is_err());
        assert_eq!(names(folder.path()), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_devices_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("result"), folder.path().join("link"));
        write(&path, b"old").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write(&link, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert!(
            std::fs::symlink_metadata(&link)
                .unwrap()
                .file_type()
                .is_symlink()
        );
        write(Path::new("/dev/null"), b"gone").unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
        if Path::new("/dev/full").exists() {
            assert_eq!(
                write(Path::new("/dev/full"), b"x").unwrap_err().kind(),
                io::ErrorKind::StorageFull
            );
        }
    }
}
