//! Which explanations compete.
use crate::causes::{ALL, Cause, Evidence};
use crate::diagnosis::Diagnosis;
use serde::Serialize;

/// Explanations that the runs at hand cannot tell apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Class {
    /// Its members; the first is what the diagnosis named, unless nothing could be named.
    pub members: Vec<Cause>,
    /// Why they are open.
    pub why: String,
    /// What would separate them, in words.
    pub next: String,
}

/// A pair that no circle can tell apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineTest {
    /// The pair, by name.
    pub pair: [String; 2],
    /// The test that can.
    pub test: String,
    /// Why no circle can.
    pub why: String,
}

/// The question that the next runs should answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// What circles may tell.
    pub classes: Vec<Class>,
    /// What they cannot.
    pub line_tests: Vec<LineTest>,
}

fn seen_in_circles(cause: Cause) -> bool {
    cause.model().evidence() == Evidence::Signature
}

/// The question that a diagnosis leaves.
pub fn of(diagnosis: &Diagnosis) -> Question {
    let mut question = Question {
        classes: Vec::new(),
        line_tests: Vec::new(),
    };
    for finding in &diagnosis.findings {
        let words = finding.cause.model().words();
        let mut members = vec![finding.cause];
        for id in &finding.indistinguishable_from {
            match Cause::from_id(id) {
                Some(cause)
                    if seen_in_circles(cause)
                        && seen_in_circles(finding.cause)
                        && !words.never_told_from.contains(&id.as_str()) =>
                {
                    members.push(cause);
                }
                _ => question.line_tests.push(LineTest {
                    pair: [words.id.to_string(), id.clone()],
                    test: words.next.to_string(),
                    why: "they do the same to every circle".into(),
                }),
            }
        }
        if members.len() > 1 {
            let why = "these runs show the same of each".to_string();
            question.classes.push(Class {
                members,
                why,
                next: words.next.to_string(),
            });
        }
    }
    // Provisional findings of a session without a proof are no more than questions.
    let nothing_proven = diagnosis.gain.is_none();
    if question.classes.is_empty() && (nothing_proven || diagnosis.unexplained.present) {
        let why = if diagnosis.unexplained.present {
            "something matches no cause: more radii, feeds and places narrow its law down"
                .to_string()
        } else {
            diagnosis.cannot_tell.join("; ")
        };
        let members = ALL
            .iter()
            .map(|model| model.cause())
            .filter(|cause| seen_in_circles(*cause))
            .collect();
        let next = "a spread of radii, feeds and both directions, in random order".into();
        question.classes.push(Class { members, why, next });
    }
    question
}
