//! Parameters of `loadrt giotto`: LinuxCNC finds each by two symbols, its type and its address.
use core::cell::UnsafeCell;
use core::ffi::{CStr, c_char, c_int};

/// A word that LinuxCNC writes before `rtapi_app_main` is called, and nobody afterwards.
#[repr(transparent)]
pub struct Given<T>(UnsafeCell<T>);

// SAFETY: written by the loader before any code of this component runs, then only read.
unsafe impl<T> Sync for Given<T> {}

/// The address of a static, or of its name: for the loader alone.
#[repr(transparent)]
pub struct Address<T>(*const T);

// SAFETY: never read through by this component.
unsafe impl<T> Sync for Address<T> {}

macro_rules! parameter {
    ($value:ident: $type:ty = $default:expr, $letter:literal, $kind:ident, $address:ident) => {
        static $value: Given<$type> = Given(UnsafeCell::new($default));
        /// Its type.
        #[unsafe(no_mangle)]
        #[allow(non_upper_case_globals, reason = "the loader's name")]
        pub static $kind: Address<c_char> = Address($letter.as_ptr());
        /// Where it is.
        #[unsafe(no_mangle)]
        #[allow(non_upper_case_globals, reason = "the loader's name")]
        pub static $address: Address<Given<$type>> = Address(&$value);
    };
}

parameter!(JOINTS: c_int = 3, c"i", rtapi_info_type_joints, rtapi_info_address_joints);
parameter!(TABLE: *const c_char = core::ptr::null(), c"s", rtapi_info_type_table, rtapi_info_address_table);
parameter!(COORDINATES: *const c_char = core::ptr::null(), c"s", rtapi_info_type_coordinates, rtapi_info_address_coordinates);
parameter!(UNITS: *const c_char = core::ptr::null(), c"s", rtapi_info_type_units_per_mm, rtapi_info_address_units_per_mm);
parameter!(WINDOW: *const c_char = core::ptr::null(), c"s", rtapi_info_type_window_ms, rtapi_info_address_window_ms);

/// Text that was given.
fn text(value: &Given<*const c_char>) -> Option<&'static CStr> {
    // SAFETY: written before this code runs; text that the loader keeps for good, ends with 0.
    unsafe {
        let text = *value.0.get();
        (!text.is_null()).then(|| CStr::from_ptr(text))
    }
}

/// A number that was given, or what is taken without.
fn number(value: &Given<*const c_char>, without: f64) -> f64 {
    match text(value) {
        // What is no number is refused by name by whoever checks the range.
        Some(text) => text
            .to_str()
            .ok()
            .and_then(|t| t.trim().parse().ok())
            .unwrap_or(f64::NAN),
        None => without,
    }
}

pub(crate) fn joints() -> usize {
    // SAFETY: as above.
    usize::try_from(unsafe { *JOINTS.0.get() }).unwrap_or(0)
}

pub(crate) fn table() -> Option<&'static CStr> {
    text(&TABLE)
}

pub(crate) fn coordinates() -> &'static str {
    text(&COORDINATES).map_or("XYZABCUVW", |t| t.to_str().unwrap_or(""))
}

pub(crate) fn units_per_mm() -> f64 {
    number(&UNITS, 1.0)
}

pub(crate) fn window_ms() -> f64 {
    number(&WINDOW, 15.0)
}
