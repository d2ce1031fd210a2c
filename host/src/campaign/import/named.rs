//! Columns known by the words of the header, in five languages, with units in brackets, at the end of the name, in a row of
//! their own or in the lines before.
use super::Format;
use super::grid::{Grid, Names};
use super::layout::{DateOrder, Head, Layout, Open, Quantity, is_stamp, split, unit};
use super::words::{Meaning, Side, Word};

/// What the lines of a file say of its columns.
#[derive(Debug)]
pub(super) enum Found {
    Table(Box<Layout>),
    /// Columns with names, of which these do not make a circular test.
    Names(Vec<String>),
    /// No rows of numbers, or none with names.
    Nothing,
}

/// A field of the row with what its name says.
#[derive(Clone, Debug)]
struct Column {
    at: usize,
    name: String,
    word: Word,
}

/// `alone`: a single column of lengths is a turn of evenly spaced readings.
pub(super) fn recognise(head: &Head, alone: bool) -> Found {
    let Some(grid) = Grid::of(head) else {
        return Found::Nothing;
    };
    let Some(names) = grid.names(head) else {
        return Found::Nothing;
    };
    let mut columns = columns(&names, &grid);
    orientations(&mut columns);
    let mut notes = Vec::new();
    let mut open = Open::default();
    let mut fields = positions(&columns, &grid, head, &mut open, &mut notes);
    let measured = fields
        .iter()
        .filter(|f| matches!(f.1, Quantity::Position(_)))
        .count();
    if measured < 2 {
        fields = lengths(&columns, &mut open);
    }
    let radial = fields
        .iter()
        .any(|f| matches!(f.1, Quantity::Deviation | Quantity::Radius));
    let angles = fields.iter().any(|f| f.1 == Quantity::Angle);
    if measured < 2 && !radial {
        return Found::Names(names.names);
    }
    let time = time(&columns, &grid, head, &mut open, &names);
    fields.extend(time);
    if measured < 2 && time.is_none() && !angles && !alone {
        return Found::Names(names.names);
    }
    notes.extend(unused(&columns, &fields));
    let own = crate::campaign::is_contract_header(head.line(names.line)) && names.line == 0;
    let format = if own {
        Format::Contract
    } else if grid.decimal_comma {
        Format::German
    } else {
        Format::Named
    };
    Found::Table(Box::new(Layout {
        decimal_comma: grid.decimal_comma,
        width: grid.width,
        open,
        notes,
        ..Layout::new(format, grid.separator, grid.first, fields)
    }))
}

fn columns(names: &Names, grid: &Grid) -> Vec<Column> {
    let of = |(at, name): (usize, &String)| {
        let mut word = Word::of(name);
        let group = names.groups.get(at).map_or("", String::as_str);
        let above = Word::of(group);
        if let Meaning::Position(axis, side) = word.meaning {
            // `Rotation` above a letter is no place; `Soll` above one is no measurement.
            word.meaning = match Word::of(&format!("{group} {name}")).meaning {
                Meaning::Other if above.meaning == Meaning::Other => Meaning::Other,
                Meaning::Position(_, of_group) if side == Side::Unsaid => {
                    Meaning::Position(axis, of_group)
                }
                _ => word.meaning,
            };
        }
        let given = names.units.get(at).and_then(|u| u.as_deref());
        if let Some(factor) = given.and_then(unit) {
            word.factor = Some(factor);
            word.grad = given == Some("grad");
        }
        let numeric = grid.numbers.contains(&at) || grid.stamps.contains(&at);
        if !numeric && !matches!(word.meaning, Meaning::Other | Meaning::Index) {
            word.meaning = Meaning::Other;
        }
        Column {
            at,
            name: name.clone(),
            word,
        }
    };
    names
        .names
        .iter()
        .enumerate()
        .filter(|(_, n)| !n.is_empty())
        .map(of)
        .collect()
}

/// x, y, z before w are a quaternion.
fn orientations(columns: &mut [Column]) {
    for k in 3..columns.len() {
        let w = columns[k].name.trim().eq_ignore_ascii_case("w");
        let axis = |c: &Column| match c.word.meaning {
            Meaning::Position(axis, _) => Some(axis),
            _ => None,
        };
        if w && (0..3).all(|a| axis(&columns[k - 3 + a]) == Some(a)) {
            (0..3).for_each(|a| columns[k - 3 + a].word.meaning = Meaning::Other);
        }
    }
}

