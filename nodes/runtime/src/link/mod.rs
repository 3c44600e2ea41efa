//! The link between the processes of a run: the only file that knows Zenoh.
//!
//! A run is a star. The coordinator's session is the hub and listens, nodes connect to it as clients, or all connect to
//! a router; there is no scouting and no gossip, so nothing leaves the endpoints given. A node's put waits a minute for its
//! link; the hub, which forwards for all, gives a message to a node that takes nothing up after a second: what is lost is
//! asked for again, and a node that stays away loses its lease. Payloads of 3 KiB or more go through shared memory.

pub mod certificates;
pub mod endpoint;
pub mod router;
pub mod shared_memory;
pub mod turned_away;
pub mod words;
pub mod zenoh_config;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, OnceLock, PoisonError},
    time::Duration,
};

use bytes::Bytes;
use stagger_messages::Plan;
use zenoh::{
    Config, Session, Wait,
    bytes::ZBytes,
    key_expr::{OwnedKeyExpr, keyexpr},
    liveliness::LivelinessToken,
    pubsub,
    qos::{CongestionControl, Reliability},
    query, sample,
    sample::{Locality, SampleKind},
    shm::{GarbageCollect, PosixShmProviderBackend, ShmProvider, ShmProviderBuilder, ZShm, ZShmMut},
};

use crate::link::{
    certificates::CertificateProblem,
    shared_memory::{Pool, Segment},
    words::{tell_of, why_not, without_places},
    zenoh_config::settings,
};

/// Payloads of this many bytes or more go through shared memory; smaller ones cost less in the socket.
const SHARED_MEMORY_FROM: usize = 3 * 1024;

/// Why the processes of a run cannot talk.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// A configuration file that is not one.
    #[error("Zenoh configuration {}: {message}\nhint: expected Zenoh's JSON5; docs/several-hosts.md shows one", .path.display())]
    Config {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
    /// Certificates that cannot serve.
    #[error("cannot {what}: {source}")]
    Certificate {
        /// What was tried.
        what: String,
        /// What is wrong.
        source: CertificateProblem,
    },
    /// A session that does not open, a declaration or a put that fails.
    #[error("cannot {what}: {message}")]
    Zenoh {
        /// What was tried.
        what: String,
        /// What Zenoh said.
        message: String,
    },
}

fn failed(what: impl Into<String>) -> impl FnOnce(zenoh::Error) -> LinkError {
    let what = what.into();
    move |error| LinkError::Zenoh { what, message: without_places(&error.to_string()) }
}

/// Where in the star a process stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Role {
    /// Listens; the nodes' messages to each other pass through it.
    Hub {
        /// Endpoints such as `unixsock-stream//tmp/x/hub.sock` or `tcp/127.0.0.1:7447`.
        listen: Vec<String>,
    },
    /// Listens for everybody and takes no part in a run itself.
    Router {
        /// Endpoints.
        listen: Vec<String>,
    },
    /// Connects to the hub or, as the coordinator then does too, to a router.
    Node {
        /// The endpoint of the one that listens.
        connect: String,
    },
}

impl Role {
    /// The endpoints it listens on or connects to, for messages.
    #[must_use]
    pub fn endpoints(&self) -> String {
        match self {
            Self::Hub { listen } | Self::Router { listen } => listen.join(", "),
            Self::Node { connect } => connect.clone(),
        }
    }
}

/// A message as it came.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Key it was put on.
    pub key: String,
    /// Header; empty where there is none.
    pub attachment: Bytes,
    /// Body.
    pub payload: Bytes,
}

/// A session, shared by everything that runs in this process.
#[derive(Clone)]
pub struct Link {
    session: Session,
    /// Who hears every message first, where somebody does.
    first: Arc<OnceLock<First>>,
    pool: Arc<Pool<SharedMemory>>,
    /// Whether what is put goes through shared memory where nothing else is asked for: it ends with its process, and a
    /// hub that replays may end right after its last put.
    shares: bool,
}

type Receive = Arc<dyn Fn(Sample) + Send + Sync>;

/// The keys somebody hears first, and the subscriptions to some of them that come after it.
///
/// Zenoh calls the subscriptions of one session in no order, and those to what the session itself puts after the network
/// has it. A recording would get the fields a step rests on behind its acceptance, or a question behind its answers.
struct First {
    key: OwnedKeyExpr,
    receive: Receive,
    after: Arc<Mutex<After>>,
}

