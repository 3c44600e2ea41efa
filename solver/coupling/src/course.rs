//! Everything the coordinator decides from, as plain data that can be saved.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use stagger_messages::{Decision, Field, Iterate, Plan, Verdict, Version};

use super::{
    Accelerator, Clocks, Ensemble, Iterates, Ledger, Measured, Outcome, Progress, Rates, Settings, StepControl, System,
    Task, Turn, change, readers, systems,
};
use crate::SolveError;

/// Everything the coordinator decides from: step control, rates and acceleration. With the nodes' states it is all that
/// a run's future depends on.
pub struct Course {
    /// Accept, iterate, reject.
    pub control: StepControl,
    rates: Rates,
    /// Fields that a node which is iterated reads from the iteration before, by their writer and name.
    read_late: BTreeSet<(String, String)>,
    systems: Vec<(System, Accelerator)>,
    /// x: what the readers of each accelerated field freeze in the iteration under way.
    frozen: BTreeMap<String, Field>,
    /// x̃: what its writer answered.
    answered: BTreeMap<String, Field>,
    /// Its value at the window's start.
    committed: BTreeMap<String, Field>,
}

/// The part of a checkpoint that is the coordinator's.
#[derive(Serialize, Deserialize)]
struct Saved {
    progress: Progress,
    clocks: Clocks,
    accelerators: Vec<Accelerator>,
    ledger: Ledger,
    observer: Vec<u8>,
}

/// The energy of the run up to a checkpoint, whose `coordinator` bytes these are.
///
/// # Errors
/// They are not those of a course.
pub fn ledger_at(checkpoint: &[u8]) -> Result<Ledger, SolveError> {
    let saved: Saved = postcard::from_bytes(checkpoint).map_err(|source| failed("restored", source))?;
    Ok(saved.ledger)
}

impl Course {
    /// The course of a run of `duration_s` from t = 0.
    #[must_use]
    pub fn new(settings: &Settings, plan: &Plan, measured: &Measured, duration_s: f64) -> Self {
        let systems = systems(plan, settings);
        Self {
            control: StepControl::new(settings, measured, duration_s),
            rates: Rates::new(plan, settings),
            read_late: read_late(plan),
            systems: systems.into_iter().map(|system| (system.clone(), Accelerator::new(system.method))).collect(),
            frozen: BTreeMap::new(),
            answered: BTreeMap::new(),
            committed: BTreeMap::new(),
        }
    }

    /// The course as bytes, with the run's energy so far and the bytes of whoever observes the run.
    ///
    /// # Errors
    /// It cannot be encoded.
    pub fn save(&self, ledger: Ledger, observer: Vec<u8>) -> Result<Vec<u8>, SolveError> {
        let saved = Saved {
            progress: self.control.progress().clone(),
            clocks: self.rates.clocks().clone(),
            accelerators: self.systems.iter().map(|(_, accelerator)| accelerator.clone()).collect(),
            ledger,
            observer,
        };
        postcard::to_stdvec(&saved).map_err(|source| failed("encoded", source))
    }

