//! What a signature may know of a run: where the machine was at each sample, not what was measured.
use super::Effect;
use giotto_shared::Axis;
use std::sync::Arc;

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
        self.psi_rad = psi_rad;
    }

    /// Where the machine angle ψ stands between reversals of the axis whose reversals lie at `first_rad` + kπ:
    /// the share of the half turn since the last one, 0…1, and the sign of the half turn (+1 from `first_rad` on).
    pub fn since_reversal(&self, psi_rad: f64, first_rad: f64) -> (f64, f64) {
        let halves = self.sign * (psi_rad - first_rad) * std::f64::consts::FRAC_1_PI;
        // `floor` without a call; angles are a few turns at most.
        let cut = halves as i64;
        let whole = cut - i64::from((cut as f64) > halves);
        (halves - whole as f64, if whole % 2 == 0 { 1.0 } else { -1.0 })
    }

    /// Duration of half a turn, s.
    pub fn half_turn_s(&self) -> f64 {
        std::f64::consts::PI / self.omega_rad_s
    }
}

/// The axes an effect sits on: the named one, or both.
pub(super) fn axes_of(effect: &Effect) -> impl Iterator<Item = Axis> {
    [Axis::X, Axis::Y].into_iter().filter(move |axis| effect.axis.is_none_or(|named| named == *axis))
}
