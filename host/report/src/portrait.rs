//! A small polar picture: one profile on its circle, magnified until it fills the ring, zero and angles labelled.
use std::fmt::Write;

/// A curve of a portrait: its class and its profile, m.
pub type Curve<'a> = (&'static str, &'a [Option<f64>]);

const NOMINAL: f64 = 70.0;
const REACH: f64 = 28.0;

/// The picture as one `<svg>` element. `id` is unique on the page.
pub fn svg(id: &str, description: &str, curves: &[Curve<'_>]) -> String {
    let values = || curves.iter().flat_map(|c| c.1.iter().flatten());
    let most = values().fold(0.0, |m: f64, v| m.max(v.abs())).max(1e-9);
    let ring = round(most);
    let scale = REACH / ring;
    let mut out = format!(
        "<svg class=\"portrait\" viewBox=\"-116 -116 232 232\" role=\"img\" aria-labelledby=\"{id}-d\"><desc id=\"{id}-d\">{}</desc>",
        super::number::escape(description)
    );
    for r in [NOMINAL - REACH, NOMINAL + REACH] {
        let _ = write!(out, "<circle class=\"grid\" r=\"{r:.1}\"/>");
    }
    let _ = write!(out, "<circle class=\"nominal\" r=\"{NOMINAL}\"/>");
    for (x, y, anchor, text) in [
        (112.0, 4.0, "end", "0°"),
        (0.0, -104.0, "middle", "90°"),
        (-112.0, 4.0, "start", "180°"),
        (0.0, 113.0, "middle", "270°"),
    ] {
        let _ = write!(
            out,
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{text}</text>"
        );
    }
    for (class, profile) in curves {
        let _ = write!(out, "<path class=\"polar-line {class}\" d=\"");
        let mut pen = false;
        let n = profile.len().max(1);
        for k in 0..=profile.len() {
            let Some(Some(value)) = profile.get(k % n) else {
                pen = false;
                continue;
            };
            let angle = (2 * (k % n) + 1) as f64 * std::f64::consts::PI / n as f64;
            let r = (NOMINAL + value * scale).max(0.0);
            let (sin, cos) = angle.sin_cos();
            let _ = write!(
                out,
                "{}{:.1} {:.1}",
                if pen { 'L' } else { 'M' },
                r * cos,
                -r * sin
            );
            pen = true;
        }
        out.push_str("\"/>");
    }
    let label = super::number::plain(ring * 1e6);
    let _ = write!(
        out,
        "<text class=\"title\" y=\"-6\" text-anchor=\"middle\">ring</text><text class=\"title\" y=\"10\" text-anchor=\"middle\">±{label} µm</text></svg>"
    );
    out
}

/// The next of 1, 2, 5 times a power of ten.
fn round(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|m| m * power >= value * 0.999);
    step.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_fills_the_ring_and_gaps_stay_open() {
        let mut profile: Vec<Option<f64>> =
            (0..180).map(|k| Some(4e-6 * f64::from(k % 2))).collect();
        profile[20] = None;
        let text = svg("a", "x < y", &[("CCW", &profile)]);
        assert!(text.contains("±5 µm") && text.contains("x &lt; y"));
        assert_eq!(text.matches('M').count(), 2, "a gap begins a new stroke");
        assert!(!svg("a", "", &[("CCW", &[])]).contains("NaN"));
    }
}
