//! Medians with quartiles, ratios, and the page.
use comfy_table::{CellAlignment, Table as Grid, presets};
use serde_json::Value;
use std::fmt::Write;

/// Times of one work at one size.
#[derive(Clone, Debug, Default)]
pub(crate) struct Times(Vec<f64>);

impl Times {
    /// Adds one time, s.
    pub(crate) fn push(&mut self, seconds: f64) {
        self.0.push(seconds);
        self.0.sort_by(f64::total_cmp);
    }

    fn quantile(&self, q: f64) -> f64 {
        self.0
            .get(((self.0.len() - 1) as f64 * q).round() as usize)
            .copied()
            .unwrap_or(f64::NAN)
    }

    /// Median, s; NaN if there is none.
    pub(crate) fn median(&self) -> f64 {
        if self.0.is_empty() {
            f64::NAN
        } else {
            self.quantile(0.5)
        }
    }

    fn words(&self) -> String {
        if self.0.is_empty() {
            return "–".to_owned();
        }
        let unit = |s: f64| match s {
            s if s < 1e-3 => (s * 1e6, "µs"),
            s if s < 1.0 => (s * 1e3, "ms"),
            s => (s, "s"),
        };
        let (median, name) = unit(self.median());
        let scale = median / self.median();
        let [low, high] = [0.25, 0.75].map(|q| self.quantile(q) * scale);
        let digits = if median < 10.0 { 2 } else { 1 };
        format!("{median:.digits$} {name} [{low:.digits$}–{high:.digits$}]")
    }
}

/// A table of sizes against contenders.
pub(crate) struct Table {
    title: String,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
    remarks: Vec<String>,
}

impl Table {
    /// An empty table; giotto is the first contender.
    pub(crate) fn new(title: &str, size: &str, contenders: &[&str], ratios: &[&str]) -> Self {
        let header = [size]
            .into_iter()
            .chain(contenders.iter().copied())
            .chain(ratios.iter().copied());
        let header = header.map(str::to_owned).collect();
        Self {
            title: title.to_owned(),
            header,
            rows: Vec::new(),
            remarks: Vec::new(),
        }
    }

    /// Adds a size: times of each contender, then ratios.
    pub(crate) fn row(&mut self, size: usize, times: &[&Times], ratios: &[f64]) {
        let ratio = |r: &f64| {
            if r.is_nan() {
                "–".to_owned()
            } else {
                format!("{r:.2}×")
            }
        };
        let row = [format!("{size}")]
            .into_iter()
            .chain(times.iter().map(|t| t.words()))
            .chain(ratios.iter().map(ratio));
        self.rows.push(row.collect());
        eprintln!(
            "{}: {}",
            self.title,
            self.rows[self.rows.len() - 1].join("  ")
        );
    }

    /// Adds a row as it stands.
    pub(crate) fn words(&mut self, row: &[String]) {
        self.rows.push(row.to_vec());
        eprintln!("{}: {}", self.title, row.join("  "));
    }

    /// Adds a sentence under the table.
    pub(crate) fn remark(&mut self, text: String) {
        self.remarks.push(text);
    }

    /// For the terminal.
    pub(crate) fn text(&self) -> String {
        let mut grid = Grid::new();
        grid.load_style(presets::NOTHING)
            .set_header(&self.header)
            .add_rows(&self.rows);
        grid.column_iter_mut().for_each(|c| {
            c.set_cell_alignment(CellAlignment::Right);
        });
        format!("\n{}\n{grid}\n{}", self.title, self.remarks.join("\n"))
    }

    /// For the page.
    pub(crate) fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule: Vec<String> = self.header.iter().map(|_| "--:".to_owned()).collect();
        let rows: String = self.rows.iter().map(|r| line(r)).collect();
        let remarks: String = self.remarks.iter().map(|r| format!("- {r}\n")).collect();
        format!(
            "\n## {}\n\n{}{}{rows}\n{remarks}",
            self.title,
            line(&self.header),
            line(&rule)
        )
    }
}

/// Growth exponent between the first and the last of (size, seconds).
pub(crate) fn growth(times: &[(usize, f64)]) -> f64 {
    match (times.first(), times.last()) {
        (Some(a), Some(b)) => (b.1 / a.1).ln() / (b.0 as f64 / a.0 as f64).ln(),
        _ => f64::NAN,
    }
}

/// What the page says before its tables.
pub(crate) fn heading(versions: &Value) -> String {
    let processor = std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("model name"))?;
            Some(line.split(':').nth(1)?.trim().to_owned())
        });
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let mut page = String::from(
        "# Side by side\n\nWritten by `cargo bench -p giotto --bench peers`. Median of interleaved rounds, [quartiles]; a ratio above 1 \
         means that giotto takes less time. Each part has a process of its own. Answers of all contenders are compared before they count.\n\n",
    );
    // Writing to a string cannot fail.
    let _ = writeln!(
        page,
        "{cores} × {}, load {} at the start; giotto {}; {versions}",
        processor.unwrap_or_default(),
        load.split(' ').next().unwrap_or("?"),
        env!("CARGO_PKG_VERSION"),
    );
    page
}
