//! The page of a corrected program: the part drawn, its arcs, and what was left.
use super::ReportError;
use super::number::{fixed, plain};
use super::pages::{Drawn, Page, Part, Row, Table, render};
use super::plan_view::{Stroke, plan_views};

/// A program and what became of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// Its name.
    pub name: String,
    /// What is to be read first.
    pub words: Vec<String>,
    /// Its moves.
    pub strokes: Vec<Stroke>,
    /// Arcs of one size that were corrected.
    pub sizes: Vec<Size>,
    /// Why arcs were left.
    pub reasons: Vec<Reason>,
    /// How the figures were got, and what they leave out.
    pub method: Vec<String>,
}

/// Corrected arcs of one radius and feed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// The first line, from 1.
    pub line: usize,
    /// So many arcs.
    pub count: usize,
    /// Radius, mm.
    pub radius_mm: f64,
    /// Feed along the arc, mm/s.
    pub feed_mm_s: f64,
    /// Change of the radius, µm.
    pub change_um: f64,
    /// Largest contour error as programmed and as corrected, µm; `None` where it was not worked out.
    pub contour_um: [Option<f64>; 2],
}

/// Arcs that were left for one reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Reason {
    /// In words, with the code and the line that are to blame.
    pub words: String,
    /// So many arcs.
    pub count: usize,
    /// Their lines, the first of them.
    pub lines: String,
}

/// Rows of a table at most; what lies behind is counted.
const MOST_ROWS: usize = 200;

/// The page of a program.
///
/// # Errors
/// As [`super::html`].
///
/// ```
/// use giotto_report::program_page::{Program, Reason, program_page};
///
/// let program = Program {
///     name: "part.nc".into(),
///     words: vec!["0 of 1 arcs corrected.".into()],
///     reasons: vec![Reason { words: "G41 in line 3".into(), count: 1, lines: "5".into() }],
///     ..Program::default()
/// };
/// let page = program_page(&program)?;
/// assert!(page.contains("part.nc") && page.contains("G41 in line 3"));
/// # Ok::<(), giotto_report::ReportError>(())
/// ```
pub fn program_page(program: &Program) -> Result<String, ReportError> {
    let charts = plan_views(&program.strokes, "plan").into_iter();
    let mut parts = vec![Part {
        title: "What was corrected".into(),
        words: program.words.clone(),
        tables: vec![sizes(&program.sizes)],
        charts: charts
            .map(|view| Drawn {
                svg: view.svg,
                caption: view.caption,
            })
            .collect(),
    }];
    if !program.reasons.is_empty() {
        let left: usize = program.reasons.iter().map(|r| r.count).sum();
        parts.push(Part {
            title: "What was left, and why".into(),
            words: vec![format!(
                "{left} arc{} in the program as {}.",
                if left == 1 { " stands" } else { "s stand" },
                if left == 1 { "it did" } else { "they did" }
            )],
            tables: vec![reasons(&program.reasons)],
            charts: Vec::new(),
        });
    }
    parts.push(Part {
        title: "How this was worked out".into(),
        words: program.method.clone(),
        tables: Vec::new(),
        charts: Vec::new(),
    });
    render(&Page {
        title: format!("{}: corrected arcs", program.name),
        parts,
        version: env!("CARGO_PKG_VERSION"),
    })
}

fn sizes(list: &[Size]) -> Table {
    let um = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), |v| fixed(v, 1));
    let row = |size: &Size| Row {
        cells: vec![
            if size.count > 1 {
                format!("{}…", size.line)
            } else {
                size.line.to_string()
            },
            size.count.to_string(),
            plain((size.radius_mm * 1e3).round() * 1e-3),
            plain((size.feed_mm_s * 100.0).round() * 1e-2),
            fixed(size.change_um, 1),
            um(size.contour_um[0]),
            um(size.contour_um[1]),
        ],
        marked: false,
    };
    let more: usize = list.iter().skip(MOST_ROWS).map(|s| s.count).sum();
    Table {
        caption: if more > 0 {
            format!(
                "Corrected arcs by size, the most frequent; {more} of other sizes are not listed. Change of the radius, largest contour error before and after"
            )
        } else {
            "Corrected arcs by size: change of the radius, largest contour error before and after"
                .into()
        },
        header: vec![
            "Line",
            "arcs",
            "R, mm",
            "mm/s",
            "ΔR, µm",
            "before, µm",
            "after, µm",
        ],
        rows: list.iter().take(MOST_ROWS).map(row).collect(),
        wraps: false,
    }
}

fn reasons(list: &[Reason]) -> Table {
    let row = |reason: &Reason| Row {
        cells: vec![
            reason.words.clone(),
            reason.count.to_string(),
            reason.lines.clone(),
        ],
        marked: false,
    };
    Table {
        caption: "Reasons, the most frequent first".into(),
        header: vec!["Reason", "arcs", "lines"],
        rows: list.iter().take(MOST_ROWS).map(row).collect(),
        wraps: true,
    }
}
