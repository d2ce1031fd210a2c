//! The component: what LinuxCNC calls to load it, each period, and to take it away.
use crate::page::{self, create, describe};
use crate::pins::{Pins, make};
use crate::{hal, parameters};
use core::cell::UnsafeCell;
use core::ffi::{c_int, c_long, c_void};
use core::sync::atomic::Ordering::Relaxed;
use giotto_corrector::handover::{Page, Taker};
use giotto_corrector::{Corrector, Settings, SettingsError};

/// Times that a bit stays up which says to stop, s.
const STOP_S: f64 = 0.1;

/// All that the real-time thread owns.
struct Component {
    id: c_int,
    corrector: Corrector,
    taker: Taker,
    pins: *const Pins,
    page: *mut Page,
    period_ns: c_long,
    /// The table that was asked for at load could not be used.
    lost: bool,
    stop_left_s: f64,
}

struct Static(UnsafeCell<Component>);

// SAFETY: set up before the component is ready, then used by the real-time thread alone, then taken away when that no longer
// runs it.
unsafe impl Sync for Static {}

static COMPONENT: Static = Static(UnsafeCell::new(Component {
    id: -1,
    corrector: Corrector::new(Settings::UNUSED),
    taker: Taker::new(),
    pins: core::ptr::null(),
    page: core::ptr::null_mut(),
    period_ns: 0,
    lost: false,
    stop_left_s: 0.0,
}));

/// Room for the table that is read at load.
static IMAGE: Image = Image(UnsafeCell::new([0; MAX_IMAGE]));
const MAX_IMAGE: usize = 64 * 1024;
struct Image(UnsafeCell<[u8; MAX_IMAGE]>);
// SAFETY: used at load alone.
unsafe impl Sync for Image {}

/// Loads it.
///
/// # Safety
/// Called by LinuxCNC, once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtapi_app_main() -> c_int {
    // SAFETY: nothing else runs code of this component yet.
    let component = unsafe { &mut *COMPONENT.0.get() };
    match load(component) {
        Ok(()) => 0,
        Err(code) => {
            take_away(component);
            code
        }
    }
}

/// Takes it away.
///
/// # Safety
/// Called by LinuxCNC, after the threads have stopped.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtapi_app_exit() {
    // SAFETY: the threads have stopped.
    take_away(unsafe { &mut *COMPONENT.0.get() });
}

fn load(component: &mut Component) -> Result<(), c_int> {
    const INVALID: c_int = -22;
    let joints = parameters::joints();
    let settings = Settings::new(
        joints,
        parameters::coordinates(),
        parameters::units_per_mm(),
    )
    .and_then(|settings| settings.with_window(parameters::window_ms() * 1e-3));
    let settings = settings.map_err(|SettingsError(name)| {
        hal::complain(match name {
            "joints" => c"joints: 2 to 9 are possible",
            "coordinates" => c"coordinates: a letter of XYZABCUVW for each joint",
            "units_per_mm" => {
                c"units_per_mm: a number above 0 (1.0 for millimetres, 0.03937007874 for inches)"
            }
            _ => c"window_ms: 1 to 100 are possible",
        });
        INVALID
    })?;
    component.corrector.set(settings);
    // SAFETY: as LinuxCNC's manual has it: init, pins, function, ready.
    unsafe {
        component.id = hal::hal_init(c"giotto".as_ptr());
        if component.id < 0 {
            return Err(component.id);
        }
        component.pins = make(component.id, joints)?;
    }
    component.page = create().unwrap_or(core::ptr::null_mut());
    if component.page.is_null() {
        hal::complain(
            c"no shared memory in /dev/shm: corrects by the table given at load, and no other",
        );
    }
    load_table(component, joints);
    // SAFETY: the argument lasts as long as the component.
    unsafe {
        let argument: *mut c_void = COMPONENT.0.get().cast();
        let done = hal::hal_export_funct(
            c"giotto.update".as_ptr(),
            update,
            argument,
            1,
            0,
            component.id,
        );
        if done != 0 {
            return Err(done);
        }
        match hal::hal_ready(component.id) {
            0 => Ok(()),
            error => Err(error),
        }
    }
}

/// The table that was asked for. Without it everything passes through, and `giotto.fault` says so.
fn load_table(component: &mut Component, joints: usize) {
    // SAFETY: used here alone.
    let image = unsafe { &mut *IMAGE.0.get() };
    let path = parameters::table();
    let length = path.and_then(|path| page::read(path, image));
    let mut used: &[u8] = &[];
    match (path, length) {
        (None, _) => {}
        (Some(_), None) => hal::complain(c"table: the file cannot be read; nothing is corrected"),
        (Some(_), Some(length)) => match image.get(..length) {
            Some(bytes) if component.corrector.load(bytes).is_ok() => used = bytes,
            _ => hal::complain(
                c"table: not a table of giotto (`giotto table show FILE`); nothing is corrected",
            ),
        },
    }
    component.lost = path.is_some() && used.is_empty();
    // SAFETY: mapped, and shared by atomics alone.
    if let Some(shared) = unsafe { component.page.as_ref() } {
        describe(shared, joints, path, used);
    }
}

fn take_away(component: &mut Component) {
    if component.id >= 0 {
        // SAFETY: the component's own id.
        unsafe { hal::hal_exit(component.id) };
        component.id = -1;
    }
    if !component.page.is_null() {
        page::remove(component.page);
        component.page = core::ptr::null_mut();
    }
}

/// One period.
unsafe extern "C" fn update(argument: *mut c_void, period_ns: c_long) {
    // SAFETY: LinuxCNC calls it in one thread, with the argument that was given at load.
    let component = unsafe { &mut *argument.cast::<Component>() };
    let Component {
        corrector, taker, ..
    } = component;
    // SAFETY: mapped until the threads have stopped.
    let page = unsafe { component.page.as_ref() };
    // SAFETY: made at load.
    let Some(pins) = (unsafe { component.pins.as_ref() }) else {
        return;
    };
    let period_s = period_ns as f64 * 1e-9;
    if let Some(page) = page {
        if component.period_ns != period_ns {
            component.period_ns = period_ns;
            page.period_ns.store(period_ns as u32, Relaxed);
        }
        if taker.take(page, corrector) {
            component.stop_left_s = STOP_S;
        }
    }
    component.stop_left_s -= if component.stop_left_s > 0.0 {
        period_s
    } else {
        0.0
    };
    // SAFETY: in the real-time thread.
    let input = unsafe { pins.read() };
    let mut output = corrector.tick(&input, period_s);
    component.lost &= !corrector.has_table();
    output.fault |= component.lost;
    let cuts = corrector
        .counters()
        .offset_cuts
        .wrapping_add(corrector.counters().slew_cuts);
    // SAFETY: in the real-time thread.
    unsafe { pins.write(&output, cuts, component.stop_left_s > 0.0) };
    if let Some(page) = page {
        taker.publish(page, corrector, &input, &output);
    }
}
