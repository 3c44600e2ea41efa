//! The nodes of a run as the ensemble that the coupling drives.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::{Duration, Instant},
};

use stagger_coupling::{COORDINATOR, Ensemble, FrozenFields, Outcome, Task};
use stagger_messages::{
    Decision, Envelope, Field, Plan, Ready, Report, SCHEMA_VERSION, Source, Stop, Verdict, Version, codec, directive,
    keys, report,
};

use super::{Remote, RunError, backpressure::Backpressure, remote::Event};

/// After how long an unanswered question is put again, at first; then after twice as long each time.
const ASK_AGAIN: Duration = Duration::from_secs(2);
/// The same for the plan.
const PLAN_AGAIN: Duration = Duration::from_millis(250);
/// How long a user who wants the run to end waits for the step under way.
const INTERRUPTED: Duration = Duration::from_secs(10);
/// How long nodes have to leave.
const FINAL_REPORT: Duration = Duration::from_secs(5);
/// How long last words may come after the end of their node's token.
const OVERTAKEN: Duration = Duration::from_millis(300);
/// How often they are told.
const STOP_AGAIN: Duration = Duration::from_secs(1);

impl Remote<'_> {
    /// Listens to the answers of accelerated fields; prepares to publish what takes their place.
    fn accelerate(&mut self, plan: &Plan) -> Result<(), RunError> {
        self.link.share_memory(plan);
        let mut seen = BTreeSet::new();
        let all = plan.nodes.iter().flat_map(|node| &node.sources);
        let sources: Vec<Source> =
            all.filter(|source| source.accelerated && seen.insert(source.field.clone())).cloned().collect();
        for Source { writer, field, .. } in &sources {
            if !self.publishers.contains_key(field) {
                let events = self.event_sender.clone();
                self.declarations.push(self.link.subscribe(&keys::field(&self.run, writer, field), move |sample| {
                    // A coordinator that has ended needs no more events.
                    let _ = events.send(Event::Field(sample));
                })?);
                let publisher = self.link.publisher_sharing(keys::field(&self.run, COORDINATOR, field))?;
                self.publishers.insert(field.clone(), publisher);
            }
        }
        self.frozen_fields = FrozenFields::new(sources);
        self.published = (Version::INITIAL, BTreeMap::new());
        self.asked = None;
        Ok(())
    }

    fn conclude(&mut self, decision: Option<&Decision>) {
        let Some(decision) = decision else { return };
        let version = decision.version.unwrap_or_default();
        match decision.verdict() {
            Verdict::Accept => self.frozen_fields.accepted(version),
            Verdict::Reject => self.frozen_fields.rejected(version),
            Verdict::Iterate | Verdict::None => {}
        }
    }

    fn put_published(&mut self, again: bool) -> Result<(), RunError> {
        let (version, fields) = self.published.clone();
        for (name, field) in fields {
            let envelope = self.stamp(&Envelope { version: Some(version), ..Envelope::default() });
            if let Some(publisher) = self.publishers.get(&name) {
                let attachment = codec::field_attachment(&envelope, &field, None);
                publisher.put_field(attachment, field.values().bytes().clone(), again)?;
            }
        }
        Ok(())
    }
}

