use giotto::diagnosis::{baseline::*, explain::*, search::Kind, survey};
fn main() {
    for dir in std::env::args().skip(1) {
        let t = std::time::Instant::now();
        let c = giotto::campaign::read(std::path::Path::new(&dir)).unwrap();
        let tr = t.elapsed();
        let sizes: Vec<Size> = c.runs.iter().map(|r| Size::of(r, survey::believed_feed_m_s(r))).collect();
        let resp = fit_lag(&sizes);
        let e = explain(&c, &Start { response: resp, own_fourth_order: false });
        println!(
            "== {dir} {}\n   read {tr:?} all {:?} kv {:.2}  lag {:?}",
            std::fs::read_to_string(format!("{dir}/truth.json")).unwrap_or_default(),
            t.elapsed(),
            resp.a_s2.powf(-0.5),
            e.lag
        );
        println!(
            "   noise {:.3} spread {:?}",
            e.spread.noise_m() * 1e6,
            e.spread.order_m2.map(|v| (v.sqrt() * 1e8).round() / 100.0)
        );
        if let Some(t) = &e.tone {
            println!(
                "   TONE {:.3}±{:.4} Hz {:?} {:.3}um law {:.1} gain {:.0}",
                t.frequency_hz,
                t.se_hz,
                t.amplitude,
                t.amplitude_m * 1e6,
                t.law_evidence,
                t.gain
            );
        }
        let all = vec![1.0; e.runs.len()];
        let w = e.ledger.white(&all);
        let p = e.ledger.plain(&all);
        let n: f64 = e.runs.iter().map(|r| r.deviation_m.len() as f64).sum();
        let cols = giotto::diagnosis::search::columns_of(&e.nuisance, &e.items, &e.chosen);
        for &i in &e.chosen {
            let it = &e.items[i];
            let rest: Vec<usize> = e.chosen.iter().copied().filter(|&j| j != i).collect();
            let rc = giotto::diagnosis::search::columns_of(&e.nuisance, &e.items, &rest);
            let g = giotto::diagnosis::linear::solve(&w, &cols).unwrap().gain
                - giotto::diagnosis::linear::solve(&w, &rc).unwrap().gain;
            let gp = giotto::diagnosis::linear::solve(&p, &cols).unwrap().gain
                - giotto::diagnosis::linear::solve(&p, &rc).unwrap().gain;
            let vals: Vec<f64> = it
                .columns
                .iter()
                .map(|c| e.solution.coefficients[cols.iter().position(|x| x == c).unwrap()])
                .collect();
            let ses: Vec<f64> = it
                .columns
                .iter()
                .map(|c| {
                    let k = cols.iter().position(|x| x == c).unwrap();
                    e.solution.covariance[(k, k)].sqrt()
                })
                .collect();
            let name = match &it.kind {
                Kind::Cause { cause, axis, shape } => format!("{} {:?} {:?}", cause.id(), axis, shape),
                Kind::Pattern(p) => format!("?? {p:?}"),
            };
            println!(
                "   {name}: {:?} ± {:?}  chi2 {g:.0} rms {:.3} um",
                vals.iter().map(|v| format!("{v:.4e}")).collect::<Vec<_>>(),
                ses.iter().map(|v| format!("{v:.1e}")).collect::<Vec<_>>(),
                (gp / n).max(0.0).sqrt() * 1e6
            );
        }
        let left: f64 = residual(&e).iter().flatten().map(|x| x * x).sum();
        println!("   items {} residual rms {:.3}", e.items.len(), (left / n).sqrt() * 1e6);
    }
}
