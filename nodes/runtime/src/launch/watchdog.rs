//! Ends a node with its run, whatever the node does at that moment.
//!
//! A thread that needs nothing of the others: it is started before anything else, reads the pipe that the parent holds
//! open, and looks at a clock.

use std::{
    io::Read as _,
    sync::{Mutex, OnceLock, PoisonError},
    time::{Duration, Instant},
};

/// How long a node whose parent is gone may take to end by itself.
const PARENT_GONE: Duration = Duration::from_secs(2);
/// How long one whose coordinator is gone may take: what it said last is still to leave, over a link that may be slow.
const COORDINATOR_GONE: Duration = Duration::from_secs(8);
/// How long the system's own way to end a process may take, with what other threads have registered for it.
const EXIT: Duration = Duration::from_secs(1);
/// How often the clock is looked at.
const LOOK: Duration = Duration::from_millis(100);

/// The exit code of a node that is ended so.
const FAILED: i32 = 1;

type Hear = Box<dyn Fn() + Send>;

/// What a node's watchdog knows.
struct Watchdog {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// When the process is ended at the latest.
    end_by: Option<Instant>,
    parent_gone: bool,
    /// Who is told that the parent is gone.
    hear: Option<Hear>,
}

static WATCHDOG: OnceLock<Watchdog> = OnceLock::new();

impl Watchdog {
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        // Nothing in here leaves it half changed.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end_within(&self, time: Duration) {
        let end_by = Instant::now() + time;
        let mut state = self.state();
        state.end_by = Some(state.end_by.map_or(end_by, |before| before.min(end_by)));
    }
}

/// Starts watching, for a process that is one node. Where a parent holds the other end of the standard input, `child`, the
/// end of that pipe is the end of the run.
///
/// # Errors
/// The system gives no thread.
pub fn start(child: bool) -> std::io::Result<()> {
    let mut fresh = false;
    let watchdog = WATCHDOG.get_or_init(|| {
        fresh = true;
        Watchdog { state: Mutex::default() }
    });
    if !fresh {
        return Ok(());
    }
    std::thread::Builder::new().name("watchdog".into()).spawn(move || {
        loop {
            std::thread::sleep(LOOK);
            let end_by = watchdog.state().end_by;
            if end_by.is_some_and(|end_by| Instant::now() >= end_by) {
                exit(FAILED);
            }
        }
    })?;
    if child {
        std::thread::Builder::new().name("parent".into()).spawn(move || {
            // Nothing is ever written to this pipe: its end, or an error on it, is the parent's end.
            let _ = std::io::stdin().read(&mut [0]);
            watchdog.end_within(PARENT_GONE);
            let mut state = watchdog.state();
            state.parent_gone = true;
            if let Some(hear) = &state.hear {
                hear();
            }
        })?;
    }
    Ok(())
}

/// Has `hear` called when the parent is gone, or now where it is. Without a watchdog there is no parent to lose.
pub(crate) fn on_parent_gone(hear: impl Fn() + Send + 'static) {
    let Some(watchdog) = WATCHDOG.get() else { return };
    let mut state = watchdog.state();
    if state.parent_gone {
        hear();
    }
    state.hear = Some(Box::new(hear));
}

/// The coordinator is gone: this process, where it is a node alone, ends within seconds.
pub(crate) fn coordinator_gone() {
    if let Some(watchdog) = WATCHDOG.get() {
        watchdog.end_within(COORDINATOR_GONE);
    }
}

/// Ends this process, also where something that is to be done at its end never comes to an end.
pub(crate) fn exit(code: i32) -> ! {
    let forced = std::thread::Builder::new().name("end".into()).spawn(|| {
        std::thread::sleep(EXIT);
        force();
    });
    if forced.is_err() {
        // There is no thread left to be had: nothing may be tried that could stand still.
        force();
    }
    std::process::exit(code)
}

fn force() {
    #[cfg(unix)]
    // It cannot fail: nobody may be kept from ending himself.
    let _ = nix::sys::signal::raise(nix::sys::signal::SIGKILL);
    #[cfg(not(unix))]
    std::process::abort();
}
