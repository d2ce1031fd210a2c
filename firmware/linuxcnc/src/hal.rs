//! What LinuxCNC and the C library provide; resolved when the component is loaded.
use core::ffi::{c_char, c_int, c_long, c_void};

pub(crate) const IN: c_int = 16;
pub(crate) const OUT: c_int = 32;
pub(crate) const READ_WRITE: c_int = 192;
/// Level of messages that LinuxCNC shows as they are.
pub(crate) const ERROR: c_int = 1;

pub(crate) type Update = unsafe extern "C" fn(*mut c_void, c_long);

unsafe extern "C" {
    pub(crate) fn hal_init(name: *const c_char) -> c_int;
    pub(crate) fn hal_ready(id: c_int) -> c_int;
    pub(crate) fn hal_exit(id: c_int) -> c_int;
    pub(crate) fn hal_malloc(size: c_long) -> *mut c_void;
    pub(crate) fn hal_pin_float_new(
        name: *const c_char,
        way: c_int,
        pin: *mut *mut f64,
        id: c_int,
    ) -> c_int;
    pub(crate) fn hal_pin_bit_new(
        name: *const c_char,
        way: c_int,
        pin: *mut *mut bool,
        id: c_int,
    ) -> c_int;
    pub(crate) fn hal_pin_u32_new(
        name: *const c_char,
        way: c_int,
        pin: *mut *mut u32,
        id: c_int,
    ) -> c_int;
    pub(crate) fn hal_param_float_new(
        name: *const c_char,
        way: c_int,
        value: *mut f64,
        id: c_int,
    ) -> c_int;
    pub(crate) fn hal_export_funct(
        name: *const c_char,
        update: Update,
        argument: *mut c_void,
        uses_fp: c_int,
        reentrant: c_int,
        id: c_int,
    ) -> c_int;
    pub(crate) fn rtapi_print_msg(level: c_int, format: *const c_char, ...);

    pub(crate) fn open(path: *const c_char, flags: c_int, ...) -> c_int;
    pub(crate) fn read(file: c_int, buffer: *mut c_void, count: usize) -> isize;
    pub(crate) fn close(file: c_int) -> c_int;
    pub(crate) fn ftruncate(file: c_int, length: i64) -> c_int;
    pub(crate) fn unlink(path: *const c_char) -> c_int;
    pub(crate) fn getpid() -> c_int;
    pub(crate) fn mmap(
        address: *mut c_void,
        length: usize,
        protection: c_int,
        flags: c_int,
        file: c_int,
        offset: i64,
    ) -> *mut c_void;
    pub(crate) fn munmap(address: *mut c_void, length: usize) -> c_int;
    #[cfg(panic = "abort")]
    pub(crate) fn abort() -> !;
}

/// Tells the user.
pub(crate) fn complain(what: &core::ffi::CStr) {
    // SAFETY: the format takes one string that ends with 0.
    unsafe { rtapi_print_msg(ERROR, c"giotto: %s\n".as_ptr(), what.as_ptr()) }
}
