//! Data of a module: targets and speeds as literals or constants.
use std::collections::HashMap;

/// A robtarget.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Target {
    pub(super) place: [f64; 3],
    pub(super) pose: String,
}

/// The constants of a module.
#[derive(Default)]
pub(super) struct Data {
    targets: HashMap<String, Target>,
    speeds: HashMap<String, [String; 2]>,
}

/// The predefined speeds v5 … v7000, mm/s.
const PREDEFINED: [u32; 25] = [
    5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500,
    3000, 4000, 5000, 6000, 7000,
];
/// What goes with a predefined speed.
const PREDEFINED_REST: &str = "500,5000,1000";

impl Data {
    /// `CONST robtarget name := [...];` or `CONST speeddata name := [...];`
    pub(super) fn declare(&mut self, text: &str) {
        let Some((left, right)) = text.split_once(":=") else {
            return;
        };
        let words: Vec<&str> = left.split_whitespace().collect();
        let literal = right.trim().trim_end_matches(';').trim();
        let [kind, name] = match words[..] {
            [c, kind, name] if c.eq_ignore_ascii_case("CONST") => [kind, name],
            [l, c, kind, name]
                if l.eq_ignore_ascii_case("LOCAL") && c.eq_ignore_ascii_case("CONST") =>
            {
                [kind, name]
            }
            _ => return,
        };
        let name = name.to_ascii_lowercase();
        if kind.eq_ignore_ascii_case("robtarget") {
            if let Some(target) = literal_target(literal) {
                self.targets.insert(name, target);
            }
        } else if kind.eq_ignore_ascii_case("speeddata")
            && let Some(speed) = literal_speed(literal)
        {
            self.speeds.insert(name, speed);
        }
    }

    pub(super) fn target(&self, text: &str) -> Option<Target> {
        let offset = text
            .get(..5)
            .filter(|head| head.eq_ignore_ascii_case("Offs("))
            .and_then(|head| text[head.len()..].strip_suffix(')'));
        if text.starts_with('[') {
            literal_target(text)
        } else if let Some(inside) = offset {
            let (base, by) = inside.split_once(',')?;
            let by: Option<Vec<f64>> = by
                .split(',')
                .map(|n| n.parse().ok().filter(|v: &f64| v.is_finite()))
                .collect();
            let by: [f64; 3] = by?.try_into().ok()?;
            let mut target = self.targets.get(&base.to_ascii_lowercase()).cloned()?;
            (0..3).for_each(|i| target.place[i] += by[i]);
            Some(target)
        } else {
            self.targets.get(&text.to_ascii_lowercase()).cloned()
        }
    }

    /// Speed of the tool point, mm/s, and the words for the other speeds.
    pub(super) fn speed(&self, text: &str) -> Option<(f64, String)> {
        let (name, own) = match text.split_once('\\') {
            Some((name, switch)) => {
                let (key, value) = switch.split_once(":=")?;
                let value = key
                    .trim()
                    .eq_ignore_ascii_case("V")
                    .then(|| value.trim().parse::<f64>().ok())??;
                (name.trim(), Some(value))
            }
            None => (text, None),
        };
        let [v, rest] = if name.starts_with('[') {
            literal_speed(name)?
        } else if let Some(found) = self.speeds.get(&name.to_ascii_lowercase()) {
            found.clone()
        } else {
            let digits = name.strip_prefix(['v', 'V'])?;
            let v: u32 = digits.parse().ok().filter(|v| PREDEFINED.contains(v))?;
            [v.to_string(), PREDEFINED_REST.to_owned()]
        };
        let v = own.or_else(|| v.parse().ok())?;
        (v > 0.0).then_some((v, rest))
    }
}

fn literal_target(text: &str) -> Option<Target> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let inner = text.strip_prefix("[[")?.strip_suffix("]]")?;
    let (place, rest) = inner.split_once("],")?;
    let numbers: Option<Vec<f64>> = place
        .split(',')
        .map(|n| n.parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    let place = numbers?.try_into().ok()?;
    let pose = format!("{rest}]");
    // Four numbers of orientation, four of configuration, six of external axes.
    let counts: Vec<usize> = pose
        .split("],[")
        .map(|part| {
            part.trim_matches(['[', ']'])
                .split(',')
                .filter(|n| n.parse::<f64>().is_ok())
                .count()
        })
        .collect();
    (counts == [4, 4, 6]).then_some(Target { place, pose })
}

fn literal_speed(text: &str) -> Option<[String; 2]> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let (v, rest) = text.strip_prefix('[')?.strip_suffix(']')?.split_once(',')?;
    let all = std::iter::once(v).chain(rest.split(','));
    (all.clone().count() == 4 && all.clone().all(|n| n.parse::<f64>().is_ok()))
        .then(|| [v.into(), rest.into()])
}
