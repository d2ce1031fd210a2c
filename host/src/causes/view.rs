//! What a signature may know of a run: where the machine was at each sample, not what was measured.
use super::Effect;
use giotto_shared::Axis;
use std::sync::Arc;

/// Between two reversals of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Share of the half turn since the last reversal, 0…1.
    pub share: f64,
    /// Cosine of the angle since then: the direction cosine of the axis, positive where it has just turned.
    pub facing: f64,
}

/// The motion of one run, sample by sample. Samples are shared: a copy costs nothing.
#[derive(Clone, Debug)]
pub struct RunView {
    /// Programmed radius R, m.
    pub radius_m: f64,
    /// Feed f, m/s: as measured by the duration of the turn, else as programmed.
    pub feed_m_s: f64,
    /// ω = f/R, rad/s.
    pub omega_rad_s: f64,
    /// d: +1 CCW, −1 CW.
    pub sign: f64,
    /// Middle of the run as a share of the time between the first start and the last.
    pub elapsed: f64,
    /// Time between the first start and the last, s; an hour where the starts are not known.
    pub campaign_s: f64,
    /// Largest radius of the campaign, m.
    pub largest_radius_m: f64,
    /// Polar angle of the machine ψ = θ − d·φ(ω) at each sample, rad: the lag of the servo removed.
    pub psi_rad: Arc<[f64]>,
    /// cosψ and sinψ at each sample.
    pub direction: Arc<[[f64; 2]]>,
    /// Of X and Y: where each sample stands between the axis' reversals.
    pub strokes: [Arc<[Stroke]>; 2],
    /// Time since the first sample, s.
    pub time_s: Arc<[f64]>,
    /// Gain |G(jω)| of the baseline.
    pub gain: f64,
    /// Phase lag φ(ω) of the servo, rad, ≥ 0.
    pub lag_rad: f64,
}

impl RunView {
    /// Sets the machine angle and what follows from it.
    pub fn place(&mut self, psi_rad: Arc<[f64]>) {
        self.direction = psi_rad
            .iter()
            .map(|psi| {
                let (sin, cos) = psi.sin_cos();
                [cos, sin]
            })
            .collect();
        self.strokes = [(0, 0.0), (1, std::f64::consts::FRAC_PI_2)].map(|(axis, first_rad)| {
            let strokes = psi_rad.iter().zip(self.direction.iter());
            strokes
                .map(|(psi, direction)| self.stroke(psi - first_rad, direction[axis]))
                .collect()
        });
        self.psi_rad = psi_rad;
    }

    /// At an angle since some reversal of an axis, and the direction cosine of the axis there.
    fn stroke(&self, angle_rad: f64, direction: f64) -> Stroke {
        let halves = self.sign * angle_rad * std::f64::consts::FRAC_1_PI;
        // `floor` without a call; angles are a few turns at most.
        let cut = halves as i64;
        let whole = cut - i64::from((cut as f64) > halves);
        let side = if whole % 2 == 0 { 1.0 } else { -1.0 };
        Stroke {
            share: halves - whole as f64,
            facing: side * direction,
        }
    }

    /// Where each sample stands between the reversals of an axis; of X where none is named.
    pub fn strokes_of(&self, axis: Option<Axis>) -> &[Stroke] {
        &self.strokes[axis.map_or(0, Axis::index)]
    }

    /// Duration of half a turn, s.
    pub fn half_turn_s(&self) -> f64 {
        std::f64::consts::PI / self.omega_rad_s
    }
}

/// The axes an effect sits on: the named one, or both.
pub(super) fn axes_of(effect: &Effect) -> impl Iterator<Item = Axis> {
    [Axis::X, Axis::Y]
        .into_iter()
        .filter(move |axis| effect.axis.is_none_or(|named| named == *axis))
}
