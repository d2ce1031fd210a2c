//! A foreign file by its first lines: its layout, and where its rows begin.
use super::detect::{Detected, Format, detect};
use super::layout::Head;
use super::rows::{EXPECTED, Slice};
use crate::campaign::{CampaignError, Place, Problem};
use std::io::Read;
use std::path::Path;

/// All rows of a file, of the layout that its first lines show.
pub(super) fn rows_of(
    path: &Path,
    wanted: Format,
    given: Option<&str>,
) -> Result<Slice, CampaignError> {
    let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED, &e);
    if path.is_dir() {
        return Err(CampaignError::new(
            Place::file(path),
            Problem::IsDirectory { expected: EXPECTED },
        ));
    }
    let mut head = Vec::new();
    std::fs::File::open(path)
        .map_err(io)?
        .take(1 << 16)
        .read_to_end(&mut head)
        .map_err(io)?;
    if head.is_empty() {
        return Err(CampaignError::new(
            Place::file(path),
            Problem::Empty { expected: EXPECTED },
        ));
    }
    let refuse = |problem| Err(CampaignError::new(Place::at(path, 1, 1), problem));
    let lines = Head::of(&head);
    let layout = match detect(&lines, wanted, given) {
        Err(reason) => return refuse(Problem::Columns { reason }),
        Ok(Detected::Results) => return refuse(Problem::ResultsOnly),
        Ok(Detected::Unknown) => {
            let found = crate::campaign::table::shorten(lines.line(0));
            return refuse(Problem::UnknownFormat {
                found,
                wanted: wanted.to_string(),
            });
        }
        Ok(Detected::Table(layout)) => layout,
    };
    let mark = if head.starts_with(b"\xEF\xBB\xBF") {
        3
    } else {
        0
    };
    let ends = memchr::memchr_iter(b'\n', &head).map(|at| at + 1);
    let start = ends.take(layout.skip).last().unwrap_or(mark);
    let first_line = layout.skip + 1;
    Ok(Slice {
        layout,
        bytes: [start as u64, u64::MAX],
        first_line,
        rows: 0,
        scatter: None,
    })
}
