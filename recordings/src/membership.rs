//! Which messages on a run's keys are the run's own: what nodes and coordinator refuse must not be in its recording.

use stagger_messages::{Directive, Envelope, Manifest, SCHEMA_VERSION};

/// Tells a run's own messages from those of another run, an epoch that is over, other schemas, or under another's key.
pub(crate) struct Membership {
    run: String,
    /// The newest the coordinator has named; they count from 1.
    epoch: u32,
}

impl Membership {
    pub(crate) fn new(run: &str) -> Self {
        Self { run: run.into(), epoch: 1 }
    }

    /// Whether a message on `topic` is one of the node the topic names, or of the coordinator.
    pub(crate) fn admits(&self, topic: &str, envelope: &Envelope) -> bool {
        let mut parts = topic.split('/');
        let owner = if parts.next() == Some("ctl") { Some("coordinator") } else { parts.next() };
        envelope.run == self.run
            && envelope.schema == SCHEMA_VERSION
            && envelope.epoch >= self.epoch
            && owner == Some(envelope.sender.as_str())
    }

    /// The same for a directive, which may begin an epoch.
    pub(crate) fn admits_directive(&mut self, topic: &str, directive: &Directive) -> bool {
        let Some(envelope) = directive.envelope.as_ref().filter(|envelope| self.admits(topic, envelope)) else {
            return false;
        };
        self.epoch = envelope.epoch;
        true
    }

    /// The same for a checkpoint.
    pub(crate) fn admits_checkpoint(&self, envelope: &Envelope) -> bool {
        self.admits("ctl/checkpoint", envelope)
    }

    /// The same for a manifest.
    pub(crate) fn admits_manifest(&self, topic: &str, manifest: &Manifest) -> bool {
        manifest.run == self.run
            && manifest.schema == SCHEMA_VERSION
            && topic.split('/').nth(1) == Some(manifest.node.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn envelope(epoch: u32, sender: &str) -> Envelope {
        Envelope { run: "r".into(), schema: SCHEMA_VERSION, epoch, sender: sender.into(), ..Envelope::default() }
    }

    #[test]
    fn only_the_run_its_epoch_its_schemas_and_the_owner_of_the_key_are_admitted() {
        let mut membership = Membership::new("r");
        let right = envelope(1, "thermal");
        assert!(membership.admits("field/thermal/temperature", &right) && membership.admits("done/thermal", &right));
        assert!(!membership.admits("done/optics", &right));
        assert!(!membership.admits("done/thermal", &Envelope { run: "s".into(), ..right.clone() }));
        assert!(!membership.admits("done/thermal", &Envelope { schema: SCHEMA_VERSION + 1, ..right.clone() }));
        assert!(!membership.admits("done/thermal", &envelope(0, "thermal")));
        let directive = |sender, epoch| Directive { envelope: Some(envelope(epoch, sender)), ..Directive::default() };
        assert!(!membership.admits_directive("ctl/directive", &directive("thermal", 3)));
        assert!(membership.admits_directive("ctl/directive", &directive("coordinator", 2)));
        assert!(!membership.admits("done/thermal", &right), "its epoch is over");
        assert!(!membership.admits_directive("ctl/directive", &directive("coordinator", 1)));
        assert!(!membership.admits_directive("ctl/directive", &Directive::default()));
        let manifest =
            Manifest { run: "r".into(), schema: SCHEMA_VERSION, node: "thermal".into(), ..Manifest::default() };
        assert!(membership.admits_manifest("meta/thermal", &manifest));
        assert!(!membership.admits_manifest("meta/optics", &manifest));
    }
}
