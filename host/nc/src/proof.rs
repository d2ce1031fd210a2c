//! The corrected program on the simulated machine, and before readers that are not ours.
use super::state::{Action, Reading, State};
use super::{Compensated, Fate, Options, compensate, tests::model, word};
use giotto::model_file::{ModelFile, Servo};
use giotto::simulation::machine::{AccDec, PositionLoop};
use giotto::simulation::{Hold, Machine, SetPoints, drive};
use std::f64::consts::TAU;

const PLATE: &str = include_str!("parts/plate.nc");
const ACCELERATION_MM_S2: f64 = 5000.0;
const DT_S: f64 = 5e-4;

/// Slow machines, so that their errors stand well above rounding: one lag of 23 ms (the simulation's default
/// baseline), and a lag of 20 ms behind a moving average of 40 ms. With each what a fit would find of it: the
/// sums of its elements' cumulants, as β.
fn machines() -> [(&'static str, Machine, ModelFile); 2] {
    let loops = |kv_per_s| {
        [PositionLoop {
            kv_per_s,
            feed_forward: 0.0,
        }; 3]
    };
    let lag = Machine {
        servo: loops(43.3),
        ..Machine::default()
    };
    let both = Machine {
        acc_dec: AccDec::MovingAverage(0.04),
        servo: loops(50.0),
        ..Machine::default()
    };
    let beta = |k2: f64, k4: f64| {
        let (beta1_s2, beta2_s4) = (-k2 / 2.0, k2 * k2 / 8.0 + k4 / 24.0);
        model(Servo::Beta {
            beta1_s2,
            beta2_s4,
            half_width95: [0.0; 2],
        })
    };
    let (t2, m2) = (43.3_f64.powi(-2), 1.6e-3);
    [
        ("lag", lag, beta(t2, 6.0 * t2 * t2)),
        (
            "lag and moving average",
            both,
            beta(4e-4 + m2 / 12.0, 6.0 * 1.6e-7 - m2 * m2 / 120.0),
        ),
    ]
}

/// A stretch of the path, mm.
#[derive(Clone, Copy, Debug)]
enum Stretch {
    Line([f64; 2], [f64; 2]),
    Arc {
        centre: [f64; 2],
        radius: f64,
        start_rad: f64,
        sweep_rad: f64,
    },
}

impl Stretch {
    fn length(&self) -> f64 {
        match self {
            Self::Line(a, b) => (b[0] - a[0]).hypot(b[1] - a[1]),
            Self::Arc {
                radius, sweep_rad, ..
            } => radius * sweep_rad.abs(),
        }
    }

    fn at(&self, s: f64) -> [f64; 2] {
        let u = s / self.length();
        match self {
            Self::Line(a, b) => [a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1])],
            Self::Arc {
                centre,
                radius,
                start_rad,
                sweep_rad,
            } => {
                let (sin, cos) = (start_rad + u * sweep_rad).sin_cos();
                [centre[0] + radius * cos, centre[1] + radius * sin]
            }
        }
    }

    fn direction(&self, at_end: bool) -> [f64; 2] {
        let l = self.length();
        let (a, b) = if at_end {
            (self.at(l - 1e-6), self.at(l))
        } else {
            (self.at(0.0), self.at(1e-6))
        };
        let n = (b[0] - a[0]).hypot(b[1] - a[1]);
        [(b[0] - a[0]) / n, (b[1] - a[1]) / n]
    }

    fn distance(&self, p: [f64; 2]) -> f64 {
        match self {
            Self::Line(a, b) => {
                let (d, l) = ([b[0] - a[0], b[1] - a[1]], self.length());
                let u = (((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / (l * l)).clamp(0.0, 1.0);
                (p[0] - a[0] - u * d[0]).hypot(p[1] - a[1] - u * d[1])
            }
            Self::Arc {
                centre,
                radius,
                start_rad,
                sweep_rad,
            } => {
                let v = [p[0] - centre[0], p[1] - centre[1]];
                let along = (sweep_rad.signum() * (v[1].atan2(v[0]) - start_rad)).rem_euclid(TAU);
                if along <= sweep_rad.abs() {
                    return (v[0].hypot(v[1]) - radius).abs();
                }
                let ends = [self.at(0.0), self.at(self.length())];
                ends.map(|e| (p[0] - e[0]).hypot(p[1] - e[1]))
                    .into_iter()
                    .fold(f64::INFINITY, f64::min)
            }
        }
    }
}

/// Chains of feed moves in the plane that are passed without a stop, with the line each starts in.
fn chains(program: &[u8]) -> Vec<Vec<Stretch>> {
    let mut state = State::new(Reading::default());
    let lines = word::lines(program).enumerate();
    chains_of(lines.map(|(i, line)| state.step(i + 1, &line)))
}

fn chains_of(actions: impl Iterator<Item = Action>) -> Vec<Vec<Stretch>> {
    let mut list: Vec<Vec<Stretch>> = vec![Vec::new()];
    for action in actions {
        let stretch = match action {
            Action::Nothing => continue,
            Action::Line(l) => match (l.start, l.end) {
                ([Some(a), Some(b), _], [Some(c), Some(d), _]) if (c - a).hypot(d - b) > 1e-9 => {
                    Some(Stretch::Line([a, b], [c, d]))
                }
                _ => None,
            },
            Action::Arc(a) => Some(Stretch::Arc {
                centre: a.centre,
                radius: a.radius_mm,
                start_rad: (a.start[1] - a.centre[1]).atan2(a.start[0] - a.centre[0]),
                sweep_rad: a.sweep_rad,
            }),
            Action::LostArc(left) => panic!("{left}"),
            Action::Stop | Action::Other => None,
        };
        let last = list
            .last()
            .and_then(|c| c.last())
            .map(|s| s.direction(true));
        match stretch {
            None => list.push(Vec::new()),
            Some(s) => {
                let d = s.direction(false);
                if last.is_some_and(|l| l[0] * d[0] + l[1] * d[1] < 0.998) {
                    list.push(Vec::new());
                }
                list.last_mut().unwrap().push(s);
            }
        }
    }
    list.retain(|c| !c.is_empty());
    list
}

/// Where the machine goes along a chain at 25 mm/s with trapezoidal speed from rest to rest, mm.
fn travelled(machine: &Machine, chain: &[Stretch]) -> Vec<[f64; 2]> {
    let (f, a) = (25.0, ACCELERATION_MM_S2);
    let total: f64 = chain.iter().map(Stretch::length).sum();
    let (ramp_s, end_s) = (f / a, total / f + f / a);
    let way = |t: f64| match t {
        t if t < ramp_s => 0.5 * a * t * t,
        t if t < end_s - ramp_s => f * (t - 0.5 * ramp_s),
        t => total - 0.5 * a * (end_s - t).max(0.0).powi(2),
    };
    let place = |mut s: f64| {
        for stretch in chain {
            if s <= stretch.length() {
                return stretch.at(s);
            }
            s -= stretch.length();
        }
        chain[chain.len() - 1].at(chain[chain.len() - 1].length())
    };
    let n = ((end_s + 0.5) / DT_S) as usize;
    let position_m: Vec<_> = (0..n)
        .map(|k| {
            let [x, y] = place(way(k as f64 * DT_S)).map(|v| v * 1e-3);
            [x, y, 0.0]
        })
        .collect();
    let set_points = SetPoints {
        dt_s: DT_S,
        position_m: &position_m,
        centre_m: [0.0; 3],
        frame: giotto_shared::Frame::default(),
        started_s: 0.0,
        hold: Hold::Cubic,
    };
    drive(machine, &set_points)
        .position_m
        .into_iter()
        .map(|[x, y, _]| [x * 1e3, y * 1e3])
        .collect()
}

/// Contour errors of a program against the chains of the original, µm: rms and largest of each chain.
fn contour_um(
    machine: &Machine,
    chains: &[Vec<Stretch>],
    nominal: &[Vec<Stretch>],
) -> Vec<[f64; 2]> {
    assert_eq!(chains.len(), nominal.len());
    let errors = |(chain, nominal): (&Vec<Stretch>, &Vec<Stretch>)| {
        let off = travelled(machine, chain).into_iter().map(|p| {
            1e3 * nominal
                .iter()
                .map(|s| s.distance(p))
                .fold(f64::INFINITY, f64::min)
        });
        let (sum, most, n) = off.fold((0.0, 0.0, 0.0), |(s, m, n), e| {
            (s + e * e, f64::max(m, e), n + 1.0)
        });
        [f64::sqrt(sum / n), most]
    };
    chains.iter().zip(nominal).map(errors).collect()
}

fn corrected(model: &ModelFile) -> Compensated {
    let options = Options {
        acceleration_mm_s2: ACCELERATION_MM_S2,
        ..Options::default()
    };
    let result = compensate(PLATE.as_bytes(), model, &options);
    assert!(
        result
            .arcs
            .iter()
            .all(|a| matches!(a.fate, Fate::Corrected { .. })),
        "{:?}",
        result.arcs
    );
    result
}

/// The bundled part on both machines: every point of the contour is within 5 % of the original's largest error.
#[test]
fn contour_error_of_the_part() {
    let nominal = chains(PLATE.as_bytes());
    for (name, machine, model) in machines() {
        let before = contour_um(&machine, &nominal, &nominal);
        let after = contour_um(&machine, &chains(&corrected(&model).program), &nominal);
        let worst = |v: &[[f64; 2]], i: usize| v.iter().map(|e| e[i]).fold(0.0, f64::max);
        let [rms, max] = [0, 1].map(|i| 100.0 * worst(&after, i) / worst(&before, i));
        println!("{name}: {before:.2?} -> {after:.2?}: rms {rms:.1} %, max {max:.1} %");
        assert!(
            rms <= 5.0 && max <= 5.0,
            "{name}: rms {rms:.2} %, max {max:.2} %"
        );
    }
}

/// The same part as a RAPID module: its lines and arcs as MoveL and MoveC.
fn module(nominal: &[Vec<Stretch>]) -> String {
    let target = |[x, y]: [f64; 2]| {
        format!("[[{x:.9},{y:.9},0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
    };
    let mut text = "MODULE plate\nPROC main()\n".to_owned();
    for chain in nominal {
        text += &format!("MoveJ {},v500,fine,tool0;\n", target(chain[0].at(0.0)));
        for (k, stretch) in chain.iter().enumerate() {
            let zone = if k + 1 == chain.len() { "fine" } else { "z0" };
            // Half turns at most in one instruction.
            let parts = if matches!(stretch, Stretch::Arc { sweep_rad, .. } if sweep_rad.abs() > 3.2)
            {
                2
            } else {
                1
            };
            for part in 0..parts {
                let at = |u: f64| {
                    target(stretch.at(stretch.length() * (f64::from(part) + u) / f64::from(parts)))
                };
                let via = if matches!(stretch, Stretch::Arc { .. }) {
                    format!("C {},", at(0.5))
                } else {
                    "L ".into()
                };
                text += &format!("Move{via}{},[25,500,5000,1000],{zone},tool0;\n", at(1.0));
            }
        }
    }
    text + "ENDPROC\nENDMODULE\n"
}

/// Where the robot goes by a module; a stop ends a chain.
fn module_chains(program: &[u8]) -> Vec<Vec<Stretch>> {
    chains_of(
        super::rapid::actions(program)
            .into_iter()
            .map(|(_, action)| action),
    )
}

#[test]
fn contour_error_of_the_part_in_rapid() {
    let nominal = chains(PLATE.as_bytes());
    let original = module(&nominal);
    let options = Options {
        acceleration_mm_s2: ACCELERATION_MM_S2,
        ..Options::default()
    };
    for (name, machine, model) in machines() {
        let result = super::rapid::compensate(original.as_bytes(), &model, &options);
        assert!(
            result
                .arcs
                .iter()
                .all(|a| matches!(a.fate, Fate::Corrected { .. })),
            "{:?}",
            result.arcs
        );
        let before = contour_um(&machine, &module_chains(original.as_bytes()), &nominal);
        let after = contour_um(&machine, &module_chains(&result.program), &nominal);
        let worst = |v: &[[f64; 2]], i: usize| v.iter().map(|e| e[i]).fold(0.0, f64::max);
        let [rms, max] = [0, 1].map(|i| 100.0 * worst(&after, i) / worst(&before, i));
        println!("{name}: rms {rms:.1} %, max {max:.1} %");
        assert!(
            rms <= 5.0 && max <= 5.0,
            "{name}: rms {rms:.2} %, max {max:.2} %"
        );
    }
}

/// The `gcode` crate reads the output: same arcs, ends and centres that agree, nothing it stumbles over.
#[test]
fn another_parser_reads_it() {
    use ::gcode::{Code, Value};
    let program = String::from_utf8(corrected(&machines()[0].2).program).unwrap();
    let body = program.trim().trim_matches('%');
    let read = ::gcode::parse(body).unwrap();
    let (mut place, mut arcs) = ([0.0_f32; 2], 0);
    for block in &read.blocks {
        for code in &block.codes {
            let Code::General(g) = code else { continue };
            let get = |letter: char| {
                g.args
                    .iter()
                    .find(|a| a.letter == letter)
                    .map(|a| match a.value {
                        Value::Literal(v) => v,
                        _ => panic!("not a number"),
                    })
            };
            let end = [get('X').unwrap_or(place[0]), get('Y').unwrap_or(place[1])];
            let number = format!("{:?}", g.number);
            if let (Some(i), Some(j)) = (get('I'), get('J')) {
                let centre = [place[0] + i, place[1] + j];
                let radius = |p: [f32; 2]| (p[0] - centre[0]).hypot(p[1] - centre[1]);
                // The crate reads f32: large transition radii are good to a few µm.
                let tolerance = 2e-3_f32.max(4e-6 * radius(end));
                assert!(
                    (radius(place) - radius(end)).abs() < tolerance,
                    "{number} {end:?} {i} {j}"
                );
                arcs += 1;
            }
            place = end;
        }
    }
    let ours = chains(program.as_bytes())
        .iter()
        .flatten()
        .filter(|s| matches!(s, Stretch::Arc { .. }))
        .count();
    assert_eq!(arcs, ours);
    assert!(arcs > 100, "{arcs}");
}

/// LinuxCNC's own interpreter, where `GIOTTO_RS274` names it (Debian: `linuxcnc-uspace`).
#[test]
fn linuxcnc_reads_it() {
    let Some(rs274) = std::env::var_os("GIOTTO_RS274") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let (file, table, out) = (
        dir.path().join("p.ngc"),
        dir.path().join("tool.tbl"),
        dir.path().join("out"),
    );
    std::fs::write(&file, corrected(&machines()[0].2).program).unwrap();
    std::fs::write(&table, "T1 P1 D6\n").unwrap();
    let run = std::process::Command::new(rs274)
        .arg("-g")
        .arg("-t")
        .arg(&table)
        .arg(&file)
        .arg(&out)
        .output()
        .unwrap();
    let canon = std::fs::read_to_string(&out).unwrap();
    assert!(
        run.status.success() && canon.contains("PROGRAM_END"),
        "{canon}{run:?}"
    );
    let count = |name: &str, text: &str| text.matches(name).count();
    let program = String::from_utf8(corrected(&machines()[0].2).program).unwrap();
    let arcs = chains(program.as_bytes())
        .iter()
        .flatten()
        .filter(|s| matches!(s, Stretch::Arc { .. }))
        .count();
    assert_eq!(count("ARC_FEED(", &canon), arcs);
}
