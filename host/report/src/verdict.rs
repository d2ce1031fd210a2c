//! The verdict: what the simulation gets wrong, why, and what to do, in three sentences.
use super::number::{fixed, number};
use giotto::causes::Cause;
use giotto::diagnosis::{Diagnosis, Finding};

/// The three sentences.
pub fn sentences(d: &Diagnosis, runs: usize) -> [String; 3] {
    [misfit(d, runs), cause(d), action(d)]
}

/// Names of the actuators in words, with a leading space; nothing for the machine as a whole.
pub fn axis(finding: &Finding) -> String {
    let names: Vec<String> = finding
        .actuators
        .iter()
        .map(|actuator| actuator.name().to_uppercase().replace("JOINT", "joint "))
        .collect();
    if names.is_empty() {
        String::new()
    } else {
        format!(" of {}", names.join(" and "))
    }
}

fn misfit(d: &Diagnosis, runs: usize) -> String {
    let s = if runs == 1 { "" } else { "s" };
    format!(
        "The simulation ({}) misses {runs} run{s} by {} µm rms, where a sample has {} µm of noise and the size {} µm of scatter between runs.",
        d.baseline.name,
        fixed(d.misfit.total_um, 2),
        fixed(d.noise_um, 2),
        fixed(d.spread_um, 2)
    )
}

fn cause(d: &Diagnosis) -> String {
    let rest = if d.unexplained.present {
        format!(
            "; {} µm rms match no cause in the list",
            fixed(d.unexplained.rms_um, 2)
        )
    } else {
        String::new()
    };
    let Some(first) = d.findings.first() else {
        return if d.unexplained.present {
            format!("No cause in the list fits what is left{rest}.")
        } else if let (None, Some(missing)) = (&d.gain, d.cannot_tell.first()) {
            format!("Nothing can be named from these runs ({missing}).")
        } else {
            "Nothing was found beyond it: the simulation explains the data.".to_string()
        };
    };
    let others: Vec<String> = d.findings[1..]
        .iter()
        .take(3)
        .map(|f| {
            format!(
                "{}{} ({} %)",
                f.cause.model().words().name,
                axis(f),
                fixed(f.share_percent, 0)
            )
        })
        .collect();
    let more = match others.len() {
        0 => String::new(),
        _ => format!(", then {}", others.join(", ")),
    };
    let e = &first.estimate;
    format!(
        "{} % of what can be explained is {}{}, {} {} (95 %: {} to {}){more}{rest}.",
        fixed(first.share_percent, 0),
        first.cause.model().words().name,
        axis(first),
        number(e.value),
        unit(e.unit),
        number(e.ci95[0]),
        number(e.ci95[1]),
    )
}

fn action(d: &Diagnosis) -> String {
    let gain = match &d.gain {
        Some(g) if !d.findings.is_empty() => format!(
            "On runs it has not seen the extended simulation misses by {} instead of {} µm rms (gain {} %, 95 %: {} to {}); ",
            fixed(g.extended_rms_um, 2),
            fixed(g.baseline_rms_um, 2),
            fixed(g.percent, 1),
            fixed(g.ci95_percent[0], 1),
            fixed(g.ci95_percent[1], 1),
        ),
        _ => String::new(),
    };
    let correctable = d.findings.iter().any(|f| f.compensable);
    let what = match d.findings.first() {
        Some(_) if correctable => "write the extended model with `giotto diagnose CAMPAIGN -o EXTENDED.toml` and flash it".to_string(),
        Some(first) => format!("no controller can correct this: {}", first.cause.model().words().adjust),
        None if d.gain.is_none() => {
            "measure what is missing first: `giotto plan CAMPAIGN` lists the runs".to_string()
        }
        None if d.unexplained.present => {
            "look at the place and the law of what is unexplained; `giotto plan CAMPAIGN` lists runs that narrow it down".to_string()
        }
        None => "fit the radius model and flash it: `giotto fit CAMPAIGN -o MODEL.toml`".to_string(),
    };
    let text = format!("{gain}{what}.");
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// Units with their proper letters.
pub fn unit(unit: &str) -> String {
    unit.replace("um", "µm")
        .replace("^2", "²")
        .replace("^4", "⁴")
}

/// Names of look-alikes for a person; what is no cause of the list stays as it is written.
pub fn look_alike(id: &str) -> String {
    Cause::from_id(id).map_or_else(
        || id.replace('_', " "),
        |cause| cause.model().words().name.to_string(),
    )
}
