//! Ctrl-C as a wish: what moves is brought to rest, what was recorded is kept.
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Listens from now on: the first Ctrl-C sets the flag, a second one ends this program. Where there are no signals to listen to,
/// Ctrl-C does what it always did and the flag stays as it is.
pub(super) fn listen() -> Arc<AtomicBool> {
    let wish = Arc::new(AtomicBool::new(false));
    let heard = Arc::clone(&wish);
    let _ = ctrlc::set_handler(move || {
        if heard.swap(true, Relaxed) {
            std::process::exit(130);
        }
    });
    wish
}
