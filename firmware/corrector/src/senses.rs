//! Which way each slide travels, from its place a little ahead of the one that is corrected.
//!
//! A reversal is seen half a take-up early, so that the middle of the smooth change falls on it.

/// A slide has turned when it has come back by so much, m: less is rounding.
const DEAD_M: f64 = 50e-9;

/// One slide.
#[derive(Clone, Copy, Debug, Default)]
struct Sense {
    /// 0 until the slide has moved, then ±1.
    heading: f64,
    /// Farthest place in that sense, m.
    extreme_m: f64,
    /// The sense that acts: on its way from `from` to `heading`.
    now: f64,
    from: f64,
    /// How much of the way is done, 0 to 1.
    done: f64,
}

/// All slides.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Senses([Sense; 3]);

/// One slide's sense in one tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sensed {
    /// −1 to 1.
    pub(crate) now: f64,
    /// What it is or turns to.
    pub(crate) heading: f64,
    /// A turn has begun in this tick.
    pub(crate) began: bool,
    /// Share of a turn that this tick does.
    pub(crate) step: f64,
}

/// Smoothstep of degree 5.
pub(crate) fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

impl Senses {
    pub(crate) const fn new() -> Self {
        let sense = Sense {
            heading: 0.0,
            extreme_m: 0.0,
            now: 0.0,
            from: 0.0,
            done: 1.0,
        };
        Self([sense; 3])
    }

    /// Forgets which way the slides went; they stand here, m.
    pub(crate) fn forget(&mut self, place_m: [f64; 3]) {
        *self = Self::new();
        for (sense, place) in self.0.iter_mut().zip(place_m) {
            sense.extreme_m = place;
        }
    }

    /// One tick; `ahead_m` are the slides' places a little later, `share` is what a tick is of a take-up.
    pub(crate) fn tick(&mut self, ahead_m: [f64; 3], share: f64) -> [Sensed; 3] {
        let mut sensed = [Sensed::default(); 3];
        for ((sense, sensed), ahead) in self.0.iter_mut().zip(&mut sensed).zip(ahead_m) {
            *sensed = sense.tick(ahead, share);
        }
        sensed
    }
}

impl Sense {
    fn tick(&mut self, ahead_m: f64, share: f64) -> Sensed {
        let way = ahead_m - self.extreme_m;
        if way * self.heading > 0.0 {
            self.extreme_m = ahead_m;
        } else if way.abs() > DEAD_M {
            self.heading = if way > 0.0 { 1.0 } else { -1.0 };
            (self.extreme_m, self.from, self.done) = (ahead_m, self.now, 0.0);
        }
        let began = self.done <= 0.0;
        let before = smooth(self.done);
        if self.done < 1.0 {
            self.done = (self.done + share).min(1.0);
            self.now = self.from + (self.heading - self.from) * smooth(self.done);
        }
        Sensed {
            now: self.now,
            heading: self.heading,
            began,
            step: smooth(self.done) - before,
        }
    }
}
