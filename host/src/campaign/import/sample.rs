//! A fair sample of the points of a file, however large: the rows at evenly spaced bytes.
use super::rows::{EXPECTED, Slice};
use crate::campaign::CampaignError;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Files up to this size are read whole.
const WHOLE: u64 = 1 << 22;
/// Rows taken from larger ones.
const ROWS: u64 = 1 << 15;
/// Bytes in which a row is looked for.
const WINDOW: u64 = 2048;

/// x, y and z (empty where the file has none) of all rows of a small file, of 32 768 rows of a large one, in order. Rows that
/// cannot be read are left for the look at all rows to refuse.
pub(super) fn points(
    path: &Path,
    slice: &Slice,
    position: [Option<usize>; 3],
) -> Result<[Vec<f64>; 3], CampaignError> {
    let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED, &e);
    let mut points: [Vec<f64>; 3] = Default::default();
    let mut file = File::open(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    let start = slice.bytes[0];
    if slice.text.is_some() || size.saturating_sub(start) <= WHOLE {
        slice.walk_all(
            path,
            |batch| batch,
            |batch| {
                for (axis, field) in points.iter_mut().zip(position) {
                    axis.extend(field.map_or(&[][..], |f| &batch.columns[f]));
                }
                Ok(())
            },
        )?;
        return Ok(points);
    }
    let mut window = Vec::new();
    for k in 0..ROWS {
        let at = start + (size - start) / ROWS * k;
        window.clear();
        file.seek(SeekFrom::Start(at)).map_err(io)?;
        file.by_ref()
            .take(WINDOW)
            .read_to_end(&mut window)
            .map_err(io)?;
        // Somewhere in a row, but for the first place: the next one is whole.
        let from = if k == 0 {
            Some(0)
        } else {
            memchr::memchr(b'\n', &window).map(|p| p + 1)
        };
        let row = from.and_then(|from| {
            let end = memchr::memchr(b'\n', &window[from..])?;
            slice.one(&window[from..=from + end])
        });
        if let Some(row) = row {
            for (axis, field) in points.iter_mut().zip(position) {
                axis.extend(field.map(|f| row[f]));
            }
        }
    }
    Ok(points)
}
