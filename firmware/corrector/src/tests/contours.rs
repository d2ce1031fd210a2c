//! Paths whose curvature changes, through chains of several kinds: how far the machine leaves the path.
use super::*;
use std::boxed::Box;

const TICK_S: f64 = 1e-3;
/// Feed, mm/s, and radius of the arcs, mm.
const FEED: f64 = 150.0;
const RADIUS: f64 = 30.0;

/// One element of a chain, in time steps of its own: no cumulant is known here.
trait Acts {
    fn tick(&mut self, input: f64) -> f64;
}

struct Lag {
    at: f64,
    lag_s: f64,
    /// Velocity feed-forward.
    share: f64,
}

impl Acts for Lag {
    fn tick(&mut self, input: f64) -> f64 {
        self.at += (input - self.at) * (1.0 - (-TICK_S / self.lag_s).exp());
        self.share * input + (1.0 - self.share) * self.at
    }
}

struct Average {
    last: VecDeque<f64>,
}

impl Acts for Average {
    fn tick(&mut self, input: f64) -> f64 {
        self.last.push_back(input);
        self.last.pop_front();
        self.last.iter().sum::<f64>() / self.last.len() as f64
    }
}

/// ωn and ζ, in hundredths of a tick.
struct Oscillator {
    at: f64,
    velocity: f64,
    before: f64,
    omega: f64,
    zeta: f64,
}

impl Acts for Oscillator {
    fn tick(&mut self, input: f64) -> f64 {
        const PARTS: i32 = 100;
        let step = TICK_S / f64::from(PARTS);
        for part in 1..=PARTS {
            let share = f64::from(part) / f64::from(PARTS);
            let goal = self.before + (input - self.before) * share;
            let pull = self.omega * self.omega * (goal - self.at);
            self.velocity += step * (pull - 2.0 * self.zeta * self.omega * self.velocity);
            self.at += step * self.velocity;
        }
        self.before = input;
        self.at
    }
}

fn lag(ms: f64, share: f64) -> (Box<dyn Acts>, Element<f64>) {
    let (lag_s, at) = (ms * 1e-3, 0.0);
    let kv_per_s = 1.0 / lag_s;
    let element = if share > 0.0 {
        Element::FeedForwardLag {
            kv_per_s,
            feed_forward: share,
        }
    } else {
        Element::Lag { kv_per_s }
    };
    (Box::new(Lag { at, lag_s, share }), element)
}

fn average(ticks: usize) -> (Box<dyn Acts>, Element<f64>) {
    let last = std::iter::repeat_n(0.0, ticks).collect();
    let window_s = ticks as f64 * TICK_S;
    (
        Box::new(Average { last }),
        Element::MovingAverage { window_s },
    )
}

fn oscillator(omega: f64, zeta: f64) -> (Box<dyn Acts>, Element<f64>) {
    let of = Oscillator {
        at: 0.0,
        velocity: 0.0,
        before: 0.0,
        omega,
        zeta,
    };
    let element = Element::SecondOrder {
        omega_n_rad_s: omega,
        zeta,
    };
    (Box::new(of), element)
}

type Chain = Vec<(Box<dyn Acts>, Element<f64>)>;

/// A slot: lines and half-circles that meet with the same direction, at constant feed, begun and ended slowly.
fn slot(way: f64) -> [f64; 2] {
    let (straight, half) = (60.0, std::f64::consts::PI * RADIUS);
    let way = way.max(0.0);
    let lap = way % (2.0 * (straight + half));
    if lap < straight {
        [lap, 0.0]
    } else if lap < straight + half {
        let (sin, cos) = ((lap - straight) / RADIUS).sin_cos();
        [straight + RADIUS * sin, RADIUS * (1.0 - cos)]
    } else if lap < 2.0 * straight + half {
        [2.0 * straight + half - lap, 2.0 * RADIUS]
    } else {
        let (sin, cos) = ((lap - 2.0 * straight - half) / RADIUS).sin_cos();
        [-RADIUS * sin, RADIUS * (1.0 + cos)]
    }
}

