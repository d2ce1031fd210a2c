//! Hidden campaigns on disk: `campaign.toml`, a CSV a run, and `truth.json` beside them.
use crate::effects::{Hidden, Seat};
use giotto::campaign::{Direction, Plane, Run};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// Writes `case` into `dir` (made if missing), with the truth and, if it has one, `model.toml`.
pub fn write(case: &Hidden, dir: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(dir)?;
    let mut toml = String::from("[campaign]\nname = \"blind\"\nmachine = \"machine under test\"\n");
    if let Some(known) = case.campaign.repeatability_m {
        let _ = writeln!(toml, "repeatability_um = {:?}", rounded(known * 1e6));
    }
    toml.push_str(case.kinematics.as_deref().unwrap_or_default());
    for run in &case.campaign.runs {
        let direction = if run.direction == Direction::Ccw {
            "ccw"
        } else {
            "cw"
        };
        let _ = write!(
            toml,
            "\n[[run]]\nfile = \"{}\"\nradius_mm = {:?}\nfeed_mm_s = {:?}\ndirection = \"{direction}\"\nstart_angle_deg = {:?}\n",
            run.file,
            rounded(run.radius_m * 1e3),
            rounded(run.feed_m_s * 1e3),
            rounded(run.start_angle_rad.to_degrees()),
        );
        if let Some(t) = run.started_s {
            let _ = writeln!(toml, "started_s = {:?}", rounded(t));
        }
        if let Some(plane) = run.frame.plane().filter(|p| *p != Plane::Xy) {
            let _ = writeln!(toml, "plane = \"{plane}\"");
        }
        if let Some(centre) = run.centre_m {
            let _ = writeln!(toml, "centre_mm = {:?}", centre.map(|c| rounded(c * 1e3)));
        }
        if let Some(arc) = run.samples.covered_rad() {
            let _ = writeln!(toml, "arc_deg = {:.1}", arc.to_degrees().round());
        }
        if let Some(setup) = &run.setup {
            let _ = writeln!(toml, "setup = \"{setup}\"");
        }
        std::fs::write(dir.join(&run.file), csv(run))?;
    }
    std::fs::write(dir.join("campaign.toml"), toml)?;
    let truth = json!({
        "case": case.name, "seed": case.seed, "strength": case.strength,
        "noise_um": case.noise_m * 1e6, "spread_um": case.scatter_m * 1e6, "spoilt": case.spoilt,
        "truth": case.truth.iter().map(|t| json!({
            "effect": t.effect, "accept": t.accept, "value": t.value.is_finite().then_some(t.value), "unit": t.unit,
            "actuators": actuators(t.seat), "misfit_um": t.misfit_m.is_finite().then_some(t.misfit_m * 1e6),
        })).collect::<Vec<_>>(),
    });
    std::fs::write(dir.join("truth.json"), format!("{truth:#}\n"))?;
    if let Some([omega_n, zeta]) = case.model {
        let feeds = case.campaign.runs.iter().map(|t| t.feed_m_s * 1e3);
        let radii = case.campaign.runs.iter().map(|t| t.radius_m * 1e3);
        let range = |v: &mut dyn Iterator<Item = f64>| {
            v.fold((f64::MAX, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)))
        };
        let ((r0, r1), (f0, f1)) = (range(&mut radii.into_iter()), range(&mut feeds.into_iter()));
        let model = format!(
            "format = 1\ncampaign = \"blind\"\nmachine = \"machine under test\"\n\n[servo]\nkind = \"second_order\"\n\
             omega_n_rad_s = {omega_n:?}\nzeta = {zeta:?}\n\n[valid]\nradius_mm = [{r0:?}, {r1:?}]\nfeed_mm_s = [{f0:?}, {f1:?}]\n"
        );
        std::fs::write(dir.join("model.toml"), model)?;
    }
    Ok(())
}

/// Names of what an effect sits on.
fn actuators(seat: Seat) -> Vec<String> {
    let name = |slide: usize| ["x", "y", "z"][slide].to_owned();
    match seat {
        Seat::Whole => Vec::new(),
        Seat::Slide(slide) => vec![name(slide)],
        Seat::Pair(pair) => pair.map(name).to_vec(),
        Seat::Joint(joint) => vec![format!("joint{}", joint + 1)],
    }
}

/// Removes the dust of unit conversion.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

fn csv(run: &Run) -> String {
    let s = &run.samples;
    let mut out = String::new();
    if let (false, Some(time)) = (s.angle_inferred, &s.time_s) {
        // Places in the machine; of a circle in XY the two that it needs.
        let flat = run.frame.plane() == Some(Plane::Xy);
        out.push_str(if flat {
            "time_s,x_mm,y_mm\n"
        } else {
            "time_s,x_mm,y_mm,z_mm\n"
        });
        let (u, v) = (run.frame.first(), run.frame.second());
        for ((angle, deviation), t) in s.angle_rad.iter().zip(&s.deviation_m).zip(time) {
            let r = (run.radius_m + deviation) * 1e3;
            let (sin, cos) = angle.sin_cos();
            let [x, y, z] = [0, 1, 2].map(|k| r * (cos * u[k] + sin * v[k]));
            let _ = if flat {
                writeln!(out, "{t:.5},{x:.5},{y:.5}")
            } else {
                writeln!(out, "{t:.5},{x:.5},{y:.5},{z:.5}")
            };
        }
    } else if let Some(time) = &s.time_s {
        out.push_str("time_s,deviation_um\n");
        for (t, deviation) in time.iter().zip(&s.deviation_m) {
            let _ = writeln!(out, "{t:.5},{:.1}", deviation * 1e6);
        }
    } else {
        out.push_str("angle_deg,deviation_um\n");
        for (angle, deviation) in s.angle_rad.iter().zip(&s.deviation_m) {
            let _ = writeln!(out, "{:.4},{:.1}", angle.to_degrees(), deviation * 1e6);
        }
    }
    out
}
