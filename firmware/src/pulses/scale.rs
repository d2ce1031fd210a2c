//! Steps and nanometres.

/// Most steps in a [`Scale`], and most nanometres: places times either stay far within 64 bits.
const MOST: u32 = giotto_shared::wire::STEP_MOST;

/// So many steps are so many nanometres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    nm: i64,
    steps: i64,
}

/// A scale that is none: a number that is 0 or above 2²⁰.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScaleError;

impl Scale {
    /// `steps` steps are `nm` nanometres: a screw of 5 mm, 200 steps and 16 of them to one is 3125 nm to 2 steps.
    ///
    /// # Errors
    /// Either is 0 or above 2²⁰; a smaller ratio that is the same serves.
    pub const fn new(nm: u32, steps: u32) -> Result<Self, ScaleError> {
        if nm == 0 || steps == 0 || nm > MOST || steps > MOST {
            return Err(ScaleError);
        }
        Ok(Self {
            nm: nm as i64,
            steps: steps as i64,
        })
    }

    /// The place after so many steps, nm, to the nearest; saturates.
    pub fn place_nm(&self, steps: i64) -> i32 {
        let twice = steps.saturating_mul(self.nm).saturating_mul(2);
        // Never by 0: a scale has at least a step.
        let nm = twice
            .saturating_add(self.steps)
            .checked_div_euclid(self.steps.saturating_mul(2))
            .unwrap_or(0);
        nm.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }

    /// The step nearest to a place.
    pub fn nearest(&self, place_nm: i32) -> i64 {
        let twice = i64::from(place_nm).wrapping_mul(self.steps).wrapping_mul(2);
        // Never by 0, as above.
        twice
            .wrapping_add(self.nm)
            .checked_div_euclid(self.nm.wrapping_mul(2))
            .unwrap_or(0)
    }

    /// A place in eighths of a step, times the nanometres of [`Self::eighth`].
    #[inline]
    pub(super) fn fine(&self, place_nm: i32) -> i64 {
        i64::from(place_nm).wrapping_mul(self.steps).wrapping_mul(8)
    }

    /// An eighth of a step in the same numbers.
    #[inline]
    pub(super) const fn eighth(&self) -> i64 {
        self.nm
    }

    /// Whether a speed on this axis, nm per tick, needs no more than so many steps a tick.
    pub fn allows(&self, nm_per_tick: u32, steps_per_tick: u32) -> bool {
        i64::from(nm_per_tick).wrapping_mul(self.steps)
            <= i64::from(steps_per_tick).wrapping_mul(self.nm)
    }
}