impl Ensemble for Remote<'_> {
    type Error = RunError;

    fn start(&mut self, plan: &Plan) -> Result<Vec<(String, Ready)>, RunError> {
        self.order.clone_from(&plan.order);
        self.accelerate(plan)?;
        let from = plan.from.unwrap_or(Version::INITIAL);
        let mut ready: BTreeMap<String, Ready> = BTreeMap::new();
        let mut patience = PLAN_AGAIN;
        let begun = Instant::now();
        while ready.len() < self.nodes.len() {
            if self.supervisor.interrupted() {
                return Err(RunError::Interrupted);
            }
            self.check_silence(begun, &plan.order, |node| ready.contains_key(node), "its start")?;
            let about = Envelope { version: Some(from), ..Envelope::default() };
            self.direct(&about, None, directive::Task::Plan(plan.clone()))?;
            let again = Instant::now() + patience;
            patience = (2 * patience).min(ASK_AGAIN);
            while ready.len() < self.nodes.len() && Instant::now() < again {
                match self.next_report(from, again.saturating_duration_since(Instant::now()))? {
                    Some((node, report::Body::Ready(body))) => {
                        ready.insert(node, body);
                    }
                    Some((node, report::Body::Failure(failure))) => {
                        return Err(RunError::Start { node, message: failure.message });
                    }
                    Some(_) | None => {}
                }
            }
        }
        Ok(plan.order.iter().filter_map(|node| Some((node.clone(), ready.remove(node)?))).collect())
    }

    fn iterate(&mut self, before: Option<&Decision>, task: &Task) -> Result<Vec<Outcome>, RunError> {
        self.conclude(before);
        let about = Envelope {
            version: Some(task.version),
            t_s: task.window.t_s,
            dt_s: task.window.dt_s,
            ..Envelope::default()
        };
        let asked: Vec<String> = self.order.iter().filter(|node| task.asks(node)).cloned().collect();
        let mut iterate = task.iterate.clone();
        self.link.asked(false);
        self.direct(&about, before, directive::Task::Iterate(iterate.clone()))?;
        iterate.again = true;
        self.asked = Some((about.clone(), iterate.clone()));
        let mut outcomes: BTreeMap<String, Outcome> = BTreeMap::new();
        let begun = Instant::now();
        let (mut patience, mut interrupted) = (ASK_AGAIN, None);
        while !Self::complete(&asked, &outcomes) {
            let Some((node, body)) = self.next_report(task.version, patience.min(ASK_AGAIN).min(self.hang))? else {
                if self.supervisor.interrupted() && interrupted.get_or_insert_with(Instant::now).elapsed() > INTERRUPTED
                {
                    return Err(RunError::Interrupted);
                }
                self.check_silence(begun, &asked, |node| outcomes.contains_key(node), &task.version.to_string())?;
                if begun.elapsed() >= patience {
                    // A node that still solves takes this for later; one whose message was lost sends it again.
                    self.link.asked(true);
                    self.put_published(true)?;
                    self.direct(&about, before, directive::Task::Iterate(iterate.clone()))?;
                    patience *= 2;
                }
                continue;
            };
            let result = match body {
                report::Body::Done(done) => Ok(done),
                report::Body::Failure(failure) => Err(failure),
                report::Body::Ready(_) | report::Body::FinalReport(_) => continue,
            };
            if asked.contains(&node) {
                outcomes.insert(node.clone(), Outcome { node, result });
            }
        }
        // Up to the first failure in the order of solving, whoever answered first: the same decision every time.
        let mut in_order = Vec::new();
        for node in &asked {
            let Some(outcome) = outcomes.remove(node) else { break };
            let failed = outcome.result.is_err();
            in_order.push(outcome);
            if failed {
                break;
            }
        }
        Ok(in_order)
    }

    fn answered(&mut self, source: &Source, version: Version) -> Result<Field, RunError> {
        let begun = Instant::now();
        let mut again = ASK_AGAIN;
        loop {
            if let Some(field) = self.frozen_fields.get(&source.writer, &source.field, version) {
                return Ok(field.clone());
            }
            // On one link fields come before the report about them; only a lost one is waited for.
            self.next_report(version, Duration::from_millis(50))?;
            let writer = std::slice::from_ref(&source.writer);
            self.check_silence(begun, writer, |_| false, &format!("`{}` of {version}", source.field))?;
            if begun.elapsed() >= again {
                again *= 2;
                if let Some((about, iterate)) = self.asked.clone() {
                    self.direct(&about, None, directive::Task::Iterate(iterate))?;
                }
            }
        }
    }

    fn publish(&mut self, version: Version, fields: &BTreeMap<String, Field>) -> Result<(), RunError> {
        self.published = (version, fields.clone());
        self.put_published(false)
    }

    fn catch_up(&mut self) -> bool {
        self.backpressure.as_mut().is_none_or(Backpressure::wait)
    }

    fn checkpoint(&mut self, version: Version, t_s: f64, controller: Vec<u8>) {
        // Without a number: where the run goes on in another file, this message stands at its head.
        let envelope = Envelope {
            run: self.run.clone(),
            schema: SCHEMA_VERSION,
            epoch: self.epoch,
            sender: COORDINATOR.into(),
            version: Some(version),
            t_s,
            ..Envelope::default()
        };
        self.checkpoints.begin(envelope, controller);
    }

    fn finish(&mut self, last: Option<&Decision>, completed: bool, reason: &str) -> Result<(), RunError> {
        if std::mem::replace(&mut self.finished, true) {
            return Ok(());
        }
        let version = last.and_then(|decision| decision.version);
        let about = Envelope { version: version.or(Some(Version::INITIAL)), ..Envelope::default() };
        let stop = directive::Task::Stop(Stop { completed, reason: reason.into() });
        self.direct(&about, last, stop.clone())?;
        let mut deadline = Instant::now() + FINAL_REPORT;
        while self.final_reports.len() < self.nodes.len() && Instant::now() < deadline {
            if self.alive.keys().all(|node| self.final_reports.contains_key(node)) {
                // A token's end may overtake the node's last words.
                deadline = deadline.min(Instant::now() + OVERTAKEN);
            }
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(event) = self.events.recv_timeout(STOP_AGAIN.min(left)) else {
                self.direct(&about, last, stop.clone())?;
                continue;
            };
            let Some(sample) = self.sort(event)? else { continue };
            let Ok(report) = codec::decode::<Report>("report", &sample.payload) else { continue };
            if let (Some(envelope), Some(report::Body::FinalReport(final_report))) = (report.envelope, report.body)
                && self.expects(&envelope)
            {
                self.final_reports.insert(envelope.sender, final_report.fields);
            }
        }
        Ok(())
    }
}
