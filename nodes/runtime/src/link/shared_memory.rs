//! The shared memory a process places its outgoing fields in.
//!
//! Zenoh locks all of a segment into memory, in the writer and in every reader. A pool therefore begins small, grows with
//! the fields, and keeps within what its processes may lock.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    io::Write as _,
    path::{Path, PathBuf},
    sync::{LazyLock, Mutex, PoisonError},
    time::{Duration, Instant},
};

use crate::diagnostics;

/// The first segment of a process, in bytes.
const SMALLEST: usize = 2 << 20;
/// All segments of a process together, in bytes.
const LARGEST: usize = 256 << 20;
/// How often a field that does not fit any more fits into the segment made for it: the held ones of a few fields.
const FITS: usize = 16;
/// What Zenoh itself locks for each process that writes, in bytes: 1.3 MB were measured.
const BOOKKEEPING: usize = 2 << 20;
/// More than what it locks for links alone, in bytes.
const LINKS: usize = 1 << 16;
/// Newest buffers of one key that a publisher keeps; readers copy them out when they arrive. While it holds them,
/// Zenoh's watchdog does not take them back (eclipse-zenoh/zenoh#2628), however late a reader is scheduled.
const HELD_BUFFERS: usize = 3;
/// How often in a row fields must have been lost for shared memory to be given up.
const LOST: u32 = 3;
/// Where a trial goes on within this after it was asked for again, messages had been lost; else somebody still solved.
const PROMPT: Duration = Duration::from_millis(500);
/// Where the system keeps shared memory.
const FOLDER: &str = "/dev/shm";
/// How the names of Zenoh's segments end.
const SUFFIX: &str = ".zenoh";
/// A payload of this many bytes is slower by the socket to a degree that is worth a word.
const WORTH_A_WORD: usize = 1 << 18;

/// A piece of shared memory of a fixed size, as the link makes it.
pub trait Segment: Sized {
    /// What holds a payload in it until all are done with it.
    type Buffer: Clone;

    /// A new one of so many bytes.
    ///
    /// # Errors
    /// The system gives none, in words.
    fn create(bytes: usize) -> Result<Self, String>;

    /// Whether a process that has not opened it yet still can.
    fn is_there(&self) -> bool;

    /// A copy of a payload; `None` where there is no room.
    fn copy(&self, payload: &[u8]) -> Option<Self::Buffer>;
}

/// The segments of a process, made when the first large field is sent.
pub struct Pool<S: Segment>(Mutex<State<S>>);

struct State<S: Segment> {
    /// All but the last were too small; they stay, as readers may be late.
    segments: Vec<S>,
    /// Size of the last, in bytes.
    newest: usize,
    /// Size of all, in bytes.
    spent: usize,
    /// What all may have together, in bytes.
    budget: usize,
    /// Why there are no more, where the system gave none.
    refused: Option<String>,
    /// Whether what was placed did not reach its readers, and nothing more is placed.
    given_up: bool,
    told: bool,
    held: BTreeMap<String, VecDeque<S::Buffer>>,
    /// When the trial under way was asked for again.
    again: Option<Instant>,
    /// Trials in a row of which messages were lost.
    lost: u32,
}

impl<S: Segment> Default for Pool<S> {
    fn default() -> Self {
        Self::within(if LOCKED_MEMORY_BYTES.is_some() || UNUSABLE.is_some() { 0 } else { LARGEST })
    }
}

impl<S: Segment> Pool<S> {
    fn within(budget: usize) -> Self {
        Self(Mutex::new(State {
            segments: Vec::new(),
            newest: 0,
            spent: 0,
            budget,
            refused: None,
            given_up: false,
            told: UNUSABLE.is_some(),
            held: BTreeMap::new(),
            again: None,
            lost: 0,
        }))
    }

    /// Says how many processes write into shared memory that each of them reads: where a process may lock little memory,
    /// that is shared among them. Nothing is placed before that is known.
    pub fn share(&self, writers: usize) {
        if let Some(limit) = *LOCKED_MEMORY_BYTES
            && UNUSABLE.is_none()
        {
            self.state().budget = share_of(limit, writers);
        }
    }

    /// A payload for a key in shared memory; `None` where there is no room.
    pub fn place(&self, key: &str, payload: &[u8]) -> Option<S::Buffer> {
        let mut state = self.state();
        let Some(buffer) = state.copy(payload) else {
            if payload.len() >= WORTH_A_WORD && !std::mem::replace(&mut state.told, true) {
                diagnostics::warn(&format!("fields go through the socket, slower: {}", state.reason()));
            }
            return None;
        };
        let held = state.held.entry(key.to_owned()).or_default();
        held.push_back(buffer.clone());
        if held.len() > HELD_BUFFERS {
            held.pop_front();
        }
        Some(buffer)
    }

