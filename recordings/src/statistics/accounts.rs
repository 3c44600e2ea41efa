//! The decisions of a run together with the reports they are about.

use std::collections::BTreeMap;

use stagger_messages::{
    Checkpoint, Decision, Directive, Done, Energy, Report, Verdict, Version, directive, report, shown_name,
};

use stagger_coupling::{Ledger, ledger_at};

/// Puts the decisions of a run together with the nodes' reports they are about.
#[derive(Clone, Debug, Default)]
pub struct Accounts {
    done: BTreeMap<String, (Version, Done)>,
    decided: Version,
    /// The version accepted last and the end of its step, in s.
    accepted: Option<(Version, f64)>,
    iterations: u64,
    ledger: Ledger,
}

/// One decision, with what it was made from.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The decision.
    pub decision: Decision,
    /// The version decided about.
    pub version: Version,
    /// Counts the iterations of the whole run, rejected ones too, from 1.
    pub iteration: u64,
    /// Reports of that version, by node.
    pub reports: BTreeMap<String, Done>,
}

impl Accounts {
    /// Takes a node's report.
    pub fn report(&mut self, message: &Report) {
        let Some(envelope) = &message.envelope else { return };
        let (node, version) = (envelope.sender.as_str(), envelope.version.unwrap_or_default());
        // The coordinator books them under the same names.
        let ledger = |ledger: &[Energy]| -> Vec<Energy> {
            ledger.iter().map(|entry| Energy { name: shown_name(&entry.name).into_owned(), ..entry.clone() }).collect()
        };
        match &message.body {
            // A node that goes on from a checkpoint says nothing of what it holds.
            Some(report::Body::Ready(ready)) if version == Version::INITIAL => {
                self.ledger.start(node, &ledger(&ready.ledger));
            }
            Some(report::Body::Done(done)) => {
                let figures =
                    done.figures.iter().map(|(name, value)| (shown_name(name).into_owned(), *value)).collect();
                let done = Done { ledger: ledger(&done.ledger), figures, ..done.clone() };
                let known = self.done.get(node).is_some_and(|(last, _)| *last == version);
                // A physics that only reads is solved after the step is accepted.
                if let Some((_, t_s)) = self.accepted.filter(|(accepted, _)| *accepted == version && !known) {
                    self.ledger.book_until(node, &done.ledger, t_s);
                }
                self.done.insert(node.into(), (version, done));
            }
            Some(_) | None => {}
        }
    }

    /// Takes a checkpoint. A run that goes on from one begins with it: the energy up to there is in it.
    pub fn checkpoint(&mut self, message: &Checkpoint) {
        if self.iterations == 0
            && let Ok(ledger) = ledger_at(&message.coordinator)
        {
            self.ledger = ledger;
        }
    }

    /// Takes a directive; returns its decision where it is a new one, not a repetition.
    pub fn directive(&mut self, message: &Directive) -> Option<Outcome> {
        let decision = message.decision.as_ref().filter(|decision| decision.verdict() != Verdict::None)?;
        let version = decision.version.filter(|version| *version > self.decided)?;
        self.decided = version;
        self.iterations += 1;
        let about = self.done.iter().filter(|(_, (reported, _))| *reported == version);
        let reports: BTreeMap<_, _> = about.map(|(node, (_, done))| (node.clone(), done.clone())).collect();
        if decision.verdict() == Verdict::Accept {
            self.accepted = Some((version, decision.t_s));
            for (node, done) in &reports {
                self.ledger.book_until(node, &done.ledger, decision.t_s);
            }
        }
        Some(Outcome { decision: decision.clone(), version, iteration: self.iterations, reports })
    }

    /// The energy balance up to the last accepted step.
    #[must_use]
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// How many iterations were decided about.
    #[must_use]
    pub fn iterations(&self) -> u64 {
        self.iterations
    }
}

/// Whether the directive asks for a trial.
pub(crate) fn asks(message: &Directive) -> bool {
    matches!(message.task, Some(directive::Task::Iterate(_)))
}
