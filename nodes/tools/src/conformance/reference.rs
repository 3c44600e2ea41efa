//! The run that every rule repeats: the node under test among the other nodes of the scene, which are solved here.

use std::collections::BTreeMap;

use stagger_coupling::{FrozenFields, Participant, SolveError, Window};
use stagger_messages::{Field, Fields, Iterate, Plan, Source, Verdict, Version};
use stagger_scene::ParticipantError;

use super::{
    Bench, ConformanceError,
    heard::{Fault, same_values},
    session::{Given, Reply, Session, Trial, place},
};

/// Steps of the reference run.
const STEPS: u64 = 3;
/// Iterations of each: the second freezes what the first gave.
const ITERATIONS: u32 = 2;

/// What a node that keeps the protocol did, and will do again.
pub struct Reference {
    /// Who reads from whom.
    pub plan: Plan,
    /// Its initial fields.
    pub own: Fields,
    /// Initial values of what it reads.
    pub given: Given,
    /// Its trials, step by step; the last one of each step is accepted.
    pub steps: Vec<Vec<Trial>>,
}

/// The other nodes of the scene.
pub struct Surroundings {
    /// Participants by name.
    pub members: BTreeMap<String, Box<dyn Participant>>,
    /// The newest fields of all nodes; at first the initial ones of these.
    pub newest: Given,
    frozen_fields: BTreeMap<String, FrozenFields>,
}

impl Reference {
    /// A session whose node has the plan and all initial fields, and is ready.
    pub fn open(&self, bench: &Bench) -> Result<Session, Fault> {
        let mut session = Session::start(bench)?;
        self.begin(&mut session, &self.plan)?;
        Ok(session)
    }

    /// Sends a plan that starts from t = 0, and waits until the node is ready.
    pub fn begin(&self, session: &mut Session, plan: &Plan) -> Result<(), Fault> {
        let from = session.log.len();
        session.plan(plan)?;
        session.put_all(&self.given, Version::INITIAL)?;
        session.ready(from, Version::INITIAL)?;
        same_values(&self.own, &session.published(Version::INITIAL, from)?)
    }

    /// The reference run in a session whose node is ready.
    pub fn record(
        bench: &Bench,
        session: &mut Session,
        plan: Plan,
        own: Fields,
        mut around: Surroundings,
    ) -> Result<Self, Fault> {
        let sources = session.sources.clone();
        let given = of_sources(&sources, &around.newest);
        around.newest.extend(keyed(&bench.node, own.clone()));
        around.begin(&plan)?;
        let dt_s = bench.scene.coupling.dt.start_s;
        let (mut steps, mut committed) = (Vec::new(), Version::INITIAL);
        for step in 1..=STEPS {
            let window = Window { t_s: (step - 1) as f64 * dt_s, dt_s };
            let mut trials = Vec::new();
            for iteration in 1..=ITERATIONS {
                let version = Version { iteration, ..Version::first(step) };
                if iteration > 1 {
                    session.decide(Version { iteration: iteration - 1, ..version }, Verdict::Iterate);
                }
                let (ends, after, reply) = (Given::new(), Given::new(), Reply::default());
                let mut trial = Trial { version, committed, window, ends, after, reply };
                let previous = around.newest.clone();
                for node in &plan.order {
                    let fields = if *node == bench.node {
                        let end = |source: &Source| if source.same_iteration { &around.newest } else { &previous };
                        let ends = sources.iter().map(|source| (place(source), end(source).get(&place(source))));
                        trial.ends = ends.filter_map(|(key, field)| Some((key, field?.clone()))).collect();
                        trial.reply = session.solve(&trial)?;
                        trial.reply.fields.clone()
                    } else {
                        around.solve(node, &trial)?
                    };
                    around.publish(node, version, fields);
                }
                trial.after = of_sources(&sources, &around.newest);
                trials.push(trial);
            }
            if let Some(last) = trials.last() {
                around.commit(last.version)?;
                session.accept(last)?;
                committed = last.version;
            }
            steps.push(trials);
        }
        Ok(Self { plan, own, given, steps })
    }

    /// The first two trials of the first step.
    pub fn first(&self) -> (&Trial, &Trial) {
        (&self.steps[0][0], &self.steps[0][1])
    }
}

