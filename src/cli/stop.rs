//! What is told when the program is stopped by Ctrl-C, or by whoever started it.

use std::sync::{Mutex, PoisonError};

/// What a stopped command leaves, and how to go on.
static KEPT: Mutex<&str> = Mutex::new("nothing was written");

/// From now on a stopped program leaves this.
pub(super) fn keeps(kept: &'static str) {
    *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = kept;
}

/// Tells on a signal what is kept, then ends as the system would have ended the program.
#[cfg(unix)]
pub(super) fn listen() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else {
        return;
    };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            let kept = *KEPT.lock().unwrap_or_else(PoisonError::into_inner);
            eprintln!("\nstopped: {kept}");
            // If that fails, the next signal tries again.
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
}

#[cfg(not(unix))]
pub(super) fn listen() {}
