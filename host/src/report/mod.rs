//! The report: one self-contained HTML file.
use crate::campaign::Campaign;
use crate::diagnosis::Diagnosis;

/// The report of a campaign and its diagnosis.
pub fn html(campaign: &Campaign, diagnosis: &Diagnosis) -> String {
    let findings: Vec<String> = diagnosis
        .findings
        .iter()
        .map(|f| {
            format!("<li>{} {:.4} {}</li>", f.cause.model().words().name, f.estimate.value, f.estimate.unit)
        })
        .collect();
    format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>{0}</title><h1>{0}</h1><ul>{1}</ul>",
        campaign.name.replace('<', "&lt;"),
        findings.join("")
    )
}