impl First {
    fn hear(&self, sample: &Sample) {
        (self.receive)(sample.clone());
        let matching: Vec<Receive> = {
            let after = self.after.lock().unwrap_or_else(PoisonError::into_inner);
            let here = |key: &OwnedKeyExpr| keyexpr::new(&sample.key).is_ok_and(|arrived| key.intersects(arrived));
            after.receivers.values().filter(|(key, _)| here(key)).map(|(_, receive)| Arc::clone(receive)).collect()
        };
        for receive in matching {
            receive(sample.clone());
        }
    }

    /// Whether every message on `key` is heard.
    fn covers(&self, key: &keyexpr) -> bool {
        self.key.includes(key)
    }
}

#[derive(Default)]
struct After {
    count: u64,
    receivers: BTreeMap<u64, (OwnedKeyExpr, Receive)>,
}

/// Takes a subscription back.
struct Leave {
    number: u64,
    after: Arc<Mutex<After>>,
}

impl Drop for Leave {
    fn drop(&mut self) {
        self.after.lock().unwrap_or_else(PoisonError::into_inner).receivers.remove(&self.number);
    }
}

/// Stops what it stands for when dropped.
pub struct Declaration(#[expect(dead_code, reason = "held for its drop")] Kind);

enum Kind {
    Subscriber(#[expect(dead_code, reason = "held for its drop")] pubsub::Subscriber<()>),
    Queryable(#[expect(dead_code, reason = "held for its drop")] query::Queryable<()>),
    Token(#[expect(dead_code, reason = "held for its drop")] LivelinessToken),
    After(#[expect(dead_code, reason = "held for its drop")] Leave),
}

impl Link {
    /// Opens a session as `role`; `config` is a Zenoh configuration file. The role's mode and endpoints win over it.
    ///
    /// # Errors
    /// The configuration is not valid, or the endpoint cannot be listened on or reached.
    pub fn open(role: &Role, config: Option<&Path>) -> Result<Self, LinkError> {
        Self::open_as(role, config, None)
    }

    /// As [`Link::open`], for the member of a run of this name.
    ///
    /// # Errors
    /// As [`Link::open`].
    pub fn open_as(role: &Role, config: Option<&Path>, name: Option<&str>) -> Result<Self, LinkError> {
        let verb = if matches!(role, Role::Node { .. }) { "connect to" } else { "listen on" };
        let what = format!("{verb} {}", role.endpoints());
        let settings = settings(role, config)?;
        let problem = |source| LinkError::Certificate { what: what.clone(), source };
        let shown = certificates::look_at(&settings, role).map_err(problem)?;
        tell_of(role, &settings, shown.as_ref(), name);
        let settings = Config::from_json5(&settings.to_string()).map_err(|error| LinkError::Config {
            // Ours alone is valid: what is not comes from the file.
            path: config.unwrap_or(Path::new("built in")).into(),
            message: error.to_string(),
        })?;
        let session = zenoh::open(settings).wait().map_err(failed(what)).map_err(|error| why_not(error, role))?;
        Ok(Self { session, first: Arc::default(), pool: Arc::default(), shares: matches!(role, Role::Node { .. }) })
    }

    /// Prepares to put on `key` what is asked for again where it is lost.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn publisher(&self, key: String) -> Result<Publisher, LinkError> {
        self.declare(key, CongestionControl::Drop)
    }

    /// Prepares to put on `key` what every reader is waited for with: for a minute, after which it is cut off.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn publisher_that_waits(&self, key: String) -> Result<Publisher, LinkError> {
        self.declare(key, CongestionControl::Block)
    }

    fn declare(&self, key: String, when_congested: CongestionControl) -> Result<Publisher, LinkError> {
        let publisher = self
            .session
            .declare_publisher(key.clone())
            .congestion_control(when_congested)
            .reliability(Reliability::Reliable)
            .express(true)
            .wait()
            .map_err(failed(format!("declare {key}")))?;
        Ok(Publisher { publisher, first: Arc::clone(&self.first), pool: self.shares.then(|| Arc::clone(&self.pool)) })
    }

    /// Prepares to put on `key`, large payloads through shared memory, also from the hub.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn publisher_sharing(&self, key: String) -> Result<Publisher, LinkError> {
        Ok(Publisher { pool: Some(Arc::clone(&self.pool)), ..self.publisher(key)? })
    }

    /// Prepares to put on `key` through the socket whatever the size: for what must outlive this process, whose shared
    /// memory ends with it.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn publisher_by_socket(&self, key: String) -> Result<Publisher, LinkError> {
        Ok(Publisher { pool: None, ..self.publisher(key)? })
    }

    /// Says who writes into shared memory in a run, of whom each may have to lock what all of them have: its nodes, and the
    /// coordinator where fields are accelerated.
    pub fn share_memory(&self, plan: &Plan) {
        self.pool.share(plan.nodes.len() + 1);
    }

    /// Says that the nodes were asked for a trial, anew or `again`: what was put into shared memory is asked for again where it
    /// does not reach its readers, and then goes through the socket.
    pub fn asked(&self, again: bool) {
        self.pool.asked(again);
    }

    /// Has `receive` called for every message on `key`. It runs on Zenoh's thread: it may enqueue, not put.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn subscribe(
        &self,
        key: &str,
        receive: impl Fn(Sample) + Send + Sync + 'static,
    ) -> Result<Declaration, LinkError> {
        if let Some(first) = self.first.get() {
            let key = key_expression(key)?;
            if first.covers(&key) {
                let mut after = first.after.lock().unwrap_or_else(PoisonError::into_inner);
                let number = after.count;
                after.count += 1;
                after.receivers.insert(number, (key, Arc::new(receive)));
                return Ok(Declaration(Kind::After(Leave { number, after: Arc::clone(&first.after) })));
            }
        }
        let subscriber = self
            .session
            .declare_subscriber(key.to_owned())
            .callback(move |sample| receive(to_sample(&sample)))
            .wait()
            .map_err(failed(format!("subscribe to {key}")))?;
        Ok(Declaration(Kind::Subscriber(subscriber)))
    }

    /// As [`Link::subscribe`], and called first: before every later subscription to some of these keys, and before what
    /// this process puts on them leaves it. Those later ones hear nothing any more once the returned value is dropped.
    ///
    /// # Errors
    /// The key is not valid; somebody hears first already.
    pub fn subscribe_first(
        &self,
        key: &str,
        receive: impl Fn(Sample) + Send + Sync + 'static,
    ) -> Result<Declaration, LinkError> {
        let first = First { key: key_expression(key)?, receive: Arc::new(receive), after: Arc::default() };
        self.first.set(first).map_err(|_| LinkError::Zenoh {
            what: format!("subscribe to {key}"),
            message: "another subscription hears first".into(),
        })?;
        let first = Arc::clone(&self.first);
        let subscriber = self
            .session
            .declare_subscriber(key.to_owned())
            .allowed_origin(Locality::Remote)
            .callback(move |sample| {
                if let Some(first) = first.get() {
                    first.hear(&to_sample(&sample));
                }
            })
            .wait()
            .map_err(failed(format!("subscribe to {key}")))?;
        Ok(Declaration(Kind::Subscriber(subscriber)))
    }

    /// Answers every query for `key` with the messages `reply` gives, each on a key of its own under it.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn queryable(
        &self,
        key: &str,
        reply: impl Fn() -> Vec<Sample> + Send + 'static,
    ) -> Result<Declaration, LinkError> {
        // An answer may be long, and waits for its reader; Zenoh's thread, which has to carry it away, must not.
        let (ask, asked) = std::sync::mpsc::channel::<query::Query>();
        let answering = move || {
            for query in asked {
                for Sample { key, attachment, payload } in reply() {
                    // A querier that is gone needs no answer.
                    let _ = query.reply(key, payload).attachment(attachment).wait();
                }
            }
        };
        let thread = std::thread::Builder::new().name("answers".into()).spawn(answering);
        thread.map_err(|error| failed(format!("start a thread to answer on {key}"))(error.into()))?;
        let queryable = self
            .session
            .declare_queryable(key.to_owned())
            .callback(move |query| {
                // The thread ends with this callback, not before.
                let _ = ask.send(query);
            })
            .wait()
            .map_err(failed(format!("answer on {key}")))?;
        Ok(Declaration(Kind::Queryable(queryable)))
    }

    /// Asks for `key` and returns all answers that come in time.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn query(&self, key: &str, patience: Duration) -> Result<Vec<Sample>, LinkError> {
        let replies = self.session.get(key).timeout(patience).wait().map_err(failed(format!("query {key}")))?;
        let answers = std::iter::from_fn(|| replies.recv().ok()).filter_map(|reply| reply.into_result().ok());
        Ok(answers.map(|sample| to_sample(&sample)).collect())
    }

    /// Shows `key` as alive until the returned value is dropped or this process ends.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn announce(&self, key: &str) -> Result<Declaration, LinkError> {
        let token = self
            .session
            .liveliness()
            .declare_token(key.to_owned())
            .wait()
            .map_err(failed(format!("announce {key}")))?;
        Ok(Declaration(Kind::Token(token)))
    }

    /// Has `receive` called with each key under `key` that appears (`true`) or is gone (`false`), present ones first.
    ///
    /// # Errors
    /// The key is not valid.
    pub fn watch(
        &self,
        key: &str,
        receive: impl Fn(String, bool) + Send + Sync + 'static,
    ) -> Result<Declaration, LinkError> {
        let subscriber = self
            .session
            .liveliness()
            .declare_subscriber(key.to_owned())
            .history(true)
            .callback(move |sample| receive(sample.key_expr().to_string(), sample.kind() == SampleKind::Put))
            .wait()
            .map_err(failed(format!("watch {key}")))?;
        Ok(Declaration(Kind::Subscriber(subscriber)))
    }

    /// Ends the session after everything put has left.
    ///
    /// # Errors
    /// The links do not close in time.
    pub fn close(&self) -> Result<(), LinkError> {
        self.session.close().wait().map_err(failed("close the session"))
    }
}

