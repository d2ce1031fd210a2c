//! The misfit over programmed feed and radius: a table whose cells are shaded.
use giotto::campaign::Campaign;
use giotto::diagnosis::picture::RunPicture;
use serde::Serialize;

/// Most columns or rows: more distinct values are put together.
const MOST: usize = 16;

/// A map before and after, shaded on one scale.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Map {
    /// Feeds, mm/s, as words.
    pub feeds: Vec<String>,
    /// One row a radius.
    pub rows: Vec<Row>,
    /// Value of the darkest cell, µm.
    pub darkest_um: f64,
}

/// A radius.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Radius, mm, as words.
    pub radius: String,
    /// Cells before, then after.
    pub cells: [Vec<Option<Cell>>; 2],
}

/// A cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Root mean square, µm.
    pub um: String,
    /// Shade, %, 0 to 100.
    pub shade: u32,
}

/// Groups of distinct values with their words.
struct Groups {
    upper: Vec<f64>,
    words: Vec<String>,
}

impl Groups {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut distinct: Vec<f64> = values.collect();
        distinct.sort_by(f64::total_cmp);
        distinct.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs());
        let size = distinct.len().div_ceil(MOST).max(1);
        let (mut upper, mut words) = (Vec::new(), Vec::new());
        for chunk in distinct.chunks(size) {
            let (first, last) = (chunk[0] * 1e3, chunk[chunk.len() - 1] * 1e3);
            upper.push(chunk[chunk.len() - 1] * (1.0 + 1e-9));
            words.push(if chunk.len() == 1 {
                super::number::plain(first)
            } else {
                format!(
                    "{}–{}",
                    super::number::plain(first),
                    super::number::plain(last)
                )
            });
        }
        Self { upper, words }
    }

    fn at(&self, value: f64) -> usize {
        self.upper
            .partition_point(|upper| *upper < value)
            .min(self.upper.len().saturating_sub(1))
    }
}

/// The map of a campaign.
pub fn map(campaign: &Campaign, picture: &[RunPicture]) -> Map {
    let runs = || picture.iter().map(|p| &campaign.runs[p.index]);
    let (radii, feeds) = (
        Groups::of(runs().map(|r| r.radius_m)),
        Groups::of(runs().map(|r| r.feed_m_s)),
    );
    let mut sums = vec![vec![[0.0, 0.0, 0.0]; feeds.words.len()]; radii.words.len()];
    for (run, p) in runs().zip(picture) {
        let sum = &mut sums[radii.at(run.radius_m)][feeds.at(run.feed_m_s)];
        for (sum, value) in sum
            .iter_mut()
            .zip([p.rms_m[0].powi(2), p.rms_m[1].powi(2), 1.0])
        {
            *sum += value;
        }
    }
    let rms = |sum: &[f64; 3], k: usize| (sum[2] > 0.0).then(|| (sum[k] / sum[2]).sqrt() * 1e6);
    let darkest = sums
        .iter()
        .flatten()
        .flat_map(|s| [rms(s, 0), rms(s, 1)])
        .flatten()
        .fold(0.0, f64::max);
    let cell = |um: f64| Cell {
        um: super::number::fixed(um, if darkest < 100.0 { 1 } else { 0 }),
        shade: (100.0 * um / darkest.max(f64::MIN_POSITIVE)).round() as u32,
    };
    let rows = sums
        .iter()
        .zip(radii.words)
        .map(|(row, radius)| Row {
            radius,
            cells: [0, 1].map(|k| row.iter().map(|sum| rms(sum, k).map(cell)).collect()),
        })
        .collect();
    Map {
        feeds: feeds.words,
        rows,
        darkest_um: darkest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_distinct_values_are_put_together_and_every_one_finds_its_group() {
        let values: Vec<f64> = (1..=50).map(|i| f64::from(i) * 1e-3).collect();
        let groups = Groups::of(values.iter().copied());
        assert!(groups.words.len() <= MOST);
        assert_eq!(groups.words[0], "1–4");
        assert_eq!(
            (
                groups.at(1e-3),
                groups.at(4e-3),
                groups.at(5e-3),
                groups.at(50e-3)
            ),
            (0, 0, 1, 12)
        );
    }
}