/// Distance of a place from the slot, mm: from its two lines or its two half-circles.
fn off_slot([x, y]: [f64; 2]) -> f64 {
    let across = y - RADIUS;
    let along = x.clamp(0.0, 60.0);
    ((x - along).hypot(across) - RADIUS).abs()
}

/// The slot's way after so long: 150 mm/s after 0.3 s.
fn way(t: f64) -> f64 {
    let t = (t - 0.7).max(0.0);
    if t < 0.3 {
        FEED * t * t / 0.6
    } else {
        FEED * (t - 0.15)
    }
}

/// Acceleration of a corner, mm/s²: the joints' own.
const CORNER: f64 = 3000.0;
/// When it begins, s, and how much of the second stroke begins before the first has ended.
const BEGINS_S: f64 = 1.5;
const BLEND: f64 = 0.2;

/// Along X and then along Y, as a planner without a bound on jerk turns: X brakes, and Y begins a little before it stands.
fn corner(t: f64) -> [f64; 2] {
    let brake_s = FEED / CORNER;
    let stroke = |t: f64| {
        let t = t.max(0.0);
        if t < brake_s {
            0.5 * CORNER * t * t
        } else {
            FEED * (t - 0.5 * brake_s)
        }
    };
    let start = BEGINS_S + (1.0 - BLEND) * brake_s;
    [stroke(t - 0.7) - stroke(t - BEGINS_S), stroke(t - start)]
}

/// Distance of a place from a path that was sampled, mm.
fn off_path(path: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let distance = |pair: &[[f64; 2]]| {
        let [[ax, ay], [bx, by]] = [pair[0], pair[1]];
        let (dx, dy) = (bx - ax, by - ay);
        let square = dx * dx + dy * dy;
        let share = ((x - ax) * dx + (y - ay) * dy) / square.max(1e-12);
        let share = share.clamp(0.0, 1.0);
        (x - ax - share * dx).hypot(y - ay - share * dy)
    };
    path.windows(2).map(distance).fold(f64::INFINITY, f64::min)
}

/// Where the machine is, tick by tick, and the largest acceleration of a set-point, mm/s².
fn driven(
    chain: &dyn Fn() -> Chain,
    correct: bool,
    ticks: u32,
    path: &dyn Fn(f64) -> [f64; 2],
) -> (Vec<[f64; 2]>, f64) {
    let mut cumulants = Cumulants::<f64>::default();
    for (_, element) in chain() {
        cumulants += element.cumulants();
    }
    let image = table(
        Cumulants {
            kappa2_s2: cumulants.kappa2_s2 as f32,
            kappa4_s4: cumulants.kappa4_s4 as f32,
        },
        &[],
        None,
    );
    let mut corrector = corrector(2, 1.0);
    corrector.load(&image).unwrap();
    let mut axes = [chain(), chain()];
    let mut last = [[0.0; 2]; 2];
    let (mut places, mut hardest) = (Vec::new(), 0.0f64);
    for tick in 0..ticks {
        let mut command = [0.0; JOINTS];
        command[..2].copy_from_slice(&path(f64::from(tick) * TICK_S));
        let mut input = input(command, command);
        input.enable = correct;
        let out = corrector.tick(&input, TICK_S);
        let mut place = [0.0; 2];
        for (k, axis) in axes.iter_mut().enumerate() {
            place[k] = axis
                .iter_mut()
                .fold(out.command[k], |at, (element, _)| element.tick(at));
            let second = out.command[k] - 2.0 * last[1][k] + last[0][k];
            hardest = hardest.max(second.abs() / (TICK_S * TICK_S));
        }
        last = [last[1], [out.command[0], out.command[1]]];
        places.push(place);
    }
    (places, hardest)
}

/// Farthest from the slot, µm, and the largest acceleration of a set-point, mm/s².
fn farthest(chain: &dyn Fn() -> Chain, correct: bool) -> [f64; 2] {
    let (places, hardest) = driven(chain, correct, 8000, &|t| slot(way(t)));
    let worst = places.into_iter().map(off_slot).fold(0.0, f64::max);
    [worst * 1e3, hardest]
}

