//! A node written from docs/protocol.md alone, without the host: right where it is told nothing, and otherwise wrong
//! about one thing.
//!
//! It reads `positions` and `temperature` and writes their sum over time, so that all of its past shows in its answer.

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        mpsc::{Receiver, channel},
    },
    time::Duration,
};

use bytes::Bytes;
use prost::Message as _;
use stagger_messages::{
    Change, Directive, Done, Envelope, Failure, Field, FieldSummary, FinalReport, Iterate, Manifest, Measure, NodePlan,
    Plan, Port, Ports, Ready, Report, SCHEMA_VERSION, Snapshot, Source, Verdict, Version, codec, directive, keys,
    report,
};
use stagger_runtime::link::{Declaration, Link, Publisher, Role, Sample};

/// Ways to be wrong, and the one rule that each breaks.
pub const WRONGS: [(&str, &str); 27] = [
    ("other-schema", "announce"),
    ("port-without-unit", "ports"),
    ("no-initial-fields", "initial"),
    ("early-ready", "ready"),
    ("skips-a-field", "reply"),
    ("not-finite", "reply"),
    ("never-again", "again"),
    ("keeps-state-between-trials", "pure"),
    ("ignores-reject", "reject"),
    ("no-farewell", "farewell"),
    ("exits-with-1", "farewell"),
    ("commits-every-trial", "commit"),
    ("commits-twice", "commit-once"),
    ("never-rests", "rest"),
    ("window-of-the-run", "long-window"),
    ("swallows-nan", "not-a-number"),
    ("gap-in-the-sequence", "sequence"),
    ("takes-the-newest-field", "order"),
    ("hears-old-epochs", "late"),
    ("counts-no-refusals", "foreign"),
    ("reference-to-the-newest", "references"),
    ("ignores-the-coordinator's-iterate", "accelerated"),
    ("empty-snapshot", "snapshot"),
    ("forgets-its-state", "restore"),
    ("stays-in-its-epoch", "epoch"),
    ("outlives-its-parent", "parent"),
    ("outlives-the-coordinator", "coordinator"),
];

enum Event {
    Directive(Sample),
    Field(Sample),
    Gone,
}

type Key = (String, String, Version);

struct Node {
    wrong: String,
    run: String,
    name: String,
    link: Link,
    events: Receiver<Event>,
    fields: [Publisher; 2],
    report: Publisher,
    snapshot: Publisher,
    ports: [Arc<Port>; 2],
    epoch: Option<u32>,
    sequence: u64,
    refused: u64,
    sources: Vec<Source>,
    inbox: BTreeMap<Key, Field>,
    early: Vec<Sample>,
    from: Version,
    waiting: bool,
    pending: Option<(Envelope, Iterate)>,
    /// State and version committed, and those of the last trial.
    committed: (f64, Version),
    trial: Option<(f64, Version, Done)>,
    accepted: Version,
    /// What a wrong node remembers of a trial that is not accepted.
    trace: f64,
}

