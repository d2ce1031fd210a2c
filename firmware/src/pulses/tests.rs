//! Pulses replayed into places.
extern crate std;
use super::*;
use crate::control::STREAM_PLACES;
use crate::engine::{Config, Planner, StreamPlan};
use giotto_shared::model::Cumulants;
use giotto_shared::table::{Limits, Table, Terms, Travel, Zone};
use std::vec::Vec;

/// What a drive makes of the lines of one axis: counts, and how long each level was.
#[derive(Default)]
struct Drive {
    count: i64,
    step: bool,
    up: bool,
    /// Slots of the level of the step, of the direction, and since the last step rose.
    level_for: u32,
    direction_for: u32,
    risen_for: u32,
    shortest_high: u32,
    shortest_low: u32,
    shortest_set_up: u32,
    shortest_hold: u32,
    rises: u64,
    /// Slots from one step to the next.
    apart: Vec<u32>,
}

const LONG: u32 = 1 << 30;

impl Drive {
    fn new() -> Self {
        Self {
            up: true,
            level_for: LONG,
            direction_for: LONG,
            risen_for: LONG,
            shortest_high: LONG,
            shortest_low: LONG,
            shortest_set_up: LONG,
            shortest_hold: LONG,
            ..Self::default()
        }
    }

    fn slot(&mut self, step: bool, up: bool) {
        if up != self.up {
            self.shortest_hold = self.shortest_hold.min(self.risen_for);
            (self.up, self.direction_for) = (up, 0);
        }
        if step != self.step {
            if step {
                self.shortest_low = self.shortest_low.min(self.level_for);
                self.shortest_set_up = self.shortest_set_up.min(self.direction_for);
                self.count += if up { 1 } else { -1 };
                self.rises += 1;
                self.apart.push(self.risen_for);
                self.risen_for = 0;
            } else {
                self.shortest_high = self.shortest_high.min(self.level_for);
            }
            (self.step, self.level_for) = (step, 0);
        }
        for time in [
            &mut self.level_for,
            &mut self.direction_for,
            &mut self.risen_for,
        ] {
            *time = (*time + 1).min(LONG);
        }
    }
}

fn play(drives: &mut [Drive; 3], pattern: &Pattern) {
    for levels in pattern {
        for (axis, drive) in drives.iter_mut().enumerate() {
            drive.slot(levels >> (2 * axis) & 1 == 1, levels >> (2 * axis) & 2 == 2);
        }
    }
}

fn keeps(widths: Widths, drive: &Drive) {
    assert!(
        drive.shortest_high >= u32::from(widths.high),
        "high {}",
        drive.shortest_high
    );
    assert!(
        drive.shortest_low >= u32::from(widths.low),
        "low {}",
        drive.shortest_low
    );
    let set_up = drive.shortest_set_up;
    assert!(set_up >= u32::from(widths.set_up), "set-up {set_up}");
    assert!(
        drive.shortest_hold >= u32::from(widths.hold),
        "hold {}",
        drive.shortest_hold
    );
}

/// xorshift64*, 53 bits of it: 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Three axes that swing about where they began, at rest at first; none faster than `feed`, m/s, or more than 3 m/s².
fn swings(random: &mut Random, feed: f64) -> impl Fn(f64) -> [i32; 3] + use<> {
    let mut axis = || {
        [0, 1, 2].map(|_| {
            let rate = 2.0 + 20.0 * random.next();
            let reach = (feed / 3.0 / rate).min(1.0 / (rate * rate)) * (0.2 + 0.8 * random.next());
            (rate, reach)
        })
    };
    let axes = [axis(), axis(), axis()];
    move |t: f64| {
        axes.map(|axis| {
            let metres: f64 = axis
                .iter()
                .map(|(rate, reach)| reach * (1.0 - (rate * t).cos()))
                .sum();
            (metres * 1e9) as i32
        })
    }
}

