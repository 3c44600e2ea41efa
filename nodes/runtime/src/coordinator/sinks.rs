//! What takes the messages of a run while it goes on: its recording, and a viewer.

use std::{
    collections::BTreeMap,
    sync::atomic::{AtomicBool, Ordering},
};

use bytes::Bytes;
use prost::Message as _;
use stagger_messages::{Manifest, keys};
use stagger_recordings::{Exchange, RecorderSender};

use crate::{
    coordinator::backpressure::Backpressure,
    diagnostics,
    link::{Declaration, Link, LinkError},
    run::outputs::OutputError,
};

/// What takes the messages of a run.
pub trait Sink {
    /// The way in.
    fn sender(&self) -> RecorderSender;

    /// Whether the run waits for it. One that is not waited for is left behind where it cannot keep up.
    fn is_waited_for(&self) -> bool;

    /// The nodes fit together, and the run begins.
    ///
    /// # Errors
    /// Its output cannot have its name.
    fn begin(&mut self) -> Result<(), OutputError> {
        Ok(())
    }
}

/// The sinks of a run, which hear every message until this is dropped.
pub struct Sinks<'a> {
    sinks: Vec<&'a mut dyn Sink>,
    run: String,
    _subscription: Option<Declaration>,
}

impl<'a> Sinks<'a> {
    /// Has them hear all messages of `run` from now on, each before anybody else in this process does.
    ///
    /// # Errors
    /// The link fails.
    pub fn attach(link: &Link, run: &str, sinks: Vec<&'a mut dyn Sink>) -> Result<Self, LinkError> {
        let (waited, others): (Vec<_>, Vec<_>) = sinks.iter().partition(|sink| sink.is_waited_for());
        let senders = |sinks: Vec<&&'a mut dyn Sink>| sinks.into_iter().map(|sink| sink.sender()).collect::<Vec<_>>();
        let (waited, others) = (senders(waited), senders(others));
        let others: Vec<_> = others.into_iter().map(|sender| (sender, AtomicBool::new(false))).collect();
        let take = move |exchange: Exchange| {
            for (sender, behind) in &others {
                if !behind.load(Ordering::Relaxed)
                    && (!sender.has_room(&exchange) || sender.push(exchange.clone()).is_err())
                {
                    behind.store(true, Ordering::Relaxed);
                    diagnostics::warn("the viewer has ended or cannot keep up: the run goes on without it");
                }
            }
            // Transport threads must not wait: `Backpressure` does, and tells where the recording has ended.
            for sender in &waited {
                let _ = sender.hand_over(exchange.clone());
            }
        };
        let subscription = if sinks.is_empty() {
            None
        } else {
            Some(link.subscribe_first(&keys::all(run), move |sample| {
                let topic = keys::topic(&sample.key);
                Exchange::from_parts(topic, sample.attachment, sample.payload).into_iter().for_each(&take);
            })?)
        };
        Ok(Self { sinks, run: run.into(), _subscription: subscription })
    }

    /// Hands over what the nodes have said of themselves.
    pub fn manifests(&self, manifests: &BTreeMap<String, Manifest>) {
        for (node, manifest) in manifests {
            let key = keys::manifest(&self.run, node);
            let Some(exchange) = Exchange::from_parts(keys::topic(&key), Bytes::new(), manifest.encode_to_vec().into())
            else {
                continue;
            };
            for sink in &self.sinks {
                // One that has ended tells so itself, or is left behind with the first message.
                let _ = sink.sender().push(exchange.clone());
            }
        }
    }

    /// The nodes fit together, and the run begins.
    ///
    /// # Errors
    /// An output cannot have its name.
    pub fn begin(&mut self) -> Result<(), OutputError> {
        self.sinks.iter_mut().try_for_each(|sink| sink.begin())
    }

    /// What the run waits for between iterations; `None` where it is not recorded.
    #[must_use]
    pub fn backpressure(&self) -> Option<Backpressure> {
        self.sinks.iter().find(|sink| sink.is_waited_for()).map(|sink| Backpressure::of(sink.sender()))
    }
}
