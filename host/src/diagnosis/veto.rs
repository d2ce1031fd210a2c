//! The veto of the runs left out: a cause without which they are foretold better has no place in the model.
//!
//! Each radius is left out once, then each speed; the set is fitted on the runs that stay, shapes as they are. All of it
//! are small sums of Gram matrices, so that every cause can be tried without.
use super::explained::{Explained, refit};
use super::linear::{Factor, solve};
use super::search::columns_of;
use super::tangent;

/// Runs that are left out together: those of each radius, then those of each speed; nothing where all are alike.
pub fn folds(radius_and_feed: &[[f64; 2]]) -> [Vec<Vec<usize>>; 2] {
    [0, 1].map(|which| {
        let mut values: Vec<f64> = radius_and_feed.iter().map(|run| run[which]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * b.abs());
        if values.len() < 2 {
            return Vec::new();
        }
        let of = |value: f64| {
            let same = |i: &usize| (radius_and_feed[*i][which] - value).abs() < 1e-9 * value.abs();
            (0..radius_and_feed.len()).filter(same).collect()
        };
        values.into_iter().map(of).collect()
    })
}

/// The same of an explained campaign.
pub fn folds_of(found: &Explained) -> Vec<Vec<usize>> {
    let runs: Vec<[f64; 2]> = found
        .runs
        .iter()
        .map(|run| [run.view.radius_m, run.programmed_m_s])
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
        let runs = [[0.1, 0.2], [0.1, 0.4], [0.3, 0.2]];
        assert_eq!(
            folds(&runs),
            [vec![vec![0, 1], vec![2]], vec![vec![0, 2], vec![1]]]
        );
        assert_eq!(
            folds(&runs[..2])[0],
            Vec::<Vec<usize>>::new(),
            "one radius cannot go out"
        );
    }
}