/// The measured positions, and those that were wanted.
fn positions(
    columns: &[Column],
    grid: &Grid,
    head: &Head,
    open: &mut Open,
    notes: &mut Vec<String>,
) -> Vec<(usize, Quantity, f64)> {
    let of = |side: Side| -> [Vec<&Column>; 3] {
        [0, 1, 2].map(|axis| {
            let is = |c: &&Column| c.word.meaning == Meaning::Position(axis, side);
            columns.iter().filter(is).collect()
        })
    };
    let axes = |set: &[Vec<&Column>; 3]| set.iter().filter(|c| !c.is_empty()).count();
    let (measured, wanted, plain) = (of(Side::Measured), of(Side::Wanted), of(Side::Unsaid));
    let labelled = axes(&measured) >= 2;
    let used = if labelled { &measured } else { &plain };
    if axes(used) < 2 {
        return Vec::new();
    }
    let sets = used
        .iter()
        .map(Vec::len)
        .filter(|n| *n > 0)
        .min()
        .unwrap_or(0);
    let mut taken = 0;
    let mut targets: Option<[Option<&Column>; 3]> =
        (axes(&wanted) >= 2).then(|| [0, 1, 2].map(|axis| wanted[axis].first().copied()));
    let set = |k: usize| [0, 1, 2].map(|axis| used[axis].get(k).copied());
    if sets == 2 && targets.is_none() && used.iter().all(|c| c.len() != 1) {
        taken = measured_of(&set(0), &set(1), grid, head);
        targets = Some(set(1 - taken));
        let name = |k: usize| {
            let columns = set(k).into_iter().flatten();
            let places: Vec<String> = columns.map(|c| (c.at + 1).to_string()).collect();
            places.join(", ")
        };
        notes.push(format!(
            "positions stand twice: columns {} are taken as measured, {} as the commanded path",
            name(taken),
            name(1 - taken)
        ));
    } else if sets > 1 {
        let first = set(0).into_iter().flatten().next().map_or(0, |c| c.at + 1);
        notes.push(format!(
            "positions of {sets} points: the first is taken, from column {first} on (--columns for another)"
        ));
    } else if labelled && (axes(&plain) >= 2 || targets.is_some()) {
        let names: Vec<&str> = set(0)
            .into_iter()
            .flatten()
            .map(|c| c.name.trim())
            .collect();
        notes.push(format!("measured is {}", names.join(", ")));
    }
    let given = default_length(head, grid.first);
    let mut fields = Vec::new();
    let mut push = |set: [Option<&Column>; 3], make: fn(usize) -> Quantity| {
        for (axis, column) in set.into_iter().enumerate() {
            if let Some(column) = column {
                let factor = column.word.factor.or(given);
                open.length |= factor.is_none();
                fields.push((column.at, make(axis), factor.unwrap_or(1e-3)));
            }
        }
    };
    push(set(taken), Quantity::Position);
    if let Some(targets) = targets {
        push(targets, Quantity::Target);
    }
    fields
}

/// Which of two sets was measured: the one with noise; the second where both are alike.
fn measured_of(
    first: &[Option<&Column>; 3],
    second: &[Option<&Column>; 3],
    grid: &Grid,
    head: &Head,
) -> usize {
    let noise = |set: &[Option<&Column>; 3]| {
        let of = |c: &Column| {
            let value = |line: &String| {
                let field = split(line, grid.separator).get(c.at)?.replace(',', ".");
                field.parse::<f64>().ok()
            };
            let rows = head.lines[grid.first..].iter();
            let values: Vec<f64> = rows.filter_map(value).collect();
            // Third differences: a circle that is sampled closely has next to none.
            let third = values
                .windows(4)
                .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs());
            let mut third: Vec<f64> = third.collect();
            third.sort_unstable_by(f64::total_cmp);
            third.get(third.len() / 2).copied().unwrap_or(0.0)
        };
        set.iter().flatten().map(|c| of(c)).sum::<f64>()
    };
    usize::from(noise(second) * 1.5 >= noise(first))
}

/// Deviation or radius, with the angle where there is one.
fn lengths(columns: &[Column], open: &mut Open) -> Vec<(usize, Quantity, f64)> {
    let find = |meaning| columns.iter().find(|c| c.word.meaning == meaning);
    let mut fields = Vec::new();
    if let Some(angle) = find(Meaning::Angle) {
        let degree = std::f64::consts::PI / 180.0;
        open.angle = angle.word.grad;
        fields.push((
            angle.at,
            Quantity::Angle,
            angle.word.factor.unwrap_or(degree),
        ));
    }
    if let Some(c) = find(Meaning::Deviation) {
        fields.push((c.at, Quantity::Deviation, c.word.factor.unwrap_or(1e-6)));
    } else if let Some(c) = find(Meaning::Radius) {
        fields.push((c.at, Quantity::Radius, c.word.factor.unwrap_or(1e-3)));
    }
    fields
}

