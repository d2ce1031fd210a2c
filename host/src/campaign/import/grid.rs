//! Where the rows of a text file begin, how their fields are divided, and which lines above them name the columns.
use super::layout::{Head, is_missing, is_stamp, split, unit};

/// So many lines must look alike to be rows.
const ALIKE: usize = 3;
/// So many lines above the rows may name their columns.
const ABOVE: usize = 8;

/// How the rows of a file look.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    pub(super) separator: u8,
    pub(super) decimal_comma: bool,
    /// First line with a row.
    pub(super) first: usize,
    /// Fields of a row.
    pub(super) width: usize,
    /// Columns that hold dates or times of day.
    pub(super) stamps: Vec<usize>,
    /// Columns that hold numbers.
    pub(super) numbers: Vec<usize>,
}

/// Names and units of columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    /// Line of the names.
    pub(super) line: usize,
    pub(super) names: Vec<String>,
    /// Units from a line of their own.
    pub(super) units: Vec<Option<String>>,
    /// What stands above each name.
    pub(super) groups: Vec<String>,
}

impl Grid {
    /// The rows of a file, by its first lines.
    pub(super) fn of(head: &Head) -> Option<Self> {
        let candidates = [b';', b'\t', b',', b' ']
            .into_iter()
            .filter_map(|separator| {
                let from = (0..head.lines.len()).find(|&k| alike(head, k, separator))?;
                // A row that is broken hides those before it: they are rows as well, and it is named when it is read.
                let is_row = |k: &usize| shape(&head.lines[*k], separator).is_some();
                let before = (from.saturating_sub(ALIKE)..from).rev().take_while(is_row);
                let first = before.last().unwrap_or(from);
                Some(Self {
                    first,
                    ..Self::at(head, from, separator)
                })
            });
        // More columns of numbers say more; a row that begins earlier is no accident.
        candidates.reduce(|best, next| {
            let value = |g: &Self| {
                let useful = g.numbers.len() + g.stamps.len();
                // A wrong separator leaves pieces of numbers, which are text.
                let text = g.width - useful;
                (useful as i64 - text as i64, usize::MAX - g.first)
            };
            if value(&next) > value(&best) {
                next
            } else {
                best
            }
        })
    }

    fn at(head: &Head, first: usize, separator: u8) -> Self {
        let rows: Vec<Vec<&str>> = head.lines[first..]
            .iter()
            .filter(|l| !l.trim().is_empty())
            .take(64)
            .map(|l| split(l, separator))
            .collect();
        let width = rows.first().map_or(0, Vec::len);
        let column = |k: usize| rows.iter().filter_map(move |r| r.get(k).copied());
        let stamps: Vec<usize> = (0..width)
            .filter(|&k| column(k).any(is_stamp) && column(k).all(|f| is_stamp(f) || is_missing(f)))
            .collect();
        let numbers = (0..width).filter(|&k| {
            column(k).any(|f| number(f, separator))
                && column(k).all(|f| number(f, separator) || is_missing(f))
        });
        let decimal_comma = separator != b','
            && rows.iter().flatten().any(|f| f.contains(','))
            && !rows
                .iter()
                .flatten()
                .any(|f| f.contains('.') && !is_stamp(f));
        Self {
            separator,
            decimal_comma,
            first,
            width,
            numbers: numbers.collect(),
            stamps,
        }
    }

    /// The names of the columns, from the lines above the rows.
    pub(super) fn names(&self, head: &Head) -> Option<Names> {
        let mut units: Vec<Option<String>> = Vec::new();
        let mut names: Option<Names> = None;
        for at in (self.first.saturating_sub(ABOVE)..self.first).rev() {
            let line = head.lines[at].trim();
            let bare = line.trim_start_matches(['#', '%', '/', '!', '*', ' ']);
            if bare.is_empty() {
                if names.is_some() {
                    break;
                }
                continue;
            }
            let fields = self.header_fields(bare, line);
            if let Some(found) = &mut names {
                // What stands above the names is divided as the rows are, or says nothing of them.
                let above = split(line, self.separator);
                if above.len() == self.width {
                    for (group, field) in found.groups.iter_mut().zip(above) {
                        if !field.is_empty() {
                            *group = format!("{field} {group}").trim().to_owned();
                        }
                    }
                }
                continue;
            }
            let is_unit = |f: &String| unit(f.trim_matches(['[', ']', '(', ')'])).is_some();
            let filled: Vec<&String> = fields.iter().filter(|f| !f.is_empty()).collect();
            if units.is_empty()
                && fields.len() <= self.width
                && !filled.is_empty()
                && filled.iter().filter(|f| is_unit(f)).count() * 2 > filled.len()
                && fields.len() > 1
            {
                units = fields
                    .iter()
                    .map(|f| Some(f.trim_matches(['[', ']', '(', ')']).to_owned()))
                    .collect();
                continue;
            }
            let words = filled
                .iter()
                .filter(|f| f.chars().any(char::is_alphabetic))
                .count();
            if fields.len() + 1 >= self.width && fields.len() <= self.width + 1 && words > 0 {
                names = Some(Names {
                    line: at,
                    groups: vec![String::new(); fields.len()],
                    names: fields,
                    units: units.clone(),
                });
            }
        }
        names
    }

    /// The fields of a line of names, which may be divided otherwise than the rows.
    fn header_fields(&self, bare: &str, line: &str) -> Vec<String> {
        let own = |text: &str, separator| -> Vec<String> {
            split(text, separator)
                .into_iter()
                .map(str::to_owned)
                .collect()
        };
        let as_rows = own(
            if self.separator == b' ' { bare } else { line },
            self.separator,
        );
        if as_rows.len() == self.width {
            return as_rows
                .into_iter()
                .map(|f| {
                    f.trim_start_matches(['#', '%', '/', '!', '*', ' '])
                        .to_owned()
                })
                .collect();
        }
        [b';', b'\t', b',', b' ']
            .into_iter()
            .map(|separator| own(bare, separator))
            .find(|fields| fields.len() == self.width)
            .unwrap_or(as_rows)
    }
}

/// Fields of a line that mostly holds numbers.
fn shape(line: &str, separator: u8) -> Option<usize> {
    let fields = split(line, separator);
    let numbers = fields.iter().filter(|f| number(f, separator)).count();
    let stamps = fields.iter().filter(|f| is_stamp(f)).count();
    let text = fields
        .iter()
        .filter(|f| !number(f, separator) && !is_stamp(f) && !is_missing(f))
        .count();
    (numbers > 0 && numbers + stamps >= text).then_some(fields.len())
}

/// Whether rows begin at a line.
fn alike(head: &Head, from: usize, separator: u8) -> bool {
    let shape = |line: &str| shape(line, separator);
    let Some(width) = shape(&head.lines[from]) else {
        return false;
    };
    let next: Vec<&String> = head.lines[from + 1..].iter().take(ALIKE).collect();
    let filled: Vec<&&String> = next.iter().filter(|l| !l.trim().is_empty()).collect();
    // A file of two rows has no third.
    let there = head.lines[from..].iter().filter(|l| !l.trim().is_empty());
    filled.len() + 1 >= there.take(ALIKE).count()
        && filled.iter().all(|line| shape(line) == Some(width))
}

fn number(field: &str, separator: u8) -> bool {
    if is_missing(field) || !field.bytes().any(|b| b.is_ascii_digit()) {
        return false;
    }
    field.parse::<f64>().is_ok()
        || (separator != b',' && field.replacen(',', ".", 1).parse::<f64>().is_ok())
}
