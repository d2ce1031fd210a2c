//! The offset that one zone of a table asks for at one place of the path: the opposite of the machine's error there.
use crate::arc::{Ahead, OnArc, Turn};
use crate::history::History;
use crate::law::ZoneLaw;
use crate::senses::Sensed;
use crate::settings::Settings;
use crate::stencil::Stencil;
use core::f64::consts::TAU;
use giotto_shared::kinematics::path;
use giotto_shared::law::{ArmLaw, JointSides, Pace};

/// What all voices see of the place that is corrected, SI, by slide.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place {
    pub(crate) place_m: [f64; 3],
    pub(crate) velocity_m_s: [f64; 3],
    pub(crate) acceleration_m_s2: [f64; 3],
    /// Third and fourth derivative.
    pub(crate) higher: [[f64; 3]; 2],
    pub(crate) turn: Turn,
    pub(crate) sensed: [Sensed; 3],
    /// How what is taken from the history turns until the place that is corrected; `None`: it is the same place.
    pub(crate) ahead: Option<Ahead>,
}

/// A friction pulse: what is up of it, and what the turn under way adds, m.
#[derive(Clone, Copy, Debug, Default)]
struct Pulse {
    now_m: f64,
    rise_m: f64,
}

/// What a voice keeps from tick to tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Voice {
    /// Where errors of position are counted from, m.
    pub(crate) reference_m: [f64; 3],
    /// By slide.
    pulse: [Pulse; 3],
    on_arc: OnArc,
    stencil: Stencil,
    arm: Option<(ArmLaw<f64>, JointSides<f64>)>,
    /// What the joints asked for last, m.
    joints_m: [f64; 3],
}

impl Voice {
    pub(crate) fn new(
        zone: &ZoneLaw,
        reference_m: [f64; 3],
        stencil: Stencil,
        pace: &Pace<f64>,
    ) -> Self {
        let arm = zone.arm.and_then(|arm| {
            let errors = zone.profile.arm;
            // An arm that cannot stand where zeros are counted from asks for nothing.
            let law = ArmLaw::new(arm.kinematics, arm.common, errors, arm.home_m, pace);
            law.ok().map(|law| (law, JointSides::default()))
        });
        Self {
            arm,
            joints_m: [0.0; 3],
            reference_m,
            stencil,
            pulse: [Pulse {
                now_m: 0.0,
                rise_m: 0.0,
            }; 3],
            on_arc: OnArc::new(),
        }
    }

    /// The offset by slide, m.
    pub(crate) fn tick(
        &mut self,
        zone: &ZoneLaw,
        at: &Place,
        history: &History,
        settings: &Settings,
    ) -> [f64; 3] {
        let mut offset = [0.0; 3];
        let metre = settings.units_per_m;
        for (offset, joint) in offset.iter_mut().zip(settings.joint) {
            if let Some(joint) = joint {
                *offset = history.offset(joint, &self.stencil) / metre;
            }
        }
        if let Some(ahead) = &at.ahead {
            offset = ahead.turned(offset);
        }
        self.by_joints(at, &mut offset);
        if zone.has_terms {
            self.by_motion(zone, at, &mut offset);
            self.by_sense(zone, at, history.tick_s(), &mut offset);
            by_place(zone, at, &mut offset);
            self.on_circles(zone, at, history.tick_s(), &mut offset);
        }
        offset
    }

    /// What the joints of an arm ask for. Where it cannot stand the last of it is held.
    fn by_joints(&mut self, at: &Place, offset: &mut [f64; 3]) {
        let Some((law, sides)) = &mut self.arm else {
            return;
        };
        let [third, fourth] = at.higher;
        let path = path(&[
            at.place_m,
            at.velocity_m_s,
            at.acceleration_m_s2,
            third,
            fourth,
        ]);
        if let Ok(joints_m) = law.offset(&path, sides) {
            self.joints_m = joints_m;
        }
        for (offset, joints) in offset.iter_mut().zip(self.joints_m) {
            *offset += joints;
        }
    }

    /// Errors by position, velocity and acceleration.
    fn by_motion(&self, zone: &ZoneLaw, at: &Place, offset: &mut [f64; 3]) {
        let p = &zone.profile;
        let ([x, y, z], [rx, ry, rz]) = (at.place_m, self.reference_m);
        let (dx, dy, dz) = (x - rx, y - ry, z - rz);
        let by_slide = p.position.iter().zip(p.velocity_s).zip(p.acceleration_s2);
        let motion = at.velocity_m_s.into_iter().zip(at.acceleration_m_s2);
        for ((offset, (([px, py, pz], lag), second)), (velocity, acceleration)) in
            offset.iter_mut().zip(by_slide).zip(motion)
        {
            *offset -= px * dx + py * dy + pz * dz + lag * velocity + second * acceleration;
        }
    }

    /// Play and friction: by which way the slides travel.
    fn by_sense(&mut self, zone: &ZoneLaw, at: &Place, tick_s: f64, offset: &mut [f64; 3]) {
        let p = &zone.profile;
        let slides = p
            .play_m
            .iter()
            .zip(p.spike)
            .zip(at.sensed)
            .zip(&mut self.pulse);
        for (slide, (((play, spike), sensed), pulse)) in slides.enumerate() {
            for (offset, play) in offset.iter_mut().zip(play) {
                *offset += 0.5 * play * sensed.now;
            }
            if spike.peak_m != 0.0 {
                if sensed.began {
                    pulse.rise_m = spike.peak_m * sensed.heading - pulse.now_m;
                }
                pulse.now_m =
                    pulse.now_m * libm::exp(-tick_s / spike.decay_s) + pulse.rise_m * sensed.step;
                if let Some(offset) = offset.get_mut(slide) {
                    *offset += pulse.now_m;
                }
            }
        }
    }

    /// What only circles have: a constant offset outward, a bow counted from the centre.
    fn on_circles(&mut self, zone: &ZoneLaw, at: &Place, tick_s: f64, offset: &mut [f64; 3]) {
        let (share, outward, arm) = self.on_arc.tick(&at.turn, zone.radius_m, tick_s);
        let p = &zone.profile;
        for (offset, outward) in offset.iter_mut().zip(outward) {
            *offset -= share * p.radius_offset_m * outward;
        }
        for (arm, row) in arm.into_iter().zip(&p.bow_per_m) {
            for (offset, bow) in offset.iter_mut().zip(row) {
                *offset -= share * bow * arm * arm;
            }
        }
    }
}

/// Periodic errors of screws and gears.
fn by_place(zone: &ZoneLaw, at: &Place, offset: &mut [f64; 3]) {
    for cyclic in zone.profile.cyclic.iter().filter(|c| c.amplitude_m != 0.0) {
        let place = at.place_m.get(cyclic.slide).copied().unwrap_or(0.0);
        if let Some(offset) = offset.get_mut(cyclic.slide) {
            *offset -=
                cyclic.amplitude_m * libm::sin(TAU * place / cyclic.pitch_m + cyclic.phase_rad);
        }
    }
}