/// Puts messages on one key.
pub struct Publisher {
    publisher: pubsub::Publisher<'static>,
    first: Arc<OnceLock<First>>,
    pool: Option<Arc<Pool<SharedMemory>>>,
}

impl Publisher {
    /// Whether somebody subscribes to the key.
    ///
    /// # Errors
    /// The session is closed.
    pub fn has_reader(&self) -> Result<bool, LinkError> {
        if self.first.get().is_some_and(|first| first.covers(self.publisher.key_expr())) {
            return Ok(true);
        }
        let status = self.publisher.matching_status().wait();
        Ok(status.map_err(failed(format!("look for readers of {}", self.publisher.key_expr())))?.matching())
    }

    /// Puts one message.
    ///
    /// # Errors
    /// The session is closed.
    pub fn put(&self, attachment: Option<Vec<u8>>, payload: Bytes) -> Result<(), LinkError> {
        self.put_through(self.pool.as_deref(), attachment, payload)
    }

    /// Puts a field; `again` through the socket whatever its size, which reaches a reader to whom shared memory does not.
    ///
    /// # Errors
    /// The session is closed.
    pub fn put_field(&self, attachment: Vec<u8>, payload: Bytes, again: bool) -> Result<(), LinkError> {
        let pool = self.pool.as_deref().filter(|_| !again);
        self.put_through(pool, Some(attachment), payload)
    }

