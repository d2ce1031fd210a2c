//! What all boards share: the tick in SysTick, the hand-over to it, the background loop, the log.
//!
//! | priority | runs | takes |
//! |---|---|---|
//! | highest | SysTick: one tick of the engine | what `giotto-hil ticks` counts |
//! | middle | receive interrupt of the link: a byte into a queue | some 30 instructions |
//! | thread | server, flash, set-points out, log, watchdog; sleeps when there is nothing to do | – |
//!
//! A tick that is due while the last one still runs is late: it is counted, the run stops within its limits, and
//! nothing starts before the fault is cleared. The watchdog is fed by the background, and only if there has been a tick since: it ends
//! a background that hangs and a timer that does. The stop input (`super::stop`) is
//! read in every tick.
//!
//! RTIC would prove that no lock is held across priorities. There is no lock: tick and background meet in two
//! single-producer, single-consumer queues and a page of words, each written by one side, so its ceilings would
//! guard nothing; and the emulated board has no PAC that it could be told about. The priorities are three
//! lines below.
pub mod flash;
pub mod idle;
pub mod interrupt;
pub mod kept;
pub mod log;
pub mod port;
pub mod record;
pub mod stack;
#[cfg(feature = "stepped")]
pub mod steps;

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use cortex_m::singleton;
use cortex_m_rt::exception;
use critical_section::Mutex;
use embedded_io::{Read, ReadReady, Write};
use embedded_storage::nor_flash::NorFlash;
use giotto_firmware::control::{self, Alive, Desk, Job, Shared, Tick};
use giotto_firmware::engine::{Config, Executor, Planner};
use giotto_firmware::server::{Board, Buffers, Server, TimedSetPoint};
use giotto_firmware::store::{Layout, stored_config};
use giotto_shared::wire::{IN_FLIGHT, MAX_FRAME, MachineConfig, PositionState};
use heapless_spsc::spsc::{Consumer, Producer, Queue};

/// Ticks a second unless others are stored; the `fast` images show how many there can be.
pub const TICK_HZ: u32 = if cfg!(feature = "fast") { 8000 } else { 1000 };
/// Priority of the link's receive interrupt; the tick has 0.
pub const LINK_PRIORITY: u8 = 0x40;
/// Bytes that arrive while the background is busy: what a host may have on its way, one place always stays free.
pub const RECEIVED: usize = 1024;
const _: () = assert!(
    RECEIVED > IN_FLIGHT + MAX_FRAME,
    "no room for what a host may have on its way"
);

/// Places in a queue; one always stays free.
const SEGMENTS: usize = control::SEGMENTS + 1;
const SET_POINTS: usize = control::SET_POINTS + 1;

type BoardTick = Tick<
    &'static Shared,
    Consumer<'static, Job, SEGMENTS>,
    Producer<'static, TimedSetPoint, SET_POINTS>,
>;
type BoardDesk = Desk<
    &'static mut Planner,
    &'static Shared,
    Producer<'static, Job, SEGMENTS>,
    Consumer<'static, TimedSetPoint, SET_POINTS>,
>;

static SHARED: Shared = Shared::new();
/// What the watchdog is fed by.
static ALIVE: Alive = Alive::new();
/// Where the tick is made; the interrupt keeps a reference to it.
static TICK: Mutex<Cell<Option<&'static mut BoardTick>>> = Mutex::new(Cell::new(None));

/// Ticks a second, once they have begun.
static RATE_HZ: AtomicU32 = AtomicU32::new(TICK_HZ);

// Time since boot by ticks, those included in which the core stood still.
defmt::timestamp!("{=u32:ms}", {
    let ms = u64::from(SHARED.now()) * 1000 / u64::from(RATE_HZ.load(Relaxed).max(1));
    ms as u32
});

/// The tick's owner once it has begun. See the table above for its contract; the late flag is the next tick's
/// own request, already pending.
#[exception]
fn SysTick() {
    static mut OWNED: Option<&'static mut BoardTick> = None;
    static mut LATE: bool = false;
    let Some(tick) = OWNED else {
        *OWNED = critical_section::with(|token| TICK.borrow(token).take());
        return;
    };
    #[cfg(feature = "stepped")]
    if !steps::may_pass() {
        return;
    }
    SHARED.set_stop_input(super::stop::active());
    let output = tick.tick(*LATE);
    kept::keep(output.corrected_nm);
    let (lines, placed) = (tick.lines(&output), tick.placed());
    let went_out = super::outputs::set(lines, output.corrected_nm, placed);
    // SysTick counts down from the moment that this tick was due.
    let used = SYST::get_reload().saturating_sub(SYST::get_current());
    if used > WORST_TICK.load(Relaxed) {
        WORST_TICK.store(used, Relaxed);
    }
    // What cannot go out ends the run as a tick that came late does.
    *LATE = SCB::is_pendst_pending() || !went_out;
    ALIVE.ticked();
}

/// Where the machine stands by what was kept, or at the origin.
#[allow(dead_code, reason = "not every board makes pulses")]
pub fn kept_place_nm() -> [i32; 3] {
    kept::kept().unwrap_or_default()
}

/// So many ticks fell due in which the core stood still; with interrupts masked.
#[allow(dead_code, reason = "not every board stands still")]
pub fn lose(ticks: u32) {
    SHARED.lose(ticks);
}

/// Longest tick so far, by SysTick's count.
static WORST_TICK: AtomicU32 = AtomicU32::new(0);

/// The same as a share of the time between two ticks, thousandths; one that was late counts as less than it was.
fn worst_tick_permille() -> u16 {
    let between = (SYST::get_reload() / 1000).max(1);
    (WORST_TICK.load(Relaxed) / between).min(1000) as u16
}

