//! What the coordinator hears of the nodes, and says to them.

use std::{
    collections::BTreeMap,
    sync::mpsc::RecvTimeoutError,
    time::{Duration, Instant},
};

use prost::Message as _;
use stagger_coupling::{COORDINATOR, Outcome};
use stagger_messages::{
    Decision, Directive, Envelope, Report, SCHEMA_VERSION, Snapshot, Version, codec, directive, keys, report,
};

use super::{Remote, RunError, remote::Event};
use crate::link::{LinkError, Sample};

impl Remote<'_> {
    pub(super) fn liveliness_changed(&mut self, key: &str, alive: bool) {
        let Some((node, instance)) = keys::parse_live(key).filter(|(node, _)| self.nodes.contains(*node)) else {
            return;
        };
        if alive {
            if !self.evicted.contains(&(node.into(), instance.into())) {
                self.alive.entry(node.into()).or_default().insert(instance.into());
            }
        } else if let Some(instances) = self.alive.get_mut(node) {
            instances.remove(instance);
            if instances.is_empty() {
                self.alive.remove(node);
            }
        }
    }

    /// Whether the process that takes part as `node` is alive.
    fn lives(&self, node: &str) -> bool {
        let (alive, current) = (self.alive.get(node), self.current.get(node));
        alive.zip(current).is_some_and(|(alive, current)| alive.contains(current))
    }

    pub(super) fn lost(&mut self, node: String, at: String) -> RunError {
        let why = self.supervisor.why_it_ended(&node);
        RunError::Lost { node, at, why }
    }

    pub(super) fn stamp(&mut self, about: &Envelope) -> Envelope {
        let envelope = Envelope {
            run: self.run.clone(),
            schema: SCHEMA_VERSION,
            epoch: self.epoch,
            sender: COORDINATOR.into(),
            sequence: self.sequence,
            ..about.clone()
        };
        self.sequence += 1;
        envelope
    }

    pub(super) fn direct(
        &mut self,
        about: &Envelope,
        decision: Option<&Decision>,
        task: directive::Task,
    ) -> Result<(), LinkError> {
        let envelope = Some(self.stamp(about));
        // It goes with the decision that accepts the checkpoint's version.
        let checkpoint = decision.is_some() && self.checkpoints.asks();
        let directive = Directive { envelope, decision: decision.cloned(), task: Some(task), checkpoint };
        self.directives.put(None, directive.encode_to_vec().into())
    }

    /// The next report of this epoch about `version`, or `None` when none comes in time.
    pub(super) fn next_report(
        &mut self,
        version: Version,
        patience: Duration,
    ) -> Result<Option<(String, report::Body)>, RunError> {
        let deadline = Instant::now() + patience;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let event = match self.events.recv_timeout(left) {
                Ok(event) => event,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return Ok(None),
            };
            let Some(sample) = self.sort(event)? else {
                if let Some(node) = self.nodes.iter().find(|node| !self.lives(node)).cloned() {
                    return Err(self.lost(node, version.to_string()));
                }
                continue;
            };
            match codec::decode::<Report>("report", &sample.payload) {
                Ok(Report { envelope: Some(envelope), body: Some(body) }) if self.expects(&envelope) => {
                    if envelope.version == Some(version) {
                        return Ok(Some((envelope.sender, body)));
                    }
                }
                _ => self.refused += 1,
            }
        }
    }

    /// Takes in an event; a report is handed back.
    pub(super) fn sort(&mut self, event: Event) -> Result<Option<Sample>, LinkError> {
        match event {
            Event::Report(sample) => return Ok(Some(sample)),
            Event::Alive(key, alive) => self.liveliness_changed(&key, alive),
            Event::Field(sample) => self.take_field(sample),
            Event::Snapshot(sample) => match codec::decode::<Snapshot>("snapshot", &sample.payload) {
                Ok(snapshot) if snapshot.envelope.as_ref().is_some_and(|envelope| self.expects(envelope)) => {
                    self.checkpoints.receive(snapshot, &self.nodes)?;
                }
                _ => self.refused += 1,
            },
        }
        Ok(None)
    }

    fn take_field(&mut self, sample: Sample) {
        let Ok(received) = codec::decode_field(&sample.attachment, sample.payload) else {
            self.refused += 1;
            return;
        };
        if !self.expects(&received.envelope) || !self.frozen_fields.receive(received) {
            self.refused += 1;
        }
    }

    /// Whether all nodes asked have answered, or all before one that failed: those after it may wait for its fields.
    pub(super) fn complete(asked: &[String], outcomes: &BTreeMap<String, Outcome>) -> bool {
        for answer in asked.iter().map(|node| outcomes.get(node)) {
            match answer {
                None => return false,
                Some(outcome) if outcome.result.is_err() => return true,
                Some(_) => {}
            }
        }
        true
    }

    pub(super) fn check_silence(
        &self,
        since: Instant,
        asked: &[String],
        answered: impl Fn(&str) -> bool,
        at: &str,
    ) -> Result<(), RunError> {
        if since.elapsed() < self.hang {
            return Ok(());
        }
        let silent = asked.iter().find(|node| !answered(node)).cloned().unwrap_or_default();
        Err(RunError::Silent { node: silent, at: at.into(), patience: self.hang })
    }

    pub(super) fn expects(&self, envelope: &Envelope) -> bool {
        envelope.run == self.run
            && envelope.schema == SCHEMA_VERSION
            && envelope.epoch == self.epoch
            && self.nodes.contains(&envelope.sender)
    }
}
