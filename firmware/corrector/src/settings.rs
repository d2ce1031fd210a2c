//! What a corrector is told once, before its first tick.

/// Most joints.
pub const JOINTS: usize = 9;
/// Shortest and longest period of a tick, s: servo threads, and the doors of robots (path correction takes one place in 48 ms).
pub const PERIOD_S: [f64; 2] = [250.0e-6, 50.0e-3];

/// Numbers and places that do not change while it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Joints in use, 2 to [`JOINTS`].
    pub(crate) joints: usize,
    /// The slide that each joint moves (0 X, 1 Y, 2 Z); `None`: it is delayed with the others and not corrected.
    pub(crate) slide: [Option<usize>; JOINTS],
    /// The first joint of each slide.
    pub(crate) joint: [Option<usize>; 3],
    /// Machine units in a metre.
    pub(crate) units_per_m: f64,
    /// Distance of the set-points that are differentiated with, s; the latency is twice that.
    pub(crate) window_s: f64,
    /// Time of a change from one correction to another, s.
    pub(crate) engage_s: f64,
    /// Time in which play is taken up at a reversal, s.
    pub(crate) take_up_s: f64,
    /// `Some`: set-points pass undelayed, and the offset is that of the place so long after the newest one, s.
    pub(crate) lead_s: Option<f64>,
}

/// Why settings cannot be used: the name of the first that is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettingsError(pub &'static str);

impl Settings {
    /// For a corrector that is told its settings later.
    pub const UNUSED: Self = Self {
        joints: 2,
        slide: [None; JOINTS],
        joint: [None; 3],
        units_per_m: 1e3,
        window_s: 0.015,
        engage_s: 0.5,
        take_up_s: 0.008,
        lead_s: None,
    };

    /// Settings for joints that move these axes: a letter a joint, as LinuxCNC's `coordinates` (`XYZ`, `XZ`, `XYYZ`).
    ///
    /// # Errors
    /// Fewer than 2 or more than [`JOINTS`] joints, a letter that is no axis, units that are not positive.
    pub fn new(joints: usize, coordinates: &str, units_per_mm: f64) -> Result<Self, SettingsError> {
        if !(2..=JOINTS).contains(&joints) {
            return Err(SettingsError("joints"));
        }
        if !(units_per_mm > 0.0 && units_per_mm.is_finite()) {
            return Err(SettingsError("units_per_mm"));
        }
        let mut settings = Self {
            joints,
            units_per_m: units_per_mm * 1e3,
            ..Self::UNUSED
        };
        let letters = coordinates
            .bytes()
            .filter(|letter| !letter.is_ascii_whitespace());
        let mut count = 0;
        for (joint, letter) in letters.enumerate() {
            let slide = match letter.to_ascii_uppercase() {
                b'X' => Some(0),
                b'Y' => Some(1),
                b'Z' => Some(2),
                b'A' | b'B' | b'C' | b'U' | b'V' | b'W' => None,
                _ => return Err(SettingsError("coordinates")),
            };
            count = joint.saturating_add(1);
            if joint >= joints {
                // The default names more axes than a small machine has.
                break;
            }
            if let Some(of) = settings.slide.get_mut(joint) {
                *of = slide;
            }
            if let Some(first) = slide.and_then(|slide| settings.joint.get_mut(slide)) {
                *first = first.or(Some(joint));
            }
        }
        if count < joints {
            return Err(SettingsError("coordinates"));
        }
        Ok(settings)
    }

    /// Other distance of the set-points that are differentiated with, s; the latency is twice that.
    ///
    /// # Errors
    /// Not within 1 ms and 0.1 s.
    pub fn with_window(self, window_s: f64) -> Result<Self, SettingsError> {
        if (1e-3..=0.1).contains(&window_s) {
            Ok(Self { window_s, ..self })
        } else {
            Err(SettingsError("window_ms"))
        }
    }

    /// For a controller that adds the offset to a path of its own, `lead_s` after it has sent the place: nothing is delayed, and
    /// the offset is the one of the place ahead. The path is taken to go on along its circle or line until then; where one
    /// begins or ends the offset is late by `lead_s` and twice the window.
    ///
    /// # Errors
    /// Not within 0 and 0.5 s.
    pub fn with_lead(self, lead_s: f64) -> Result<Self, SettingsError> {
        if (0.0..=0.5).contains(&lead_s) {
            Ok(Self {
                lead_s: Some(lead_s),
                ..self
            })
        } else {
            Err(SettingsError("lead_s"))
        }
    }

    /// Joints in use.
    pub const fn joints(&self) -> usize {
        self.joints
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_name_the_slides_and_the_first_joint_of_each() {
        let gantry = Settings::new(4, "xyyz", 1.0).unwrap();
        assert_eq!(gantry.joint, [Some(0), Some(1), Some(3)]);
        assert_eq!(
            gantry.slide[..5],
            [Some(0), Some(1), Some(1), Some(2), None]
        );
        let lathe = Settings::new(2, "X Z", 1.0).unwrap();
        assert_eq!(lathe.joint, [Some(0), None, Some(1)]);
        let five = Settings::new(5, "XYZABCUVW", 1.0).unwrap();
        assert_eq!(five.slide[3..5], [None, None]);
        for (joints, letters, units, name) in [
            (1, "XYZ", 1.0, "joints"),
            (10, "XYZABCUVW", 1.0, "joints"),
            (3, "XY", 1.0, "coordinates"),
            (3, "XYQ", 1.0, "coordinates"),
            (3, "XYZ", 0.0, "units_per_mm"),
            (3, "XYZ", f64::NAN, "units_per_mm"),
        ] {
            assert_eq!(
                Settings::new(joints, letters, units),
                Err(SettingsError(name))
            );
        }
    }
}
