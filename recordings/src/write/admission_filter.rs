//! Which messages on a run's keys are the run's own: what nodes and coordinator refuse must not be in its recording.

use stagger_messages::{Directive, Envelope, Manifest, SCHEMA_VERSION, Version, directive};

/// Messages of one sender that may be lost in a row. A node puts some dozens for a trial, and again a few times; what is
/// numbered further ahead than this was not numbered by a node.
const LARGEST_GAP: u64 = 10_000;

/// Tells a run's own messages from those of another run, another epoch, other schemas, under another's key, or about what
/// was never asked.
pub(crate) struct AdmissionFilter {
    run: String,
    /// The newest the coordinator has named; they count from 1.
    epoch: u32,
    /// The newest version of this epoch that was asked for.
    asked: Option<Version>,
    /// Whether every directive is heard before what follows from it. Who joins a run on its way hears in no such order, and
    /// may hear of a new epoch by a field.
    from_start: bool,
}

impl AdmissionFilter {
    pub(crate) fn new(run: &str, from_start: bool) -> Self {
        Self { run: run.into(), epoch: 1, asked: None, from_start }
    }

    /// Whether a message on `topic` is one of the node the topic names, or of the coordinator, about what was asked for.
    pub(crate) fn admits(&self, topic: &str, envelope: &Envelope) -> bool {
        let asked = !self.from_start
            || envelope.epoch == self.epoch && envelope.version.is_some() && envelope.version <= self.asked;
        self.owns(topic, envelope) && envelope.epoch >= self.epoch && asked
    }

    /// The same for a directive, which may begin an epoch; returns whether it does where it is the run's own.
    pub(crate) fn admits_directive(&mut self, topic: &str, directive: &Directive) -> Option<bool> {
        let envelope = directive.envelope.as_ref()?;
        let version = envelope.version?;
        if !self.owns(topic, envelope) || envelope.epoch < self.epoch {
            return None;
        }
        let plan = matches!(directive.task, Some(directive::Task::Plan(_)));
        let begins = envelope.epoch > self.epoch;
        // Only a plan begins an epoch, as for a node.
        if self.from_start && begins && !plan {
            return None;
        }
        if begins {
            self.epoch = envelope.epoch;
            self.asked = None;
        }
        let next = self.asked.is_none_or(|asked| version.step <= asked.step.saturating_add(1));
        // What was asked before is repeated by nobody of the run once more was asked; an end may be said about anything.
        let over = Some(version) < self.asked && !matches!(directive.task, Some(directive::Task::Stop(_)));
        if self.from_start && (!next || over) {
            return None;
        }
        self.asked = self.asked.max(Some(version));
        Some(begins)
    }

    /// Whether a message is of an epoch to come, in which numbers begin anew.
    pub(crate) fn is_later(&self, envelope: &Envelope) -> bool {
        envelope.epoch > self.epoch
    }

    /// The same for a checkpoint: of what was accepted, or the one the run goes on from.
    pub(crate) fn admits_checkpoint(&self, envelope: &Envelope) -> bool {
        let first = self.asked.is_none() && envelope.epoch == self.epoch && self.owns("ctl/checkpoint", envelope);
        first || self.admits("ctl/checkpoint", envelope)
    }

    /// The same for a manifest.
    pub(crate) fn admits_manifest(&self, topic: &str, manifest: &Manifest) -> bool {
        manifest.run == self.run
            && manifest.schema == SCHEMA_VERSION
            && topic.split('/').nth(1) == Some(manifest.node.as_str())
    }

    fn owns(&self, topic: &str, envelope: &Envelope) -> bool {
        let mut parts = topic.split('/');
        let owner = if parts.next() == Some("ctl") { Some("coordinator") } else { parts.next() };
        envelope.run == self.run && envelope.schema == SCHEMA_VERSION && owner == Some(envelope.sender.as_str())
    }
}

/// What came of one sender's messages, which it numbers from 0 in each epoch.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Numbering {
    received: u64,
    /// One more than the highest number seen.
    sent: u64,
}

impl Numbering {
    /// Whether a message may have this number.
    pub(crate) fn admits(&self, number: u64) -> bool {
        number <= self.sent.saturating_add(LARGEST_GAP)
    }

    pub(crate) fn count(&mut self, number: u64) {
        self.received += 1;
        self.sent = self.sent.max(number.saturating_add(1));
    }

    /// Messages that were sent, but never came.
    pub(crate) fn missing(&self) -> u64 {
        self.sent.saturating_sub(self.received)
    }
}

#[cfg(test)]
mod tests {
    use stagger_messages::{Iterate, Plan};

    use super::*;

    fn envelope(epoch: u32, sender: &str) -> Envelope {
        let version = Some(Version::first(1));
        Envelope {
            run: "r".into(),
            schema: SCHEMA_VERSION,
            epoch,
            sender: sender.into(),
            version,
            ..Envelope::default()
        }
    }

    fn about(epoch: u32, sender: &str, (step, attempt, iteration): (u64, u32, u32)) -> Envelope {
        Envelope { version: Some(Version { step, attempt, iteration }), ..envelope(epoch, sender) }
    }

