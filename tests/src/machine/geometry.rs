//! Errors that belong to the place: guides, scales, screws.

/// Position-dependent geometry of three slides.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Geometry {
    /// Relative scale error of X, Y and Z, m/m.
    pub scale: [f64; 3],
    /// Scale error with the sense of travel, m/m: a slide that runs back reads shorter than one that runs forth.
    pub sense_scale: [f64; 3],
    /// Squareness ε of the pairs XY, YZ, ZX: the first moves by `ε·second`, rad.
    pub squareness_rad: [f64; 3],
    /// Curvature of a guide: the place along the first index moves the slide of the second, 1/m.
    pub bow_per_m: [[f64; 3]; 3],
    /// Periodic error of each slide.
    pub cyclic: [Option<Cyclic>; 3],
}

/// `amplitude·sin(2π·position/pitch + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cyclic {
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Pitch, m.
    pub pitch_m: f64,
    /// Phase at the origin of the machine, rad.
    pub phase_rad: f64,
}

impl Geometry {
    /// Where the tool is when the scales read `p`, m.
    pub fn place(&self, p: [f64; 3]) -> [f64; 3] {
        let mut out = [0.0; 3];
        for k in 0..3 {
            let periodic = self.cyclic[k].map_or(0.0, |c| {
                c.amplitude_m * (2.0 * std::f64::consts::PI * p[k] / c.pitch_m + c.phase_rad).sin()
            });
            let next = (k + 1) % 3;
            let bent: f64 = (0..3).map(|j| self.bow_per_m[j][k] * p[j] * p[j]).sum();
            out[k] =
                p[k] * (1.0 + self.scale[k]) + self.squareness_rad[k] * p[next] + bent + periodic;
        }
        out
    }

    /// Where the tool is from the tool's place over the `centre`, when the scales read `centre + p`, m.
    pub fn from_centre(&self, centre: [f64; 3], p: [f64; 3]) -> [f64; 3] {
        let there = self.place([0, 1, 2].map(|k| centre[k] + p[k]));
        // The instrument is set up where the machine stands at the centre; at the origin only the screw's phase is
        // left of that, which a set-up offset takes up.
        if centre == [0.0; 3] {
            return there;
        }
        let here = self.place(centre);
        [0, 1, 2].map(|k| there[k] - here[k])
    }
}
