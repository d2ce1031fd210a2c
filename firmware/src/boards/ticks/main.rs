//! Counts the instructions of one engine tick on QEMU's mps2-an386, for `giotto-hil ticks`.
//!
//! Run with `-icount shift=10`: an instruction lasts 1024 ns, SysTick counts 40 ns, so a difference of SysTick values
//! is a count of instructions. What is counted is the call of the tick as the image makes it, compute only: no
//! interrupt entry, no ports; `interrupt` is all that the handler of a board does. UART0 says one line a case, `NAME MIN MAX`, and `end`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: build it for thumbv7em-none-eabihf");
}

#[cfg(target_os = "none")]
mod image {
    use core::fmt::{self, Write};
    use core::hint::black_box;
    use core::ptr;
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m_rt::entry;
    use defmt as _;
    use giotto_firmware::control::Shared;
    use giotto_firmware::control::bench::{self, Interrupt};
    use giotto_firmware::engine::bench::{Arc, DEAREST, Libm, Plain, Streamed, TERMS, Turning};
    use giotto_firmware::engine::flag;
    use giotto_shared::term::Term;

    /// How far a helix rises, m.
    const HELIX_M: f64 = 0.02;

    /// Nothing logs here.
    #[defmt::global_logger]
    struct Silence;
    // SAFETY: it keeps nothing, so nothing can mix.
    #[allow(unsafe_code, reason = "defmt asks for it")]
    unsafe impl defmt::Logger for Silence {
        fn acquire() {}
        unsafe fn flush() {}
        unsafe fn release() {}
        unsafe fn write(_: &[u8]) {}
    }

    extern "C" fn unexpected() {
        cortex_m::asm::udf();
    }

