//! One process of the node under test, and the coordinator's side of its run, moved by hand.

use std::{
    collections::BTreeMap,
    process::{Child, ExitStatus},
    sync::mpsc::Receiver,
    time::{Duration, Instant},
};

use bytes::Bytes;
use prost::Message as _;
use stagger_coupling::Window;
use stagger_messages::{
    Decision, Directive, Done, Envelope, Field, Fields, FinalReport, Iterate, Manifest, Part, Plan, Ports,
    SCHEMA_VERSION, Snapshot, Source, Stop, Verdict, Version, codec, directive, keys, report,
};
use stagger_runtime::{
    launch::{self, Common, stderr_tail::StderrTail},
    link::{Declaration, Link, Publisher, Role, Sample, endpoint::Endpoint},
};

use super::{
    Bench,
    heard::{Fault, Heard, listen, name_of, same_values},
};

/// How long a node is listened to that must say nothing.
const SILENCE: Duration = Duration::from_millis(300);
/// How long a node may take to end.
const LEAVE: Duration = Duration::from_secs(5);
/// Lines of its diagnostics that are told with a fault.
const LAST_LINES: usize = 5;

/// Fields by their writer and their name: several nodes may write one that is added up.
pub type Given = BTreeMap<(String, String), Field>;

/// A trial of the node under test: what it is given and, once known, what it answers.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Its version.
    pub version: Version,
    /// The version committed before it.
    pub committed: Version,
    /// Its window.
    pub window: Window,
    /// Value of each source at the window's end, for this trial.
    pub ends: Given,
    /// What each source holds at this very version, once all nodes have solved.
    pub after: Given,
    /// The node's answer.
    pub reply: Reply,
}

/// What a node answers.
#[derive(Clone, Debug, Default)]
pub struct Reply {
    /// The written fields.
    pub fields: Fields,
    /// The report.
    pub done: Done,
}

/// A process of the node under test in a run of its own.
pub struct Session {
    /// What the node announced.
    pub manifest: Manifest,
    /// Everything it has put.
    pub log: Vec<Heard>,
    /// The epoch directives and fields are sent in.
    pub epoch: u32,
    /// Where the frozen fields of the node come from.
    pub sources: Vec<Source>,
    /// What the next directive says about the iteration before.
    pub decision: Option<Decision>,
    run: String,
    node: String,
    sequence: u64,
    events: Receiver<Heard>,
    /// What the node published in this epoch, references resolved.
    values: BTreeMap<(String, Version), Field>,
    child: Child,
    words: StderrTail,
    patience: Duration,
    directives: Publisher,
    publishers: BTreeMap<(String, String), Publisher>,
    token: Option<Declaration>,
    declarations: Vec<Declaration>,
    link: Link,
    _endpoint: Endpoint,
}

impl Session {
    /// Opens a hub, starts the node's process, waits for its token, and asks for its manifest.
    ///
    /// # Errors
    /// It does not start, or does not announce itself.
    pub fn start(bench: &Bench) -> Result<Self, Fault> {
        let (run, node) = (bench.run.clone(), bench.node.clone());
        let failed = |error: &dyn std::fmt::Display| Fault::new("a process that starts", error.to_string());
        let mut endpoint = Endpoint::new(&run).map_err(|error| failed(&error))?;
        let link = Link::open(&Role::Hub { listen: vec![endpoint.name.clone()] }, None)?;
        let (sender, events) = std::sync::mpsc::channel();
        let (tokens, token_keys) = std::sync::mpsc::channel();
        let mut declarations = vec![listen(&link, &run, &node, sender)?];
        declarations.push(link.watch(&keys::live(&run, &node, "*"), move |key, alive| {
            if alive {
                // Nobody waits any more for a token that comes late.
                let _ = tokens.send(key);
            }
        })?);
        let token = link.announce(&keys::live(&run, "coordinator", "conformance"))?;
        let directives = link.publisher(keys::directive(&run))?;
        let handed_over = match &bench.scene_file {
            Some(_) => None,
            None => endpoint.hand_over(&bench.scene).map_err(|error| failed(&error))?,
        };
        let (made, files) = handed_over.map(|handed| (handed.scene, handed.files)).unzip();
        let common = Common {
            run: run.clone(),
            connect: endpoint.name.clone(),
            scene: bench.scene_file.clone().or(made).unwrap_or_default(),
            overrides: bench.scene.overrides.clone(),
            files: bench.files.clone().or(files.flatten()),
            scene_hash: bench.scene.hash,
            threads: None,
        };
        let mut command = launch::command(&node, &bench.runs, &common).map_err(|error| failed(&error))?;
        let mut child = command.spawn().map_err(|error| failed(&format!("{}: {error}", launch::shown(&command))))?;
        let words = StderrTail::follow(&mut child, LAST_LINES, |_| {});
        let mut session = Self {
            manifest: Manifest::default(),
            log: Vec::new(),
            epoch: 1,
            sources: Vec::new(),
            decision: None,
            run,
            node,
            sequence: 0,
            events,
            values: BTreeMap::new(),
            child,
            words,
            patience: bench.patience,
            directives,
            publishers: BTreeMap::new(),
            token: Some(token),
            declarations,
            link,
            _endpoint: endpoint,
        };
        session.manifest = session.announced(&token_keys)?;
        Ok(session)
    }