    fn put_through(
        &self,
        pool: Option<&Pool<SharedMemory>>,
        attachment: Option<Vec<u8>>,
        payload: Bytes,
    ) -> Result<(), LinkError> {
        let key = self.publisher.key_expr().as_str();
        if let Some(first) = self.first.get().filter(|first| first.covers(self.publisher.key_expr())) {
            let attachment = attachment.clone().map(Bytes::from).unwrap_or_default();
            first.hear(&Sample { key: key.to_owned(), attachment, payload: payload.clone() });
        }
        let pool = pool.filter(|_| payload.len() >= SHARED_MEMORY_FROM);
        let body = match pool.and_then(|pool| pool.place(key, &payload)) {
            Some(buffer) => buffer.into(),
            None => ZBytes::from(payload),
        };
        self.publisher.put(body).attachment(attachment).wait().map_err(failed(format!("put {key}")))
    }
}

/// A segment of the memory that Zenoh's sessions on one host share.
pub struct SharedMemory {
    provider: ShmProvider<PosixShmProviderBackend>,
    /// The files it is in, as far as the system shows them.
    files: Vec<PathBuf>,
}

impl SharedMemory {
    fn allocate(&self, bytes: usize) -> Option<ZShmMut> {
        self.provider.alloc(bytes).with_policy::<GarbageCollect>().wait().ok()
    }
}

