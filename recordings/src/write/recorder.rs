//! The recorder: takes the messages of a run and writes them on a thread of its own.

use std::{
    collections::BTreeSet,
    io::Write,
    sync::{
        Arc, OnceLock,
        atomic::{AtomicU64, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use bytes::Bytes;

use crate::{
    RecordingError, RunInfo,
    write::{
        queue::{Popped, Queue},
        record_writer::RecordWriter,
    },
};

/// How long a message may wait for the operating system: a run that is killed loses no more than this.
const FLUSH_AFTER: Duration = Duration::from_millis(500);
/// How often a recording that is being closed is looked at.
const LOOK: Duration = Duration::from_millis(5);

/// Which iterations' fields are kept. Control messages always are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Level {
    /// Every exchange.
    #[default]
    All,
    /// Fields of accepted iterations.
    Accepted,
}

/// What is recorded, and how much may wait to be written.
#[derive(Clone, Debug)]
pub struct RecorderOptions {
    /// Which iterations' fields are kept.
    pub level: Level,
    /// Keeps the fields of each n-th accepted step, of the start and of the last step; above 1 the level is
    /// [`Level::Accepted`].
    pub every: u64,
    /// Whether checkpoints will come: what was solved since the last one may be solved, and sent, once more.
    pub checkpoints: bool,
    /// Names of the fields to keep; `None` keeps all.
    pub fields: Option<BTreeSet<String>>,
    /// Simulated time from one picture for other programs' viewers to the next, in s; `None` takes none.
    pub frame_period_s: Option<f64>,
    /// Bytes that may wait to be written before whoever makes them is made to wait.
    pub queue_bytes: usize,
    /// How long the output may take nothing before it is given up.
    pub patience: Duration,
    /// How large the output may become, in bytes, where the system ends a process that writes more.
    pub largest_bytes: Option<u64>,
    /// Whether the run was on its way when it began to be heard: epoch and version may then be any that follow.
    pub joined: bool,
}

impl Default for RecorderOptions {
    fn default() -> Self {
        Self {
            level: Level::All,
            every: 1,
            checkpoints: false,
            fields: None,
            frame_period_s: None,
            queue_bytes: 256 << 20,
            patience: Duration::from_secs(30),
            largest_bytes: None,
            joined: false,
        }
    }
}

/// Type of a control message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlKind {
    /// [`stagger_messages::Directive`].
    Directive,
    /// [`stagger_messages::Report`].
    Report,
    /// [`stagger_messages::Manifest`].
    Manifest,
    /// [`stagger_messages::Checkpoint`].
    Checkpoint,
}

/// One message as it went over the wire.
#[derive(Clone, Debug)]
pub enum Exchange {
    /// A field.
    Field {
        /// Its key behind the run's name: `field/particles/positions`.
        topic: String,
        /// The field without its values.
        attachment: Bytes,
        /// The values.
        payload: Bytes,
    },
    /// A control message.
    Control {
        /// Its key behind the run's name: `ctl/directive`.
        topic: String,
        /// The message.
        message: Bytes,
        /// Its type.
        kind: ControlKind,
    },
}

impl Exchange {
    /// A message by its topic: `field/…`, `ctl/…`, `done/…`, `meta/…` or `checkpoint`. `None` for what is not recorded.
    #[must_use]
    pub fn from_parts(topic: &str, attachment: Bytes, payload: Bytes) -> Option<Self> {
        let kind = match topic.split('/').next() {
            Some("field") => return Some(Self::Field { topic: topic.into(), attachment, payload }),
            Some("ctl") => ControlKind::Directive,
            Some("done") => ControlKind::Report,
            Some("meta") => ControlKind::Manifest,
            Some("checkpoint") => ControlKind::Checkpoint,
            _ => return None,
        };
        Some(Self::Control { topic: topic.into(), message: payload, kind })
    }

    fn bytes(&self) -> usize {
        // What the queue itself spends on an entry; it keeps a flood of empty messages bounded too.
        const ENTRY_BYTES: usize = 128;
        let content = match self {
            Self::Field { topic, attachment, payload } => topic.len() + attachment.len() + payload.len(),
            Self::Control { topic, message, .. } => topic.len() + message.len(),
        };
        ENTRY_BYTES + content
    }
}

/// What became of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Messages in the file.
    pub messages: u64,
    /// Bytes of field values in the file.
    pub field_bytes: u64,
    /// Bytes of what is there for other programs' viewers only.
    pub display_bytes: u64,
    /// Size of the file.
    pub file_bytes: u64,
    /// Messages that were sent but never reached the recorder, from gaps in the senders' numbering; those of an epoch that
    /// is over only up to the checkpoint from which all was solved, and sent, again.
    pub lost: u64,
    /// Messages that could not be decoded or are not this run's own, and are not in the file.
    pub refused: u64,
}

