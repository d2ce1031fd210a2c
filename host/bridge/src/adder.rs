//! A correction for a path that is the robot's: its places come in, what is to be added comes out.
use crate::Place;
use giotto_corrector::{Corrector, Input, JOINTS, LawError, Settings};

/// Longest gap that is bridged along the path, s. After a longer one the correction is held, taken out, and begun anew.
const BRIDGED_S: f64 = 0.1;
/// Time in which what was held is taken out, s.
const OUT_S: f64 = 0.5;

/// Correction of a path, cycle by cycle.
#[derive(Clone, Debug)]
pub(crate) struct Adder {
    settings: Settings,
    image: Vec<u8>,
    corrector: Box<Corrector>,
    cycle_s: f64,
    /// Bounds of what goes out: of each coordinate, mm, and of its change in a cycle; `None`: set-points of the robot's own
    /// path are delayed, and move as it does.
    bounds: Option<[f64; 2]>,
    /// The last places, the newest first, and how many cycles each lies before the newest.
    last: Vec<(Place, u32)>,
    out: Place,
    /// What was held over a gap, and how much of it is taken out.
    left: Place,
    left_done: f64,
    cuts: u32,
}

/// What an adder says of one cycle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Added {
    /// To be added to the place that came, mm.
    pub(crate) beside: Place,
    /// Something acts, or is on its way in or out.
    pub(crate) active: bool,
    /// A bound was reached.
    pub(crate) limited: bool,
}

/// Input of one tick without feedback, joints and soft limits: X, Y, Z in mm.
pub(crate) fn input(place: Place, enable: bool) -> Input {
    let mut command = [0.0; JOINTS];
    for (command, place) in command.iter_mut().zip(place) {
        *command = place;
    }
    Input {
        command,
        // Nothing follows what is no number: the robot's drives are the robot's.
        feedback: [f64::NAN; JOINTS],
        motor_offset: [0.0; JOINTS],
        soft: [[f64::NEG_INFINITY, f64::INFINITY]; JOINTS],
        enable,
        coordinated: true,
        machine_on: true,
    }
}

/// Smoothstep of degree 5.
pub(crate) fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

/// Through four places at most, at these times: where the path was at `at`.
fn between(known: &[(Place, f64)], at: f64) -> Place {
    let mut place = [0.0; 3];
    for (index, (known_place, time)) in known.iter().enumerate() {
        let others = known
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index);
        let weight: f64 = others
            .map(|(_, (_, other))| (at - other) / (time - other))
            .product();
        for (place, known) in place.iter_mut().zip(known_place) {
            *place += weight * known;
        }
    }
    place
}

impl Adder {
    /// `limit_mm` and `slew_mm_s` bound an offset that the robot adds itself.
    pub(crate) fn new(
        settings: Settings,
        image: &[u8],
        cycle_s: f64,
        bounds: Option<[f64; 2]>,
    ) -> Result<Self, LawError> {
        let mut corrector = Box::new(Corrector::new(settings));
        corrector.load(image)?;
        Ok(Self {
            settings,
            image: image.to_vec(),
            corrector,
            cycle_s,
            bounds: bounds.map(|[limit_mm, slew_mm_s]| [limit_mm, slew_mm_s * cycle_s]),
            last: Vec::with_capacity(4),
            out: [0.0; 3],
            left: [0.0; 3],
            left_done: 1.0,
            cuts: 0,
        })
    }

    /// The robot's path is at `place`, `cycles` after the last one; `None`: nothing is known of before.
    pub(crate) fn cycle(&mut self, place: Place, cycles: Option<u32>, wanted: bool) -> Added {
        let bridged = cycles.filter(|cycles| f64::from(*cycles - 1) * self.cycle_s <= BRIDGED_S);
        let cycles = bridged.unwrap_or_else(|| {
            self.begin_anew();
            1
        });
        for known in &mut self.last {
            known.1 += cycles;
        }
        let mut known: Vec<(Place, f64)> = vec![(place, 0.0)];
        known.extend(
            self.last
                .iter()
                .map(|(place, ago)| (*place, -f64::from(*ago))),
        );
        for missing in (1..cycles).rev() {
            let place = between(&known, -f64::from(missing));
            self.corrector.tick(&input(place, wanted), self.cycle_s);
        }
        let out = self.corrector.tick(&input(place, wanted), self.cycle_s);
        self.last.insert(0, (place, 0));
        self.last.truncate(3);
        self.gate(place, &out.command, cycles, out.active)
    }

    /// The correction that was held stays for a moment; the engine begins anew.
    fn begin_anew(&mut self) {
        (self.left, self.left_done) = (self.out, 0.0);
        self.last.clear();
        self.corrector.set(self.settings);
        // It was loaded before, and no other is in its way.
        let loaded = self.corrector.load(&self.image);
        debug_assert!(loaded.is_ok());
        self.cuts = 0;
    }

    /// The last gate: bounds of the offset and of its change from one answer to the next, whatever came before.
    fn gate(&mut self, place: Place, command: &[f64], cycles: u32, active: bool) -> Added {
        let step = f64::from(cycles) * self.cycle_s / OUT_S;
        self.left_done = (self.left_done + step).min(1.0);
        let left = 1.0 - smooth(self.left_done);
        let counters = self.corrector.counters();
        let cuts = counters.offset_cuts.wrapping_add(counters.slew_cuts);
        let mut limited = cuts != self.cuts;
        self.cuts = cuts;
        let axes = self.out.iter_mut().zip(command).zip(place).zip(self.left);
        for (((out, command), place), held) in axes {
            let wanted = (command - place) + left * held;
            *out = match self.bounds {
                None => wanted,
                Some([limit, step]) => {
                    let allowed = wanted.clamp(-limit, limit).clamp(*out - step, *out + step);
                    limited |= allowed != wanted;
                    allowed
                }
            };
        }
        Added {
            beside: self.out,
            active: active || left > 0.0 || self.out != [0.0; 3],
            limited,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_bridged_along_a_cubic_exactly() {
        let path = |t: f64| [1.0 + t, t * t - 3.0 * t, 0.2 * t * t * t];
        let known = [0.0, -3.0, -4.0, -5.0].map(|t| (path(t), t));
        for t in [-1.0, -2.0] {
            for (found, expected) in between(&known, t).into_iter().zip(path(t)) {
                assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            }
        }
        assert_eq!(between(&known[..1], -1.0), known[0].0);
    }
}
