//! The circle to program so that the machine makes the wanted one.
use super::chain::Response;
use super::steps::{Meeting, Step, Steps};
use super::{Keep, Left, Options};
use giotto::model_file::{ModelFile, Servo};
use giotto_shared::model::RadiusModel;

/// The inverse of a model's radius law and where it may be used.
#[derive(Debug)]
pub(super) struct Inverse {
    servo: Servo,
    keep: Keep,
    /// Largest angular rate that the fit has seen, rad/s.
    omega_max: f64,
    max_offset_mm: f64,
    steps: Steps,
}

/// A circle to program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Twin {
    /// Change of the radius, mm.
    pub(super) delta_mm: f64,
    /// Factor on the feed.
    pub(super) feed_factor: f64,
}

/// The law holds by ω, so that the largest ω of the fit bounds it; a little more is rounding of the file.
const OMEGA_MARGIN: f64 = 1.001;
/// Largest share of the radius that a correction may take.
const MAX_SHARE: f64 = 0.1;

impl Inverse {
    pub(super) fn new(model: &ModelFile, options: &Options) -> Self {
        Self {
            servo: model.servo,
            keep: options.keep,
            omega_max: OMEGA_MARGIN * model.valid.feed_mm_s[1] / model.valid.radius_mm[0],
            max_offset_mm: options.max_offset_mm,
            steps: Steps::new(Response::of(&model.servo), options),
        }
    }

    /// The step of a correction at a joint; see [`Steps::step`].
    pub(super) fn step(&self, meeting: &Meeting) -> Step {
        self.steps.step(meeting)
    }

    /// Circle to program for a wanted one of radius and feed in mm and mm/s.
    pub(super) fn twin(&self, radius_mm: f64, feed_mm_s: f64) -> Result<Twin, Left> {
        let omega = feed_mm_s / radius_mm;
        let (r, f) = (radius_mm * 1e-3, feed_mm_s * 1e-3);
        let solved = match (self.servo, self.servo.element()) {
            (
                Servo::Beta {
                    beta1_s2, beta2_s4, ..
                },
                _,
            ) => {
                let law = RadiusModel { beta1_s2, beta2_s4 };
                let programmed = match self.keep {
                    Keep::Omega => law.inverse_keeping_omega(r, f),
                    Keep::Feed => law.inverse_keeping_feed(r, f),
                };
                programmed.ok().map(|p| p.radius_m)
            }
            (_, Some(element)) => match self.keep {
                Keep::Omega => Some(r / element.gain(omega)),
                Keep::Feed => keeping_feed(r, f, |w| element.gain(w)),
            },
            (_, None) => None,
        };
        let radius = solved
            .filter(|r| r.is_finite() && *r > 0.0)
            .ok_or(Left::NoInverse)?;
        let delta_mm = radius * 1e3 - radius_mm;
        if delta_mm == 0.0 {
            return Ok(Twin {
                delta_mm,
                feed_factor: 1.0,
            });
        }
        if omega > self.omega_max {
            return Err(Left::BeyondModel);
        }
        if delta_mm.abs() > self.max_offset_mm.min(MAX_SHARE * radius_mm) {
            return Err(Left::OffsetTooLarge);
        }
        let feed_factor = if self.keep == Keep::Omega {
            radius * 1e3 / radius_mm
        } else {
            1.0
        };
        Ok(Twin {
            delta_mm,
            feed_factor,
        })
    }
}

/// Solves Rp·|G(f/Rp)| = R by the secant method; the correction is small, so that it converges in a few steps.
fn keeping_feed(r: f64, f: f64, gain: impl Fn(f64) -> f64) -> Option<f64> {
    let miss = |p: f64| p * gain(f / p) - r;
    let (mut a, mut b) = (r, r / gain(f / r));
    for _ in 0..60 {
        let (ma, mb) = (miss(a), miss(b));
        if mb.abs() <= 1e-15 * r || ma == mb {
            break;
        }
        (a, b) = (b, b - mb * (b - a) / (mb - ma));
    }
    (miss(b).abs() <= 1e-12 * r).then_some(b)
}
