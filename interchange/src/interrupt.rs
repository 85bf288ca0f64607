//! Ctrl-C: unfinished files go before the program does, and it ends by the signal, so that `make` and the shell see why.
//!
//! The list of unfinished files is locked while one is made, so none can come into being between the clearing and the end.
//! `kill -9` cannot be caught; what it leaves is named `.NAME.*.partial`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A set of paths is whole wherever its holder panicked.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes an unfinished file; `path` tells where it is.
pub(crate) fn make<T, E>(make: impl FnOnce() -> Result<T, E>, path: impl Fn(&T) -> PathBuf) -> Result<T, E> {
    let mut unfinished = unfinished();
    let made = make()?;
    unfinished.insert(absolute(&path(&made)));
    Ok(made)
}

/// Leaves a file alone from now on: it is finished, gone, or to be kept.
pub(crate) fn leave(path: &Path) {
    unfinished().remove(&absolute(path));
}

/// Lists a file as unfinished again.
pub(crate) fn take_up(path: &Path) {
    unfinished().insert(absolute(path));
}

/// Independent of the working folder; the path itself where that is unknown.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// From now on an interrupt (Ctrl-C), a hang-up and a request to end remove unfinished files first.
#[cfg(unix)]
pub(crate) fn clear_up_when_interrupted() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    // Without a handler the signals end the program as they always did.
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP]) else { return };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            // Held to the end: whoever wants to make a file now waits.
            let list = unfinished();
            list.iter().for_each(|path| drop(std::fs::remove_file(path)));
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
}

#[cfg(not(unix))]
pub(crate) fn clear_up_when_interrupted() {}
