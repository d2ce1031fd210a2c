//! What a path asks for against what it may, and how much longer its ramps have to be.

/// Bounds of a correction, SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) offset_m: f32,
    /// By axis.
    pub(super) slew_m_s: [f32; 3],
}

impl Bounds {
    /// Rate of change that the tightest of the axes allows which a path moves along; any of them, if it moves along none.
    fn slew_of(&self, moved: [bool; 3]) -> f32 {
        let all = moved == [false; 3];
        let axes = self.slew_m_s.iter().zip(moved);
        let least = |least: f32, (slew_m_s, moved): (&f32, bool)| {
            if moved || all {
                least.min(*slew_m_s)
            } else {
                least
            }
        };
        axes.fold(f32::INFINITY, least)
    }
}

/// The largest on a path, SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    pub(super) offset_m: f32,
    pub(super) slew_m_s: f32,
    pub(super) acceleration_m_s2: f32,
}

impl Demand {
    /// Offset and slew of their bounds on the axes that are moved, with a tenth to spare: 1 is just within both.
    pub(super) fn correction(&self, bounds: &Bounds, moved: [bool; 3]) -> f32 {
        1.1 * (self.offset_m / bounds.offset_m).max(self.slew_m_s / bounds.slew_of(moved))
    }

    /// Acceleration of its limit, with what a sweep over a ramp may miss to spare.
    pub(super) fn acceleration(&self, limit_m_s2: f32) -> f32 {
        self.acceleration_m_s2 / (0.985 * limit_m_s2)
    }
}

/// Longest ramp, of the quickest.
const LONGEST: f32 = 32.0;

/// The factor for a next try at a ramp that asks for so many times what it may; `None`: it will do, or nothing will.
pub(super) fn longer(stretch: f32, over: f32) -> Option<f32> {
    (over > 1.0 && stretch < LONGEST).then(|| stretch * (1.01 * libm::sqrtf(over)).clamp(1.01, 2.0))
}
