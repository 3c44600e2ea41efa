//! The user's wish to end: once is asked, twice is at once.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use crate::diagnostics;

/// The exit code of a process that was interrupted: 128 and the number of SIGINT.
const INTERRUPTED: i32 = 130;

/// A flag that Ctrl-C, or the system's request to end, sets; the second one ends this process at once.
#[must_use]
pub fn flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    let handler = move || {
        if set.swap(true, Ordering::Relaxed) {
            crate::launch::watchdog::exit(INTERRUPTED);
        }
        diagnostics::note("ending as soon as it can be done in order; interrupt once more to end at once");
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        diagnostics::warn(&format!("Ctrl-C will end the run at once: {error}"));
    }
    flag
}