/// The limits that a board starts with: those stored, if it bears them, or its own.
#[inline(never)]
pub fn limits<F: NorFlash>(board: &Board, flash: F, layout: Layout) -> (F, MachineConfig) {
    let own = board.limits();
    let (flash, stored) = stored_config(flash, layout, &own);
    let bears = |limits: &MachineConfig| (board.bears)(limits).is_ok();
    (flash, stored.filter(bears).unwrap_or(own))
}

/// The server's memory. `None` if asked for twice.
pub fn buffers() -> Option<&'static mut Buffers> {
    singleton!(: Buffers = Buffers::new())
}

/// Prepares the engine and hands its fast half to SysTick, which is started; `at_first`: what is known of where the machine
/// stands where nothing was kept. `None` if called twice.
#[inline(never)] // Its frame would stay below that of the loop that never returns.
pub fn start(
    syst: &mut SYST,
    scb: &mut SCB,
    (clock_hz, tick_hz): (u32, u32),
    at_first: PositionState,
) -> Option<BoardDesk> {
    RATE_HZ.store(tick_hz, Relaxed);
    let config = Config::robot(tick_hz);
    let segments = singleton!(: Queue<Job, SEGMENTS> = Queue::new())?;
    let set_points = singleton!(: Queue<TimedSetPoint, SET_POINTS> = Queue::new())?;
    // The seal of memory that was never written does not fit.
    let (place_nm, known) = match kept::kept() {
        Some(place_nm) => (place_nm, PositionState::Kept),
        None => ([0; 3], at_first),
    };
    SHARED.stands(place_nm, known);
    let planner = singleton!(: Planner = Planner::new(&config, place_nm))?;
    let (segments_in, segments_out) = segments.split();
    let (points_in, points_out) = set_points.split();
    let tick = singleton!(: BoardTick = Tick::new(
        Executor::new(place_nm, config.engage_ticks(), true), &SHARED, segments_out, points_in
    ))?;
    critical_section::with(|token| TICK.borrow(token).set(Some(tick)));
    // SAFETY: the priority of SysTick guards no critical section that is based on priorities; there is none.
    #[allow(unsafe_code, reason = "cortex-m has no safe way to set a priority")]
    unsafe {
        scb.set_priority(SystemHandler::SysTick, 0);
    }
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(clock_hz.checked_div(tick_hz)?.saturating_sub(1));
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();
    Some(Desk::new(planner, &SHARED, segments_in, points_out))
}

/// What the background loop needs of a board.
pub struct Ports<L, S, G> {
    /// The host's link.
    pub link: L,
    /// Where set-points stream unless the link asks for them; `None`: nowhere.
    pub stream: Option<S>,
    /// Where the log goes.
    pub log: G,
    /// Feeds the watchdog.
    pub feed: fn(),
    /// Stops what counts time on its own, where ticks pass as the host grants them.
    #[cfg(feature = "stepped")]
    pub still: fn(),
    /// Bytes the link has lost since it was last asked.
    pub lost: fn() -> u32,
}

/// Serves for ever.
pub fn background<F, L, S, G>(
    board: Board,
    flash: F,
    layout: Layout,
    (desk, buffers, syst): (BoardDesk, &'static mut Buffers, SYST),
    mut ports: Ports<L, S, G>,
) -> !
where
    F: NorFlash,
    L: Read + ReadReady + Write,
    S: Write,
    G: Write,
{
    let mut server = Server::new(board, flash, layout, desk, buffers);
    server.wake();
    defmt::info!(
        "{=str} {=str}, {=u32} ticks a second",
        board.name,
        board.build,
        board.tick_hz
    );
    let mut record = record::Record::new();
    if ports.stream.is_some() {
        // The line carries a thousand a second.
        let every = board.tick_hz.div_ceil(1000).min(u32::from(u16::MAX));
        server.subscribe(every as u16, false);
    }
    let mut rounds: u8 = 0;
    let mut idle = idle::Idle::new();
    #[cfg(feature = "stepped")]
    let mut link = steps::Stepped::new(ports.link, syst, ports.still);
    #[cfg(not(feature = "stepped"))]
    let mut link = {
        // The counter runs on by itself.
        let _ = syst;
        ports.link
    };
    loop {
        ALIVE.feed(ports.feed);
        server.count_lost_bytes((ports.lost)());
        if rounds == 0 {
            let (worst, left) = stack::worst_and_left_bytes();
            server.note_stack(worst, left);
            server.note_worst_tick(worst_tick_permille());
        }
        rounds = rounds.wrapping_add(1);
        // A port that fails loses what was being sent; the host asks again.
        let _ = server.serve(&mut link);
        if let Some(stream) = &mut ports.stream {
            let _ = server.stream(stream);
        }
        record.say(&server);
        log::drain(&mut ports.log);
        if server.reset_requested() {
            defmt::info!("reset");
            log::drain(&mut ports.log);
            #[cfg(feature = "stepped")]
            link.close();
            SCB::sys_reset();
        }
        #[cfg(feature = "stepped")]
        link.round();
        #[cfg(feature = "stepped")]
        let may_sleep = || link.may_sleep();
        #[cfg(not(feature = "stepped"))]
        let may_sleep = || true;
        if let Some(permille) = idle.sleep(may_sleep) {
            server.note_idle(permille);
        }
    }
}

/// A panic is a defect. Nothing moves on: the watchdog ends it, and the controller boots into a defined state.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    loop {
        cortex_m::asm::nop();
    }
}
