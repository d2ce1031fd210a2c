//! What the ratio ρ = κ4/κ2² of a chain allows it to be.
//!
//! Every member with one parameter has its own ρ; members with two cover a range. Names are given by an interval
//! of ρ, never by its middle, and the simplest that fit are named: a single lag is also a feed-forward lag with a = 0.
use core::fmt;

/// A kind of chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// One lag, of the position loop or an exponential filter: ρ = 6.
    SingleLag,
    /// One moving average: ρ = −1.2.
    MovingAverage,
    /// Chords between set-points: ρ = −0.6.
    Chord,
    /// Lag with velocity feed-forward a: ρ = 6(1 + a²)/(1 − a²) > 6. Named from 6.5 (a > 0.2) upwards.
    FeedForwardLag,
    /// Second order (mechanics, or a loop with its drive): any ρ < 6. Named below −1.2, where nothing
    /// else of the table is, and wherever no member with one parameter fits.
    SecondOrder,
    /// Several lags and averages in series: −1.2 < ρ < 6. Named where no member with one parameter fits.
    Cascade,
}

impl Class {
    /// All classes, in the order of their names in output.
    pub const ALL: [Self; 6] = [
        Self::SingleLag,
        Self::MovingAverage,
        Self::Chord,
        Self::FeedForwardLag,
        Self::SecondOrder,
        Self::Cascade,
    ];

    /// Name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::SingleLag => "single_lag",
            Self::MovingAverage => "moving_average",
            Self::Chord => "chord",
            Self::FeedForwardLag => "feed_forward_lag",
            Self::SecondOrder => "second_order",
            Self::Cascade => "cascade",
        }
    }
}

const LAG: f64 = 6.0;
const MOVING_AVERAGE: f64 = -1.2;
const CHORD: f64 = -0.6;
const FEED_FORWARD_FROM: f64 = 6.5;

/// The classes that an interval of ρ allows.
///
/// ```
/// use giotto_shared::model::{Class, Classes};
///
/// // An interval of κ4/κ2² about 6 is a single lag and nothing else.
/// let classes = Classes::of_interval(5.6, 6.3);
/// assert!(classes.contains(Class::SingleLag));
/// assert_eq!(classes.iter().count(), 1);
/// // An interval that is as wide as the table tells nothing.
/// assert!(Classes::of_interval(-100.0, 100.0).is_any());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Classes([bool; Class::ALL.len()]);

impl Classes {
    /// Classes for ρ between `low` and `high`; infinities are allowed. An interval that is not one (NaN, or
    /// low > high) tells nothing: all classes.
    pub fn of_interval(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() || low > high {
            return Self([true; Class::ALL.len()]);
        }
        let covers = |value: f64| (low..=high).contains(&value);
        let mut of = [false; Class::ALL.len()];
        of[Class::SingleLag as usize] = covers(LAG);
        of[Class::MovingAverage as usize] = covers(MOVING_AVERAGE);
        of[Class::Chord as usize] = covers(CHORD);
        of[Class::FeedForwardLag as usize] = high > FEED_FORWARD_FROM || low > LAG;
        of[Class::SecondOrder as usize] = low < MOVING_AVERAGE;
        if !of.contains(&true) {
            of[Class::SecondOrder as usize] = true;
            of[Class::Cascade as usize] = true;
        }
        Self(of)
    }

    /// Whether `class` is possible.
    pub fn contains(&self, class: Class) -> bool {
        self.0[class as usize]
    }

    /// The possible classes.
    pub fn iter(&self) -> impl Iterator<Item = Class> + '_ {
        Class::ALL.into_iter().filter(|class| self.contains(*class))
    }

    /// Whether the interval rules out nothing: it reaches from below a moving average to above a lag.
    pub fn is_any(&self) -> bool {
        Class::ALL
            .into_iter()
            .filter(|class| *class != Class::Cascade)
            .all(|class| self.contains(class))
    }
}

impl fmt::Display for Classes {
    /// `any`, or the names joined by ` or `.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_any() {
            return f.write_str("any");
        }
        for (i, class) in self.iter().enumerate() {
            write!(f, "{}{}", if i == 0 { "" } else { " or " }, class.name())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn an_interval_names_all_it_covers_and_nothing_else() {
        for (low, high, words) in [
            (5.0, 6.4, "single_lag"),
            (5.0, 9.0, "single_lag or feed_forward_lag"),
            (6.1, 6.2, "feed_forward_lag"),
            (-1.3, -1.1, "moving_average or second_order"),
            (-0.7, -0.5, "chord"),
            (-1.1, 6.1, "single_lag or chord"),
            (-2600.0, -2500.0, "second_order"),
            (1.0, 4.0, "second_order or cascade"),
            (-100.0, 100.0, "any"),
            (f64::NEG_INFINITY, f64::INFINITY, "any"),
            (f64::NAN, 1.0, "any"),
            (2.0, 1.0, "any"),
        ] {
            assert_eq!(
                Classes::of_interval(low, high).to_string(),
                words,
                "{low} {high}"
            );
        }
    }
}
