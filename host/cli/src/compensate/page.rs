//! `--report`: the part drawn, its arcs by correction, what was left, and the contour before and after through the model.
use super::Args;
use crate::Failure;
use giotto::model_file::ModelFile;
use giotto_nc::contour::contour;
use giotto_nc::path::{Kind, Move, moves};
use giotto_nc::{Fate, Led, Left, Options, Report};
use giotto_report::plan_view::{Curve, Sort, Stroke};
use giotto_report::program_page::{Program, Reason, Size, program_page};
use std::collections::BTreeMap;

/// Lines that are named beside a reason.
const LINES: usize = 12;

/// A program, its output and what became of its arcs.
pub(super) struct Page<'a> {
    pub(super) args: &'a Args,
    pub(super) options: &'a Options,
    pub(super) model: &'a ModelFile,
    pub(super) program: &'a [u8],
    pub(super) output: &'a [u8],
    pub(super) arcs: &'a [Report],
}

/// Largest contour errors of the arcs of one line, before and after, µm.
type Errors = [Option<f64>; 2];

impl Page<'_> {
    pub(super) fn html(&self) -> Result<String, Failure> {
        let meant = moves(self.program, self.options);
        let (errors, whole) = self.errors(&meant);
        let fates: BTreeMap<usize, Fate> = self.arcs.iter().map(|a| (a.line, a.fate)).collect();
        let name = self.args.program.file_name().map_or_else(
            || self.args.program.display().to_string(),
            |name| name.to_string_lossy().into_owned(),
        );
        let page = Program {
            words: self.words(&errors),
            strokes: meant
                .iter()
                .map(|m| stroke(m, fates.get(&m.line), errors.get(&m.line)))
                .collect(),
            sizes: self.sizes(&errors),
            reasons: self.reasons(),
            method: self.method(&errors, whole),
            name,
        };
        program_page(&page).map_err(Failure::input)
    }

    /// Contour errors by line, and whether the whole program was run.
    fn errors(&self, meant: &[Move]) -> (BTreeMap<usize, Errors>, bool) {
        let mut list: BTreeMap<usize, Errors> = BTreeMap::new();
        let driven = moves(self.output, self.options);
        let run = |run: &[Move]| contour(run, meant, self.model, self.options);
        let (Some(before), Some(after)) = (run(meant), run(&driven)) else {
            return (list, false);
        };
        for (slot, found) in [&before, &after].into_iter().enumerate() {
            for (m, um) in meant.iter().zip(&found.most_um) {
                let Some(um) = um.filter(|_| matches!(m.kind, Kind::Arc { .. })) else {
                    continue;
                };
                let most = list.entry(m.line).or_default()[slot].get_or_insert(0.0);
                *most = most.max(um);
            }
        }
        // On a lead the machine is beside the contour by intent.
        for report in self.arcs {
            if let (
                Fate::Corrected {
                    led: Led::Tangent, ..
                },
                Some(errors),
            ) = (report.fate, list.get_mut(&report.line))
            {
                errors[1] = None;
            }
        }
        (list, before.whole && after.whole)
    }

    fn words(&self, errors: &BTreeMap<usize, Errors>) -> Vec<String> {
        let (mut corrected, mut largest, mut slower_s) = (0, 0.0_f64, 0.0);
        for report in self.arcs {
            if let Fate::Corrected {
                delta_mm,
                slower_s: more,
                ..
            } = report.fate
            {
                corrected += 1;
                largest = largest.max(delta_mm.abs());
                slower_s += more;
            }
        }
        let mut words = vec![format!(
            "{corrected} of {} arcs corrected, radius changed by up to {:.1} µm.",
            self.arcs.len(),
            largest * 1e3
        )];
        let of = |report: &Report| {
            let found = errors.get(&report.line)?;
            matches!(report.fate, Fate::Corrected { .. }).then_some((report.line, *found))
        };
        let both = self.arcs.iter().filter_map(of);
        let both = both.filter_map(|(line, e)| Some((line, e[0]?, e[1]?)));
        let worst = both.fold(None, |worst: Option<(f64, f64, usize)>, (line, was, is)| {
            let (before, after, at) = worst.unwrap_or((0.0, 0.0, line));
            let at = if is > after { line } else { at };
            Some((before.max(was), after.max(is), at))
        });
        if let Some((before, after, line)) = worst {
            words.push(format!(
                "Largest contour error of the corrected arcs through the model: {before:.1} µm as programmed, {after:.1} µm as corrected (line {line})."
            ));
        }
        words.extend(super::summary::slower(slower_s).map(|words| plain(&words)));
        words
    }

    /// Corrected arcs of one radius and feed, to a tenth of a percent, the most frequent first.
    fn sizes(&self, errors: &BTreeMap<usize, Errors>) -> Vec<Size> {
        let grain = |v: f64| (v.ln() * 1000.0).round() as i64;
        let mut sizes: BTreeMap<(i64, i64), Size> = BTreeMap::new();
        for report in self.arcs {
            let Fate::Corrected {
                radius_mm,
                feed_mm_s,
                delta_mm,
                ..
            } = report.fate
            else {
                continue;
            };
            let found = errors.get(&report.line).copied().unwrap_or_default();
            let key = (grain(radius_mm), grain(feed_mm_s));
            let size = sizes.entry(key).or_insert(Size {
                line: report.line,
                count: 0,
                radius_mm,
                feed_mm_s,
                change_um: delta_mm * 1e3,
                contour_um: [None; 2],
            });
            size.count += 1;
            for (most, found) in size.contour_um.iter_mut().zip(found) {
                *most = match (*most, found) {
                    (Some(a), Some(b)) => Some(f64::max(a, b)),
                    (a, b) => a.or(b),
                };
            }
        }
        let mut list: Vec<Size> = sizes.into_values().collect();
        list.sort_by_key(|size| (std::cmp::Reverse(size.count), size.line));
        list
    }

    fn reasons(&self) -> Vec<Reason> {
        let mut reasons: BTreeMap<Left, Vec<usize>> = BTreeMap::new();
        for report in self.arcs {
            if let Fate::Left(left) = report.fate {
                reasons.entry(left).or_default().push(report.line);
            }
        }
        let mut list: Vec<Reason> = reasons
            .into_iter()
            .map(|(left, lines)| {
                let named: Vec<String> =
                    lines.iter().take(LINES).map(ToString::to_string).collect();
                let more = if lines.len() > LINES { " …" } else { "" };
                Reason {
                    words: plain(&left.to_string()),
                    count: lines.len(),
                    lines: named.join(", ") + more,
                }
            })
            .collect();
        list.sort_by_key(|reason| std::cmp::Reverse(reason.count));
        list
    }

    fn method(&self, errors: &BTreeMap<usize, Errors>, whole: bool) -> Vec<String> {
        let mut words = vec![format!(
            "Model {}, of the machine {}; acceleration {} mm/s². Each stretch between two stops or corners is run from rest to rest through \
             the chain of lags that the radius law of the model stands for, and its distance from the programmed path is taken. A figure is \
             the largest of all arcs of its row, with their joints and stops.",
            self.args.model.display(),
            self.model.machine,
            self.options.acceleration_mm_s2
        )];
        if errors.is_empty() {
            words.push("No contour was worked out: the model's radius law stands for no chain of lags that is known, or no arc of the program has a known place.".into());
        } else if !whole {
            words.push("The program is longer than what is worked out here; arcs behind that place have no contour error.".into());
        }
        let effects = super::not_applied(self.model);
        if !effects.is_empty() {
            words.push(format!(
                "Not in these figures, and not in the correction: {}.",
                effects.join(", ")
            ));
        }
        let led = |r: &&Report| {
            matches!(
                r.fate,
                Fate::Corrected {
                    led: Led::Tangent,
                    ..
                }
            )
        };
        if self.arcs.iter().any(|r| led(&r)) {
            words.push("Circles with leads have no figure behind the correction: on a lead the tool is beside the contour by intent.".into());
        }
        words.push(
            "In simulation only: no corrected program has been run on a real machine.".into(),
        );
        words
    }
}