impl Segment for SharedMemory {
    type Buffer = ZShm;

    fn create(bytes: usize) -> Result<Self, String> {
        shared_memory::has_room(bytes)?;
        let before = shared_memory::mapped();
        let words = |error: zenoh::Error| without_places(&error.to_string());
        let provider = ShmProviderBuilder::default_backend(bytes).wait().map_err(words)?;
        let mut segment = Self { provider, files: Vec::new() };
        // With the first allocation of a process Zenoh makes the segment it keeps its books in.
        drop(segment.allocate(1));
        segment.files = shared_memory::mapped().into_iter().filter(|file| !before.contains(file)).collect();
        Ok(segment)
    }

    fn is_there(&self) -> bool {
        self.files.iter().all(|file| file.exists())
    }

    fn copy(&self, payload: &[u8]) -> Option<ZShm> {
        // Before, not only when it is full: memory that was used is warm.
        self.provider.garbage_collect();
        let mut buffer = self.allocate(payload.len())?;
        buffer.as_mut().copy_from_slice(payload);
        Some(buffer.into())
    }
}

fn key_expression(key: &str) -> Result<OwnedKeyExpr, LinkError> {
    OwnedKeyExpr::new(key).map_err(failed(format!("subscribe to {key}")))
}

fn to_sample(sample: &sample::Sample) -> Sample {
    Sample {
        key: sample.key_expr().to_string(),
        attachment: sample.attachment().map(contiguous).unwrap_or_default(),
        payload: contiguous(sample.payload()),
    }
}

/// The bytes in one piece. What lies in shared memory is copied out at once: its owner may reuse the buffer later,
/// and a reader keeps committed fields for longer than that.
fn contiguous(bytes: &ZBytes) -> Bytes {
    struct Piece(ZBytes);
    impl AsRef<[u8]> for Piece {
        fn as_ref(&self) -> &[u8] {
            self.0.slices().next().unwrap_or_default()
        }
    }
    if bytes.as_shm().is_none() && bytes.slices().count() == 1 {
        Bytes::from_owner(Piece(bytes.clone()))
    } else {
        bytes.to_bytes().into_owned().into()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn what_subscribes_first_hears_every_message_first_from_near_and_far() {
        let folder = tempfile::tempdir().unwrap();
        let endpoint = format!("unixsock-stream/{}/hub.sock", folder.path().display());
        let hub = Link::open(&Role::Hub { listen: vec![endpoint.clone()] }, None).unwrap();
        let node = Link::open(&Role::Node { connect: endpoint }, None).unwrap();
        let (tell, told) = mpsc::channel();
        let hears = |who: usize| {
            let tell = Mutex::new(tell.clone());
            move |sample: Sample| tell.lock().unwrap().send((who, sample.key)).unwrap()
        };
        let _first = hub.subscribe_first("run/**", hears(0)).unwrap();
        let mut later: Vec<Declaration> =
            (1..6).map(|who| hub.subscribe(["run/*/0", "run/*/1"][who % 2], hears(who)).unwrap()).collect();
        let near = hub.publisher("run/field/0".into()).unwrap();
        let far = node.publisher("run/field/1".into()).unwrap();
        let order = |publisher: &Publisher, readers: usize| {
            publisher.put(None, Bytes::from_static(b"1")).unwrap();
            let patience = Duration::from_secs(20);
            let heard: Vec<_> = (0..readers).map(|_| told.recv_timeout(patience).unwrap().0).collect();
            assert!(told.recv_timeout(Duration::from_millis(20)).is_err(), "each hears it once");
            heard
        };
        // What leaves has been heard: here nobody but the first hears it.
        hub.publisher("run/alone".into()).unwrap().put(None, Bytes::new()).unwrap();
        assert_eq!(told.try_recv().unwrap(), (0, "run/alone".to_owned()));
        assert_eq!(order(&near, 3), [0, 2, 4]);
        assert_eq!(order(&far, 4), [0, 1, 3, 5]);
        // Who leaves hears nothing more.
        later.remove(2);
        assert_eq!(order(&far, 3), [0, 1, 5]);
    }
}
