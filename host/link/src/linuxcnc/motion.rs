//! What the server asks of an engine, where the engine corrects the set-points of LinuxCNC.
use super::page::Page;
use giotto_corrector::handover::{state, verdict};
use giotto_firmware::engine::Config;
use giotto_firmware::server::{Motion, Snapshot, TimedSetPoint};
use giotto_shared::table::TableError;
use giotto_shared::wire::{
    ExactCircle, ExactSegment, MotionRefusal, MotionState, Pose, PositionState, Refusal, SetPoint,
};
use std::collections::VecDeque;
use std::io;
use std::time::{Duration, Instant};

/// LinuxCNC has ended if its ticks have stood still for so long.
const DEAD: Duration = Duration::from_secs(2);
/// Set-points kept for the link, at most.
const SET_POINTS: usize = 256;

/// The component, as an engine.
#[derive(Debug)]
pub(super) struct PageMotion {
    page: Page,
    /// The server has booted: from now on what it says goes to the component.
    armed: bool,
    every: u32,
    points: VecDeque<TimedSetPoint>,
    dropped: u32,
    seen: (u32, Instant),
    recorded: u32,
}

impl PageMotion {
    pub(super) fn new(page: Page) -> Self {
        Self {
            page,
            armed: false,
            every: 0,
            points: VecDeque::new(),
            dropped: 0,
            seen: (0, Instant::now()),
            recorded: 0,
        }
    }

    pub(super) fn arm(&mut self) {
        self.armed = true;
    }

    /// Whether LinuxCNC still runs; takes a set-point if one is wanted.
    pub(super) fn alive(&mut self) -> io::Result<()> {
        let words = self.page.words()?;
        if words.tick != self.seen.0 {
            self.seen = (words.tick, Instant::now());
        } else if self.seen.1.elapsed() > DEAD {
            return Err(io::Error::other("the ticks of LinuxCNC stand still"));
        }
        // Set-points are looked at, not counted: the clock of this program is not that of the machine.
        if self.every > 0 && words.tick.wrapping_sub(self.recorded) >= self.every {
            self.recorded = words.tick;
            if self.points.len() >= SET_POINTS {
                self.points.pop_front();
                self.dropped = self.dropped.wrapping_add(1);
            }
            self.points.push_back(TimedSetPoint {
                tick: words.tick,
                point: SetPoint {
                    raw_nm: words.raw_nm,
                    corrected_nm: words.corrected_nm,
                },
                last: false,
            });
        }
        Ok(())
    }
}

impl Motion for PageMotion {
    fn snapshot(&self) -> Snapshot {
        // A page that cannot be read shows as a machine at rest; the link then says that it is lost.
        let words = self.page.words().unwrap_or_default();
        Snapshot {
            state: if words.state & state::MOVING != 0 {
                MotionState::Running
            } else {
                MotionState::Idle
            },
            tick: words.tick,
            raw_nm: words.raw_nm,
            corrected_nm: words.corrected_nm,
            tick_overruns: 0,
            offset_clamps: words.offset_cuts,
            slew_clamps: words.slew_cuts,
            dropped_set_points: self.dropped,
            dropped_segments: 0,
            uncorrected_segments: 0,
            stops: words.resets,
            segments: 0,
            queued: 0,
            missing_set_points: 0,
            late_set_points: 0,
            rejected_set_points: 0,
            fault: None,
            stop_input: words.state & state::MACHINE_ON == 0,
            position: PositionState::Known,
            override_percent: 100,
        }
    }

    fn now(&self) -> u32 {
        self.page.words().map_or(0, |words| words.tick)
    }

    fn plans(&self) -> bool {
        false
    }

    fn install(&mut self, image: Option<&[u8]>) -> Result<(), Refusal> {
        let image = image.unwrap_or_default();
        let crc = giotto_corrector::handover::crc(image);
        if self.page.crc().is_ok_and(|in_use| in_use == crc) {
            return Ok(());
        }
        match self.page.offer(image) {
            Ok(Some(verdict::GOOD)) => Ok(()),
            Ok(Some(verdict::TERMS)) => Err(Refusal::Motion(MotionRefusal::Terms)),
            Ok(Some(_)) => Err(Refusal::Table(TableError::Malformed)),
            Ok(None) | Err(_) => Err(Refusal::Motion(MotionRefusal::Busy)),
        }
    }

    fn bypass(&mut self, on: bool) {
        if self.armed {
            // A page that is gone is noticed by the link.
            let _ = self.page.bypass(on);
        }
    }

    fn run_circle(&mut self, _: &ExactCircle) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn begin(&mut self) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn append(&mut self, _: &ExactSegment, _: u32) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn begin_stream(&mut self, _: f32, _: u16) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn points(&mut self, _: &[u8]) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn end(&mut self) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn stop(&mut self) {
        // As above.
        let _ = self.page.stop();
    }

    fn hold(&mut self) {}

    fn configure(&mut self, _: &Config) -> Result<(), MotionRefusal> {
        // Limits of the path are LinuxCNC's own; those of the correction are the table's.
        Ok(())
    }

    fn pause(&mut self, _: bool) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn set_override(&mut self, _: u8) {}

    fn clear_fault(&mut self) -> Result<(), MotionRefusal> {
        Ok(())
    }

    fn declare(&mut self, _: Pose) -> Result<(), MotionRefusal> {
        Err(MotionRefusal::PlannedElsewhere)
    }

    fn subscribe(&mut self, every: u16) {
        self.every = u32::from(every);
    }

    fn set_points_waiting(&self) -> usize {
        self.points.len()
    }

    fn next_set_point(&mut self) -> Option<TimedSetPoint> {
        self.points.pop_front()
    }
}