fn scale(random: &mut Random) -> Scale {
    // From 1.5 to 8 µm a step, most of them no whole number of nanometres.
    Scale::new(
        (1_400_000.0 * (0.35 + 0.35 * random.next())) as u32,
        90 + (random.next() * 100.0) as u32,
    )
    .unwrap()
}

#[test]
fn a_place_and_its_steps_are_the_same_at_the_end_of_every_tick() {
    let mut random = Random(1);
    for run in 0..30 {
        let widths = Widths {
            high: 1 + run % 2,
            low: 1 + run % 3 % 2,
            set_up: 1 + run % 4,
            hold: 1 + run % 5,
        };
        let scales = [scale(&mut random), scale(&mut random), scale(&mut random)];
        let path = swings(&mut random, 0.045);
        let mut stepper = Stepper::new(scales, widths, [0; 3]);
        assert!(stepper.allows(45_000));
        let mut drives = [Drive::new(), Drive::new(), Drive::new()];
        let mut pattern = [0; SLOTS];
        for tick in 0..4000 {
            let to = path(f64::from(tick) * 1e-3);
            stepper.tick(to, &mut pattern).unwrap();
            play(&mut drives, &pattern);
            for axis in 0..3 {
                assert_eq!(drives[axis].count, stepper.made()[axis]);
                // Half a step and an eighth; what waits for its direction is less than a step.
                let off =
                    scales[axis].fine(to[axis]) - 8 * drives[axis].count * scales[axis].eighth();
                assert!(
                    off.abs() <= 13 * scales[axis].eighth(),
                    "{run} {tick}: {off}"
                );
            }
        }
        for drive in &drives {
            keeps(widths, drive);
        }
    }
}

#[test]
fn steps_of_a_steady_path_are_as_far_apart_as_it_is_fast() {
    let scale = Scale::new(3125, 1).unwrap();
    for nm_per_tick in [1_000, 3_125, 10_007, 99_999, 180_001] {
        let mut stepper = Stepper::new([scale; 3], Widths::SHORTEST, [0; 3]);
        let mut drives = [Drive::new(), Drive::new(), Drive::new()];
        let mut pattern = [0; SLOTS];
        for tick in 1..400 {
            let x = tick * nm_per_tick;
            stepper.tick([x, -x, 0], &mut pattern).unwrap();
            play(&mut drives, &pattern);
        }
        let exact = 3125.0 * SLOTS as f64 / f64::from(nm_per_tick);
        for drive in &drives[..2] {
            // The first one of Y waits for its direction.
            for apart in &drive.apart[2..] {
                assert!(
                    (f64::from(*apart) - exact).abs() < 1.0,
                    "{apart} of {exact}"
                );
            }
        }
        assert_eq!(drives[2].rises, 0);
    }
}

#[test]
fn a_place_that_trembles_on_an_edge_makes_no_steps() {
    let scale = Scale::new(1000, 1).unwrap();
    let mut stepper = Stepper::new([scale; 3], Widths::SHORTEST, [0; 3]);
    let mut drives = [Drive::new(), Drive::new(), Drive::new()];
    let mut pattern = [0; SLOTS];
    for tick in 0..1000 {
        let at = 624 + tick % 3;
        stepper.tick([at, at - 124, -at], &mut pattern).unwrap();
        play(&mut drives, &pattern);
    }
    assert_eq!(drives.map(|drive| drive.count), [1, 0, -1]);
}

#[test]
fn what_is_too_fast_is_refused_and_nothing_of_it_made() {
    let scale = Scale::new(3125, 1).unwrap();
    let mut stepper = Stepper::new([scale; 3], Widths::SHORTEST, [0; 3]);
    assert!(stepper.allows(59 * 3125) && !stepper.allows(59 * 3125 + 1));
    let mut pattern = [0; SLOTS];
    let most = 60 * 3125;
    stepper.tick([0, most, 0], &mut pattern).unwrap();
    let made = stepper.made();
    let refused = stepper.tick([0, 2 * most + 1, most + 1], &mut pattern);
    assert_eq!((refused, stepper.made()), (Err(TooFast { axis: 1 }), made));
    assert_eq!(
        (Scale::new(0, 1), Scale::new(1, 0)),
        (Err(ScaleError), Err(ScaleError))
    );
}