/// The column of time; frames by their rate where there is none.
fn time(
    columns: &[Column],
    grid: &Grid,
    head: &Head,
    open: &mut Open,
    names: &Names,
) -> Option<(usize, Quantity, f64)> {
    let times = || columns.iter().filter(|c| c.word.meaning == Meaning::Time);
    if let Some(c) = times().find(|c| grid.numbers.contains(&c.at)) {
        open.time = c.word.factor.is_none();
        return Some((c.at, Quantity::Time, c.word.factor.unwrap_or(1.0)));
    }
    let stamp = columns.iter().find(|c| grid.stamps.contains(&c.at));
    if let Some(c) = stamp {
        let field = head.lines[grid.first..].iter().find_map(|line| {
            let field = split(line, grid.separator)
                .get(c.at)
                .map(|f| (*f).to_owned())?;
            is_stamp(&field).then_some(field)
        })?;
        return Some((c.at, Quantity::Stamp(order_of(&field)), 1.0));
    }
    let index = columns.iter().find(|c| {
        c.word.meaning == Meaning::Index && grid.numbers.contains(&c.at) && is_frame(&c.name)
    })?;
    let rate_hz = frame_rate(head, names.line)?;
    Some((index.at, Quantity::Time, 1.0 / rate_hz))
}

fn is_frame(name: &str) -> bool {
    ["frame", "sample", "index"].contains(&name.trim().to_lowercase().as_str())
}

/// Order of the parts of a date: the year before, points between as in Germany, else as in America.
fn order_of(stamp: &str) -> DateOrder {
    let date = stamp.trim().split([' ', 'T']).next().unwrap_or("");
    if date.contains(':')
        || date
            .split(['-', '/', '.'])
            .next()
            .is_some_and(|p| p.len() == 4)
    {
        DateOrder::YearMonthDay
    } else if date.contains('.') {
        DateOrder::DayMonthYear
    } else {
        DateOrder::MonthDayYear
    }
}

/// Frames a second, from the lines above the names: `Capture Frame Rate,20.0`, or Vicon's line with the rate alone.
fn frame_rate(head: &Head, names: usize) -> Option<f64> {
    let lines = || head.lines[..names].iter();
    let pair = lines().find_map(|line| {
        let fields = split(line, b',');
        let at = fields.iter().position(|f| {
            let f = f.to_lowercase();
            f.contains("frame rate") || f.contains("sample rate") || f.contains("sampling rate")
        })?;
        fields.get(at + 1)?.parse::<f64>().ok()
    });
    let alone = || lines().find_map(|line| line.trim().trim_matches(',').parse::<f64>().ok());
    pair.or_else(alone)
        .filter(|rate| *rate > 0.0 && rate.is_finite())
}

/// `Length Units,Meters` above the names.
fn default_length(head: &Head, rows: usize) -> Option<f64> {
    if head.lines[..rows]
        .iter()
        .any(|l| l.contains("field.") && l.contains("position"))
    {
        return Some(1.0); // ROS writes metres
    }
    head.lines[..rows].iter().find_map(|line| {
        let lower = line.to_lowercase();
        let at = lower.find("length unit").or_else(|| lower.find("units:"))?;
        let words = lower[at..].split([',', ':', ';', '\t', ' ', '=']);
        words.filter(|w| !w.is_empty()).skip(1).find_map(unit)
    })
}

/// Words on the columns that were not taken.
fn unused(columns: &[Column], fields: &[(usize, Quantity, f64)]) -> Option<String> {
    let names: Vec<&str> = columns
        .iter()
        .filter(|c| c.word.meaning == Meaning::Unknown && !fields.iter().any(|f| f.0 == c.at))
        .map(|c| c.name.trim())
        .collect();
    (!names.is_empty()).then(|| format!("columns not understood: {}", names.join(", ")))
}

/// Meaning and factor to SI of a column name such as `x_mm`, `X [mm]`, `Zeit (s)`, `Abweichung [µm]`.
pub(super) fn column(name: &str) -> Option<(Quantity, f64)> {
    let word = Word::of(name);
    let degree = std::f64::consts::PI / 180.0;
    let (quantity, usual) = match word.meaning {
        Meaning::Time => (Quantity::Time, 1.0),
        Meaning::Angle => (Quantity::Angle, degree),
        Meaning::Deviation => (Quantity::Deviation, 1e-6),
        Meaning::Radius => (Quantity::Radius, 1e-3),
        Meaning::Position(axis, Side::Wanted) => (Quantity::Target(axis), 1e-3),
        Meaning::Position(axis, _) => (Quantity::Position(axis), 1e-3),
        _ => return None,
    };
    // `x_furlong` is refused: what stands behind the axis is no unit that is known.
    let plain = name.trim().split(['_', '[', '(', ' ']).count() <= 1 || word.factor.is_some();
    (plain || matches!(quantity, Quantity::Target(_)))
        .then_some((quantity, word.factor.unwrap_or(usual)))
}
