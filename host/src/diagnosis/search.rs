//! The search for the set of explanations, on evidence at the level of runs.
//!
//! Evidence of a set is what it takes off χ² (noise and scatter between runs in the metric) less a price for
//! each member. The price grows with the number of competitors and of shapes tried (extended BIC, Chen &
//! Chen 2008, doi 10.1093/biomet/asn034), so that pure noise is left alone. Members enter one by one, leave
//! when others make them needless, and are exchanged for better ones until nothing improves.
use super::hypothesis::Hypothesis;
use super::linear::Factor;
use super::products::Products;
use std::cell::Cell;

/// Most members.
const MOST: usize = 14;

/// Evidence of a set: `None` where its columns are not independent in these runs.
pub fn evidence(
    products: &Products,
    nuisance: &[usize],
    items: &[Hypothesis],
    set: &[usize],
) -> Option<f64> {
    let price: f64 = set.iter().map(|&i| items[i].price).sum();
    Factor::new(products, &columns_of(nuisance, items, set)).map(|factor| factor.gain() - price)
}

/// Columns of nuisance and set.
pub fn columns_of(nuisance: &[usize], items: &[Hypothesis], set: &[usize]) -> Vec<usize> {
    nuisance
        .iter()
        .copied()
        .chain(set.iter().flat_map(|&i| items[i].columns.iter().copied()))
        .collect()
}

/// The best set, starting from `start` and without the `barred`.
pub fn select(
    products: &Products,
    nuisance: &[usize],
    items: &[Hypothesis],
    start: &[usize],
    barred: &[usize],
) -> Vec<usize> {
    let price = |set: &[usize]| set.iter().map(|&i| items[i].price).sum::<f64>();
    let factor = |set: &[usize]| Factor::new(products, &columns_of(nuisance, items, set));
    let mut set = start.to_vec();
    // A start that these runs cannot tell apart is no start.
    if factor(&set).is_none() {
        set.clear();
    }
    for _ in 0..4 * MOST {
        let best = factor(&set).map_or(f64::NEG_INFINITY, |factor| factor.gain() - price(&set));
        let outside: Vec<usize> = (0..items.len())
            .filter(|i| !set.contains(i) && !barred.contains(i))
            .collect();
        let mut next: Option<(f64, Vec<usize>)> = None;
        let improved = Cell::new(false);
        let mut consider = |value: f64, base: &[usize], further: &[usize]| {
            if value > best + 1e-6 && next.as_ref().is_none_or(|(other, _)| value > *other) {
                next = Some((value, [base, further].concat()));
                improved.set(true);
            }
        };
        // Without one of the members (or all kept), alone and with one from outside.
        for at in (0..set.len()).map(Some).chain([None]) {
            let base = at.map_or_else(|| set.clone(), |at| without(&set, at));
            let Some(mut factor) = factor(&base) else {
                continue;
            };
            let paid = price(&base);
            consider(factor.gain() - paid, &base, &[]);
            if base.len() == MOST {
                continue;
            }
            for &candidate in &outside {
                if let Some(gain) = factor.gain_with(&items[candidate].columns) {
                    consider(gain - paid - items[candidate].price, &base, &[candidate]);
                }
            }
        }
        // Two that nearly cancel show only together; looked at where one alone no longer helps.
        if !improved.get() {
            let listed: Vec<usize> = outside
                .iter()
                .copied()
                .filter(|&i| items[i].listed())
                .collect();
            for at in (0..set.len()).map(Some).chain([None]) {
                let base = at.map_or_else(|| set.clone(), |at| without(&set, at));
                let Some(mut factor) = factor(&base).filter(|_| base.len() + 2 <= MOST) else {
                    continue;
                };
                let paid = price(&base);
                for (i, &one) in listed.iter().enumerate() {
                    let paid = paid + items[one].price;
                    let beside = |factor: &mut Factor<'_>| {
                        for &other in &listed[i + 1..] {
                            if let Some(gain) = factor.gain_with(&items[other].columns) {
                                consider(gain - paid - items[other].price, &base, &[one, other]);
                            }
                        }
                    };
                    factor.with(&items[one].columns, beside);
                }
            }
        }
        let Some((_, better)) = next else { break };
        set = better;
    }
    set
}

fn without(set: &[usize], at: usize) -> Vec<usize> {
    set.iter()
        .enumerate()
        .filter(|(i, _)| *i != at)
        .map(|(_, v)| *v)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::Cause;
    use crate::diagnosis::hypothesis::Kind;

    /// Products of the data and three columns: the first explains it, the second nearly does, the third not at all.
    fn products() -> Products {
        let columns: [Vec<f64>; 4] = [
            (0..60)
                .map(|i| 2.0 * f64::from(i % 7) + 0.3 * f64::from((i * 13) % 5))
                .collect(),
            (0..60).map(|i| f64::from(i % 7)).collect(),
            (0..60)
                .map(|i| f64::from(i % 7) + f64::from(i % 3))
                .collect(),
            (0..60).map(|i| f64::from((i * 31) % 11) - 5.0).collect(),
        ];
        Products::from_fn(4, |i, j| {
            columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum()
        })
    }

    fn items(price: f64) -> Vec<Hypothesis> {
        [Cause::ScaleError, Cause::RadiusOffset, Cause::Squareness]
            .into_iter()
            .enumerate()
            .map(|(i, cause)| Hypothesis {
                kind: Kind::Cause {
                    cause,
                    site: crate::causes::Site::Machine,
                    shape: Vec::new(),
                },
                columns: vec![i + 1],
                price,
                fitted_beside: None,
            })
            .collect()
    }

    #[test]
    fn the_best_column_is_chosen_and_its_neighbour_exchanged_for_it() {
        let (products, items) = (products(), items(60.0));
        assert_eq!(select(&products, &[], &items, &[], &[]), vec![0]);
        assert_eq!(
            select(&products, &[], &items, &[1], &[]),
            vec![0],
            "from the wrong start"
        );
        assert_eq!(
            select(&products, &[], &items, &[], &[0]),
            vec![1],
            "the neighbour stands in when it is barred"
        );
    }

    #[test]
    fn two_that_nearly_cancel_are_found_together() {
        let wave = |i: i32, k: i32| f64::from((i * k + i * i) % 13) - 6.0;
        let one: Vec<f64> = (0..60).map(|i| wave(i, 3)).collect();
        let other: Vec<f64> = (0..60).map(|i| -wave(i, 3) + 0.2 * wave(i, 5)).collect();
        let sum: Vec<f64> = one.iter().zip(&other).map(|(a, b)| a + b).collect();
        let columns = [sum, one, other, (0..60).map(|i| wave(i, 7)).collect()];
        let products = Products::from_fn(4, |i, j| {
            columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum()
        });
        let worth = products.at(0, 0);
        assert_eq!(
            select(&products, &[], &items(0.4 * worth), &[], &[]),
            vec![0, 1]
        );
        assert!(
            select(&products, &[], &items(0.6 * worth), &[], &[]).is_empty(),
            "above their worth"
        );
    }

    #[test]
    fn nothing_is_chosen_above_its_worth() {
        assert!(select(&products(), &[], &items(1e9), &[], &[]).is_empty());
    }
}
