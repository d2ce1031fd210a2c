//! The veto of the runs left out: a cause without which they are foretold better has no place in the model.
//!
//! Each radius is left out once, then each speed (of two speeds each in one direction: what one speed says of another is
//! nothing, so that every law of the speed would fail for want of runs). The set is fitted on the runs that stay, shapes as
//! they are. All of it are small sums of Gram matrices, so that every cause can be tried without.
use super::explained::{Explained, refit};
use super::linear::{Factor, solve};
use super::search::columns_of;
use super::tangent;

/// Radius (m), feed (m/s) and sense of travel (±1) of a run.
type Circle = [f64; 3];

/// Runs that are left out together: those of each radius, then those of each speed; nothing where all are alike.
pub fn folds(circles: &[Circle]) -> [Vec<Vec<usize>>; 2] {
    let values = |which: usize| {
        let mut values: Vec<f64> = circles.iter().map(|run| run[which]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * b.abs());
        values
    };
    let with = |which: usize, value: f64| {
        let same = move |i: &usize| (circles[*i][which] - value).abs() < 1e-9 * value.abs();
        (0..circles.len()).filter(same)
    };
    let each = |which: usize| -> Vec<Vec<usize>> {
        let of = |value: f64| with(which, value).collect();
        match values(which) {
            alone if alone.len() < 2 => Vec::new(),
            values => values.into_iter().map(of).collect(),
        }
    };
    let (feeds, ways) = (values(1), values(2));
    let by_feed = match (feeds.len(), ways.len()) {
        (2, 2) => feeds
            .iter()
            .flat_map(|feed| ways.iter().map(|way| (*feed, *way)))
            .map(|(feed, way)| with(1, feed).filter(|&i| circles[i][2] == way).collect())
            .filter(|runs: &Vec<usize>| !runs.is_empty())
            .collect(),
        (2, _) => Vec::new(),
        _ => each(1),
    };
    [each(0), by_feed]
}

/// The same of an explained campaign.
pub fn folds_of(found: &Explained) -> Vec<Vec<usize>> {
    let runs: Vec<Circle> = found
        .runs
        .iter()
        .map(|run| [run.view.radius_m, run.programmed_m_s, run.view.sign])
        .collect();
    folds(&runs).concat()
}

/// Those members of a set that the runs of these weights determine, the earlier ones first, and the columns to fit: the
/// model's own parameters among them as far as they are determined beside the members. With one speed left, a static
/// error of the size cannot be told from the servo, which then stays as all runs have it.
pub fn determined(found: &Explained, weights: &[f64], set: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let products = found.gram.white(weights);
    let whole = columns_of(&found.nuisance, &found.items, set);
    if Factor::new(&products, &whole).is_some() {
        return (set.to_vec(), whole);
    }
    let (mut kept, mut columns): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    let add = |columns: &mut Vec<usize>, more: &[usize]| {
        let before = columns.len();
        columns.extend(more);
        let ok = Factor::new(&products, columns).is_some();
        if !ok {
            columns.truncate(before);
        }
        ok
    };
    for &item in set {
        if add(&mut columns, &found.items[item].columns) {
            kept.push(item);
        }
    }
    for own in &found.nuisance {
        add(&mut columns, &[*own]);
    }
    (kept, columns)
}

/// Sum of squares of what a set fails to foretell of the runs left out, m².
fn failed_m2(found: &Explained, folds: &[Vec<usize>], set: &[usize]) -> f64 {
    let of_fold = |out: &Vec<usize>| -> f64 {
        let mut weights = found.all();
        out.iter().for_each(|&run| weights[run] = 0.0);
        let (_, columns) = determined(found, &weights, set);
        let coefficients = solve(&found.gram.white(&weights), &columns)
            .map_or_else(Vec::new, |solution| solution.coefficients);
        let mut only = vec![0.0; found.runs.len()];
        out.iter().for_each(|&run| only[run] = 1.0);
        let plain = found.gram.plain(&only);
        let mut left = plain.at(0, 0);
        for (&a, x) in columns.iter().zip(&coefficients) {
            left -= 2.0 * x * plain.at(a, 0);
            for (&b, y) in columns.iter().zip(&coefficients) {
                left += x * y * plain.at(a, b);
            }
        }
        left.max(0.0)
    };
    folds.iter().map(of_fold).sum()
}

/// Takes causes out of the chosen ones as long as that makes the runs left out better foretold; their items.
pub fn apply(found: &mut Explained) -> Vec<usize> {
    let folds = folds_of(found);
    let mut gone = Vec::new();
    if folds.is_empty() {
        return gone;
    }
    loop {
        let now = failed_m2(found, &folds, &found.chosen);
        let better = found
            .stated()
            .map(|item| {
                (
                    failed_m2(found, &folds, &without(&found.chosen, item)),
                    item,
                )
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(failed, _)| *failed < now * (1.0 - ROUNDING));
        let Some((_, item)) = better else { break };
        take_out(found, item);
        gone.push(item);
    }
    gone
}

/// Differences of the sums below this share are rounding.
const ROUNDING: f64 = 1e-9;

/// Takes one member out of the chosen set and fits the others again.
pub fn take_out(found: &mut Explained, item: usize) {
    found.chosen = without(&found.chosen, item);
    let all = found.all();
    refit(found, &all);
    tangent::finish(found, &all);
}

fn without(set: &[usize], item: usize) -> Vec<usize> {
    set.iter().copied().filter(|&other| other != item).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_go_out_by_radius_and_by_feed() {
        let runs = [[0.1, 0.2, 1.0], [0.1, 0.4, 1.0], [0.3, 0.6, 1.0]];
        assert_eq!(
            folds(&runs),
            [vec![vec![0, 1], vec![2]], vec![vec![0], vec![1], vec![2]]]
        );
        assert_eq!(
            folds(&runs[..2])[0],
            Vec::<Vec<usize>>::new(),
            "one radius cannot go out"
        );
    }

    #[test]
    fn of_two_speeds_each_goes_out_in_one_direction() {
        let runs = [
            [0.1, 0.2, 1.0],
            [0.1, 0.4, 1.0],
            [0.1, 0.2, -1.0],
            [0.1, 0.4, -1.0],
        ];
        assert_eq!(folds(&runs)[1], [vec![2], vec![0], vec![3], vec![1]]);
        assert_eq!(folds(&runs[..2])[1], Vec::<Vec<usize>>::new());
    }
}
