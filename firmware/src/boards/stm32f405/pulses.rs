//! Step and direction of three axes on port B. The pattern that a tick makes is played in the next one without the core: TIM1 asks
//! for a word in each slot, and a stream of DMA2 brings it from memory to the port (RM0090 10.3, table 43: TIM1_UP is stream 5,
//! channel 6), from one of two buffers while the tick fills the other.
//!
//! | pin | line |
//! |---|---|
//! | PB13 (SCK), PB15 (MOSI) | step and direction of X |
//! | PB14 (MISO), PB9 (D10) | of Y |
//! | PB8 (D9), PB7 (SDA) | of Z |
//!
//! From a set-point to the end of its pulses: **two ticks, always** (one in which it is made, one in which it is played). With a
//! dead crystal there are no pulses: 16 MHz have no whole number of cycles in a slot.
//!
//! **Never run on a real board**; QEMU has neither TIM1's requests nor this stream.
use super::register::Register;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use giotto_firmware::pulses::{Pattern, SLOTS, Scale, Stepper, TooFast, Widths};
use giotto_shared::wire::{ConfigField, MachineConfig};

/// A step is so many nanometres, on each axis, unless others are stored: a belt of 40 mm a turn and 1600 steps, which is good for
/// 1.475 m/s.
pub const STEP: [u32; 2] = [25_000, 1];
/// What the drives ask of the lines, in slots of 8.3 µs.
const WIDTHS: Widths = Widths::SHORTEST;
/// Pins of step and direction, in the order of the bits of a [`Pattern`].
const PINS: [u32; 6] = [13, 15, 14, 9, 8, 7];

const GPIOB: usize = 0x4002_0400;
const MODE: Register = Register::at(GPIOB, 0x00);
const SPEED: Register = Register::at(GPIOB, 0x08);
/// Sets pins by its lower half, resets them by its upper one.
const SET_RESET: usize = 0x18;

const TIM1: usize = 0x4001_0000;
const TIM_CONTROL: Register = Register::at(TIM1, 0x00);
const TIM_REQUESTS: Register = Register::at(TIM1, 0x0c);
const TIM_RELOAD: Register = Register::at(TIM1, 0x2c);

const DMA2: usize = 0x4002_6400;
const STREAM: usize = 0x10 + 0x18 * 5;
const DMA_CONTROL: Register = Register::at(DMA2, STREAM);
const DMA_COUNT: Register = Register::at(DMA2, STREAM + 0x04);
const DMA_PORT: Register = Register::at(DMA2, STREAM + 0x08);
const DMA_FIRST: Register = Register::at(DMA2, STREAM + 0x0c);
const DMA_SECOND: Register = Register::at(DMA2, STREAM + 0x10);

const ENABLE: u32 = 1;
/// Channel 6, highest priority, words on both sides, memory counts up, two buffers, memory to port.
const DMA_MODE: u32 = 6 << 25 | 0b11 << 16 | 0b10 << 13 | 0b10 << 11 | 1 << 10 | 1 << 18 | 1 << 6;
/// The second buffer is the one that is played.
const SECOND_PLAYS: u32 = 1 << 19;

/// What is played, and what the tick fills.
static BUFFERS: [[AtomicU32; SLOTS]; 2] = [const { [const { AtomicU32::new(0) }; SLOTS] }; 2];

/// The port's word for the levels of all lines.
const fn word(levels: u8) -> u32 {
    let (mut word, mut bit) = (0, 0);
    while bit < PINS.len() {
        let reset = if levels >> bit & 1 == 1 { 0 } else { 16 };
        word |= 1 << (PINS[bit] + reset);
        bit += 1;
    }
    word
}

const WORDS: [u32; 64] = {
    let mut words = [0; 64];
    let mut levels = 0;
    while levels < words.len() {
        words[levels] = word(levels as u8);
        levels += 1;
    }
    words
};

/// Fastest tick with pulses: some 5000 instructions each, a tenth of the core's time.
const FASTEST_HZ: u32 = 4000;

