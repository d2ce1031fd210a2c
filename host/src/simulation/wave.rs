//! The command of a circle at a constant rate: a wave on each axis, Re(phasor·e^{iψ}), ψ the angle of the command.
use super::machine::{AccDec, Machine};
use nalgebra::Complex;

/// Steps from one evaluated angle to the next.
const FINE: usize = 32;

/// Cosine and sine of an angle that grows by the same step, by turning an evaluated one through a table of turns: two
/// evaluations a [`FINE`]th step instead of each. Right to two ε on top of the rounding of the angle itself.
#[derive(Clone, Debug)]
pub(super) struct Turns {
    start_rad: f64,
    step_rad: f64,
    fine: [[f64; 2]; FINE],
}

impl Turns {
    /// From `start_rad` on, `step_rad` a step.
    pub(super) fn new(start_rad: f64, step_rad: f64) -> Self {
        Self {
            start_rad,
            step_rad,
            fine: std::array::from_fn(|k| wave(step_rad * k as f64)),
        }
    }

    /// Angle of a step, rad.
    pub(super) fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// Cosine and sine at step `k`.
    pub(super) fn at(&self, k: f64) -> [f64; 2] {
        wave(self.start_rad + self.step_rad * k)
    }

    /// The same from step `first` on.
    pub(super) fn fill(&self, first: f64, waves: &mut [[f64; 2]]) {
        for (block, waves) in waves.chunks_mut(FINE).enumerate() {
            let [c, s] = self.at(first + (FINE * block) as f64);
            for (wave, [cos, sin]) in waves.iter_mut().zip(self.fine) {
                *wave = [c * cos - s * sin, s * cos + c * sin];
            }
        }
    }
}

fn wave(angle_rad: f64) -> [f64; 2] {
    let (sin, cos) = angle_rad.sin_cos();
    [cos, sin]
}

/// Phasor of what reaches the chain of an axis that is commanded `reach_m[0]`·cosψ + `reach_m[1]`·sinψ: behind dead time
/// and moving average.
pub(super) fn phasor(
    machine: &Machine,
    axis: usize,
    reach_m: [f64; 2],
    omega_rad_s: f64,
) -> Complex<f64> {
    let circle = Complex::new(reach_m[0], -reach_m[1]);
    let late = Complex::cis(-omega_rad_s * machine.dead_time_s[axis]);
    let mean = match machine.acc_dec {
        // ∫e^{iωt}dt over the window before now, over its length.
        AccDec::MovingAverage(window_s) => {
            let turn = omega_rad_s * window_s;
            (Complex::from(1.0) - Complex::cis(-turn)) / Complex::new(0.0, turn)
        }
        AccDec::None | AccDec::Exponential(_) => Complex::from(1.0),
    };
    circle * late * mean
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_waves_are_right_to_what_is_stated() {
        let mut worst: f64 = 0.0;
        for (start, step) in [
            (0.3, 1e-3),
            (-2.0, -0.0174),
            (0.0, std::f64::consts::TAU / 1e6),
        ] {
            let turns = Turns::new(start, step);
            let mut waves = vec![[0.0; 2]; 5000];
            turns.fill(-1700.0, &mut waves);
            for (k, [c, s]) in waves.iter().enumerate() {
                let grown = step * (k as f64 - 1700.0);
                let angle = start + grown;
                // Product and sum are each rounded by half an ε, here and there.
                let rounding = f64::EPSILON * (grown.abs() + angle.abs());
                let (sin, cos) = angle.sin_cos();
                worst = worst.max(((c - cos).abs().max((s - sin).abs()) - rounding) / f64::EPSILON);
            }
        }
        assert!(worst <= 2.0 && worst > 0.2, "{worst} ε");
    }

    /// Oracle: the mean of the wave over the window, by many points.
    #[test]
    fn phasor_is_the_late_mean_of_the_circle() {
        let machine = Machine {
            acc_dec: AccDec::MovingAverage(0.08),
            dead_time_s: [0.01, 0.03, 0.02],
            ..Machine::default()
        };
        let (radius, omega, psi, n) = (0.2, -5.0, 0.7, 20_000);
        for axis in 0..2 {
            let at = |back_s: f64| {
                let angle = psi - omega * (back_s + machine.dead_time_s[axis]);
                radius * if axis == 0 { angle.cos() } else { angle.sin() }
            };
            let window = |k: i32| 0.08 * (f64::from(k) + 0.5) / f64::from(n);
            let mean = (0..n).map(|k| at(window(k))).sum::<f64>() / f64::from(n);
            let found = (phasor(&machine, axis, [[radius, 0.0], [0.0, radius]][axis], omega)
                * Complex::cis(psi))
            .re;
            assert!((found - mean).abs() < 1e-10, "axis {axis}: {found} {mean}");
        }
    }
}