#[test]
fn where_lines_meet_arcs_the_contour_holds_as_well() {
    type Named = (&'static str, f64, f64, fn() -> Chain);
    // What may be left of the contour error, and how much harder the set-points may pull.
    let chains: [Named; 8] = [
        ("lag and average", 0.08, 2.6, || {
            std::vec![average(40), lag(20.0, 0.0)]
        }),
        ("lag", 0.06, 1.9, || std::vec![lag(20.0, 0.0)]),
        ("average", 0.20, 2.9, || std::vec![average(60)]),
        ("two lags", 0.06, 2.4, || {
            std::vec![lag(10.0, 0.0), lag(20.0, 0.0)]
        }),
        ("three lags", 0.09, 2.8, || {
            std::vec![lag(12.0, 0.0), lag(12.0, 0.0), lag(12.0, 0.0)]
        }),
        ("average, two lags", 0.09, 2.8, || {
            std::vec![average(30), lag(5.0, 0.0), lag(15.0, 0.0)]
        }),
        // These have no lag and average: what the operator of even derivatives leaves.
        ("feed-forward", 0.85, 2.6, || std::vec![lag(25.0, 0.5)]),
        ("second order", 0.36, 3.5, || {
            std::vec![oscillator(60.0, 0.9)]
        }),
    ];
    for (name, share, pull, chain) in chains {
        let [bare, _] = farthest(&chain, false);
        let [left, hardest] = farthest(&chain, true);
        std::println!(
            "{name}: {bare:.1} -> {left:.1} um ({:.3}), {hardest:.0} mm/s2",
            left / bare
        );
        assert!(left < share * bare, "{name}: {left} of {bare} um");
        let most = FEED * FEED / RADIUS;
        assert!(hardest < pull * most, "{name}: {hardest} of {most} mm/s2");
    }
}

/// Corners at the full acceleration of the joints: what the correction leaves of them, and how hard it pulls. With no more than
/// three times that acceleration, no linear inverse that looks as far ahead leaves less than 3 % of the first one.
#[test]
fn corners_keep_their_place_at_less_than_three_times_their_acceleration() {
    type Named = (&'static str, f64, fn() -> Chain);
    let chains: [Named; 5] = [
        ("lag and average", 0.11, || {
            std::vec![average(40), lag(20.0, 0.0)]
        }),
        ("lag", 0.05, || std::vec![lag(20.0, 0.0)]),
        ("two lags", 0.08, || {
            std::vec![lag(10.0, 0.0), lag(20.0, 0.0)]
        }),
        ("three lags", 0.14, || {
            std::vec![lag(12.0, 0.0), lag(12.0, 0.0), lag(12.0, 0.0)]
        }),
        ("short lag and average", 0.11, || {
            std::vec![average(30), lag(10.0, 0.0)]
        }),
    ];
    let path: Vec<[f64; 2]> = (0..2500)
        .map(|tick| corner(f64::from(tick) * TICK_S))
        .collect();
    // From half a second before the corner to one after it.
    let near = |places: &[[f64; 2]]| {
        let places = places.iter().take(2400).skip(1000);
        let far = places.map(|place| off_path(&path[900..], *place));
        far.fold(0.0, f64::max) * 1e3
    };
    for (name, share, chain) in chains {
        let (bare, _) = driven(&chain, false, 2500, &corner);
        let (corrected, hardest) = driven(&chain, true, 2500, &corner);
        let (bare, left) = (near(&bare), near(&corrected));
        std::println!(
            "{name}: corner {bare:.1} -> {left:.1} um ({:.3}), {hardest:.0} mm/s2",
            left / bare
        );
        assert!(left < share * bare, "{name}: {left} of {bare} um");
        assert!(hardest < 3.0 * CORNER, "{name}: {hardest} mm/s2");
    }
}