/// A plan as of a machine with the paper's cumulants.
fn plan(feed_m_s: f32) -> StreamPlan {
    let zone = Zone {
        place_m: None,
        radius_m: [0.001, 1.0],
        feed_m_s: [0.001, 2.0],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 46.58e-6,
            kappa4_s4: -5.5265e-6,
        },
        terms: Terms::new(),
    };
    let table = Table {
        machine: heapless::String::new(),
        zones: [zone].into_iter().collect(),
        limits: Limits {
            offset_m: 5e-3,
            slew_m_s: 0.1,
        },
        arm: None,
    };
    let mut planner = Planner::new(&Config::robot(1000), [0; 3]);
    planner.set_table(Some(&table)).unwrap();
    let plan = planner.stream(feed_m_s, STREAM_PLACES).unwrap();
    assert!(plan.corrected());
    plan
}

/// A planner's pulses in, corrected pulses out, over paths of all kinds until a million steps have come out.
#[test]
fn a_million_steps_in_and_out_and_none_is_lost() {
    let (mut random, mut steps, mut offset) = (Random(7), 0, 0);
    let plan = plan(0.05);
    while steps < 1_000_000 {
        let scales = [scale(&mut random), scale(&mut random), scale(&mut random)];
        let path = swings(&mut random, 0.045);
        let mut planner = Stepper::new(scales, Widths::SHORTEST, [0; 3]);
        let mut into = [Drive::new(), Drive::new(), Drive::new()];
        let mut out = [Drive::new(), Drive::new(), Drive::new()];
        // Counters that begin anywhere, and wrap.
        let begin = [0, 1, 2].map(|_| (random.next() * 65536.0) as u16);
        let out_scales = [scale(&mut random), scale(&mut random), scale(&mut random)];
        let mut relay = Relay::new(
            &plan,
            (scales, begin),
            (out_scales, Widths::SHORTEST),
            [0; 3],
            50_000 + 100_000,
        )
        .unwrap();
        assert_eq!(relay.latency(), plan.latency() + 1);
        let (mut pattern, mut places) = ([0; SLOTS], Vec::new());
        for tick in 0..3000 {
            // It swings, and stands for the last half second.
            let to = path(f64::from(tick.min(2500)) * 1e-3);
            planner.tick(to, &mut pattern).unwrap();
            play(&mut into, &pattern);
            let counters = [0, 1, 2].map(|axis| begin[axis].wrapping_add(into[axis].count as u16));
            places.push([0, 1, 2].map(|axis| scales[axis].place_nm(into[axis].count)));
            let output = relay.tick(counters, &mut pattern).unwrap();
            play(&mut out, &pattern);
            let late = places.len().checked_sub(1 + plan.latency() as usize);
            let nominal = late.map_or([0; 3], |at| places[at]);
            assert_eq!(output.nominal_nm, nominal, "constant latency");
            for axis in 0..3 {
                offset = offset.max((output.corrected_nm[axis] - output.nominal_nm[axis]).abs());
            }
        }
        for axis in 0..3 {
            assert_eq!(relay.steps_in()[axis], into[axis].count);
            assert_eq!(relay.steps_out()[axis], out[axis].count);
            keeps(Widths::SHORTEST, &out[axis]);
            // Where the planner's pulses say, to the edge of a step.
            let end = places[places.len() - 1][axis];
            let off = out_scales[axis].fine(end) - 8 * out[axis].count * out_scales[axis].eighth();
            assert!(off.abs() <= 5 * out_scales[axis].eighth(), "{off}");
            steps += out[axis].rises;
        }
    }
    assert!(offset > 2000, "it was corrected: {offset} nm");
    std::println!("{steps} steps out, largest correction {offset} nm");
}
