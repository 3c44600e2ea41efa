//! An ensemble whose participants are all in this process.

use std::collections::BTreeMap;

use stagger_messages::{
    Checkpoint, Decision, Envelope, Failure, Field, Fields, Plan, Ports, Ready, Snapshot, Source, Verdict, Version,
    codec,
};

use super::{COORDINATOR, ControlError, Ensemble, Inbox, Outcome, Participant, Task, plan::PlanError};
use crate::SolveError;

/// Why participants in this process cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum InProcessError {
    /// The step control gave up.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// A participant cannot start or commit.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The participants do not fit together.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// Participants in one thread, handing each other their fields: the same numbers as nodes of their own, and the
/// smallest thing that runs a scene.
#[derive(Default)]
pub struct InProcess {
    members: BTreeMap<String, Member>,
    order: Vec<String>,
    /// Where the run goes on, and the last checkpoint it took.
    checkpoint: Option<Checkpoint>,
    /// A checkpoint to be taken when the decision that accepts its version is told.
    wanted: Option<(Version, f64, Vec<u8>)>,
}

struct Member {
    participant: Box<dyn Participant>,
    inbox: Inbox,
    /// What it answered last, and the version of that.
    answered: (Version, Fields),
    /// What it committed last.
    committed: (Version, Fields),
}

impl InProcess {
    /// Nodes by name.
    #[must_use]
    pub fn new(members: BTreeMap<String, Box<dyn Participant>>) -> Self {
        let member = |participant| Member {
            participant,
            inbox: Inbox::default(),
            answered: (Version::INITIAL, Fields::new()),
            committed: (Version::INITIAL, Fields::new()),
        };
        let members = members.into_iter().map(|(name, participant)| (name, member(participant))).collect();
        Self { members, ..Self::default() }
    }

    /// Goes on from a checkpoint: its version is to be that of the plan.
    #[must_use]
    pub fn from_checkpoint(self, checkpoint: Checkpoint) -> Self {
        Self { checkpoint: Some(checkpoint), ..self }
    }

    /// The last checkpoint that was taken.
    #[must_use]
    pub fn last_checkpoint(&self) -> Option<&Checkpoint> {
        self.checkpoint.as_ref()
    }

    /// Ports by node.
    #[must_use]
    pub fn ports(&self) -> BTreeMap<String, Ports> {
        self.members.iter().map(|(name, member)| (name.clone(), member.participant.ports())).collect()
    }

    /// The fields committed last: after a run, those at its end.
    #[must_use]
    pub fn fields(&self) -> Fields {
        self.members.values().flat_map(|member| member.committed.1.clone()).collect()
    }

    /// The fields that each node committed last.
    pub fn committed(&self) -> impl Iterator<Item = (&str, &Fields)> {
        self.members.iter().map(|(name, member)| (name.as_str(), &member.committed.1))
    }

    fn deliver(&mut self, sender: &str, version: Version, fields: &Fields) {
        for member in self.members.values_mut() {
            for field in
                fields.values().filter(|field| member.inbox.reads(sender, field.name())).cloned().collect::<Vec<_>>()
            {
                member.inbox.insert(sender, version, field);
            }
        }
    }

    fn conclude(&mut self, decision: Option<&Decision>) -> Result<(), SolveError> {
        let Some(decision) = decision else { return Ok(()) };
        let version = decision.version.unwrap_or_default();
        for member in self.members.values_mut() {
            match decision.verdict() {
                Verdict::Accept => {
                    if member.answered.0 == version {
                        member.participant.commit(version)?;
                        member.inbox.commit();
                        member.committed.clone_from(&member.answered);
                    }
                    member.inbox.accepted(version);
                }
                Verdict::Reject => member.inbox.rejected(version),
                Verdict::Iterate | Verdict::None => {}
            }
        }
        match self.wanted.take() {
            Some((version, t_s, course)) => self.take_checkpoint(version, t_s, course),
            None => Ok(()),
        }
    }

    fn take_checkpoint(&mut self, version: Version, t_s: f64, coordinator: Vec<u8>) -> Result<(), SolveError> {
        let about =
            |sender: &str| Envelope { sender: sender.into(), version: Some(version), t_s, ..Envelope::default() };
        let mut nodes = Vec::new();
        for (name, member) in &self.members {
            nodes.push(snapshot(member.participant.as_ref(), &member.inbox, &member.committed, about(name))?);
        }
        self.checkpoint = Some(Checkpoint { envelope: Some(about(COORDINATOR)), coordinator, nodes });
        Ok(())
    }
}

/// Everything a node needs to go on: its state, what it committed last and, of what it reads, what nobody else will
/// send again. `about` names the node and the version of the checkpoint.
///
/// # Errors
/// The state cannot be encoded.
pub fn snapshot(
    participant: &dyn Participant,
    inbox: &Inbox,
    committed: &(Version, Fields),
    about: Envelope,
) -> Result<Snapshot, SolveError> {
    let of = |sender: &str, at, field| {
        codec::field_message(&Envelope { sender: sender.into(), version: Some(at), ..about.clone() }, field)
    };
    let (at, fields) = committed;
    let older = inbox.older_than(about.version.unwrap_or_default());
    Ok(Snapshot {
        committed: Some(*at),
        state: participant.snapshot()?,
        fields: fields.values().map(|field| of(&about.sender, *at, field)).collect(),
        frozen: older.iter().map(|(sender, at, field)| of(sender, *at, field)).collect(),
        envelope: Some(about),
    })
}