    /// No interrupt is enabled.
    #[allow(
        unsafe_code,
        reason = "the linker script of cortex-m-rt looks for this name and section"
    )]
    #[unsafe(link_section = ".vector_table.interrupts")]
    #[unsafe(no_mangle)]
    pub static __INTERRUPTS: [extern "C" fn(); 1] = [unexpected];

    /// UART0 (CMSDK): data, and control with its transmitter enabled.
    struct Uart;

    impl Uart {
        fn start() -> Self {
            Self::set(0x4000_4010, 54);
            Self::set(0x4000_4008, 1);
            Self
        }

        /// Bit 0: the transmitter is full.
        fn state() -> u32 {
            // SAFETY: a register of UART0; reading it changes nothing.
            #[allow(unsafe_code, reason = "registers")]
            unsafe {
                ptr::read_volatile(0x4000_4004 as *const u32)
            }
        }

        fn set(address: usize, value: u32) {
            // SAFETY: a register of UART0; it has no effect on memory.
            #[allow(unsafe_code, reason = "registers")]
            unsafe {
                ptr::write_volatile(address as *mut u32, value);
            }
        }
    }

    impl Write for Uart {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            for byte in text.bytes() {
                while Self::state() & 1 != 0 {}
                Self::set(0x4000_4000, u32::from(byte));
            }
            Ok(())
        }
    }

    /// Instructions between two readings of SysTick, which counts down in 24 bits.
    fn between(before: u32, after: u32) -> u32 {
        let counts = before.wrapping_sub(after) & 0x00ff_ffff;
        (counts * 40 + 512) / 1024
    }

    /// Smallest and largest count.
    struct Range(u32, u32);

    impl Range {
        const NONE: Self = Self(u32::MAX, 0);

        fn add(&mut self, count: u32) {
            self.0 = self.0.min(count);
            self.1 = self.1.max(count);
        }
    }

    fn say(name: &str, range: &Range) {
        // A UART that takes any byte cannot fail.
        let _ = writeln!(Uart, "{name} {} {}", range.0, range.1);
    }

    /// What it costs to measure nothing.
    fn overhead() -> u32 {
        let mut least = u32::MAX;
        for _ in 0..8 {
            let before = SYST::get_current();
            least = least.min(between(before, SYST::get_current()));
        }
        least
    }

    /// From rest to rest. All ticks under way, and those at constant feed.
    fn arc(terms: &[Term<f32>], rise_m: f64, floor: u32) -> Option<[Range; 2]> {
        run(Arc::new(terms, rise_m), floor)
    }

    fn run(mut arc: Arc, floor: u32) -> Option<[Range; 2]> {
        let mut ranges = [Range::NONE, Range::NONE];
        while !arc.done() {
            let before = SYST::get_current();
            let output = arc.tick();
            let count = between(before, SYST::get_current()).saturating_sub(floor);
            if output.flags & flag::MOVING != 0 {
                ranges[0].add(count);
            }
            if output.flags & flag::CRUISE != 0 {
                ranges[1].add(count);
            }
        }
        arc.sound().then_some(ranges)
    }

    /// Of so many ticks in a ramp one has a run that is stopped in it.
    const STOP_EVERY: u32 = 3;

    /// Ticks of runs from rest to rest, each set-point recorded.
    struct Interrupts {
        /// All but those below.
        all: Range,
        /// Those of them under way.
        moving: Range,
        /// In which a stop begins in a ramp: one a run.
        begins: Range,
        /// After that, to rest.
        stopping: Range,
    }

    impl Interrupts {
        /// One run, stopped before the ramp tick of this number; whether there was one.
        fn run(
            &mut self,
            floor: u32,
            stop_at: u32,
            segments: &mut bench::Segments,
            points: &mut bench::Points,
        ) -> Option<bool> {
            let shared = Shared::new();
            let mut interrupt = Interrupt::new(HELIX_M, &shared, segments, points)?;
            let (mut ramps, mut stopped) = (0_u32, false);
            loop {
                let begins = !stopped && ramps == stop_at;
                stopped |= begins;
                let before = SYST::get_current();
                let output = black_box(interrupt.run(black_box(stopped), black_box(false)));
                let count = between(before, SYST::get_current()).saturating_sub(floor);
                let moving = output.flags & flag::MOVING != 0;
                if begins {
                    self.begins.add(count);
                } else if stopped {
                    self.stopping.add(count);
                } else {
                    self.all.add(count);
                    if moving {
                        self.moving.add(count);
                    }
                }
                let ramp = moving && output.flags & flag::CRUISE == 0;
                ramps = ramps.wrapping_add(u32::from(ramp));
                if !interrupt.drain() {
                    return Some(stopped);
                }
            }
        }
    }

    /// A run that nobody stops, and one for each so many ticks of its ramps.
    fn interrupt(floor: u32) -> Option<Interrupts> {
        let segments = cortex_m::singleton!(: bench::Segments = bench::Segments::new())?;
        let points = cortex_m::singleton!(: bench::Points = bench::Points::new())?;
        let mut counted = Interrupts {
            all: Range::NONE,
            moving: Range::NONE,
            begins: Range::NONE,
            stopping: Range::NONE,
        };
        counted.run(floor, u32::MAX, segments, points)?;
        let mut stop_at = 1;
        while counted.run(floor, stop_at, segments, points)? {
            stop_at += STOP_EVERY;
        }
        // There were ramps to stop in.
        (stop_at > 100 * STOP_EVERY).then_some(counted)
    }

    fn stream(floor: u32) -> Option<Range> {
        let mut streamed = Streamed::new()?;
        let mut range = Range::NONE;
        for _ in 0..2000_u16 {
            let sample = Some(streamed.sample());
            let before = SYST::get_current();
            black_box(streamed.tick(sample));
            range.add(between(before, SYST::get_current()).saturating_sub(floor));
        }
        streamed.sound().then_some(range)
    }

    /// A phase of 32 bits and `idsp`'s table of sines.
    #[derive(Default)]
    struct Idsp {
        phase: i32,
    }

    impl Turning for Idsp {
        fn advance(&mut self, by_rad: f32) {
            const PER_RAD: f32 = (2_147_483_648.0 / core::f64::consts::PI) as f32;
            self.phase = self.phase.wrapping_add((by_rad * PER_RAD) as i32);
        }

        fn turned(&self, re: f32, im: f32) -> [[f32; 2]; 2] {
            let (cos, sin) = idsp::cossin(self.phase);
            let [cos, sin] = [cos, sin].map(|v| v as f32 * (1.0 / 2_147_483_648.0));
            [[cos, sin], [re * cos - im * sin, re * sin + im * cos]]
        }
    }

    /// An angle and nalgebra's rotation.
    #[derive(Default)]
    struct Nalgebra {
        theta: f32,
    }

    impl Turning for Nalgebra {
        fn advance(&mut self, by_rad: f32) {
            self.theta += by_rad;
        }

        fn turned(&self, re: f32, im: f32) -> [[f32; 2]; 2] {
            let rotation = nalgebra::Rotation2::new(self.theta);
            [
                (rotation * nalgebra::Vector2::x()).into(),
                (rotation * nalgebra::Vector2::new(re, im)).into(),
            ]
        }
    }

    fn plain<T: Turning>(floor: u32) -> Range {
        let mut plain = Plain::<T>::default();
        let mut range = Range::NONE;
        // To the end of its ramp.
        for _ in 0..400_u16 {
            let before = SYST::get_current();
            black_box(plain.tick());
            range.add(between(before, SYST::get_current()).saturating_sub(floor));
        }
        range
    }

    fn measure() -> Option<()> {
        let floor = overhead();
        let [all, steady] = arc(&[], 0.0, floor)?;
        say("arc_beta", &all);
        say("arc_beta_steady", &steady);
        say("stream", &stream(floor)?);
        let [all, steady] = arc(&TERMS, 0.0, floor)?;
        say("arc_extended", &all);
        say("arc_extended_steady", &steady);
        let [all, _] = arc(&DEAREST, 0.0, floor)?;
        say("arc_dearest", &all);
        let [all, _] = arc(&[], HELIX_M, floor)?;
        say("helix_beta", &all);
        let [all, _] = arc(&TERMS, HELIX_M, floor)?;
        say("helix_extended", &all);
        let [all, steady] = run(Arc::of_arm(), floor)?;
        say("arm", &all);
        say("arm_steady", &steady);
        let counted = interrupt(floor)?;
        say("interrupt", &counted.all);
        say("interrupt_moving", &counted.moving);
        say("interrupt_stop", &counted.begins);
        say("interrupt_stopping", &counted.stopping);
        say("naive_libm", &plain::<Libm>(floor));
        say("naive_nalgebra", &plain::<Nalgebra>(floor));
        say("naive_idsp", &plain::<Idsp>(floor));
        Some(())
    }

    #[entry]
    fn main() -> ! {
        let _ = Uart::start();
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.SYST.set_clock_source(SystClkSource::Core);
            core.SYST.set_reload(0x00ff_ffff);
            core.SYST.clear_current();
            core.SYST.enable_counter();
        }
        let _ = writeln!(
            Uart,
            "{}",
            if measure().is_some() { "end" } else { "failed" }
        );
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        let _ = writeln!(Uart, "failed");
        loop {
            cortex_m::asm::nop();
        }
    }
}
