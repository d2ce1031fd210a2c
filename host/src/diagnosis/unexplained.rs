//! Words for what has no name.
use super::duration::Durations;
use super::explained::{Explained, energies};
use super::finding::{Signature, Unexplained};
use super::hypothesis::Kind;
use super::pattern::{Law, Pattern};

/// Describes the patterns that the search had to take in.
pub fn describe(found: &Explained, durations: &Durations) -> Unexplained {
    let weights = found.all();
    let (each, _) = energies(found, &weights);
    let samples: f64 = found
        .runs
        .iter()
        .map(|run| run.deviation_m.len() as f64)
        .sum();
    let mut patterns: Vec<(f64, Pattern)> = found
        .chosen
        .iter()
        .zip(each)
        .filter_map(|(&item, energy)| match found.items[item].kind {
            Kind::Pattern(pattern) => Some((energy, pattern)),
            Kind::Cause { .. } => None,
        })
        .collect();
    patterns.sort_by(|a, b| b.0.total_cmp(&a.0));
    let energy: f64 = patterns.iter().map(|p| p.0).sum();
    let mut signature = Signature::default();
    if let Some((_, strongest)) = patterns.first() {
        fill(&mut signature, strongest);
    }
    signature.words = patterns
        .iter()
        .take(4)
        .map(|(energy, pattern)| {
            format!(
                "{} ({:.2} µm rms)",
                words(pattern),
                (energy / samples).sqrt() * 1e6
            )
        })
        .collect();
    if patterns.len() > 4 {
        signature
            .words
            .push(format!("and {} more of the kind", patterns.len() - 4));
    }
    let mut present = !patterns.is_empty();
    if let Durations::Unexplained { runs, smallest } = durations {
        present = true;
        signature.when = Some(format!("{runs} turns did not last as programmed"));
        signature.words.push(format!(
            "{runs} turns did not last as programmed (down to {:.1} % of the feed), and not as under one limit of the centripetal acceleration",
            100.0 * smallest
        ));
    }
    Unexplained {
        present,
        rms_um: (energy / samples.max(1.0)).sqrt() * 1e6,
        signature,
    }
}

fn parity(odd: bool) -> &'static str {
    if odd { "odd" } else { "even" }
}

fn fill(signature: &mut Signature, pattern: &Pattern) {
    let mut scale = |law: Law| {
        signature.feed_exponent = Some(law.feed);
        signature.radius_exponent = Some(law.radius);
    };
    match *pattern {
        Pattern::Size { odd, law } => {
            scale(law);
            signature.harmonic = Some(0);
            signature.direction_parity = Some(parity(odd));
        }
        Pattern::Time { step, law } => {
            scale(law);
            signature.harmonic = Some(0);
            signature.direction_parity = Some("even");
            signature.when = Some(match step {
                None => "grows over the campaign".into(),
                Some(at) => format!("steps at {:.0} % of the campaign", 100.0 * at),
            });
        }
        Pattern::Harmonic {
            order, odd, law, ..
        } => {
            scale(law);
            signature.harmonic = Some(order);
            signature.direction_parity = Some(parity(odd));
        }
        Pattern::Bump {
            centre_rad,
            odd,
            law,
            ..
        } => {
            scale(law);
            signature.direction_parity = Some(parity(odd));
            signature.angle_deg = Some(centre_rad.to_degrees());
        }
    }
}

/// `∝ f²·R⁻¹`, for a person.
pub(super) fn law_words(feed: f64, radius: f64) -> String {
    match (feed, radius) {
        (0.0, 0.0) => "independent of speed and radius".to_owned(),
        (f, 0.0) => format!("∝ {}, whatever the radius", power("f", f)),
        (0.0, r) => format!("∝ {}, whatever the speed", power("R", r)),
        (f, r) => format!("∝ {}·{}", power("f", f), power("R", r)),
    }
}

/// A power with its exponent set high; one that is no whole number stays on the line.
fn power(name: &str, exponent: f64) -> String {
    if exponent == 1.0 {
        return name.to_owned();
    }
    if exponent.fract() != 0.0 {
        return format!("{name}^{exponent}");
    }
    let high = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    };
    format!(
        "{name}{}",
        format!("{exponent:.0}")
            .chars()
            .map(high)
            .collect::<String>()
    )
}

fn words(pattern: &Pattern) -> String {
    let law = |law: Law| law_words(law.feed, law.radius);
    let ways = |odd: bool| {
        if odd {
            "flips with the direction"
        } else {
            "the same both ways"
        }
    };
    match *pattern {
        Pattern::Size { odd, law: l } => format!("a change of size, {}, {}", ways(odd), law(l)),
        Pattern::Time { step: None, law: l } => {
            format!("a change of size that grows over the campaign, {}", law(l))
        }
        Pattern::Time {
            step: Some(at),
            law: l,
        } => {
            format!(
                "a step of size after {:.0} % of the campaign, {}",
                100.0 * at,
                law(l)
            )
        }
        Pattern::Harmonic {
            order, odd, law: l, ..
        } => {
            format!("{order} waves a turn, {}, {}", ways(odd), law(l))
        }
        Pattern::Bump {
            centre_rad,
            width_rad,
            odd,
            law: l,
        } => format!(
            "a bump at {:.0}° about {:.0}° wide, {}, {}",
            centre_rad.to_degrees(),
            2.0 * width_rad.to_degrees(),
            ways(odd),
            law(l)
        ),
    }
}
