//! Nodes as threads of this process, sharing its session: the same code path without the sockets.

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::Sender,
    },
    thread::JoinHandle,
};

use stagger_coupling::Participant;

use crate::{
    coordinator::Supervisor,
    link::{Link, LinkError},
    node::host::{Event, Host, HostError, Identity, NodeEnd},
};

/// A host on a thread of its own.
type HostThread = JoinHandle<Result<NodeEnd, HostError>>;

/// Nodes that run as threads.
pub struct Threads {
    threads: BTreeMap<String, (Option<HostThread>, Sender<Event>)>,
    interrupted: Arc<AtomicBool>,
}

impl Threads {
    /// Starts a thread for each participant.
    ///
    /// # Errors
    /// The link fails.
    pub fn start(
        link: &Link,
        run: &str,
        scene_hash: u64,
        participants: BTreeMap<String, Box<dyn Participant>>,
        interrupted: Arc<AtomicBool>,
    ) -> Result<Self, LinkError> {
        let mut threads = BTreeMap::new();
        for (node, participant) in participants {
            let identity = Identity { run: run.into(), node: node.clone(), scene_hash };
            let host = Host::new(link, identity, participant)?;
            let sender = host.sender();
            threads.insert(node, (Some(std::thread::spawn(move || host.run())), sender));
        }
        Ok(Self { threads, interrupted })
    }

    /// Whether a node of that name is one of them.
    #[must_use]
    pub fn has(&self, node: &str) -> bool {
        self.threads.contains_key(node)
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        for (thread, sender) in self.threads.values_mut() {
            // A host that has ended hears nothing, and its result was its FinalReport.
            let _ = sender.send(Event::Abandoned);
            if let Some(thread) = thread.take() {
                let _ = thread.join();
            }
        }
    }
}

impl Supervisor for Threads {
    fn why_it_ended(&mut self, node: &str) -> String {
        let thread = self.threads.get_mut(node).and_then(|(thread, _)| thread.take());
        match thread.map(JoinHandle::join) {
            Some(Ok(Err(error))) => error.to_string(),
            Some(Ok(Ok(end))) => format!("it ended: {end:?}"),
            Some(Err(_)) => "its thread panicked".into(),
            None => "it said nothing".into(),
        }
    }

    fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn restart(&mut self, _node: &str) -> Result<(), String> {
        Err("it is a thread of this process".into())
    }

    fn ended_early(&mut self) -> Option<String> {
        let ended = |thread: &Option<HostThread>| thread.as_ref().is_some_and(JoinHandle::is_finished);
        self.threads.iter().find_map(|(name, (thread, _))| ended(thread).then(|| name.clone()))
    }
}