    /// Says that a trial was asked for, anew or `again`: the latter where somebody still solves, or lacks a message. Shared
    /// memory that is gone, as where somebody emptied its folder, or that did not reach its readers a few times in a row, is
    /// given up.
    pub fn asked(&self, again: bool) {
        let mut state = self.state();
        if state.segments.is_empty() || state.given_up {
            return;
        }
        if again {
            state.again = Some(Instant::now());
            if !state.segments.iter().all(S::is_there) {
                state.give_up("somebody has removed the files it was in");
            }
            return;
        }
        let prompt = state.again.take().is_some_and(|again| again.elapsed() < PROMPT);
        state.lost = if prompt { state.lost + 1 } else { 0 };
        if state.lost >= LOST {
            state.give_up("what was in it did not arrive, several times in a row");
        }
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State<S>> {
        // A poisoned lock means a panic while the state was consistent: nothing in here leaves it half changed.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S: Segment> State<S> {
    /// Places nothing any more. The segments stay, as readers may be late.
    fn give_up(&mut self, why: &str) {
        self.given_up = true;
        self.told = true;
        self.held.clear();
        diagnostics::warn(&format!(
            "shared memory is of no use any more, {why}: fields go through the socket from now on, slower"
        ));
    }

    fn copy(&mut self, payload: &[u8]) -> Option<S::Buffer> {
        if self.given_up {
            return None;
        }
        let into_newest = |segments: &[S]| segments.last()?.copy(payload);
        into_newest(&self.segments).or_else(|| {
            self.grow(payload.len());
            into_newest(&self.segments)
        })
    }

    /// Makes a larger segment, as far as the budget goes.
    fn grow(&mut self, length: usize) {
        let wanted = SMALLEST.max(2 * self.newest).max(length.saturating_mul(FITS).next_power_of_two());
        let size = wanted.min(self.budget.saturating_sub(self.spent));
        // With less than this the next one of the same field finds no room.
        if self.refused.is_some() || size < SMALLEST.min(length.saturating_mul(2 + HELD_BUFFERS)) || size < length {
            return;
        }
        match S::create(size) {
            Ok(segment) => {
                self.segments.push(segment);
                (self.newest, self.spent) = (size, self.spent + size);
            }
            Err(error) => self.refused = Some(error),
        }
    }

    fn reason(&self) -> String {
        match (&self.refused, *LOCKED_MEMORY_BYTES) {
            (Some(error), _) => format!("there is no shared memory ({error})"),
            (None, Some(limit)) if self.budget < LARGEST => format!(
                "a process may lock {} MiB of memory, too little for shared memory between them (`ulimit -l` raises it)",
                limit >> 20
            ),
            _ => format!("{} MiB of shared memory are full", self.spent >> 20),
        }
    }
}

/// Whether this process may lock what Zenoh locks for its links alone, some 20 kB each, and has where to put it; a session
/// that does not fails to open.
pub fn is_possible() -> bool {
    LOCKED_MEMORY_BYTES.is_none_or(|limit| limit >= BOOKKEEPING) && UNUSABLE.is_none()
}

/// Why this host's shared memory cannot be used, where that is so.
pub fn why_unusable() -> Option<&'static str> {
    UNUSABLE.as_deref()
}

static UNUSABLE: LazyLock<Option<String>> = LazyLock::new(|| can_be_had([LINKS, LINKS, 0]).err());

/// Whether a segment of so many bytes can be had, and another for Zenoh's books: Zenoh itself asks for no more than a name
/// and a length, and leaves them behind where there is no memory.
///
/// # Errors
/// It cannot, in words.
pub fn has_room(bytes: usize) -> Result<(), String> {
    can_be_had([bytes, BOOKKEEPING, 0])
}

/// How large a file of this process may become, in bytes, where that is limited.
#[must_use]
pub fn largest_file_bytes() -> Option<u64> {
    #[cfg(unix)]
    {
        use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
        let (limit, _) = getrlimit(Resource::RLIMIT_FSIZE).ok()?;
        (limit != RLIM_INFINITY).then_some(limit)
    }
    #[cfg(not(unix))]
    None
}

#[cfg(target_os = "linux")]
fn can_be_had(sizes: [usize; 3]) -> Result<(), String> {
    // Segments are files to the limit of a file's size, beyond which the system ends the process.
    let most = sizes.into_iter().fold(BOOKKEEPING, usize::max);
    if let Some(limit) = largest_file_bytes().filter(|limit| *limit < most as u64) {
        return Err(format!("no file may grow beyond {limit} bytes, as `ulimit -f` shows"));
    }
    let probe = || -> std::io::Result<()> {
        let mut files = Vec::new();
        // One each: names may be as scarce as memory.
        for (number, bytes) in sizes.into_iter().enumerate() {
            let path = Path::new(FOLDER).join(format!("stagger-probe-{}-{number}", std::process::id()));
            let file = std::fs::File::options().write(true).create(true).truncate(true).open(&path)?;
            files.push(Probe(path));
            fill(file, bytes)?;
        }
        Ok(())
    };
    probe().map_err(|error| format!("{FOLDER}: {error}"))
}

#[cfg(not(target_os = "linux"))]
fn can_be_had(_sizes: [usize; 3]) -> Result<(), String> {
    Ok(())
}

/// A file that goes with its use.
#[cfg(target_os = "linux")]
struct Probe(PathBuf);

#[cfg(target_os = "linux")]
impl Drop for Probe {
    fn drop(&mut self) {
        // Whoever removed it before has done the same.
        let _ = std::fs::remove_file(&self.0);
    }
}

#[cfg(target_os = "linux")]
fn fill(mut file: std::fs::File, bytes: usize) -> std::io::Result<()> {
    let zeros = [0; 1 << 16];
    let mut left = bytes;
    while left > 0 {
        let piece = left.min(zeros.len());
        file.write_all(&zeros[..piece])?;
        left -= piece;
    }
    Ok(())
}

/// The files of Zenoh's segments that this process has mapped, as far as the system shows them.
pub fn mapped() -> BTreeSet<PathBuf> {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let files = maps.lines().filter_map(|line| line.split_once(FOLDER).map(|(_, name)| format!("{FOLDER}{name}")));
    files.filter(|file| file.ends_with(SUFFIX)).map(PathBuf::from).collect()
}

/// What one of `writers` may lock where every process locks what all of them have, in bytes.
fn share_of(limit: usize, writers: usize) -> usize {
    (limit / writers.max(1)).saturating_sub(BOOKKEEPING).min(LARGEST)
}

/// How much memory this process may lock, in bytes; `None` is as much as it likes.
static LOCKED_MEMORY_BYTES: LazyLock<Option<usize>> = LazyLock::new(locked_memory_bytes);

#[cfg(target_os = "linux")]
fn locked_memory_bytes() -> Option<usize> {
    use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};

