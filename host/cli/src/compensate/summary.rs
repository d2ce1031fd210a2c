//! What a person reads about a corrected program: sizes, and each reason once with its count and its lines.
use super::Args;
use crate::Output;
use giotto::model_file::ModelFile;
use giotto_nc::{Fate, Led, Left, Report};
use std::collections::BTreeMap;

/// What remains at a joint is said from this share of the correction on.
const JOINT_BAR: f64 = 0.05;
/// Corrected arcs that are named one by one; of more the sizes are grouped.
const NAMED: usize = 20;
/// Lines that are named beside a reason.
const LINES: usize = 6;

/// A program and what became of its arcs.
pub(super) struct Summary<'a> {
    pub(super) args: &'a Args,
    pub(super) model: &'a ModelFile,
    pub(super) arcs: &'a [Report],
}

/// Arcs of one size.
#[derive(Default)]
struct Size {
    count: usize,
    first_line: usize,
    radius_mm: f64,
    feed_mm_s: f64,
    delta_mm: f64,
    share: f64,
}

impl Summary<'_> {
    pub(super) fn say(&self, out: Output) {
        let corrected = self
            .arcs
            .iter()
            .filter(|a| matches!(a.fate, Fate::Corrected { .. }))
            .count();
        let largest = self.arcs.iter().fold(0.0, |most, a| match a.fate {
            Fate::Corrected { delta_mm, .. } => f64::max(most, delta_mm.abs()),
            Fate::Left(_) => most,
        });
        out.say(format_args!(
            "{}: {corrected} of {} arcs corrected, radius changed by up to {:.1} µm",
            self.args.output.display(),
            self.arcs.len(),
            largest * 1e3
        ));
        if corrected <= NAMED {
            self.one_by_one(out);
        } else {
            self.by_size(out);
        }
        let slower_s = self.arcs.iter().fold(0.0, |sum, a| match a.fate {
            Fate::Corrected { slower_s, .. } => sum + slower_s,
            Fate::Left(_) => sum,
        });
        if let Some(words) = slower(slower_s) {
            out.say(format_args!("{words}"));
        }
        self.leads(out);
        self.reasons(out);
        let not_applied = super::not_applied(self.model);
        if !not_applied.is_empty() {
            out.say(format_args!(
                "only the radius law is applied; {} act on lines too and belong to the controller's table",
                not_applied.join(", ")
            ));
        }
    }

    fn one_by_one(&self, out: Output) {
        let name = self.args.program.display();
        for report in self.arcs {
            if let Fate::Corrected {
                radius_mm,
                feed_mm_s,
                delta_mm,
                blocks,
                joint_share,
                ..
            } = report.fate
            {
                out.say(format_args!(
                    "  {name}:{}: R {radius_mm:.3} mm at {feed_mm_s:.1} mm/s: {:+.1} µm, {blocks} block{}{}",
                    report.line,
                    delta_mm * 1e3,
                    if blocks == 1 { "" } else { "s" },
                    joints(joint_share, delta_mm)
                ));
            }
        }
    }

    /// Arcs that have one radius and feed, to a tenth of a percent, in one line.
    fn by_size(&self, out: Output) {
        let mut sizes: BTreeMap<(i64, i64), Size> = BTreeMap::new();
        let grain = |v: f64| (v.ln() * 1000.0).round() as i64;
        for report in self.arcs {
            if let Fate::Corrected {
                radius_mm,
                feed_mm_s,
                delta_mm,
                joint_share,
                ..
            } = report.fate
            {
                let size = sizes
                    .entry((grain(radius_mm), grain(feed_mm_s)))
                    .or_insert_with(|| Size {
                        first_line: report.line,
                        radius_mm,
                        feed_mm_s,
                        ..Size::default()
                    });
                size.count += 1;
                if delta_mm.abs() > size.delta_mm.abs() {
                    size.delta_mm = delta_mm;
                }
                size.share = size.share.max(joint_share);
            }
        }
        let mut list: Vec<_> = sizes.into_iter().collect();
        list.sort_by_key(|(_, size)| std::cmp::Reverse(size.count));
        let rest: usize = list.iter().skip(NAMED).map(|(_, size)| size.count).sum();
        for (_, size) in list.iter().take(NAMED) {
            out.say(format_args!(
                "  {} of R {:.3} mm at {:.1} mm/s: {:+.1} µm (line {}{}){}",
                size.count,
                size.radius_mm,
                size.feed_mm_s,
                size.delta_mm * 1e3,
                size.first_line,
                if size.count > 1 { " …" } else { "" },
                joints(size.share, size.delta_mm)
            ));
        }
        if rest > 0 {
            out.say(format_args!("  {rest} of other sizes; --json names each"));
        }
    }

    fn leads(&self, out: Output) {
        let lines = |wanted: Led| -> Vec<String> {
            let of = |report: &&Report| matches!(report.fate, Fate::Corrected { led, .. } if led == wanted);
            let list = self.arcs.iter().filter(of);
            list.map(|report| report.line.to_string()).collect()
        };
        for (led, words) in [
            (Led::Tangent, "with leads of their own"),
            (
                Led::SideUnknown,
                "begin or end at a stop and got no lead: say which side is free by --inside, --outside or a comment before them",
            ),
            (
                Led::NoRoom,
                "begin or end at a stop and got no lead: none can be run there within the model and the acceleration",
            ),
        ] {
            let lines = lines(led);
            if !lines.is_empty() {
                let named = lines[..lines.len().min(LINES)].join(", ");
                let more = if lines.len() > LINES { " …" } else { "" };
                out.say(format_args!(
                    "  circles {words}: {} (line {named}{more})",
                    lines.len()
                ));
            }
        }
    }

    fn reasons(&self, out: Output) {
        let name = self.args.program.display();
        let mut reasons: BTreeMap<Left, Vec<usize>> = BTreeMap::new();
        let mut counts: BTreeMap<Left, usize> = BTreeMap::new();
        for report in self.arcs {
            if let Fate::Left(left) = report.fate {
                *counts.entry(left).or_default() += 1;
                let lines = reasons.entry(left).or_default();
                if lines.len() < LINES {
                    lines.push(report.line);
                }
            }
        }
        for (left, lines) in reasons {
            let count = counts[&left];
            let more = if count > lines.len() { " …" } else { "" };
            let listed: Vec<String> = lines.iter().map(ToString::to_string).collect();
            let left_um = match left {
                Left::BeyondModel => self.range(),
                _ => String::new(),
            };
            out.say(format_args!(
                "  {name}:{}: {count} arc{} left as {} (line{} {}{more}): {left}{left_um}",
                lines.first().copied().unwrap_or(1),
                if count == 1 { "" } else { "s" },
                if count == 1 { "it was" } else { "they were" },
                if lines.len() == 1 { "" } else { "s" },
                listed.join(", ")
            ));
        }
    }

    /// What the model holds for, and how to measure farther.
    fn range(&self) -> String {
        let valid = &self.model.valid;
        let ([r0, r1], [f0, f1]) = (valid.radius_mm, valid.feed_mm_s);
        format!(
            " (it was fitted on R {r0}…{r1} mm at {f0}…{f1} mm/s, feed over radius up to {:.3} 1/s; measure circles of a \
             smaller radius or at a higher feed, add them to the campaign and fit again)",
            f1 / r0
        )
    }
}

/// What slowing down before stops costs, if anything.
pub(super) fn slower(slower_s: f64) -> Option<String> {
    (slower_s > 0.0).then(|| {
        format!(
            "The last stretch of an arc before a stop is run at half of F or at 35 % of it: {slower_s:.2} s in all; `--full-feed-to-stops` keeps F."
        )
    })
}

fn joints(share: f64, delta_mm: f64) -> String {
    if share > JOINT_BAR {
        format!(
            "; up to {:.0} % of that ({:.1} µm) remains at a joint",
            100.0 * share,
            share * delta_mm.abs() * 1e3
        )
    } else {
        String::new()
    }
}