    fn announced(&mut self, tokens: &Receiver<String>) -> Result<Manifest, Fault> {
        let expected = format!("a liveliness token on {}", keys::live(&self.run, &self.node, "<instance>"));
        let deadline = Instant::now() + self.patience;
        let key = loop {
            if let Ok(key) = tokens.recv_timeout(Duration::from_millis(20)) {
                break key;
            }
            self.alive(&expected)?;
            if Instant::now() > deadline {
                return Err(Fault::new(
                    expected,
                    format!("none within {} s{}", self.patience.as_secs(), self.words.told()),
                ));
            }
        };
        let meta = keys::manifest(&self.run, &self.node);
        let answers = self.link.query(&meta, self.patience)?;
        let expected = format!("a Manifest in answer to a query on {meta}, as soon as the token is there");
        let Some(answer) = answers.first() else { return Err(Fault::new(expected, "no answer")) };
        let manifest: Manifest = codec::decode("manifest", &answer.payload)
            .map_err(|error| Fault::new(expected.clone(), error.to_string()))?;
        let instance = keys::parse_live(&key).map_or("", |(_, instance)| instance);
        if instance != manifest.instance {
            let found = format!("`{instance}` and `{}`", manifest.instance);
            return Err(Fault::new("the same instance in the token and in the manifest", found));
        }
        Ok(manifest)
    }

    /// The ports it announced.
    pub fn ports(&self) -> Ports {
        self.manifest.ports.clone().unwrap_or_default()
    }

    /// Sends the plan; the node's own part of it says what it is given from now on.
    pub fn plan(&mut self, plan: &Plan) -> Result<(), Fault> {
        let mine = plan.nodes.iter().find(|part| part.node == self.node);
        self.sources = mine.map(|part| part.sources.clone()).unwrap_or_default();
        let about = Envelope { version: plan.from.or(Some(Version::INITIAL)), ..Envelope::default() };
        self.direct(about, directive::Task::Plan(plan.clone()), false)
    }

    /// Begins a new epoch: the messages of the one before no longer count.
    pub fn next_epoch(&mut self) {
        self.epoch += 1;
        self.sequence = 0;
        self.values.clear();
        self.decision = None;
    }

    /// An envelope as the coordinator or another node stamps it.
    pub fn envelope(&mut self, sender: &str, version: Version) -> Envelope {
        self.sequence += 1;
        Envelope {
            run: self.run.clone(),
            schema: SCHEMA_VERSION,
            epoch: self.epoch,
            sender: sender.into(),
            sequence: self.sequence - 1,
            version: Some(version),
            ..Envelope::default()
        }
    }

    /// Publishes a field for `writer`, whole or as a reference to what it held at `same_as`.
    pub fn put(
        &mut self,
        writer: &str,
        field: &Field,
        version: Version,
        same_as: Option<Version>,
    ) -> Result<(), Fault> {
        let header = self.envelope(writer, version);
        let payload = if same_as.is_some() { Bytes::new() } else { field.values().bytes().clone() };
        self.put_raw(writer, field.name(), codec::field_attachment(&header, field, same_as), payload)
    }

