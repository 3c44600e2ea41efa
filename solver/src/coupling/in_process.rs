use std::collections::BTreeMap;

use stagger_messages::{Decision, Failure, Field, Fields, Plan, Ports, Ready, Source, Verdict, Version};

use super::{ControlError, Ensemble, Frozen, Outcome, Participant, Task, plan::PlanError};
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
    members: BTreeMap<String, Box<dyn Participant>>,
    order: Vec<String>,
    sources: BTreeMap<String, Vec<Source>>,
    /// Values at the window's start.
    committed: Fields,
    /// Newest iterates of the current attempt.
    newest: Fields,
    attempt: (u64, u32),
}

impl InProcess {
    /// Nodes by name.
    #[must_use]
    pub fn new(members: BTreeMap<String, Box<dyn Participant>>) -> Self {
        Self { members, ..Self::default() }
    }

    /// Ports by node.
    #[must_use]
    pub fn ports(&self) -> BTreeMap<String, Ports> {
        self.members.iter().map(|(name, member)| (name.clone(), member.ports())).collect()
    }

    /// The fields at the newest iterate: after a run, those at its end.
    #[must_use]
    pub fn fields(&self) -> &Fields {
        &self.newest
    }

    fn conclude(&mut self, decision: Option<&Decision>) -> Result<(), SolveError> {
        if let Some(decision) = decision.filter(|decision| decision.verdict() == Verdict::Accept) {
            for member in self.members.values_mut() {
                member.commit(decision.version.unwrap_or_default())?;
            }
            self.committed.clone_from(&self.newest);
        }
        Ok(())
    }
}

/// The frozen fields of a node, from where `start` and `end` find a field.
pub fn freeze<'a>(
    sources: &[Source],
    start: impl Fn(&Source) -> Option<&'a Field>,
    end: impl Fn(&Source) -> Option<&'a Field>,
) -> Option<Frozen> {
    let mut frozen = Frozen::default();
    for source in sources {
        let end = end(source)?.clone();
        let start = if source.interpolate { start(source)?.clone() } else { end.clone() };
        frozen.start.insert(source.field.clone(), start);
        frozen.end.insert(source.field.clone(), end);
    }
    Some(frozen)
}

impl Ensemble for InProcess {
    type Error = InProcessError;

    fn start(&mut self, plan: &Plan) -> Result<Vec<(String, Ready)>, InProcessError> {
        self.order.clone_from(&plan.order);
        let mut all = Vec::new();
        for node in &plan.nodes {
            self.sources.insert(node.node.clone(), node.sources.clone());
            let Some(member) = self.members.get_mut(&node.node) else { continue };
            member.set_sources(&node.sources);
            let (fields, ready) = member.initial()?;
            self.newest.extend(fields);
            all.push((node.node.clone(), ready));
        }
        self.committed.clone_from(&self.newest);
        Ok(all)
    }

    fn iterate(&mut self, before: Option<&Decision>, task: &Task) -> Result<Vec<Outcome>, InProcessError> {
        self.conclude(before)?;
        let Version { step, attempt, .. } = task.version;
        if self.attempt != (step, attempt) {
            self.newest.clone_from(&self.committed);
            self.attempt = (step, attempt);
        }
        let previous = self.newest.clone();
        let mut outcomes = Vec::new();
        for node in &self.order {
            let sources = self.sources.get(node).map_or(&[][..], Vec::as_slice);
            let frozen = freeze(
                sources,
                |source| self.committed.get(&source.field),
                |source| if source.same_iteration { &self.newest } else { &previous }.get(&source.field),
            );
            let (Some(frozen), Some(member)) = (frozen, self.members.get_mut(node)) else {
                return Err(SolveError::Mismatch(format!("`{node}` lacks a frozen field for {}", task.version)).into());
            };
            let result = match member.solve(task.version, task.window, &frozen) {
                Ok(answer) => {
                    self.newest.extend(answer.fields);
                    Ok(answer.done)
                }
                Err(error) => Err(Failure { retry: error.retry(), message: error.to_string() }),
            };
            let failed = result.is_err();
            outcomes.push(Outcome { node: node.clone(), result });
            if failed {
                break;
            }
        }
        Ok(outcomes)
    }

    fn finish(&mut self, last: Option<&Decision>, _completed: bool, _reason: &str) -> Result<(), InProcessError> {
        Ok(self.conclude(last)?)
    }
}