/// Writes a run to MCAP on a thread of its own.
///
/// Nothing is dropped. Who must not wait hands messages over ([`RecorderSender::hand_over`]), and whoever causes them waits
/// between two rounds until the disk has caught up ([`RecorderSender::catch_up`]): what waits is bounded by
/// [`RecorderOptions::queue_bytes`] and the messages of one round. An output that takes nothing for
/// [`RecorderOptions::patience`] is given up with an error. A recorder that is dropped without [`Recorder::finish`] still
/// closes its file.
pub struct Recorder {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Result<Recorded, RecordingError>>>,
}

/// Hands messages to a [`Recorder`].
#[derive(Clone)]
pub struct RecorderSender {
    shared: Arc<Shared>,
}

struct Shared {
    queue: Queue<(Exchange, u64)>,
    failure: OnceLock<String>,
    /// Bytes the output has taken.
    written: Arc<AtomicU64>,
    patience: Duration,
}

impl Shared {
    fn failure(&self) -> RecordingError {
        match self.failure.get() {
            Some(cause) => RecordingError::Write(cause.clone()),
            None => RecordingError::Closed,
        }
    }

    /// Waits until `done`, as long as the output takes something within the patience.
    fn wait_until(&self, mut done: impl FnMut() -> bool) -> Result<(), RecordingError> {
        let (mut taken, mut since) = (self.progress(), Instant::now());
        while !done() {
            let now = self.progress();
            if now != taken {
                (taken, since) = (now, Instant::now());
            } else if since.elapsed() >= self.patience {
                let stalled = format!("the disk has taken nothing for {:.0} s", self.patience.as_secs_f64());
                // Set once; who came first had the same reason or a better one.
                let _ = self.failure.set(stalled);
                self.queue.close();
                return Err(self.failure());
            }
        }
        Ok(())
    }

    /// Waits until the thread has ended. One that never comes back from the disk is left to the end of the process.
    fn wait_for<T>(&self, thread: &JoinHandle<T>) -> Result<(), RecordingError> {
        self.wait_until(|| {
            let finished = thread.is_finished();
            if !finished {
                std::thread::sleep(LOOK);
            }
            finished
        })
    }

    fn progress(&self) -> (u64, usize) {
        (self.written.load(Ordering::Relaxed), self.queue.bytes())
    }
}

/// Closes the queue when the thread ends, however it ends: nobody may wait for a writer that is gone.
struct CloseAtEnd(Arc<Shared>);

impl Drop for CloseAtEnd {
    fn drop(&mut self) {
        self.0.queue.close();
    }
}

impl Recorder {
    /// Starts recording into `output`, which is written front to back, without seeking.
    ///
    /// # Errors
    /// The head of the file cannot be written, or the thread cannot be started.
    pub fn create(
        output: impl Write + Send + 'static,
        info: &RunInfo,
        options: RecorderOptions,
    ) -> Result<Self, RecordingError> {
        let bytes = Arc::new(AtomicU64::new(0));
        let output = Counted { output, bytes: Arc::clone(&bytes), largest: options.largest_bytes.unwrap_or(u64::MAX) };
        let mut writer = RecordWriter::create(output, info, &options)?;
        let shared = Arc::new(Shared {
            queue: Queue::new(options.queue_bytes),
            failure: OnceLock::new(),
            written: Arc::clone(&bytes),
            patience: options.patience,
        });
        let work = {
            let shared = Arc::clone(&shared);
            move || {
                let _close = CloseAtEnd(Arc::clone(&shared));
                let result = drain(&shared.queue, &mut writer).and_then(|()| writer.finish());
                if let Err(error) = &result {
                    let cause = match error {
                        RecordingError::Write(cause) => cause.clone(),
                        other => other.to_string(),
                    };
                    // Set once, here.
                    let _ = shared.failure.set(cause);
                }
                result.map(|recorded| Recorded { file_bytes: bytes.load(Ordering::Relaxed), ..recorded })
            }
        };
        let thread = std::thread::Builder::new().name("recorder".into()).spawn(work).map_err(RecordingError::Thread)?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// A handle for handing over messages.
    #[must_use]
    pub fn sender(&self) -> RecorderSender {
        RecorderSender { shared: Arc::clone(&self.shared) }
    }

    /// Writes what waits, then the index, and closes the file.
    ///
    /// # Errors
    /// Something could not be written, now or earlier.
    pub fn finish(mut self) -> Result<Recorded, RecordingError> {
        self.shared.queue.close();
        let thread = self.thread.take().ok_or(RecordingError::Closed)?;
        self.shared.wait_for(&thread)?;
        let broken = |_| Err(RecordingError::Write("the recorder's thread broke down".into()));
        let recorded = thread.join().unwrap_or_else(broken)?;
        // What was given up lacks messages, even where the disk came back later.
        if self.shared.failure.get().is_some() { Err(self.shared.failure()) } else { Ok(recorded) }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.shared.queue.close();
        // Whoever wants to know the outcome calls `finish`.
        if let Some(thread) = self.thread.take()
            && self.shared.wait_for(&thread).is_ok()
        {
            let _ = thread.join();
        }
    }
}

impl RecorderSender {
    /// Whether [`Self::push`] would hand over this message without waiting.
    #[must_use]
    pub fn has_room(&self, exchange: &Exchange) -> bool {
        self.shared.queue.has_room(exchange.bytes())
    }