    /// Goes on from saved bytes; returns the energy up to there and the observer's bytes.
    ///
    /// # Errors
    /// They are not those of a course of this plan.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(Ledger, Vec<u8>), SolveError> {
        let saved: Saved = postcard::from_bytes(bytes).map_err(|source| failed("restored", source))?;
        if saved.accelerators.len() != self.systems.len() {
            let (found, expected) = (saved.accelerators.len(), self.systems.len());
            return Err(SolveError::Mismatch(format!(
                "the checkpoint has {found} accelerated systems, but the scene has {expected}"
            )));
        }
        self.control.restore(saved.progress);
        self.rates.restore(saved.clocks);
        for ((_, accelerator), saved) in self.systems.iter_mut().zip(saved.accelerators) {
            *accelerator = saved;
        }
        (self.frozen, self.answered, self.committed) = Default::default();
        Ok((saved.ledger, saved.observer))
    }

    /// What the nodes are asked next.
    pub(super) fn task(&self, turn: Turn) -> Task {
        let (version, committed) = (self.control.version(), self.control.committed());
        let window = self.control.window();
        let parts = self.rates.parts(version, committed, window, self.control.is_last(), turn);
        Task { version, window, iterate: Iterate { committed: Some(committed), again: false, parts } }
    }

    /// Whether nodes that only read are to solve before the iteration is judged: the others have converged.
    pub(super) fn reads_now(&self, outcomes: &[Outcome]) -> bool {
        let has_reading = self.rates.has_reading(self.control.version().step, self.control.is_last());
        has_reading && self.control.clone().judge(outcomes).is_ok_and(|decision| decision.verdict() == Verdict::Accept)
    }

    /// Takes the values at the start of the run's next window.
    pub(super) fn begin<E: Ensemble>(&mut self, ensemble: &mut E) -> Result<(), E::Error> {
        for source in self.systems.iter().flat_map(|(system, _)| &system.fields) {
            let clock = self.rates.clocks().get(&source.writer).map(|(version, _)| *version);
            let field = ensemble.answered(source, clock.unwrap_or(self.control.committed()))?;
            self.committed.insert(source.field.clone(), field);
        }
        self.frozen.clone_from(&self.committed);
        Ok(())
    }

    /// Forgets of fields that nobody reads from the iteration before that their rows changed. Measures accelerated fields by their residual x̃ − x: what their writers say, the distance between two answers, is
    /// no measure of convergence where the iterates between them were changed.
    pub(super) fn residuals<E: Ensemble>(
        &mut self,
        ensemble: &mut E,
        version: Version,
        outcomes: &mut [Outcome],
    ) -> Result<(), E::Error> {
        self.answered.clear();
        for Outcome { node, result } in outcomes.iter_mut() {
            for sums in result.iter_mut().flat_map(|done| &mut done.changes) {
                sums.other_rows &= self.read_late.contains(&(node.clone(), sums.field.clone()));
            }
        }
        for source in self.systems.iter().flat_map(|(system, _)| &system.fields) {
            let outcome = outcomes.iter_mut().find(|outcome| outcome.node == source.writer);
            let Some(Ok(done)) = outcome.map(|outcome| &mut outcome.result) else { continue };
            let answered = ensemble.answered(source, version)?;
            if let (Some(frozen), Some(committed), Some(sums)) = (
                self.frozen.get(&source.field),
                self.committed.get(&source.field),
                done.changes.iter_mut().find(|sums| sums.field == source.field),
            ) {
                // From an iterate on other rows there is no residual; the writer has measured what it can.
                if frozen.support == answered.support {
                    let residual = change(&answered, frozen, committed).map_err(SolveError::from)?;
                    (sums.change, sums.worst_row) = (residual.change, residual.worst_row);
                }
            }
            self.answered.insert(source.field.clone(), answered);
        }
        Ok(())
    }

    /// Moves on with what was decided about `version`.
    pub(super) fn follow<E: Ensemble>(
        &mut self,
        ensemble: &mut E,
        decision: &Decision,
        version: Version,
        last: bool,
    ) -> Result<(), E::Error> {
        for (system, accelerator) in &mut self.systems {
            if rows_changed(system, &self.frozen, &self.answered) {
                accelerator.forget();
            }
        }
        match decision.verdict() {
            Verdict::Iterate => {
                let fields = self.accelerate()?;
                if !fields.is_empty() {
                    ensemble.publish(version, &fields)?;
                    self.frozen.extend(fields);
                }
            }
            Verdict::Accept => {
                for (system, accelerator) in &mut self.systems {
                    if let Some(pairs) = pairs(system, &self.frozen, &self.answered)? {
                        accelerator.accepted(&pairs);
                    }
                }
                self.rates.accepted(version, decision.t_s, last);
                self.committed.extend(std::mem::take(&mut self.answered));
                self.frozen.clone_from(&self.committed);
            }
            Verdict::Reject | Verdict::None => {
                self.systems.iter_mut().for_each(|(_, accelerator)| accelerator.rejected());
                self.frozen.clone_from(&self.committed);
            }
        }
        Ok(())
    }

    /// The next iterate of each accelerated field that was answered.
    fn accelerate(&mut self) -> Result<BTreeMap<String, Field>, SolveError> {
        let mut next = BTreeMap::new();
        for (system, accelerator) in &mut self.systems {
            let Some(pairs) = pairs(system, &self.frozen, &self.answered)? else {
                // A writer rests, or particles came or went: the answers themselves.
                accelerator.rejected();
                let answered = system.fields.iter().filter_map(|source| self.answered.get_key_value(&source.field));
                next.extend(answered.map(|(name, field)| (name.clone(), field.clone())));
                continue;
            };
            for (source, values) in system.fields.iter().zip(accelerator.next(&pairs)) {
                let answered = &self.answered[&source.field];
                let field = Field::with_support(answered.port.clone(), answered.support.clone(), values.into())?;
                next.insert(source.field.clone(), field);
            }
        }
        Ok(next)
    }
}

/// What is read from the iteration before, but for the nodes that only read: they solve when the others have converged.
fn read_late(plan: &Plan) -> BTreeSet<(String, String)> {
    let readers = readers(plan);
    let iterated = plan.nodes.iter().filter(|node| !readers.contains(&node.node));
    let late = iterated.flat_map(|node| &node.sources).filter(|source| !source.same_iteration);
    late.map(|source| (source.writer.clone(), source.field.clone())).collect()
}

/// Whether a field of the system was answered on other rows than it was frozen on: what was learnt speaks of others.
fn rows_changed(system: &System, frozen: &BTreeMap<String, Field>, answered: &BTreeMap<String, Field>) -> bool {
    let both = system.fields.iter().filter_map(|source| frozen.get(&source.field).zip(answered.get(&source.field)));
    both.into_iter().any(|(frozen, answered)| frozen.support != answered.support)
}

/// The iterates of a system, where all its writers answered on the rows they were asked about.
fn pairs<'f>(
    system: &System,
    frozen: &'f BTreeMap<String, Field>,
    answered: &'f BTreeMap<String, Field>,
) -> Result<Option<Vec<Iterates<'f>>>, SolveError> {
    let mut pairs = Vec::new();
    for source in &system.fields {
        let (Some(frozen), Some(answered)) = (frozen.get(&source.field), answered.get(&source.field)) else {
            return Ok(None);
        };
        if frozen.support != answered.support {
            return Ok(None);
        }
        pairs.push(Iterates { frozen: frozen.f64()?, answered: answered.f64()? });
    }
    Ok(Some(pairs))
}

fn failed(what: &'static str, source: postcard::Error) -> SolveError {
    SolveError::Snapshot { node: super::COORDINATOR.into(), what, source }
}