    fn plan(epoch: u32, sender: &str, step: u64) -> Directive {
        let task = Some(directive::Task::Plan(Plan::default()));
        Directive { envelope: Some(about(epoch, sender, (step, 1, 1))), task, ..Directive::default() }
    }

    fn iterate(epoch: u32, version: (u64, u32, u32)) -> Directive {
        let task = Some(directive::Task::Iterate(Iterate::default()));
        Directive { envelope: Some(about(epoch, "coordinator", version)), task, ..Directive::default() }
    }

    const TOPIC: &str = "ctl/directive";

    #[test]
    fn only_the_run_its_epoch_its_schemas_and_the_owner_of_the_key_are_admitted() {
        let mut admission = AdmissionFilter::new("r", true);
        let right = envelope(1, "thermal");
        assert!(!admission.admits("done/thermal", &right), "nothing was asked yet");
        assert_eq!(admission.admits_directive(TOPIC, &plan(1, "coordinator", 1)), Some(false));
        assert!(admission.admits("field/thermal/temperature", &right) && admission.admits("done/thermal", &right));
        assert!(!admission.admits("done/optics", &right));
        assert!(!admission.admits("done/thermal", &Envelope { run: "s".into(), ..right.clone() }));
        assert!(!admission.admits("done/thermal", &Envelope { schema: SCHEMA_VERSION + 1, ..right.clone() }));
        assert!(!admission.admits("done/thermal", &Envelope { version: None, ..right.clone() }));
        assert!(!admission.admits("done/thermal", &envelope(0, "thermal")));
        assert!(!admission.admits("done/thermal", &envelope(99, "thermal")), "an epoch to come");
        assert_eq!(admission.admits_directive(TOPIC, &plan(3, "thermal", 1)), None);
        assert_eq!(admission.admits_directive(TOPIC, &iterate(2, (1, 1, 1))), None, "only a plan begins an epoch");
        assert_eq!(admission.admits_directive(TOPIC, &plan(2, "coordinator", 1)), Some(true));
        assert!(!admission.admits("done/thermal", &right), "its epoch is over");
        assert_eq!(admission.admits_directive(TOPIC, &plan(1, "coordinator", 1)), None);
        assert_eq!(admission.admits_directive(TOPIC, &Directive::default()), None);
        let manifest =
            Manifest { run: "r".into(), schema: SCHEMA_VERSION, node: "thermal".into(), ..Manifest::default() };
        assert!(admission.admits_manifest("meta/thermal", &manifest));
        assert!(!admission.admits_manifest("meta/optics", &manifest));
    }

    #[test]
    fn nothing_is_admitted_about_what_was_not_asked() {
        let mut admission = AdmissionFilter::new("r", true);
        let admits =
            |admission: &AdmissionFilter, version| admission.admits("done/thermal", &about(1, "thermal", version));
        assert!(admission.admits_checkpoint(&about(1, "coordinator", (40, 1, 3))), "the one the run goes on from");
        admission.admits_directive(TOPIC, &plan(1, "coordinator", 40)).unwrap();
        assert_eq!(admission.admits_directive(TOPIC, &iterate(1, (1_000_000_000, 1, 1))), None);
        admission.admits_directive(TOPIC, &iterate(1, (41, 2, 3))).unwrap();
        for earlier in [(41, 2, 3), (41, 2, 2), (41, 1, 9), (40, 1, 1)] {
            assert!(admits(&admission, earlier), "{earlier:?}");
        }
        for later in [(41, 2, 4), (41, 3, 1), (42, 1, 1), (1_000_000_000, 1, 1)] {
            assert!(!admits(&admission, later), "{later:?}");
        }
        assert!(!admission.admits_checkpoint(&about(1, "coordinator", (42, 1, 1))));
        assert_eq!(admission.admits_directive(TOPIC, &iterate(1, (41, 2, 3))), Some(false), "it is asked again");
        assert_eq!(admission.admits_directive(TOPIC, &iterate(1, (41, 2, 2))), None, "somebody repeats it");
        assert_eq!(admission.admits_directive(TOPIC, &plan(1, "coordinator", 40)), None, "somebody repeats it");
        assert!(admits(&admission, (41, 2, 3)));
    }

    #[test]
    fn who_joins_on_the_way_hears_of_an_epoch_by_anything() {
        let mut admission = AdmissionFilter::new("r", false);
        assert!(admission.admits("field/thermal/temperature", &about(3, "thermal", (700, 1, 1))));
        assert_eq!(admission.admits_directive(TOPIC, &iterate(3, (701, 1, 1))), Some(true));
        assert!(!admission.admits("field/thermal/temperature", &about(2, "thermal", (700, 1, 1))));
    }

    #[test]
    fn a_number_far_ahead_is_no_gap() {
        let mut numbering = Numbering::default();
        for number in [0, 1, 4] {
            assert!(numbering.admits(number));
            numbering.count(number);
        }
        assert_eq!(numbering.missing(), 2);
        assert!(numbering.admits(10_000) && !numbering.admits(100_000) && !numbering.admits(u64::MAX));
        numbering.count(u64::MAX);
        assert_eq!(numbering.missing(), u64::MAX - 4, "no number is beyond the last");
    }
}