    /// Publishes on a field's key whatever it may be.
    pub fn put_raw(&mut self, writer: &str, field: &str, attachment: Vec<u8>, payload: Bytes) -> Result<(), Fault> {
        let key = (writer.to_owned(), field.to_owned());
        if !self.publishers.contains_key(&key) {
            let publisher = self.link.publisher(keys::field(&self.run, writer, field))?;
            self.publishers.insert(key.clone(), publisher);
        }
        match self.publishers.get(&key) {
            Some(publisher) => Ok(publisher.put(Some(attachment), payload)?),
            None => Ok(()),
        }
    }

    /// Publishes every source at one version.
    pub fn put_all(&mut self, fields: &Given, version: Version) -> Result<(), Fault> {
        for source in self.sources.clone() {
            if let Some(field) = fields.get(&place(&source)) {
                self.put(&source.writer, field, version, None)?;
            }
        }
        Ok(())
    }

    /// Gives the frozen fields of a trial: those that are not the committed ones, which the node holds already.
    pub fn give(&mut self, trial: &Trial) -> Result<(), Fault> {
        for source in self.sources.clone() {
            let version = frozen_version(&source, trial.version, trial.committed);
            if let (true, Some(field)) = (version != trial.committed, trial.ends.get(&place(&source))) {
                self.put(&source.writer, field, version, None)?;
            }
        }
        Ok(())
    }

    /// Gives what the other nodes published after this one in a trial that is now accepted.
    pub fn settle(&mut self, trial: &Trial) -> Result<(), Fault> {
        for source in self.sources.clone().into_iter().filter(|source| !source.same_iteration) {
            if let Some(field) = trial.after.get(&place(&source)) {
                self.put(&source.writer, field, trial.version, None)?;
            }
        }
        Ok(())
    }

    /// Asks for a trial.
    pub fn ask(&mut self, trial: &Trial, again: bool, parts: Vec<Part>, checkpoint: bool) -> Result<(), Fault> {
        let about = Envelope {
            version: Some(trial.version),
            t_s: trial.window.t_s,
            dt_s: trial.window.dt_s,
            ..Envelope::default()
        };
        let iterate = Iterate { committed: Some(trial.committed), again, parts };
        self.direct(about, directive::Task::Iterate(iterate), checkpoint)
    }

    /// Asks for a trial, gives its frozen fields, and waits for the answer.
    pub fn solve(&mut self, trial: &Trial) -> Result<Reply, Fault> {
        let from = self.log.len();
        self.ask(trial, false, Vec::new(), false)?;
        self.give(trial)?;
        self.answer(trial.version, from)
    }

    /// The same, and the answer must be the one the trial had.
    pub fn repeat(&mut self, trial: &Trial) -> Result<Reply, Fault> {
        let reply = self.solve(trial)?;
        same_values(&trial.reply.fields, &reply.fields)?;
        Ok(reply)
    }

    /// Repeats all trials of a step and has the last one accepted with the next directive.
    pub fn repeat_step(&mut self, trials: &[Trial]) -> Result<(), Fault> {
        for trial in trials {
            self.repeat(trial)?;
        }
        match trials.last() {
            Some(last) => self.accept(last),
            None => Ok(()),
        }
    }

    /// Has a trial accepted with the next directive.
    pub fn accept(&mut self, trial: &Trial) -> Result<(), Fault> {
        self.settle(trial)?;
        self.decide(trial.version, Verdict::Accept);
        Ok(())
    }

    /// Says with the next directive what became of a trial.
    pub fn decide(&mut self, version: Version, verdict: Verdict) {
        self.decision = Some(Decision { version: Some(version), verdict: verdict.into(), ..Decision::default() });
    }

    fn direct(&mut self, about: Envelope, task: directive::Task, checkpoint: bool) -> Result<(), Fault> {
        let stamp = self.envelope("coordinator", Version::INITIAL);
        let envelope = Envelope { version: about.version, t_s: about.t_s, dt_s: about.dt_s, ..stamp };
        let decision = self.decision.take();
        self.direct_raw(Directive { envelope: Some(envelope), decision, task: Some(task), checkpoint }.encode_to_vec())
    }

    /// Sends a recorded directive, stamped as one of this session; a checkpoint is not asked for.
    pub fn pass_on(&mut self, directive: &Directive) -> Result<(), Fault> {
        let Directive { envelope: Some(about), decision, task: Some(task), .. } = directive.clone() else {
            return Ok(());
        };
        self.decision = decision;
        self.direct(about, task, false)
    }