/// Takes part in a run, wrong in one way, and ends the process.
pub fn run(wrong: &str) -> ! {
    let of = |name| std::env::var(name).unwrap();
    let (run, name) = (of("STAGGER_RUN"), of("STAGGER_NODE"));
    let link = Link::open(&Role::Node { connect: of("STAGGER_CONNECT") }, None).unwrap();
    let (sender, events) = channel();
    let port = |field, measure| Port::f64(field, "K", "wrong", 1, measure);
    let mut ports = [port("sum", Measure::Magnitude), port("last", Measure::None)];
    if wrong == "port-without-unit" {
        ports[1].unit.clear();
    }
    let reads = vec![
        Port::f64("positions", "m", "particles", 3, Measure::None),
        Port::f64("temperature", "K", "particles", 1, Measure::None),
    ];
    let manifest = Manifest {
        run: run.clone(),
        schema: if wrong == "other-schema" { SCHEMA_VERSION + 1 } else { SCHEMA_VERSION },
        node: name.clone(),
        instance: "1".into(),
        program: "wrong".into(),
        pid: std::process::id(),
        ports: Some(Ports::new(reads.clone(), ports.to_vec())),
        scene_hash: of("STAGGER_SCENE_HASH").parse().unwrap(),
    };
    let mut declarations: Vec<Declaration> = Vec::new();
    let to = sender.clone();
    let heard = move |sample| drop(to.send(Event::Directive(sample)));
    declarations.push(link.subscribe(&keys::directive(&run), heard).unwrap());
    for read in &reads {
        let to = sender.clone();
        let heard = move |sample| drop(to.send(Event::Field(sample)));
        declarations.push(link.subscribe(&keys::field(&run, "*", &read.field), heard).unwrap());
    }
    if wrong != "outlives-the-coordinator" {
        let to = sender.clone();
        let heard = move |_, alive: bool| drop((!alive).then(|| to.send(Event::Gone)));
        declarations.push(link.watch(&keys::live(&run, "coordinator", "*"), heard).unwrap());
    }
    if wrong != "outlives-its-parent" {
        std::thread::spawn(move || {
            let _ = std::io::Read::read(&mut std::io::stdin(), &mut [0]);
            let _ = sender.send(Event::Gone);
        });
    }
    let key = keys::manifest(&run, &name);
    let answer = Sample { key: key.clone(), attachment: Bytes::new(), payload: manifest.encode_to_vec().into() };
    declarations.push(link.queryable(&key, move || vec![answer.clone()]).unwrap());
    let publisher = |key| link.publisher(key).unwrap();
    let mut node = Node {
        wrong: wrong.into(),
        events,
        fields: [publisher(keys::field(&run, &name, "sum")), publisher(keys::field(&run, &name, "last"))],
        report: publisher(keys::report(&run, &name)),
        snapshot: publisher(keys::snapshot(&run, &name)),
        ports: ports.map(Arc::new),
        epoch: None,
        sequence: 0,
        refused: 0,
        sources: Vec::new(),
        inbox: BTreeMap::new(),
        early: Vec::new(),
        from: Version::INITIAL,
        waiting: false,
        pending: None,
        committed: (0.0, Version::INITIAL),
        trial: None,
        accepted: Version::INITIAL,
        trace: 0.0,
        link: link.clone(),
        run,
        name,
    };
    declarations.push(link.announce(&keys::live(&node.run, &node.name, "1")).unwrap());
    let code = node.take_part();
    link.close().unwrap();
    std::process::exit(code)
}

impl Node {
    fn is(&self, wrong: &str) -> bool {
        self.wrong == wrong
    }

    fn take_part(&mut self) -> i32 {
        loop {
            match self.events.recv().unwrap() {
                Event::Gone => return 1,
                Event::Field(sample) => self.field(sample),
                Event::Directive(sample) => {
                    if let Some(code) = self.directive(&sample) {
                        return code;
                    }
                }
            }
            self.ready();
            self.solve();
        }
    }

    fn field(&mut self, sample: Sample) {
        let Ok(received) = codec::decode_field(&sample.attachment, sample.payload.clone()) else {
            return self.refuse();
        };
        let envelope = received.envelope;
        let old = self.is("hears-old-epochs");
        match self.epoch {
            Some(epoch) if envelope.epoch <= epoch => {
                let fits = envelope.run == self.run && envelope.schema == SCHEMA_VERSION;
                if !fits || (envelope.epoch < epoch && !old) {
                    return self.refuse();
                }
            }
            _ => return self.early.push(sample),
        }
        let version = envelope.version.unwrap();
        let newest = |node: &Self| {
            let mut of_field =
                node.inbox.iter().filter(|((from, name, _), _)| *from == envelope.sender && *name == received.name);
            of_field.next_back().map(|(_, field)| field.clone())
        };
        let place = |version| (envelope.sender.clone(), received.name.clone(), version);
        let value = match received.same_as {
            Some(_) if self.is("reference-to-the-newest") => newest(self),
            Some(same_as) => self.inbox.get(&place(same_as)).cloned(),
            None => received.field,
        };
        if let Some(value) = value {
            self.inbox.insert(place(version), value);
        }
    }

    fn refuse(&mut self) {
        self.refused += u64::from(!self.is("counts-no-refusals"));
    }

    fn directive(&mut self, sample: &Sample) -> Option<i32> {
        let Ok(directive) = Directive::decode(sample.payload.clone()) else {
            self.refuse();
            return None;
        };
        let envelope = directive.envelope.unwrap();
        let begins = matches!(directive.task, Some(directive::Task::Plan(_)))
            && self.epoch.is_none_or(|epoch| envelope.epoch > epoch && !self.is("stays-in-its-epoch"));
        let ours = envelope.run == self.run && envelope.schema == SCHEMA_VERSION;
        if !ours || !(begins || self.epoch == Some(envelope.epoch)) {
            self.refuse();
            return None;
        }
        if let Some(decision) = &directive.decision {
            self.conclude(decision.verdict(), decision.version.unwrap());
        }
        if directive.checkpoint {
            self.checkpoint();
        }
        match directive.task.unwrap() {
            directive::Task::Plan(plan) => self.plan(&plan, envelope.epoch, begins),
            directive::Task::Iterate(iterate) => self.iterate(envelope, iterate),
            directive::Task::Stop(_) => {
                self.farewell();
                return Some(i32::from(self.is("exits-with-1")));
            }
        }
        None
    }

