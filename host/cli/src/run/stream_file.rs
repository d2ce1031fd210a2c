//! The file of a stream: `time_s,x_mm,y_mm[,z_mm]`, one row a tick. What `giotto run -o` writes is read too, its corrected
//! columns left out.
use crate::Failure;
use std::path::Path;

/// One set-point, the line it stands in, and the column of its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub(super) line: usize,
    pub(super) column: usize,
    pub(super) time_s: f64,
    pub(super) place_nm: [i32; 3],
}

const EXPECTED: &str = "expected a CSV with time_s,x_mm,y_mm[,z_mm], one row a tick";

/// Where `time_s`, `x_mm`, `y_mm` and `z_mm` stand in a header.
fn columns(header: &[&str]) -> Result<[Option<usize>; 4], String> {
    let mut columns = [None; 4];
    for (at, column) in header.iter().enumerate() {
        match ["time_s", "x_mm", "y_mm", "z_mm"]
            .iter()
            .position(|known| known == column)
        {
            Some(known) if columns[known].is_none() => columns[known] = Some(at),
            Some(_) => return Err(format!("has two columns {column}")),
            None if column.starts_with("corrected_") => {}
            None => return Err(format!("has a column \"{column}\"")),
        }
    }
    Ok(columns)
}

/// Reads all rows.
pub(super) fn read(path: &Path) -> Result<Vec<Row>, Failure> {
    let name = path.display();
    let file = |what: &str| {
        Failure::input(format_args!("{name}: {what}; {EXPECTED}")).help("check which file this is")
    };
    let text = match std::fs::read(path) {
        Ok(bytes) if bytes.is_empty() => return Err(file("is empty")),
        Ok(bytes) => String::from_utf8(bytes).map_err(|_| file("is no text"))?,
        Err(_) if path.is_dir() => return Err(file("is a directory")),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Err(file("no such file")),
        Err(e) => return Err(file(&format!("cannot read: {e}"))),
    };
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let header: Vec<&str> = lines
        .next()
        .map_or("", |(_, line)| line)
        .split(',')
        .map(str::trim)
        .collect();
    let columns = columns(&header).map_err(|what| file(&what))?;
    let [Some(time), Some(x), Some(y), z] = columns else {
        return Err(file("lacks a column"));
    };
    let mut rows = Vec::new();
    for (index, text) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let fields: Vec<&str> = text.split(',').collect();
        let column = |field: usize| {
            1 + fields
                .iter()
                .take(field)
                .map(|field| field.len() + 1)
                .sum::<usize>()
        };
        let place = |field: usize, what: String| {
            Failure::input(format_args!(
                "{name}:{}:{}: {what}",
                index + 1,
                column(field)
            ))
            .help(EXPECTED)
        };
        if fields.len() != header.len() {
            let what = format!(
                "{} fields, expected {} as in the header",
                fields.len(),
                header.len()
            );
            return Err(place(0, what));
        }
        let number = |at: usize| {
            let field = fields[at].trim();
            let value = field.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| place(at, format!("\"{field}\", expected a number")))
        };
        let nm = |at: usize| {
            let value = number(at)?;
            let inside = value.abs() <= 2100.0;
            if inside {
                Ok((value * 1e6).round() as i32)
            } else {
                Err(place(at, format!("{value} mm, possible are -2100 to 2100")))
            }
        };
        let place_nm = [nm(x)?, nm(y)?, z.map_or(Ok(0), nm)?];
        rows.push(Row {
            line: index + 1,
            column: column(time),
            time_s: number(time)?,
            place_nm,
        });
    }
    if rows.len() < 2 {
        return Err(file("has fewer than two rows"));
    }
    Ok(rows)
}
