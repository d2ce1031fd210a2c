//! Lost motion and sideways play: errors that remember where the axis came from.

/// Play operator: the table is dragged along by a motor with `gap_m` of free travel.
#[derive(Clone, Copy, Debug)]
pub struct Play {
    half_m: f64,
    table_m: f64,
}

impl Play {
    /// Table in the middle of the gap at `position_m`.
    pub fn new(gap_m: f64, position_m: f64) -> Self {
        Self {
            half_m: gap_m / 2.0,
            table_m: position_m,
        }
    }

    /// Table position for the motor position `motor_m`.
    pub fn step(&mut self, motor_m: f64) -> f64 {
        self.table_m = self
            .table_m
            .clamp(motor_m - self.half_m, motor_m + self.half_m);
        self.table_m
    }
}

/// A state in −1…1 that follows the sense of travel over a short distance.
#[derive(Clone, Copy, Debug)]
pub struct Sense {
    per_m: f64,
    state: f64,
}

impl Sense {
    /// Changes over in `travel_m`.
    pub fn new(travel_m: f64) -> Self {
        Self {
            per_m: 2.0 / travel_m,
            state: 0.0,
        }
    }

    /// After moving by `travel_m` more.
    pub fn step(&mut self, travel_m: f64) -> f64 {
        self.state = (self.state + travel_m * self.per_m).clamp(-1.0, 1.0);
        self.state
    }
}