/// Puts what a snapshot says into a participant and its inbox; the version it had committed and the fields of that.
///
/// # Errors
/// The snapshot is not one of this participant.
pub fn restore(
    participant: &mut dyn Participant,
    inbox: &mut Inbox,
    snapshot: Snapshot,
) -> Result<(Version, Fields), SolveError> {
    let mut fields = Fields::new();
    for message in snapshot.fields {
        let received = codec::field_of(message)?;
        fields.extend(received.field.map(|field| (received.name, field)));
    }
    for message in snapshot.frozen {
        let received = codec::field_of(message)?;
        if let Some(field) = received.field {
            inbox.insert(&received.envelope.sender, received.envelope.version.unwrap_or_default(), field);
        }
    }
    participant.restore(&snapshot.state, fields.clone())?;
    Ok((snapshot.committed.unwrap_or_default(), fields))
}

impl Ensemble for InProcess {
    type Error = InProcessError;

    fn start(&mut self, plan: &Plan) -> Result<Vec<(String, Ready)>, InProcessError> {
        self.order.clone_from(&plan.order);
        let from = plan.from.filter(|from| *from != Version::INITIAL);
        let snapshots = self.checkpoint.iter().flat_map(|checkpoint| checkpoint.nodes.clone());
        let mut snapshots: BTreeMap<String, Snapshot> = snapshots
            .filter_map(|snapshot| Some((snapshot.envelope.as_ref()?.sender.clone(), snapshot)))
            .filter(|_| from.is_some())
            .collect();
        let (mut all, mut starts) = (Vec::new(), Vec::new());
        for node in &plan.nodes {
            let Some(member) = self.members.get_mut(&node.node) else { continue };
            member.inbox = Inbox::new(node.sources.clone());
            member.participant.set_sources(&node.sources);
            let ready = match snapshots.remove(&node.node) {
                Some(snapshot) => {
                    member.committed = restore(member.participant.as_mut(), &mut member.inbox, snapshot)?;
                    Ready::default()
                }
                None => {
                    let (fields, ready) = member.participant.initial()?;
                    member.committed = (Version::INITIAL, fields);
                    ready
                }
            };
            member.answered = (Version::INITIAL, Fields::new());
            starts.push((node.node.clone(), member.committed.clone()));
            all.push((node.node.clone(), ready));
        }
        for (node, (version, fields)) in starts {
            self.deliver(&node, version, &fields);
        }
        for (node, member) in &mut self.members {
            if !member.inbox.begin() {
                return Err(SolveError::Mismatch(format!("`{node}` lacks a field to start from")).into());
            }
        }
        Ok(all)
    }

    fn iterate(&mut self, before: Option<&Decision>, task: &Task) -> Result<Vec<Outcome>, InProcessError> {
        self.conclude(before)?;
        let mut outcomes = Vec::new();
        for node in self.order.clone().into_iter().filter(|node| task.asks(node)) {
            let Some(member) = self.members.get_mut(&node) else { continue };
            let Some(frozen) = member.inbox.freeze(task.version, &task.iterate)? else {
                return Err(SolveError::Mismatch(format!("`{node}` lacks a frozen field for {}", task.version)).into());
            };
            let result = match member.participant.solve(task.version, task.window_of(&node), &frozen) {
                Ok(answer) => {
                    member.answered = (task.version, answer.fields.clone());
                    self.deliver(&node, task.version, &answer.fields);
                    Ok(answer.done)
                }
                Err(error) => Err(Failure { message: error.to_string(), retry: error.retry() }),
            };
            let failed = result.is_err();
            outcomes.push(Outcome { node, result });
            if failed {
                break;
            }
        }
        Ok(outcomes)
    }

    fn answered(&mut self, source: &Source, version: Version) -> Result<Field, InProcessError> {
        let member = self.members.get(&source.writer);
        let mut held = member.iter().flat_map(|member| [&member.answered, &member.committed]);
        let field = held.find_map(|(at, fields)| fields.get(&source.field).filter(|_| *at == version)).cloned();
        let lacks = || SolveError::Mismatch(format!("`{}` holds no `{}` of {version}", source.writer, source.field));
        Ok(field.ok_or_else(lacks)?)
    }

    fn publish(&mut self, version: Version, fields: &BTreeMap<String, Field>) -> Result<(), InProcessError> {
        self.deliver(COORDINATOR, version, fields);
        Ok(())
    }

    fn checkpoint(&mut self, version: Version, t_s: f64, course: Vec<u8>) {
        self.wanted = Some((version, t_s, course));
    }

    fn finish(&mut self, last: Option<&Decision>, _completed: bool, _reason: &str) -> Result<(), InProcessError> {
        Ok(self.conclude(last)?)
    }
}