    fn conclude(&mut self, verdict: Verdict, version: Version) {
        let twice = self.is("commits-twice") && version == self.accepted;
        if verdict == Verdict::Accept && (version > self.accepted || twice) {
            let trial = self.trial.as_ref().filter(|(_, at, _)| *at == version || twice);
            if let Some((state, at, _)) = trial {
                let more = if twice { 1.0 } else { 0.0 };
                self.committed = (state + more, if twice { version } else { *at });
            }
            self.accepted = version;
            self.trace = 0.0;
        }
        if verdict == Verdict::Reject && self.is("ignores-reject") {
            self.trace = 1.0;
        }
    }

    fn plan(&mut self, plan: &Plan, epoch: u32, begins: bool) {
        if begins {
            (self.epoch, self.sequence) = (Some(epoch), 0);
            (self.trial, self.pending, self.trace) = (None, None, 0.0);
            self.inbox.clear();
            let mine = |part: &&NodePlan| part.node == self.name;
            self.sources = plan.nodes.iter().find(mine).unwrap().sources.clone();
            self.from = plan.from.unwrap_or(Version::INITIAL);
            self.committed = (0.0, Version::INITIAL);
            if self.from != Version::INITIAL {
                let key = keys::restore(&self.run, &self.name);
                let answers = self.link.query(&key, Duration::from_secs(10)).unwrap();
                let snapshot = Snapshot::decode(answers[0].payload.clone()).unwrap();
                let state = f64::from_le_bytes(snapshot.state.try_into().unwrap());
                self.committed = (state, snapshot.committed.unwrap());
            }
            self.accepted = self.from;
            for sample in std::mem::take(&mut self.early) {
                self.field(sample);
            }
        }
        let (state, version) = self.committed;
        self.publish(&Envelope { version: Some(version), ..Envelope::default() }, state);
        self.waiting = true;
    }

    fn ready(&mut self) {
        let has = |source: &Source| {
            self.inbox
                .keys()
                .any(|(from, name, at)| *from == source.writer && *name == source.field && *at <= self.from)
        };
        if self.waiting && (self.is("early-ready") || self.sources.iter().all(has)) {
            self.waiting = false;
            self.tell(
                &Envelope { version: Some(self.from), ..Envelope::default() },
                report::Body::Ready(Ready::default()),
            );
        }
    }

    fn iterate(&mut self, envelope: Envelope, iterate: Iterate) {
        let version = envelope.version.unwrap();
        if version <= self.accepted {
            return self.refuse();
        }
        let part = iterate.parts.iter().find(|part| part.node == self.name);
        if part.is_some_and(|part| part.rests) && !self.is("never-rests") {
            return;
        }
        match self.trial.clone().filter(|(_, at, _)| *at == version) {
            Some((state, _, done)) => {
                if iterate.again && !self.is("never-again") {
                    self.publish(&envelope, state);
                    self.tell(&envelope, report::Body::Done(done));
                }
            }
            None => self.pending = Some((envelope, iterate)),
        }
    }

    /// The values a source has at the start and at the end of a window; none as long as one is missing.
    fn frozen(&self, source: &Source, version: Version, iterate: &Iterate) -> Option<(f64, f64)> {
        let mean = |field: &Field| field.f64().unwrap().iter().sum::<f64>() / field.rows().max(1) as f64;
        let run = iterate.committed.unwrap();
        let part = iterate.parts.iter().find(|part| part.node == self.name);
        let start = part.map_or(run, |part| part.committed.unwrap());
        let before = Version { iteration: version.iteration - 1, ..version };
        let (writer, end) = match (source.same_iteration, version.iteration) {
            (true, _) => (source.writer.as_str(), version),
            (false, 1) => (source.writer.as_str(), run),
            (false, _) if source.accelerated && !self.is("ignores-the-coordinator's-iterate") => {
                ("coordinator", before)
            }
            (false, _) => (source.writer.as_str(), before),
        };
        let at = |from: &str, version| self.inbox.get(&(from.to_owned(), source.field.clone(), version)).map(mean);
        let newest = || {
            let mut all = self.inbox.iter().filter(|((from, name, _), _)| *from == writer && *name == source.field);
            all.next_back().map(|(_, field)| mean(field))
        };
        let end = at(writer, end).and_then(|end| if self.is("takes-the-newest-field") { newest() } else { Some(end) });
        Some((at(&source.writer, start)?, end?))
    }

