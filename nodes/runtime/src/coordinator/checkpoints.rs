//! Puts the nodes' snapshots and the coordinator's own state together to checkpoints.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex, PoisonError},
};

use bytes::Bytes;
use prost::Message as _;
use stagger_messages::{Checkpoint, Envelope, Snapshot};

use crate::link::{LinkError, Publisher};

/// Encoded snapshots by node: what a node is given that starts again.
pub type States = Arc<Mutex<BTreeMap<String, Bytes>>>;

/// The last whole checkpoint, and the one that is being put together.
pub struct Checkpoints {
    publisher: Publisher,
    states: States,
    last: Option<Checkpoint>,
    unfinished: Option<Checkpoint>,
}

impl Checkpoints {
    /// None yet; whole ones are put on `publisher`, for the recording.
    pub fn new(publisher: Publisher) -> Self {
        Self { publisher, states: States::default(), last: None, unfinished: None }
    }

    /// What the nodes are given.
    pub fn states(&self) -> States {
        Arc::clone(&self.states)
    }

    /// The last whole checkpoint.
    pub fn last(&self) -> Option<&Checkpoint> {
        self.last.as_ref()
    }

    /// Begins a checkpoint with the coordinator's part.
    pub fn begin(&mut self, envelope: Envelope, coordinator: Vec<u8>) {
        self.unfinished = Some(Checkpoint { envelope: Some(envelope), coordinator, nodes: Vec::new() });
    }

    /// Whether the nodes are still to hand over their states.
    pub fn asks(&self) -> bool {
        self.unfinished.is_some()
    }

    /// Forgets one that cannot be finished any more.
    pub fn drop_unfinished(&mut self) {
        self.unfinished = None;
    }

    /// Takes a node's part. With the last one the checkpoint is whole and takes the place of the one before.
    ///
    /// # Errors
    /// The link fails.
    pub fn receive(&mut self, snapshot: Snapshot, nodes: &BTreeSet<String>) -> Result<(), LinkError> {
        let about = |envelope: &Option<Envelope>| envelope.as_ref().and_then(|envelope| envelope.version);
        let Some(unfinished) = &mut self.unfinished else { return Ok(()) };
        if about(&snapshot.envelope) != about(&unfinished.envelope) {
            return Ok(());
        }
        unfinished.nodes.retain(|other| sender(other) != sender(&snapshot));
        unfinished.nodes.push(snapshot);
        if unfinished.nodes.len() < nodes.len() {
            return Ok(());
        }
        unfinished.nodes.sort_by(|a, b| sender(a).cmp(sender(b)));
        match self.unfinished.take() {
            Some(whole) => self.keep(whole),
            None => Ok(()),
        }
    }

    /// Makes a checkpoint the one to go on from.
    ///
    /// # Errors
    /// The link fails.
    pub fn keep(&mut self, checkpoint: Checkpoint) -> Result<(), LinkError> {
        let encoded = checkpoint.nodes.iter().map(|node| (sender(node).to_owned(), node.encode_to_vec().into()));
        *self.states.lock().unwrap_or_else(PoisonError::into_inner) = encoded.collect();
        self.publisher.put(None, checkpoint.encode_to_vec().into())?;
        self.last = Some(checkpoint);
        Ok(())
    }
}

fn sender(snapshot: &Snapshot) -> &str {
    snapshot.envelope.as_ref().map_or("", |envelope| &envelope.sender)
}
