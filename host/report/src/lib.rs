//! The report: one self-contained HTML file, no network; light, dark and paper.
//!
//! | file | holds |
//! |---|---|
//! | `figures`, `forms` | the paper's Figures 8–11 and 2–7 of a campaign, as SVG |
//! | `page_content` | what the page says, ready for the template |
//! | `cause_view`, `iso`, `plots` | its parts: causes, ISO 230-4, plots of all runs |
//! | `verdict` | the three sentences |
//! | `chart` | scatter plots as SVG |
//! | `misfit_map` | misfit over feed and radius |
//! | `polar`, `polar.js` | profiles, the plot that draws them, and what-if |
//! | `each_cause_alone` | what each cause does to each circle by itself |
//! | `portrait` | one profile as a small picture |
//! | `pages`, `page.html` | comparison and history |
//! | `program_page`, `plan_view` | a corrected program |
//! | `hash` | identity of the data |
//! | `template.html`, `style.css` | the page |
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod cause_view;
mod chart;
mod each_cause_alone;
pub mod figures;
pub mod forms;
mod hash;
mod iso;
mod misfit_map;
mod number;
mod page_content;
mod pages;
pub mod plan_view;
mod plots;
mod polar;
mod portrait;
pub mod program_page;
#[cfg(test)]
mod tests;
mod verdict;

pub use pages::{comparison_page, history_page};

use giotto::campaign::Campaign;
use giotto::diagnosis::Diagnosis;

/// Why a report could not be made: the template and what it is given do not match.
#[derive(Debug, thiserror::Error)]
#[error("the report cannot be rendered: {0}")]
pub struct ReportError(#[from] minijinja::Error);

/// The report of a campaign and its diagnosis: one HTML document. A campaign of 78 runs gives about 0.4 MB.
///
/// # Errors
/// A template that asks for what it is not given: a fault of this build, not of the data.
///
/// ```
/// use giotto::simulation::{self, Plan};
/// use giotto::diagnosis;
/// # use std::path::Path;
/// let plan = Plan::parse(
///     "[machine]\nboth = { kv_per_s = 50.0 }\ny = { backlash_um = 12.0 }\n\
///      [grid]\nradii_mm = [50.0, 150.0]\nfeeds_mm_s = [20.0, 100.0, 300.0]",
///     Path::new("plan.toml"),
/// )?;
/// let campaign = simulation::campaign(&plan, 1);
/// let page = giotto_report::html(&campaign, &diagnosis::diagnose(&campaign, &Default::default())?)?;
/// // One file: nothing is fetched, and the data's hash says what it was made of.
/// assert!(page.starts_with("<!doctype html>") && !page.contains("src=\"http"));
/// assert!(page.contains(&giotto_report::data_hash(&campaign)[..12]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn html(campaign: &Campaign, diagnosis: &Diagnosis) -> Result<String, ReportError> {
    let mut page = minijinja::Environment::new();
    // What the template asks for must be there; text is escaped by the name's ending.
    page.set_undefined_behavior(minijinja::UndefinedBehavior::Strict);
    page.add_template("style.css", include_str!("style.css"))?;
    page.add_template("polar.js", include_str!("polar.js"))?;
    page.add_template("report.html", include_str!("template.html"))?;
    let view = minijinja::value::Serde(page_content::PageContent::of(campaign, diagnosis));
    Ok(page.get_template("report.html")?.render(view)?)
}

/// SHA-256 of the data, as the report states it.
pub fn data_hash(campaign: &Campaign) -> String {
    hash::of(campaign)
}