/// Without the marks of a terminal around what is to be typed.
fn plain(words: &str) -> String {
    words.replace('`', "")
}

fn stroke(m: &Move, fate: Option<&Fate>, errors: Option<&Errors>) -> Stroke {
    let curve = match m.kind {
        Kind::Arc {
            axes,
            centre_mm,
            sweep_rad,
        } => Some(Curve {
            axes,
            centre_mm,
            sweep_rad,
        }),
        Kind::Rapid | Kind::Line | Kind::Unread => None,
    };
    let (sort, label) = match (m.kind, fate) {
        (Kind::Rapid, _) => (Sort::Rapid, String::new()),
        (Kind::Line, _) => (Sort::Line, String::new()),
        (
            _,
            Some(Fate::Corrected {
                radius_mm,
                feed_mm_s,
                delta_mm,
                ..
            }),
        ) => (
            Sort::Corrected(delta_mm * 1e3),
            format!(
                "line {}: R {radius_mm:.3} mm at {feed_mm_s:.1} mm/s: {:+.1} µm{}",
                m.line,
                delta_mm * 1e3,
                match errors {
                    Some([Some(was), Some(is)]) => format!("; contour {was:.1} → {is:.1} µm"),
                    _ => String::new(),
                }
            ),
        ),
        (_, Some(Fate::Left(left))) => (Sort::Left, format!("line {}: {left}", m.line)),
        (_, None) => (Sort::Left, format!("line {}", m.line)),
    };
    Stroke {
        from_mm: m.from_mm,
        to_mm: m.to_mm,
        curve,
        sort,
        label,
    }
}