    /// Hands over a message; waits while the queue is full.
    ///
    /// # Errors
    /// Writing has failed, or the recorder has finished: the message will not be in the file.
    pub fn push(&self, exchange: Exchange) -> Result<(), RecordingError> {
        let bytes = exchange.bytes();
        self.put(|queue, item| queue.push(item, bytes), exchange)
    }

    /// Hands over a message without waiting, whatever waits already: whoever caused it calls [`Self::catch_up`] before
    /// it causes more.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn hand_over(&self, exchange: Exchange) -> Result<(), RecordingError> {
        let bytes = exchange.bytes();
        self.put(|queue, item| queue.append(item, bytes), exchange)
    }

    /// Waits until no more than [`RecorderOptions::queue_bytes`] wait to be written; returns how long that took.
    ///
    /// # Errors
    /// Writing has failed, the recorder has finished, or the output took nothing for the recorder's patience.
    pub fn catch_up(&self) -> Result<Duration, RecordingError> {
        let since = Instant::now();
        let queue = &self.shared.queue;
        let room = queue.wait_for_room(Duration::ZERO);
        if !room {
            self.shared.wait_until(|| queue.wait_for_room(LOOK))?;
        }
        if queue.is_closed() {
            return Err(self.shared.failure());
        }
        Ok(if room { Duration::ZERO } else { since.elapsed() })
    }

    fn put(
        &self,
        put: impl FnOnce(&Queue<(Exchange, u64)>, (Exchange, u64)) -> bool,
        exchange: Exchange,
    ) -> Result<(), RecordingError> {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let now_ns = u64::try_from(since.as_nanos()).unwrap_or(u64::MAX);
        if put(&self.shared.queue, (exchange, now_ns)) { Ok(()) } else { Err(self.shared.failure()) }
    }
}

fn drain<W: Write>(queue: &Queue<(Exchange, u64)>, writer: &mut RecordWriter<W>) -> Result<(), RecordingError> {
    let mut flush_at: Option<Instant> = None;
    loop {
        match queue.pop(flush_at.unwrap_or_else(|| Instant::now() + FLUSH_AFTER)) {
            Popped::Item((exchange, publish_ns)) => {
                writer.take(exchange, publish_ns)?;
                flush_at = flush_at.or_else(|| Some(Instant::now() + FLUSH_AFTER));
            }
            Popped::TimedOut => {}
            Popped::Closed => return Ok(()),
        }
        if flush_at.is_some_and(|at| at <= Instant::now()) {
            writer.flush()?;
            flush_at = None;
        }
    }
}

struct Counted<W> {
    output: W,
    bytes: Arc<AtomicU64>,
    largest: u64,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        let room = self.largest.saturating_sub(self.bytes.load(Ordering::Relaxed));
        if room == 0 && !buffer.is_empty() {
            let limit = format!("it would grow beyond the {} bytes that a file may have (`ulimit -f`)", self.largest);
            return Err(std::io::Error::new(std::io::ErrorKind::FileTooLarge, limit));
        }
        let allowed = usize::try_from(room).map_or(buffer.len(), |room| room.min(buffer.len()));
        let written = self.output.write(&buffer[..allowed])?;
        self.bytes.fetch_add(written as u64, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.output.flush()
    }
}
