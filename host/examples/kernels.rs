//! Hot kernels for `giotto-hil instructions`, which runs them under callgrind: `kernels NAME TIMES`.
//!
//! The difference between more and fewer times is the kernel alone; what it costs to start cancels.
use giotto::campaign::{Direction, Manifest};
use giotto::fit::{Observation, Options, RadiusFit, fit_circle};
use giotto::simulation::machine::{Machine, PositionLoop, SecondOrder};
use giotto::simulation::{CircleTest, circle};
use std::error::Error;
use std::fmt::Write as _;
use std::hint::black_box;

/// Name and work.
type Kernel = (&'static str, fn() -> Result<Box<dyn Fn()>, Box<dyn Error>>);

const KERNELS: [Kernel; 4] = [
    ("circle_fit", circle_fit),
    ("campaign_rows", campaign_rows),
    ("plant_lap", plant_lap),
    ("stepwise_fit", stepwise_fit),
];

/// A wave that is no one's multiple, for noise that is the same everywhere.
fn wave(k: usize) -> f64 {
    (k as f64 * 0.618).sin()
}

/// Geometric fit of 20 000 points.
fn circle_fit() -> Result<Box<dyn Fn()>, Box<dyn Error>> {
    let point = |k: usize| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / 20_000.0).sin_cos();
        let r = 0.1 + 1e-6 * wave(k);
        (30e-6 + r * cos, -20e-6 + r * sin)
    };
    let (x, y): (Vec<f64>, Vec<f64>) = (0..20_000).map(point).unzip();
    Ok(Box::new(move || {
        let _ = black_box(fit_circle(&x, &y));
    }))
}

/// A run of 20 000 rows read and checked.
fn campaign_rows() -> Result<Box<dyn Fn()>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut rows = String::from("time_s,deviation_um\n");
    for k in 0..20_000 {
        let turn = f64::from(k) / 20_000.0;
        let deviation =
            -100.0 + 20.0 * (std::f64::consts::TAU * turn).cos() + 2.0 * wave(k as usize);
        writeln!(rows, "{:.6},{deviation:.1}", turn * std::f64::consts::TAU)?;
    }
    std::fs::write(folder.path().join("run.csv"), rows)?;
    let toml = "[campaign]\nname = \"k\"\n[[run]]\nfile = \"run.csv\"\nradius_mm = 100.0\nfeed_mm_s = 100.0\ndirection = \"ccw\"\n";
    std::fs::write(folder.path().join("campaign.toml"), toml)?;
    let manifest = Manifest::open(folder.path())?;
    Ok(Box::new(move || {
        let _ = (black_box(manifest.load(0)), &folder);
    }))
}

/// A lap of 1000 samples with lag and mechanics.
fn plant_lap() -> Result<Box<dyn Fn()>, Box<dyn Error>> {
    let machine = Machine {
        servo: [PositionLoop {
            kv_per_s: 40.0,
            feed_forward: 0.0,
        }; 3],
        mechanics: [Some(SecondOrder {
            omega_n_rad_s: 60.0,
            zeta: 0.5,
        }); 3],
        ..Machine::default()
    };
    let test = CircleTest::new(0.1, 0.3, Direction::Ccw);
    Ok(Box::new(move || {
        black_box(circle(&machine, &test));
    }))
}

/// The radius model of 300 runs.
fn stepwise_fit() -> Result<Box<dyn Fn()>, Box<dyn Error>> {
    let run = |k: usize| {
        let (radius_m, feed_m_s) = (
            [0.1, 0.15, 0.3][k % 3],
            0.02 + 0.68 * (k as f64 * 0.377).fract(),
        );
        let radius_error_m = -23.29e-6 * feed_m_s * feed_m_s / radius_m + 0.5e-6 * wave(k);
        Observation {
            radius_m,
            feed_m_s,
            radius_error_m,
            out_of_roundness_m: None,
        }
    };
    let runs: Vec<Observation> = (0..300).map(run).collect();
    Ok(Box::new(move || {
        let _ = black_box(RadiusFit::new(&runs, Options::default()));
    }))
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let kernel = KERNELS
        .iter()
        .find(|(name, _)| arguments.first().is_some_and(|a| a == name));
    let (Some((_, make)), Some(times)) = (kernel, arguments.get(1)) else {
        return Err(format!(
            "expected one of {:?} and a number of times",
            KERNELS.map(|k| k.0)
        )
        .into());
    };
    let work = make()?;
    (0..times.parse()?).for_each(|_: u32| work());
    Ok(())
}
