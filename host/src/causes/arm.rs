//! What a signature may know of an arm in one run: the circle as its joints see it, and how all joints answer.
use super::{CauseModel, Harmonics, ORDERS, RunView, Site};
use crate::kinematics::{COARSE, Cycle, Orbit, WAVES};
use giotto_shared::Actuator;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The joints in one run.
#[derive(Clone, Debug)]
pub struct ArmView {
    /// The circle as the joints see it.
    pub orbit: Arc<Orbit>,
    /// G(jn·dω) of the common response for each wave of a joint's angle.
    pub chain: [Complex<f64>; WAVES],
    /// The same seen from the machine angle ψ: the lag of the first wave taken off.
    pub answers: [Complex<f64>; WAVES],
    /// Radius error of an arm whose joints all answer so, m.
    pub common: Harmonics,
    /// Its change with κ2, m/s².
    pub per_kappa2: Harmonics,
    /// Its change with β2 beyond that of a lag, m/s⁴.
    pub per_beta2: Harmonics,
    /// Distance of the tool from each joint's axis, for sizes that are stated at the tool: of the first circle of the
    /// campaign, m.
    pub arms_m: [f64; 6],
}

/// Share of its lever by which a joint's constant error has to change the shape of a circle to be seen.
const SHOWS: f64 = 1e-3;

impl ArmView {
    /// Number of joints that turn.
    pub fn joints(&self) -> usize {
        self.orbit.kinematics().turning()
    }

    /// Joints whose motion changes the shape of the circle.
    pub fn moving(&self) -> impl Iterator<Item = Actuator> + '_ {
        let joints = self.orbit.kinematics().joints().iter().copied();
        joints.filter(|joint| self.orbit.fastest(joint.index()) > SHOWS)
    }

    /// j·n·dω for each wave.
    pub fn rates(&self, view: &RunView) -> [Complex<f64>; WAVES] {
        std::array::from_fn(|n| Complex::new(0.0, n as f64 * view.sign * view.omega_rad_s))
    }

    /// What an error of a joint that is an answer to its angle does to the radius, as waves of ψ, m.
    pub fn seen(&self, joint: usize, answers: &[Complex<f64>; WAVES]) -> Harmonics {
        let error = self.orbit.answered(joint, answers);
        harmonics(&self.orbit.seen(joint, &error))
    }

    /// What a constant error of a joint does to the radius, m/rad.
    pub fn seen_constant(&self, joint: usize) -> Harmonics {
        harmonics(&self.orbit.seen(joint, &[1.0; COARSE]))
    }

    /// What a longer link does to the radius, m/m; `None`: there is no such link.
    pub fn seen_link(&self, joint: usize) -> Option<Harmonics> {
        self.orbit
            .seen_of_link(joint)
            .map(|cycle| harmonics(&cycle))
    }
}

/// Sites of a cause of the geometry that a circle shows: what only turns or shifts the circle, as the zero of a base does, is seen
/// by none.
pub fn sites_with_shape(model: &dyn CauseModel, views: &[RunView]) -> Vec<Site> {
    /// Millimetres and milliradians.
    const UNIT: f64 = 1e-3;
    let shows = |site: &Site| {
        views.iter().any(|view| {
            let waves = model.harmonics(*site, &[], view).unwrap_or_default();
            has_shape(&waves, UNIT * view.radius_m)
        })
    };
    let mut sites = model.seat().sites(views);
    sites.retain(shows);
    sites
}

/// Whether waves are more than a shift of the centre: some share of the largest that they could be.
fn has_shape(waves: &Harmonics, of: f64) -> bool {
    let beyond = waves
        .0
        .iter()
        .enumerate()
        .filter(|(order, _)| *order != 1)
        .map(|(_, [c, s])| c * c + s * s)
        .sum::<f64>()
        .sqrt();
    beyond > SHOWS * of
}

/// Mean and waves of a quantity over one turn.
pub fn harmonics(cycle: &Cycle) -> Harmonics {
    let n = cycle.len() as f64;
    let mut out = Harmonics::default();
    for order in 0..=ORDERS {
        let step = Complex::cis(TAU * order as f64 / n);
        let mut turn = Complex::new(1.0, 0.0);
        let mut sum = Complex::new(0.0, 0.0);
        for value in cycle {
            sum += turn * *value;
            turn *= step;
        }
        out.0[order] = if order == 0 {
            [sum.re / n, 0.0]
        } else {
            [2.0 * sum.re / n, 2.0 * sum.im / n]
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_of_a_cycle_give_its_values_back() {
        let want = Harmonics::mean(0.3)
            .with(1, [1.0, -0.4])
            .with(5, [0.2, 2.0]);
        let nodes = COARSE;
        let cycle: Cycle = std::array::from_fn(|k| want.at(TAU * k as f64 / nodes as f64));
        let got = harmonics(&cycle);
        for (a, b) in got.0.iter().flatten().zip(want.0.iter().flatten()) {
            assert!((a - b).abs() < 1e-13);
        }
    }
}