/// Whether pulses can follow these limits: slots are whole cycles of the crystal's 168 MHz, and in no tick an axis needs more steps
/// than there is room for, less one.
pub fn bears(limits: &MachineConfig) -> Result<(), ConfigField> {
    let hz = limits.tick_hz;
    let slots_hz = hz.saturating_mul(SLOTS as u32);
    if hz == 0 || hz > FASTEST_HZ || !super::clock::CORE_HZ.is_multiple_of(slots_hz) {
        return Err(ConfigField::Rate);
    }
    let steps = (WIDTHS.most_per_tick() - 1) as f32 * hz as f32;
    for ([nm, of], slew_m_s) in limits.step.into_iter().zip(limits.slew_m_s) {
        Scale::new(nm, of).map_err(|_| ConfigField::Step)?;
        let fastest_m_s = steps * nm as f32 * 1e-9 / of as f32;
        let fits = limits.feed_m_s + slew_m_s <= fastest_m_s;
        // Not a number does not.
        if !fits {
            return Err(ConfigField::Feed);
        }
    }
    Ok(())
}

fn fill(buffer: &[AtomicU32; SLOTS], pattern: &Pattern) {
    for (slot, levels) in buffer.iter().zip(pattern) {
        let word = WORDS.get(usize::from(*levels)).copied().unwrap_or(0);
        slot.store(word, Relaxed);
    }
}

/// The pulses, in the tick's hands.
pub struct Pulses {
    stepper: Stepper,
    scales: [Scale; 3],
    pattern: Pattern,
    began: bool,
}

impl Pulses {
    /// At rest at a place; `None` if slots are no whole number of cycles.
    pub fn new(core_hz: u32, limits: &MachineConfig, place_nm: [i32; 3]) -> Option<Self> {
        let tick_hz = limits.tick_hz;
        let slots_hz = tick_hz.checked_mul(SLOTS as u32)?;
        if !core_hz.is_multiple_of(slots_hz) {
            return None;
        }
        let [x, y, z] = limits.step.map(|[nm, steps]| Scale::new(nm, steps).ok());
        let scales = [x?, y?, z?];
        let stepper = Stepper::new(scales, WIDTHS, place_nm);
        for pin in PINS {
            SPEED.change(0b11 << (2 * pin), 0b01 << (2 * pin));
            MODE.change(0b11 << (2 * pin), 0b01 << (2 * pin));
        }
        // APB2's timers run at the core's clock where its bus runs at half of it.
        TIM_RELOAD.set(core_hz / slots_hz - 1);
        Some(Self {
            stepper,
            scales,
            pattern: [0; SLOTS],
            began: false,
        })
    }

    /// Both buffers hold the levels of rest: from now on slots pass.
    fn begin(&mut self) {
        let address = |buffer: &[AtomicU32; SLOTS]| (&raw const *buffer) as u32;
        let [first, second] = &BUFFERS;
        DMA_PORT.set((GPIOB + SET_RESET) as u32);
        DMA_FIRST.set(address(first));
        DMA_SECOND.set(address(second));
        DMA_COUNT.set(SLOTS as u32);
        DMA_CONTROL.set(DMA_MODE);
        DMA_CONTROL.change(0, ENABLE);
        TIM_REQUESTS.set(1 << 8);
        TIM_CONTROL.change(0, ENABLE);
        self.began = true;
    }

    /// In each tick: the way to its set-point, played in the next one. `placed`: it is no way, the machine was said to stand there.
    pub fn tick(&mut self, to_nm: [i32; 3], placed: bool) -> Result<(), TooFast> {
        if placed {
            self.stepper = Stepper::new(self.scales, WIDTHS, to_nm);
        }
        self.stepper.tick(to_nm, &mut self.pattern)?;
        let [first, second] = &BUFFERS;
        if !self.began {
            fill(first, &self.pattern);
            fill(second, &self.pattern);
            self.begin();
            return Ok(());
        }
        let plays = DMA_CONTROL.get() & SECOND_PLAYS != 0;
        fill(if plays { first } else { second }, &self.pattern);
        Ok(())
    }
}
