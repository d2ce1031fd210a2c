//! What a signature may know of a run: where the machine was at each sample, not what was measured.
use super::Harmonics;
use super::arm::ArmView;
use giotto_shared::{Actuator, Frame};
use std::sync::Arc;

/// Since the last reversal of a slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Share of the half turn since then, 0…1.
    pub share: f64,
    /// Direction cosine of the slide, positive where it has just turned: an error against the new direction of travel
    /// shows so much along the radius.
    pub facing: f64,
}

/// Direction cosine below which a slide counts as standing still: it moves by a tenth of the radius or less, and what
/// it does wrong shows by as little.
const STANDS: f64 = 0.1;

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
    /// How the circle lies in the machine.
    pub frame: Frame,
    /// Where its centre is, m; the origin where no run says.
    pub centre_m: [f64; 3],
    /// Middle of the run as a share of the time between the first start and the last.
    pub elapsed: f64,
    /// Time between the first start and the last, s; an hour where the starts are not known.
    pub campaign_s: f64,
    /// Largest radius of the campaign, m.
    pub largest_radius_m: f64,
    /// Polar angle of the machine ψ = θ − d·φ(ω) at each sample, rad: the lag of the servo removed.
    pub psi_rad: Arc<[f64]>,
    /// Direction cosines of X, Y and Z at each sample: each is R times that away from the centre.
    pub direction: Arc<[[f64; 3]]>,
    /// Of X, Y and Z: where each sample stands between the reversals; empty for a slide that stands still.
    pub strokes: [Arc<[Stroke]>; 3],
    /// Time since the first sample, s.
    pub time_s: Arc<[f64]>,
    /// Gain |G(jω)| of the baseline.
    pub gain: f64,
    /// Phase lag φ(ω) of the servo, rad, ≥ 0.
    pub lag_rad: f64,
    /// The joints, where the machine is an arm whose kinematics are known: then no slide moves.
    pub arm: Option<Arc<ArmView>>,
}

impl RunView {
    /// Sets the machine angle and what follows from it.
    pub fn place(&mut self, psi_rad: Arc<[f64]>) {
        let shares = [0, 1, 2].map(|slide| self.frame.shares(slide));
        self.direction = psi_rad
            .iter()
            .map(|psi| {
                let (sin, cos) = psi.sin_cos();
                shares.map(|[first, second]| first * cos + second * sin)
            })
            .collect();
        self.strokes = Actuator::SLIDES.map(|slide| {
            if !self.moves(slide) {
                return Arc::default();
            }
            let at = slide.index();
            let [first, second] = shares[at];
            // A slide is at an extreme where the circle points along it.
            let extreme_rad = second.atan2(first);
            let strokes = psi_rad.iter().zip(self.direction.iter());
            strokes
                .map(|(psi, direction)| self.stroke(psi - extreme_rad, direction[at]))
                .collect()
        });
        self.psi_rad = psi_rad;
    }

    /// At an angle since some reversal of a slide, and the direction cosine of the slide there.
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

    /// Whether a slide moves along this circle.
    pub fn moves(&self, slide: Actuator) -> bool {
        self.arm.is_none() && slide.is_slide() && self.swing(slide) > STANDS
    }

    /// Largest direction cosine of a slide: it swings R times that to either side.
    pub fn swing(&self, slide: Actuator) -> f64 {
        let [first, second] = self.frame.shares(slide.index());
        first.hypot(second)
    }

    /// Direction cosine of a slide as a wave of ψ.
    pub fn cosine(&self, slide: Actuator) -> Harmonics {
        Harmonics::wave(1, self.frame.shares(slide.index()))
    }

    /// Velocity of a slide over the feed as a wave of ψ.
    pub fn velocity(&self, slide: Actuator) -> Harmonics {
        let [first, second] = self.frame.shares(slide.index());
        Harmonics::wave(1, [self.sign * second, -self.sign * first])
    }

    /// Where each sample stands between the reversals of a slide; empty where it stands still.
    pub fn strokes_of(&self, slide: Actuator) -> &[Stroke] {
        if slide.is_slide() {
            &self.strokes[slide.index()]
        } else {
            &[]
        }
    }

    /// Duration of half a turn, s.
    pub fn half_turn_s(&self) -> f64 {
        std::f64::consts::PI / self.omega_rad_s
    }
}
