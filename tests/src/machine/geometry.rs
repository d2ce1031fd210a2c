//! Errors that belong to the place: guides, scales, screws.

/// Position-dependent geometry.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Geometry {
    /// Relative scale error of X and Y, m/m.
    pub scale: [f64; 2],
    /// Squareness ε: x error `ε·y`, rad.
    pub squareness_rad: f64,
    /// Curvature of the guide of X (moves y) and of Y (moves x), 1/m.
    pub bow_per_m: [f64; 2],
    /// Periodic error of each axis.
    pub cyclic: [Option<Cyclic>; 2],
}

/// `amplitude·sin(2π·position/pitch + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cyclic {
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Pitch, m.
    pub pitch_m: f64,
    /// Phase at the centre of the circle, rad.
    pub phase_rad: f64,
}

impl Geometry {
    /// Where the tool is when the scales read `p` (measured from the centre of the circle), m.
    pub fn place(&self, p: [f64; 2]) -> [f64; 2] {
        let periodic = |i: usize| {
            self.cyclic[i].map_or(0.0, |c| {
                c.amplitude_m * (2.0 * std::f64::consts::PI * p[i] / c.pitch_m + c.phase_rad).sin()
            })
        };
        [
            p[0] * (1.0 + self.scale[0])
                + self.squareness_rad * p[1]
                + self.bow_per_m[1] * p[1] * p[1]
                + periodic(0),
            p[1] * (1.0 + self.scale[1]) + self.bow_per_m[0] * p[0] * p[0] + periodic(1),
        ]
    }
}