    /// `CAP_IPC_LOCK` of linux/capability.h: no limit holds.
    const IPC_LOCK: u64 = 1 << 14;
    let (limit, _) = getrlimit(Resource::RLIMIT_MEMLOCK).ok()?;
    let read = |file: &str| std::fs::read_to_string(file).unwrap_or_default();
    let status = read("/proc/self/status");
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let capabilities = effective.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok()).unwrap_or_default();
    // A capability in a namespace of users does not count here.
    let outside = read("/proc/self/uid_map").split_whitespace().eq(["0", "0", "4294967295"]);
    let unlimited = limit == RLIM_INFINITY || outside && capabilities & IPC_LOCK != 0;
    (!unlimited).then(|| usize::try_from(limit).unwrap_or(usize::MAX))
}

#[cfg(not(target_os = "linux"))]
fn locked_memory_bytes() -> Option<usize> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::SharedMemory;

    /// Puts ten fields of some size, each of which must come out as it went in.
    fn put(pool: &Pool<SharedMemory>, bytes: usize) -> bool {
        let mut shared = true;
        for round in 0..10_u8 {
            let payload = vec![round; bytes];
            let placed = pool.place("field", &payload);
            shared &= placed.is_some();
            assert!(placed.is_none_or(|buffer| buffer[..] == payload));
        }
        shared
    }

    #[test]
    fn a_pool_grows_with_the_fields_and_keeps_within_its_budget() {
        let pool = Pool::within(32 << 20);
        assert!(put(&pool, 24_000));
        assert_eq!(pool.state().spent, SMALLEST, "a small scene locks little");
        assert!(put(&pool, 600_000));
        assert_eq!(pool.state().spent, SMALLEST + (16 << 20));
        assert!(!put(&pool, 8 << 20), "what does not fit goes through the socket");
        assert!(pool.state().spent <= 32 << 20);
        assert!(put(&pool, 24_000), "and what fits does not");
    }

    #[test]
    fn a_small_limit_of_locked_memory_is_shared_among_the_writers() {
        let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
        assert_eq!(mib(share_of(64 << 20, 4)), 14.0);
        assert_eq!(share_of(8 << 20, 4), 0);
        assert_eq!(share_of(usize::MAX, 4), LARGEST);
        let pool = Pool::within(0);
        assert!(!put(&pool, 24_000) && pool.state().segments.is_empty());
    }
}