impl Surroundings {
    /// The other nodes, at t = 0.
    pub fn new(bench: &Bench) -> Result<Self, ConformanceError> {
        let mut members = bench.others()?;
        let mut newest = Given::new();
        for (node, member) in &mut members {
            let start = member.initial();
            let (fields, _) = start.map_err(|source| ParticipantError::Settings { node: node.clone(), source })?;
            newest.extend(keyed(node, fields));
        }
        Ok(Self { members, newest, frozen_fields: BTreeMap::new() })
    }

    /// Gives every node the initial fields of those it reads.
    fn begin(&mut self, plan: &Plan) -> Result<(), Fault> {
        for part in &plan.nodes {
            self.frozen_fields.insert(part.node.clone(), FrozenFields::new(part.sources.clone()));
        }
        for ((writer, _), field) in self.newest.clone() {
            self.deliver(&writer, Version::INITIAL, &field);
        }
        // What the node under test freezes is its own, but what it holds is the same.
        match self.frozen_fields.iter_mut().find_map(|(node, frozen_fields)| (!frozen_fields.begin()).then_some(node)) {
            None => Ok(()),
            Some(node) => Err(Fault::new(format!("all initial fields that `{node}` reads"), "one is missing")),
        }
    }

    fn deliver(&mut self, writer: &str, version: Version, field: &Field) {
        for frozen_fields in
            self.frozen_fields.values_mut().filter(|frozen_fields| frozen_fields.reads(writer, field.name()))
        {
            frozen_fields.insert(writer, version, field.clone());
        }
    }

    fn publish(&mut self, writer: &str, version: Version, fields: Fields) {
        for field in fields.values() {
            self.deliver(writer, version, field);
        }
        self.newest.extend(keyed(writer, fields));
    }

    fn solve(&mut self, node: &str, trial: &Trial) -> Result<Fields, Fault> {
        let failed = |found: String| Fault::new(format!("fields that `{node}` can use"), found);
        let (Some(frozen_fields), Some(member)) = (self.frozen_fields.get_mut(node), self.members.get_mut(node)) else {
            return Err(failed("no such node".into()));
        };
        let iterate = Iterate { committed: Some(trial.committed), ..Iterate::default() };
        let frozen = frozen_fields.freeze(trial.version, &iterate).map_err(|error| failed(error.to_string()))?;
        let frozen = frozen.ok_or_else(|| failed(format!("one is missing at {}", trial.version)))?;
        let answer = member.solve(trial.version, trial.window, &frozen).map_err(|error| failed(error.to_string()))?;
        Ok(answer.fields)
    }

    fn commit(&mut self, version: Version) -> Result<(), Fault> {
        for (name, member) in &mut self.members {
            let failed = |error: SolveError| Fault::new(format!("`{name}` to commit {version}"), error.to_string());
            member.commit(version).map_err(failed)?;
        }
        for (name, frozen_fields) in &mut self.frozen_fields {
            if self.members.contains_key(name) {
                frozen_fields.commit();
            }
            frozen_fields.accepted(version);
        }
        Ok(())
    }
}

fn keyed(writer: &str, fields: Fields) -> impl Iterator<Item = ((String, String), Field)> {
    let writer = writer.to_owned();
    fields.into_iter().map(move |(name, field)| ((writer.clone(), name), field))
}

fn of_sources(sources: &[Source], fields: &Given) -> Given {
    sources.iter().filter_map(|source| Some((place(source), fields.get(&place(source))?.clone()))).collect()
}

/// Who reads from whom, with the node under test among the others.
pub fn plan(bench: &Bench, session: &Session, around: &Surroundings) -> Result<Plan, Fault> {
    let mut ports: BTreeMap<_, _> =
        around.members.iter().map(|(name, member)| (name.clone(), member.ports())).collect();
    ports.insert(bench.node.clone(), session.ports());
    let plan = stagger_coupling::plan(&ports, &bench.scene.coupling);
    let mut plan =
        plan.map_err(|error| Fault::new("ports that fit the other nodes of the scene", error.to_string()))?;
    for source in plan.nodes.iter_mut().flat_map(|part| &mut part.sources) {
        // Equal answers are what is looked for: none may be given again for inputs that are merely close.
        (source.reuse_below, source.accelerated) = (0.0, false);
    }
    Ok(plan)
}
