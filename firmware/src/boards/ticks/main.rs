//! Counts the instructions of one engine tick on QEMU's mps2-an386, for `giotto-hil ticks`.
//!
//! Run with `-icount shift=10`: an instruction lasts 1024 ns, SysTick counts 40 ns, so a difference of SysTick values
//! is a count of instructions. What is counted is the call of the tick as the image makes it, compute only: no
//! interrupt entry, no ports. UART0 says one line a case, `NAME MIN MAX`, and `end`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: build it for thumbv7em-none-eabihf");
}

#[cfg(target_os = "none")]
mod naive;

#[cfg(target_os = "none")]
mod image {
    use super::naive;
    use core::fmt::{self, Write};
    use core::hint::black_box;
    use core::ptr;
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m_rt::entry;
    use defmt as _;
    use giotto_firmware::engine::{Config, Executor, Output, Planned, Planner, Segment, flag};
    use giotto_firmware::engine::{Stream, StreamSample};
    use giotto_shared::Axis;
    use giotto_shared::model::Cumulants;
    use giotto_shared::table::{Limits, Table, Travel, Zone};
    use giotto_shared::term::Term;
    use heapless::spsc::Queue;

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
    #[allow(unsafe_code, reason = "the linker script of cortex-m-rt looks for this name and section")]
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

    /// The tick as the interrupt makes it.
    #[inline(never)]
    fn tick(executor: &mut Executor, queue: &mut Queue<Planned, 2>) -> Output {
        executor.tick(queue)
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

    fn table(terms: &[Term<f32>]) -> Table {
        let mut table = Table::empty();
        table.limits = Limits { offset_m: 2e-3, slew_m_s: 0.1 };
        let mut zone = Zone {
            place_m: None,
            radius_m: [0.05, 0.3],
            feed_m_s: [0.02, 0.7],
            travel: Travel::Both,
            cumulants: Cumulants { kappa2_s2: 46.58e-6, kappa4_s4: -5.53e-6 },
            terms: heapless::Vec::new(),
        };
        for term in terms {
            let _ = zone.terms.push(*term);
        }
        let _ = table.zones.push(zone);
        table
    }

    /// One turn and more of an arc tilted in space, from rest to rest. `at`: all ticks under way, and those at
    /// constant feed.
    fn arc(planner: &mut Planner, executor: &mut Executor, floor: u32) -> Option<[Range; 2]> {
        let arc = Segment::Arc {
            centre_m: [-0.1, 0.0, 0.0],
            normal: [0.0, 0.3, 1.0],
            sweep_rad: 7.0,
            rise_m: 0.0,
            feed_m_s: 0.5,
        };
        let planned = planner.segment(&arc).ok()?;
        let mut queue = Queue::new();
        queue.enqueue(planned).ok()?;
        let mut ranges = [Range::NONE, Range::NONE];
        loop {
            let before = SYST::get_current();
            let output = tick(executor, &mut queue);
            let after = SYST::get_current();
            let count = between(before, after).saturating_sub(floor);
            if output.flags & flag::MOVING != 0 {
                ranges[0].add(count);
            }
            if output.flags & flag::CRUISE != 0 {
                ranges[1].add(count);
            }
            if executor.idle() && queue.is_empty() {
                return Some(ranges);
            }
        }
    }

    fn stream(planner: &Planner, floor: u32) -> Option<Range> {
        let plan = planner.stream(0.5).ok()?;
        let start = [100_000_000, 0, 0];
        let mut stream = Stream::new(&plan, start, 0, false);
        let mut range = Range::NONE;
        for sequence in 0..2000_u16 {
            let [x, y, z] = start;
            let position_nm = [x, y + i32::from(sequence) * 50_000, z];
            let sample = Some(StreamSample { sequence, position_nm });
            let before = SYST::get_current();
            black_box(stream_tick(&mut stream, sample));
            range.add(between(before, SYST::get_current()).saturating_sub(floor));
        }
        Some(range)
    }

    #[inline(never)]
    fn stream_tick(stream: &mut Stream, sample: Option<StreamSample>) -> Output {
        stream.tick(sample)
    }

    /// Eight terms, the spikes of both axes among them.
    fn eight_terms() -> [Term<f32>; 8] {
        [
            Term::Squareness { shear_rad: 1e-4 },
            Term::ScaleMismatch { relative: 1e-4 },
            Term::ServoMismatch { delta_tau_s: 1e-4 },
            Term::Backlash { axis: Axis::X, step_m: 1e-5 },
            Term::Backlash { axis: Axis::Y, step_m: 1e-5 },
            Term::ReversalSpike { axis: Axis::X, peak_m: 5e-6, decay_s: 0.02 },
            Term::ReversalSpike { axis: Axis::Y, peak_m: 5e-6, decay_s: 0.02 },
            Term::Cyclic { axis: Axis::X, amplitude_m: 2e-6, pitch_m: 0.01, phase_rad: 0.5 },
        ]
    }

    fn measure() -> Option<()> {
        let floor = overhead();
        let config = Config::robot(8000);
        let mut planner = Planner::new(&config, [0; 3]);
        let executor = || Executor::new([0; 3], config.engage_ticks(), false);
        planner.set_table(Some(&table(&[]))).ok()?;
        let [all, steady] = arc(&mut planner, &mut executor(), floor)?;
        say("arc_beta", &all);
        say("arc_beta_steady", &steady);
        // A stream comes at the rate of the image; the window of its differentiator is too long for 8 kHz.
        let mut streaming = Planner::new(&Config::robot(1000), [0; 3]);
        streaming.set_table(Some(&table(&[]))).ok()?;
        if let Some(range) = stream(&streaming, floor) {
            say("stream", &range);
        }
        let mut planner = Planner::new(&config, [0; 3]);
        planner.set_table(Some(&table(&eight_terms()))).ok()?;
        let [all, steady] = arc(&mut planner, &mut executor(), floor)?;
        say("arc_extended", &all);
        say("arc_extended_steady", &steady);
        let mut range = Range::NONE;
        for step in 0..200_u16 {
            let time = f32::from(step) * 1e-3;
            let before = SYST::get_current();
            black_box(naive::tick(black_box(time)));
            range.add(between(before, SYST::get_current()).saturating_sub(floor));
        }
        say("naive_libm", &range);
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
        let _ = writeln!(Uart, "{}", if measure().is_some() { "end" } else { "failed" });
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
