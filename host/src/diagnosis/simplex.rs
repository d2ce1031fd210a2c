//! A walk up a function of few parameters that has no slope to follow.

/// χ² within which a simplex has arrived.
const CLOSE: f64 = 0.5;

/// Nelder–Mead upwards; each parameter first moves by a share of itself, or by 1 ms (or mm) from zero.
pub(super) fn simplex(
    start: &[f64],
    first_step: f64,
    most: usize,
    score: impl Fn(&[f64]) -> f64,
) -> Vec<f64> {
    let n = start.len();
    let mut points: Vec<(f64, Vec<f64>)> = vec![(score(start), start.to_vec())];
    for axis in 0..n {
        let mut moved = start.to_vec();
        moved[axis] += if moved[axis].abs() > 1e-9 {
            first_step * moved[axis]
        } else {
            1e-3
        };
        points.push((score(&moved), moved));
    }
    for _ in 0..most {
        points.sort_by(|a, b| b.0.total_cmp(&a.0));
        let worst = points[n].clone();
        let centre: Vec<f64> = (0..n)
            .map(|k| points[..n].iter().map(|(_, p)| p[k]).sum::<f64>() / n as f64)
            .collect();
        let towards = |factor: f64| -> (f64, Vec<f64>) {
            let point: Vec<f64> = centre
                .iter()
                .zip(&worst.1)
                .map(|(c, w)| c + factor * (w - c))
                .collect();
            (score(&point), point)
        };
        let reflected = towards(-1.0);
        points[n] = if reflected.0 > points[0].0 {
            let expanded = towards(-2.0);
            if expanded.0 > reflected.0 {
                expanded
            } else {
                reflected
            }
        } else if reflected.0 > points[n - 1].0 {
            reflected
        } else {
            let drawn = towards(0.5);
            if drawn.0 > worst.0 {
                drawn
            } else {
                let best = points[0].1.clone();
                for point in points.iter_mut().skip(1) {
                    point.1 = point
                        .1
                        .iter()
                        .zip(&best)
                        .map(|(p, b)| 0.5 * (p + b))
                        .collect();
                    point.0 = score(&point.1);
                }
                points[n].clone()
            }
        };
        let spread = points.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max)
            - points.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
        if spread.abs() < CLOSE {
            break;
        }
    }
    points
        .into_iter()
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(|| start.to_vec(), |(_, point)| point)
}
