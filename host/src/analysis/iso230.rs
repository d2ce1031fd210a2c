//! ISO 230-4: circular deviations of pairs of runs.
//!
//! G is the radial range about the least-squares circle of one direction, G(b) that of both together. F is
//! the deviation from the nominal circle as the instrument was centred (the standard's first choice of
//! centre): a set-up offset is in F and not in G. D is the radius of the least-squares circle of both
//! directions minus the nominal one. What needs both directions is `None` where one is missing.
use super::points::Polar;
use super::run::{RunAnalysis, SECTORS};
use crate::campaign::Direction;
use giotto_shared::circle::{self, Merge};

/// One pair of runs, or a run without a partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iso230 {
    /// Nominal radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// Circular deviation G, clockwise, m.
    pub g_cw_m: Option<f64>,
    /// Circular deviation G, counter-clockwise, m.
    pub g_ccw_m: Option<f64>,
    /// Bi-directional circular deviation G(b), m.
    pub g_b_m: Option<f64>,
    /// Largest radial deviation F, m, over the directions there are.
    pub f_max_m: f64,
    /// Smallest radial deviation F, m.
    pub f_min_m: f64,
    /// Mean bi-directional radial deviation D, m.
    pub d_m: Option<f64>,
}

/// Samples kept for the figures of a pair: (angle, deviation) for the circle and for the extremes.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    angle: Vec<f64>,
    deviation: Vec<f64>,
    /// Of long runs only: the outermost and innermost sample of each small sector.
    extremes: Option<(Vec<f64>, Vec<f64>)>,
}

impl Kept {
    /// Keeps what a pair needs of a run: of a long one sector means and extremes only. Within a sector an offset
    /// of 1 mm moves the distance by 0.05 µm.
    pub(super) fn of(angle: Vec<f64>, deviation: Vec<f64>) -> Self {
        if angle.len() <= SECTORS {
            return Self {
                angle,
                deviation,
                extremes: None,
            };
        }
        let size = angle.len().div_ceil(SECTORS);
        let mut kept = Self::default();
        let mut extremes = (Vec::new(), Vec::new());
        for (a, v) in angle.chunks(size).zip(deviation.chunks(size)) {
            let n = a.len() as f64;
            kept.angle.push(a.iter().sum::<f64>() / n);
            kept.deviation.push(v.iter().sum::<f64>() / n);
            let by = |i: &usize, j: &usize| v[*i].total_cmp(&v[*j]);
            for at in [(0..a.len()).min_by(by), (0..a.len()).max_by(by)]
                .into_iter()
                .flatten()
            {
                extremes.0.push(a[at]);
                extremes.1.push(v[at]);
            }
        }
        kept.extremes = Some(extremes);
        kept
    }

    fn circle_part(&self) -> (&[f64], &[f64]) {
        (&self.angle, &self.deviation)
    }

    fn range_part(&self) -> (&[f64], &[f64]) {
        self.extremes
            .as_ref()
            .map_or(self.circle_part(), |(a, v)| (a, v))
    }
}

#[derive(Clone, Copy, Debug)]
struct Range(f64, f64);

impl Default for Range {
    fn default() -> Self {
        Self(f64::INFINITY, f64::NEG_INFINITY)
    }
}

impl Merge for Range {
    fn merge(&mut self, other: &Self) {
        *self = Self(self.0.min(other.0), self.1.max(other.1));
    }
}

/// Which runs belong together: same radius and feed, the k-th clockwise with the k-th counter-clockwise one.
/// Indices into `runs`, in order of first appearance.
pub fn pairs<'a>(
    runs: impl Iterator<Item = (f64, f64, Direction)> + 'a,
) -> Vec<Vec<[Option<usize>; 2]>> {
    let mut groups: Vec<([u64; 2], [Vec<usize>; 2])> = Vec::new();
    let mut places = std::collections::HashMap::new();
    for (index, (radius, feed, direction)) in runs.enumerate() {
        let key = [radius.to_bits(), feed.to_bits()];
        let place = *places.entry(key).or_insert_with(|| {
            groups.push((key, [Vec::new(), Vec::new()]));
            groups.len() - 1
        });
        groups[place].1[usize::from(direction == Direction::Ccw)].push(index);
    }
    let couple = |[cw, ccw]: &[Vec<usize>; 2]| {
        (0..cw.len().max(ccw.len()))
            .map(|k| [cw.get(k).copied(), ccw.get(k).copied()])
            .collect()
    };
    groups.iter().map(|(_, both)| couple(both)).collect()
}

/// Figures of a pair; `None` if both are missing.
pub(super) fn of_pair(
    cw: Option<(&RunAnalysis, &Kept)>,
    ccw: Option<(&RunAnalysis, &Kept)>,
) -> Option<Iso230> {
    let (first, _) = cw.or(ccw)?;
    let present = || cw.iter().chain(&ccw);
    let mut iso = Iso230 {
        radius_m: first.radius_m,
        feed_m_s: first.feed_m_s,
        g_cw_m: cw.map(|(run, _)| run.out_of_roundness_m),
        g_ccw_m: ccw.map(|(run, _)| run.out_of_roundness_m),
        g_b_m: None,
        f_max_m: present()
            .map(|(run, _)| run.deviation_range_m[1])
            .fold(f64::NEG_INFINITY, f64::max),
        f_min_m: present()
            .map(|(run, _)| run.deviation_range_m[0])
            .fold(f64::INFINITY, f64::min),
        d_m: None,
    };
    if let (Some((_, a)), Some((_, b))) = (cw, ccw) {
        let radius_m = first.radius_m;
        let together = Polar {
            radius_m,
            parts: vec![a.circle_part(), b.circle_part()],
        };
        if let Ok(fit) = circle::fit(&together) {
            let [cx, cy] = fit.circle.centre;
            let outline = Polar {
                radius_m,
                parts: vec![a.range_part(), b.range_part()],
            };
            let range: Range = outline.fold(|angle, deviation| {
                let mut range = Range::default();
                for (a, v) in angle.iter().zip(deviation) {
                    let ((sin, cos), r) = (a.sin_cos(), radius_m + v);
                    let d = (r * cos - cx).hypot(r * sin - cy);
                    range.merge(&Range(d, d));
                }
                range
            });
            iso.g_b_m = Some(range.1 - range.0);
            iso.d_m = Some(fit.circle.radius - radius_m);
        }
    }
    Some(iso)
}
