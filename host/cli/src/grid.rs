//! Tables for a terminal: what does not fit its width goes into a further block under the same first columns.
use super::Output;
use std::fmt::Write as _;
use std::io::IsTerminal;

/// Width where nothing says it.
const USUAL: usize = 80;
/// Narrowest that is laid out for.
const NARROWEST: usize = 40;
/// Between columns.
const GAP: usize = 2;

/// A table: text to the left in the first `left` columns, numbers to the right in the others.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
    left: usize,
    keys: usize,
}

impl Grid {
    /// With these headings; the first `keys` columns say what a row is and stand in every block.
    pub fn new(header: &[&str], left: usize, keys: usize) -> Self {
        Self {
            header: header.iter().map(|h| (*h).to_owned()).collect(),
            rows: Vec::new(),
            left,
            keys: keys.max(1),
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Prints it at the width of the terminal.
    pub fn show(&self, out: Output) {
        out.say(self.text(width()));
    }

    /// The table within `width` columns.
    pub fn text(&self, width: usize) -> String {
        let width = width.max(NARROWEST);
        let longest = |k: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(k));
            let heading = self.header.get(k).map_or(0, |h| length(h));
            cells.map(|c| length(c)).fold(heading, usize::max)
        };
        let whole: Vec<usize> = (0..self.header.len()).map(longest).collect();
        let keys: Vec<usize> = (0..self.keys.min(self.header.len())).collect();
        // Long names are cut only where a block of the table would not fit with them whole.
        let (first, others) = whole.split_at(keys.len());
        let widest = others.iter().copied().max().unwrap_or(0);
        let fits = first.iter().map(|size| size + GAP).sum::<usize>() + widest <= width;
        let most = if fits { width } else { (width / 3).max(12) };
        let sizes: Vec<usize> = whole.iter().map(|size| (*size).min(most)).collect();
        let of = |columns: &[usize]| columns.iter().map(|k| sizes[*k] + GAP).sum::<usize>();
        let mut blocks: Vec<Vec<usize>> = vec![keys.clone()];
        #[allow(
            clippy::needless_range_loop,
            reason = "indices are those of the formula"
        )]
        for k in keys.len()..self.header.len() {
            let last = blocks
                .last_mut()
                .filter(|block| of(block) + sizes[k] <= width || block.len() == keys.len());
            match last {
                Some(block) => block.push(k),
                None => blocks.push(keys.iter().copied().chain([k]).collect()),
            }
        }
        let texts: Vec<String> = blocks.iter().map(|b| self.block(b, &sizes)).collect();
        texts.join("\n\n")
    }

    fn block(&self, columns: &[usize], sizes: &[usize]) -> String {
        let line = |cells: &[String]| {
            let mut text = String::new();
            for &k in columns {
                let cell = cells.get(k).map_or("", String::as_str);
                let cell = shortened(cell, sizes[k]);
                let room = " ".repeat(sizes[k].saturating_sub(length(&cell)));
                let gap = " ".repeat(if text.is_empty() { 0 } else { GAP });
                let _ = if k < self.left {
                    write!(text, "{gap}{cell}{room}")
                } else {
                    write!(text, "{gap}{room}{cell}")
                };
            }
            text.trim_end().to_owned()
        };
        std::iter::once(&self.header)
            .chain(&self.rows)
            .map(|cells| line(cells))
            .collect::<Vec<_>>()
            .join("\n")
    }
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// A long name keeps its beginning and its end.
fn shortened(text: &str, most: usize) -> String {
    let letters: Vec<char> = text.chars().collect();
    if letters.len() <= most {
        return text.to_owned();
    }
    let tail = (most - 1) / 2;
    let head = most - 1 - tail;
    let end = &letters[letters.len() - tail..];
    letters[..head].iter().chain(&['…']).chain(end).collect()
}

/// Columns of the terminal: `COLUMNS`, or what the terminal says, or 80.
pub fn width() -> usize {
    let given = std::env::var("COLUMNS").ok().and_then(|v| v.parse().ok());
    given
        .or_else(|| {
            let terminal = std::io::stdout().is_terminal();
            let size = terminal.then(ratatui::crossterm::terminal::size);
            size.and_then(Result::ok)
                .map(|(columns, _)| usize::from(columns))
        })
        .filter(|columns| *columns > 0)
        .unwrap_or(USUAL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_fits_and_every_cell_is_there() {
        let header = [
            "run",
            "R mm",
            "feed mm/s",
            "ΔR µm",
            "roundness µm",
            "2θ",
            "3θ",
            "noise µm",
        ];
        let mut grid = Grid::new(&header, 1, 2);
        for k in 0..3 {
            let cells = (1..8).map(|c| format!("{k}{c}.5"));
            grid.row(std::iter::once(format!("a long name of run number {k}.csv")).chain(cells));
        }
        for width in [40, 60, 80, 200] {
            let text = grid.text(width);
            assert!(text.lines().all(|line| length(line) <= width), "{text}");
            for c in 1..8 {
                assert!(text.contains(&format!("2{c}.5")), "{width}: {c}\n{text}");
            }
            assert!(text.contains("2.csv"), "the end of a name says which it is");
        }
        assert_eq!(grid.text(200).lines().count(), 4);
        assert!(grid.text(60).lines().count() > 8);
    }
}
