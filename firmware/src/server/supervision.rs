//! Whether the host is still there. A run outlives its host by the segment in hand, and not for long: if nothing was heard
//! for a while nothing else starts, and what has not come to its end a little later is stopped within limits.
use giotto_shared::wire::{MotionState, SUPERVISE_MS};

/// When the host was heard, and how long it may be silent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supervision {
    tick_hz: u32,
    /// Ticks of silence allowed; 0: any.
    allowed: u32,
    heard_at: u32,
    /// The silence under way has been dealt with.
    dead: bool,
    losses: u32,
    /// Tick by which what runs has to be at its end.
    ends_at: Option<u32>,
}

/// So long the segment in hand may go on after its host was taken for dead: with the silence before and the way to rest it is
/// at rest 5 s after the last word of its host.
const GRACE_MS: u32 = 2000;

impl Supervision {
    pub(super) const fn new(tick_hz: u32) -> Self {
        let mut new = Self {
            tick_hz,
            allowed: 0,
            heard_at: 0,
            dead: false,
            losses: 0,
            ends_at: None,
        };
        new.set(SUPERVISE_MS);
        new
    }

    pub(super) const fn set(&mut self, after_ms: u16) {
        self.allowed = (self.tick_hz as u64 * after_ms as u64 / 1000) as u32;
    }

    pub(super) const fn losses(&self) -> u32 {
        self.losses
    }

    /// A request came at this tick.
    pub(super) const fn heard(&mut self, tick: u32) {
        self.heard_at = tick;
        self.dead = false;
        self.ends_at = None;
    }

    /// Whether the host has been silent for too long, and that has not been dealt with.
    #[inline]
    pub(super) const fn silent(&self, now: u32) -> bool {
        !self.dead && self.allowed > 0 && now.wrapping_sub(self.heard_at) >= self.allowed
    }

    /// Whether the link has died, now that the host has been silent: only what runs can be left alone.
    pub(super) const fn dead(&mut self, state: MotionState, now: u32) -> bool {
        if !matches!(state, MotionState::Running | MotionState::Paused) {
            return false;
        }
        self.dead = true;
        let grace = self.tick_hz as u64 * GRACE_MS as u64 / 1000;
        self.ends_at = Some(now.wrapping_add(grace as u32));
        self.losses = self.losses.wrapping_add(1);
        true
    }

    /// Whether what outlives its host has had its time; said once.
    #[inline]
    pub(super) fn overdue(&mut self, now: u32) -> bool {
        let over = self
            .ends_at
            .is_some_and(|ends_at| now.wrapping_sub(ends_at) as i32 >= 0);
        if over {
            self.ends_at = None;
        }
        over
    }
}