    fn solve(&mut self) {
        let Some((envelope, iterate)) = self.pending.clone() else { return };
        let version = envelope.version.unwrap();
        let frozen: Option<Vec<_>> = self.sources.iter().map(|source| self.frozen(source, version, &iterate)).collect();
        let Some(frozen) = frozen else { return };
        self.pending = None;
        let part = iterate.parts.iter().find(|part| part.node == self.name && !self.is("window-of-the-run"));
        let dt_s = part.map_or(envelope.dt_s, |part| part.dt_s);
        let mut mean: f64 = frozen.iter().map(|(start, end)| 0.5 * (start + end)).sum();
        if !mean.is_finite() {
            if self.is("swallows-nan") {
                mean = 0.0;
            } else {
                let failure = Failure { message: "a frozen value is no number".into(), retry: true };
                return self.tell(&envelope, report::Body::Failure(failure));
            }
        }
        let state = self.committed.0 + self.trace + mean * dt_s;
        if self.is("keeps-state-between-trials") {
            self.trace += 1e-6;
        }
        let change = Change { field: "sum".into(), change: state.abs(), rows: 1, ..Change::default() };
        let done = Done { changes: vec![change], converged: true, refused: self.refused, ..Done::default() };
        self.publish(&envelope, if self.is("not-finite") { f64::NAN } else { state });
        self.tell(&envelope, report::Body::Done(done.clone()));
        self.trial = Some((state, version, done));
    }

    fn values(&self, state: f64) -> [Field; 2] {
        [0, 1].map(|at| Field::new(&self.ports[at], 0, vec![state * (1.0 + at as f64)]).unwrap())
    }

    fn publish(&mut self, about: &Envelope, state: f64) {
        let initial = about.version == Some(Version::INITIAL);
        for (at, field) in self.values(state).iter().enumerate() {
            let skipped = at == 1 && self.is("skips-a-field") && !initial;
            if skipped || (initial && self.is("no-initial-fields")) {
                continue;
            }
            let envelope = self.stamp(about);
            let attachment = codec::field_attachment(&envelope, field, None);
            self.fields[at].put(Some(attachment), field.values().bytes().clone()).unwrap();
        }
    }

    fn checkpoint(&mut self) {
        let (state, version) = self.committed;
        let state_kept = if self.is("forgets-its-state") { 0.0 } else { state };
        let about = Envelope { version: Some(self.accepted), ..Envelope::default() };
        let fields = self.values(state);
        let fields = if self.is("empty-snapshot") { &fields[..0] } else { &fields };
        let fields = fields.iter().map(|field| codec::field_message(&about, field)).collect();
        let snapshot = Snapshot {
            envelope: Some(Envelope { sequence: 0, ..self.envelope(&about) }),
            committed: Some(version),
            state: state_kept.to_le_bytes().to_vec(),
            fields,
            frozen: Vec::new(),
        };
        self.snapshot.put(None, snapshot.encode_to_vec().into()).unwrap();
    }

    fn farewell(&mut self) {
        if self.is("no-farewell") {
            return;
        }
        let tried = self.trial.as_ref().map_or(self.committed.0, |(state, ..)| *state);
        let state = if self.is("commits-every-trial") { tried } else { self.committed.0 };
        let summary = |field: &Field| {
            let value = field.f64().unwrap()[0];
            let (name, unit) = (field.name().to_owned(), field.port.unit.clone());
            FieldSummary { field: name, unit, rows: 1, min: value, mean: value, max: value, hash: field.hash() }
        };
        let fields = self.values(state).iter().map(summary).collect();
        let about = Envelope { version: Some(self.committed.1), ..Envelope::default() };
        self.tell(&about, report::Body::FinalReport(FinalReport { fields }));
    }

    fn tell(&mut self, about: &Envelope, body: report::Body) {
        let envelope = self.stamp(about);
        self.report.put(None, Report { envelope: Some(envelope), body: Some(body) }.encode_to_vec().into()).unwrap();
    }

    fn envelope(&self, about: &Envelope) -> Envelope {
        Envelope {
            run: self.run.clone(),
            schema: SCHEMA_VERSION,
            epoch: self.epoch.unwrap_or_default(),
            sender: self.name.clone(),
            sequence: self.sequence,
            ..about.clone()
        }
    }

    fn stamp(&mut self, about: &Envelope) -> Envelope {
        let envelope = self.envelope(about);
        self.sequence += if self.is("gap-in-the-sequence") { 2 } else { 1 };
        envelope
    }
}
