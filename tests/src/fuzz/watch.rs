//! What must hold of set-points whatever a controller was asked: nothing jumps, nothing turns harder than the machine may.
use giotto_firmware::engine::Output;

/// Ticks a second of the controller that is watched.
const RATE_HZ: f64 = super::bench::TICK_HZ as f64;
/// The machine's: feed, which set-points of a stream may pass by a twentieth, and rate of the offset, m/s.
const FEED_M_S: f64 = 1.05;
const SLEW_M_S: f64 = 0.2;
/// The machine's acceleration, m/s², and what single precision and the length of a tick add.
const ACCELERATION_M_S2: f64 = 5.0 * 1.03;
/// A circle keeps its feed, whose centripetal acceleration comes on top of that along the path, m/s².
pub const CENTRIPETAL_M_S2: f64 = 5.0;
/// Of a second difference of whole nanometres.
const ROUNDING_NM: f64 = 6.0;
/// A host that says nothing for so long is not followed any further.
const DEAD_S: f64 = 5.0;
/// So long after a stop everything stands: the longest ramp there is, and the memory of a stream.
const STOPPED_S: f64 = 3.0;

fn size(v: [f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn apart(a: [i32; 3], b: [i32; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| f64::from(a[axis]) - f64::from(b[axis]))
}

/// Looks at each set-point.
#[derive(Default)]
pub struct Watch {
    last: Option<Output>,
    /// Programmed step that led to it, nm.
    step_nm: [f64; 3],
    /// What runs is a circle.
    pub circle: bool,
    /// Ticks since the host was heard, and since it asked for a stop.
    silent: u32,
    stopped: Option<u32>,
    /// Requests and ticks so far.
    pub counted: u64,
}

impl Watch {
    /// A request was sent.
    pub fn heard(&mut self) {
        self.counted += 1;
        self.silent = 0;
    }

    /// A stop was asked for, or something new was accepted.
    pub fn stops(&mut self, stops: bool) {
        self.stopped = stops.then_some(0);
    }

    /// The machine is said to stand elsewhere.
    pub fn elsewhere(&mut self) {
        (self.last, self.step_nm) = (None, [0.0; 3]);
    }

    /// After a reset what was commanded last is what is programmed.
    pub fn restarted(&mut self) {
        self.step_nm = [0.0; 3];
        if let Some(last) = &mut self.last {
            last.nominal_nm = last.corrected_nm;
        }
    }

    /// The next set-point.
    pub fn look(&mut self, output: &Output) {
        self.counted += 1;
        let Some(last) = self.last.replace(*output) else {
            return;
        };
        let most_nm = (FEED_M_S + SLEW_M_S) / RATE_HZ * 1e9 + ROUNDING_NM;
        for way_nm in apart(output.corrected_nm, last.corrected_nm) {
            assert!(way_nm.abs() <= most_nm, "a jump: {last:?} to {output:?}");
        }
        let step_nm = apart(output.nominal_nm, last.nominal_nm);
        let change_nm = [0, 1, 2].map(|axis| step_nm[axis] - self.step_nm[axis]);
        self.step_nm = step_nm;
        let across = if self.circle { CENTRIPETAL_M_S2 } else { 0.0 };
        let most = ACCELERATION_M_S2.hypot(across) / (RATE_HZ * RATE_HZ) * 1e9 + ROUNDING_NM;
        assert!(
            size(change_nm) <= most,
            "{} of {most} nm: {last:?} to {output:?}, after a step of {step_nm:?}",
            size(change_nm)
        );
        let moves = size(step_nm) > 0.0;
        self.silent = self.silent.saturating_add(1);
        assert!(
            !moves || f64::from(self.silent) <= DEAD_S * RATE_HZ,
            "it moves though nobody was heard for {DEAD_S} s"
        );
        if let Some(ticks) = &mut self.stopped {
            *ticks = ticks.saturating_add(1);
            assert!(
                !moves || f64::from(*ticks) <= STOPPED_S * RATE_HZ,
                "it moves {STOPPED_S} s after it was stopped"
            );
        }
    }
}
