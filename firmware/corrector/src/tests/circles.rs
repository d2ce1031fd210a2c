//! How much of the error of circles the correction takes out, on a machine with lag, average and play.
use super::*;

/// Places of the machine in the steady part of a turn: mean radius error, and root mean square about it, m.
fn measured(
    loops: &mut Loop,
    plane: [usize; 2],
    radius: f64,
    feed: f64,
    enable: bool,
    sign: f64,
) -> [f64; 2] {
    let (tick_s, metre) = (loops.tick_s, 1e3);
    let omega = feed / radius;
    let acceleration = (feed * feed / radius).max(0.5);
    let turn = std::f64::consts::TAU / omega;
    let whole = 2.5 * turn + feed / acceleration + 1.0;
    let mut radii = Vec::new();
    for tick in 0..(whole / tick_s) as usize {
        let t = tick as f64 * tick_s - 0.7;
        let [x, y, _] = circle(radius, omega, 2.5, acceleration, t);
        let mut command = [0.0; JOINTS];
        (command[plane[0]], command[plane[1]]) = (x * metre, sign * y * metre);
        let mut input = input(command, loops.feedback);
        input.enable = enable;
        let out = loops.tick(&input);
        let _ = out;
        let (from, until) = (feed / acceleration + 0.75 * turn, 2.0 * turn);
        if t > from && t < from + turn && t < until + turn {
            let (a, b) = (
                loops.feedback[plane[0]] / metre + radius,
                loops.feedback[plane[1]] / metre,
            );
            radii.push(a.hypot(b));
        }
    }
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    let square = radii.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / radii.len() as f64;
    [mean - radius, square.sqrt()]
}

/// Share of the radius error and of the roundness that is left.
fn left(play_mm: [f64; 2]) -> [f64; 2] {
    let terms: Vec<Term<f32>> = [Actuator::X, Actuator::Y, Actuator::Z]
        .into_iter()
        .map(|actuator| Term::Backlash {
            actuator,
            step_m: 20e-6,
        })
        .collect();
    let image = table(cumulants(), &terms, None);
    let mut sums = [[0.0; 2]; 2];
    let circles = [
        (0.02, 0.1),
        (0.02, 0.3),
        (0.05, 0.05),
        (0.1, 0.4),
        (0.2, 0.4),
        (0.05, 0.3),
    ];
    for (k, (radius, feed)) in circles.into_iter().enumerate() {
        let plane = [[0, 1], [1, 2], [2, 0]][k % 3];
        for sign in [1.0, -1.0] {
            for (enable, sums) in [false, true].into_iter().zip(&mut sums) {
                let mut corrector = corrector(3, 1.0);
                corrector.load(&image).unwrap();
                let mut loops = Loop::new(corrector, 3, 1e-3, play_mm);
                let [error, round] = measured(&mut loops, plane, radius, feed, enable, sign);
                assert_eq!(loops.corrector.counters().offset_cuts, 0);
                sums[0] += error * error;
                sums[1] += round;
            }
        }
    }
    let [before, after] = sums;
    [(after[0] / before[0]).sqrt(), after[1] / before[1]]
}

#[test]
fn lag_average_and_play_are_taken_out_in_every_plane() {
    let [radius, round] = left([0.02, 0.0]);
    assert!(radius < 0.01 && round < 0.1, "{radius} {round}");
}

/// Play behind the servo: what is done at a reversal comes through its lag, smeared over some 60 ms. Between the reversals it
/// is right; at them the step remains, whatever a set-point does.
#[test]
fn play_behind_the_servo_is_taken_out_as_far_as_its_lag_lets() {
    let [radius, round] = left([0.0, 0.02]);
    assert!(
        radius < 0.01 && (0.2..0.5).contains(&round),
        "{radius} {round}"
    );
}

#[test]
fn every_period_and_unit_gives_the_same_path() {
    let image = table(cumulants(), &eight(), None);
    let mut paths: Vec<Vec<[f64; 2]>> = Vec::new();
    for (units_per_mm, tick_s) in [
        (1.0f64, 1e-3f64),
        (1.0 / 25.4, 1e-3),
        (1.0, 250e-6),
        (1.0, 4e-3),
    ] {
        let mut corrector = corrector(3, units_per_mm);
        corrector.load(&image).unwrap();
        let metre = 1e3 * units_per_mm;
        let every = (0.04f64 / tick_s).round() as usize;
        let mut path = Vec::new();
        for tick in 0..(3.0 / tick_s) as usize {
            let at = circle(0.05, 4.0, 1.5, 1.0, tick as f64 * tick_s - 0.4);
            let mut command = [0.0; JOINTS];
            for (command, at) in command.iter_mut().zip(at) {
                *command = at * metre;
            }
            let mut input = input(command, command);
            input.enable = true;
            let out = corrector.tick(&input, tick_s);
            if tick % every == 0 {
                path.push([out.command[0] / metre, out.command[1] / metre]);
            }
        }
        paths.push(path);
    }
    let [first, rest @ ..] = &paths[..] else {
        panic!()
    };
    for (k, path) in rest.iter().enumerate() {
        let most = path.iter().zip(first).fold(0.0f64, |most, (a, b)| {
            most.max((a[0] - b[0]).abs()).max((a[1] - b[1]).abs())
        });
        // 4 ms: the window is 16 ms instead of 15, two ticks of latency and of a take-up are rounded.
        let bar = [1e-9, 5e-6, 1.2e-3][k];
        assert!(most < bar, "{k}: {most}");
    }
}