    /// Forgets what was heard, but for the values that a later message may refer to once `version` is accepted.
    pub fn forget(&mut self, version: Version) {
        self.log.clear();
        let newest: BTreeMap<String, Version> =
            self.values.keys().filter(|(_, at)| *at <= version).map(|(name, at)| (name.clone(), *at)).collect();
        self.values.retain(|(name, at), _| *at > version || newest.get(name) == Some(at));
    }

    /// Has the node end, if it likes, without a word about it.
    pub fn dismiss(&mut self) {
        let about = Envelope { version: Some(Version::INITIAL), ..Envelope::default() };
        let stop = Stop { completed: true, reason: "all is verified".into() };
        if self.direct(about, directive::Task::Stop(stop), false).is_ok() {
            // One that does not leave is ended with the session.
            let _ = self.ended("after Stop");
        }
    }

    /// Puts on the key of directives whatever it may be.
    pub fn direct_raw(&mut self, bytes: Vec<u8>) -> Result<(), Fault> {
        Ok(self.directives.put(None, bytes.into())?)
    }

    /// Answers the node's query for the snapshot it is to go on from.
    pub fn offer(&mut self, snapshot: &Snapshot) -> Result<(), Fault> {
        let key = keys::restore(&self.run, &self.node);
        let reply = Sample { key: key.clone(), attachment: Bytes::new(), payload: snapshot.encode_to_vec().into() };
        self.declarations.push(self.link.queryable(&key, move || vec![reply.clone()])?);
        Ok(())
    }

    /// Waits for what `pick` takes among the messages of this epoch behind `from`.
    ///
    /// # Errors
    /// It does not come, the node says that it failed, or it ends.
    pub fn wait<T>(
        &mut self,
        from: usize,
        expected: &str,
        pick: impl Fn(&Heard, &Envelope) -> Option<T>,
    ) -> Result<T, Fault> {
        let deadline = Instant::now() + self.patience;
        let mut at = from;
        loop {
            while at < self.log.len() {
                let heard = &self.log[at];
                at += 1;
                if let Heard::Unreadable(why) = heard {
                    return Err(Fault::new(expected, why.clone()));
                }
                let Some(envelope) = heard.envelope().filter(|envelope| envelope.epoch == self.epoch) else { continue };
                if let Some(found) = pick(heard, envelope) {
                    return Ok(found);
                }
                if let Heard::Report(_, report::Body::Failure(failure)) = heard {
                    return Err(Fault::new(expected, format!("a Failure: {}", failure.message)));
                }
            }
            if !self.hear(Duration::from_millis(20)) {
                if let Err(ended) = self.alive(expected) {
                    // Its last message may still be on its way.
                    if self.hear(SILENCE) {
                        continue;
                    }
                    return Err(ended);
                }
                if Instant::now() > deadline {
                    let found =
                        format!("nothing of the kind within {} s{}", self.patience.as_secs(), self.words.told());
                    return Err(Fault::new(expected, found));
                }
            }
        }
    }

    /// Takes what has come; waits at most so long for one message.
    fn hear(&mut self, patience: Duration) -> bool {
        let Ok(heard) = self.events.recv_timeout(patience) else { return false };
        if let Heard::Field(received) = &heard
            && received.envelope.epoch == self.epoch
        {
            let version = received.envelope.version.unwrap_or_default();
            let known = |earlier: Version| self.values.get(&(received.name.clone(), earlier)).cloned();
            if let Some(field) = received.field.clone().or_else(|| received.same_as.and_then(known)) {
                self.values.insert((received.name.clone(), version), field);
            }
        }
        self.log.push(heard);
        true
    }

    /// Listens for a while in which the node must not report anything.
    ///
    /// # Errors
    /// It does.
    pub fn silent(&mut self, from: usize, expected: &str) -> Result<(), Fault> {
        let deadline = Instant::now() + SILENCE;
        while let Some(left) = deadline.checked_duration_since(Instant::now()) {
            self.hear(left);
        }
        self.alive(expected)?;
        let told = self.log[from..].iter().find_map(|heard| match heard {
            Heard::Report(envelope, body) => Some((envelope.version.unwrap_or_default(), body.clone())),
            _ => None,
        });
        match told {
            Some((version, body)) => Err(Fault::new(expected, format!("{} at {version}", name_of(&body)))),
            None => Ok(()),
        }
    }

    /// The answer to a trial: its report, and every written field at its version before it.
    pub fn answer(&mut self, version: Version, from: usize) -> Result<Reply, Fault> {
        let expected = format!("Done for {version}");
        let done = self.wait(from, &expected, |heard, envelope| match heard {
            Heard::Report(_, report::Body::Done(done)) if envelope.version == Some(version) => Some(done.clone()),
            _ => None,
        })?;
        let fields = self.published(version, from)?;
        Ok(Reply { fields, done })
    }

    /// Every written field at a version, among the messages behind `from`.
    pub fn published(&self, version: Version, from: usize) -> Result<Fields, Fault> {
        let mut fields = Fields::new();
        for port in self.ports().writes {
            let expected = format!("`{}` at {version}, before the report about it", port.field);
            let is_it = |heard: &Heard| {
                matches!(heard, Heard::Field(received) if received.name == port.field
                    && received.envelope.version == Some(version) && received.envelope.epoch == self.epoch)
            };
            if !self.log[from..].iter().any(is_it) {
                return Err(Fault::new(expected, "nothing"));
            }
            match self.values.get(&(port.field.clone(), version)) {
                Some(field) => fields.insert(port.field.clone(), field.clone()),
                None => return Err(Fault::new(expected, "a reference to a version that was never sent")),
            };
        }
        Ok(fields)
    }

    /// Waits until the node says that it holds what it needs to go on from `version`.
    pub fn ready(&mut self, from: usize, version: Version) -> Result<(), Fault> {
        self.wait(from, &format!("Ready for {version}"), |heard, envelope| {
            let is_ready = matches!(heard, Heard::Report(_, report::Body::Ready(_)));
            (is_ready && envelope.version == Some(version)).then_some(())
        })
    }

    /// Says that the run is over and waits for the node's last word.
    pub fn stop(&mut self) -> Result<FinalReport, Fault> {
        let from = self.log.len();
        let about = Envelope { version: Some(Version::INITIAL), ..Envelope::default() };
        let stop = Stop { completed: true, reason: "the rule has been checked".into() };
        self.direct(about, directive::Task::Stop(stop), false)?;
        self.wait(from, "a FinalReport in answer to Stop", |heard, _| match heard {
            Heard::Report(_, report::Body::FinalReport(last)) => Some(last.clone()),
            _ => None,
        })
    }

    /// Waits until the process has ended.
    pub fn ended(&mut self, because: &str) -> Result<ExitStatus, Fault> {
        let begun = Instant::now();
        while begun.elapsed() < LEAVE {
            if let Ok(Some(status)) = self.child.try_wait() {
                return Ok(status);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Err(Fault::new(format!("a process that ends within {} s {because}", LEAVE.as_secs()), "it still runs"))
    }

    /// Closes the pipe on its standard input, as the end of its parent does.
    pub fn close_pipe(&mut self) {
        drop(self.child.stdin.take());
    }

    /// Takes the coordinator's token away and closes the hub, as the end of its process does.
    pub fn close_hub(&mut self) -> Result<(), Fault> {
        self.token = None;
        self.declarations.clear();
        Ok(self.link.close()?)
    }

    fn alive(&mut self, expected: &str) -> Result<(), Fault> {
        match self.child.try_wait() {
            Ok(Some(status)) => {
                // Its last lines are on their way.
                std::thread::sleep(Duration::from_millis(50));
                Err(Fault::new(expected, format!("its process has ended ({status}){}", self.words.told())))
            }
            _ => Ok(()),
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // One that has ended cannot be killed, which is as good.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Writer and name of a source.
pub fn place(source: &Source) -> (String, String) {
    (source.writer.clone(), source.field.clone())
}

/// The version at which a source holds what is frozen at the window's end of the trial `version`, as docs/protocol.md
/// says it.
pub fn frozen_version(source: &Source, version: Version, committed: Version) -> Version {
    match (source.same_iteration, version.iteration) {
        (true, _) => version,
        (false, 0 | 1) => committed,
        (false, iteration) => Version { iteration: iteration - 1, ..version },
    }
}
