//! What takes part in a run: it answers trials and commits them.

use std::collections::BTreeMap;

use stagger_messages::{Change, Done, Field, Fields, Measure, Port, Ports, Ready, Rows, Source, Version};

use super::{Frozen, NotConverged, Physics, Reply, Window, change, relative, vetting::fits};
use crate::SolveError;

/// What a participant answers to a trial: its fields and the report that goes to the coordinator.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The written fields at the window's end.
    pub fields: Fields,
    /// Changes, ledger, figures. Times and counts are filled in by who runs the participant.
    pub done: Done,
}

/// One party to the staggered iteration, whatever computes it.
pub trait Participant: Send {
    /// Fields read and written.
    fn ports(&self) -> Ports;

    /// The written fields and the energy held at t = 0.
    ///
    /// # Errors
    /// The start asked for cannot be made.
    fn initial(&mut self) -> Result<(Fields, Ready), SolveError>;

    /// How its frozen fields are measured, from the plan; a participant that never answers twice may ignore it.
    fn set_sources(&mut self, sources: &[Source]);

    /// Solves one trial from the last committed state.
    ///
    /// # Errors
    /// The frozen fields do not fit, or a value of the reply is not finite.
    fn solve(&mut self, version: Version, window: Window, frozen: &Frozen) -> Result<Answer, SolveError>;

    /// Makes a trial the state the next ones start from.
    ///
    /// # Errors
    /// That version is not the last trial.
    fn commit(&mut self, version: Version) -> Result<(), SolveError>;

    /// The committed state as bytes, for [`Participant::restore`].
    ///
    /// # Errors
    /// There is none yet, or it cannot be encoded.
    fn snapshot(&self) -> Result<Vec<u8>, SolveError>;

    /// Goes on from a state that was committed with these fields: the same bits follow as would have followed then.
    ///
    /// # Errors
    /// The bytes are no state of this physics.
    fn restore(&mut self, state: &[u8], fields: Fields) -> Result<(), SolveError>;
}

/// A physics in this process.
pub struct Local<P: Physics> {
    name: String,
    physics: P,
    sources: BTreeMap<String, (Measure, f64)>,
    committed: Option<(P::State, Fields)>,
    trial: Option<Trial<P::State>>,
}

struct Trial<S> {
    version: Version,
    window: Window,
    /// What it was solved with: a later iteration compares its own frozen fields with these.
    frozen: Frozen,
    state: S,
    answer: Answer,
}

impl<P: Physics> Local<P> {
    /// Wraps `physics` under the name of its node.
    pub fn new(name: impl Into<String>, physics: P) -> Self {
        Self { name: name.into(), physics, sources: BTreeMap::new(), committed: None, trial: None }
    }

    /// Neither a field nor an energy is handed on that is not finite, nor a figure that is no number.
    fn finite(&self, Reply { fields, ledger, figures, .. }: &Reply) -> Result<(), SolveError> {
        for field in fields.values() {
            if let Some(index) = field.first_not_finite() {
                return Err(SolveError::NotFinite {
                    node: self.name.clone(),
                    field: field.name().into(),
                    row: index / field.components().max(1),
                    value: field.f64()?[index],
                });
            }
        }
        if let Some(entry) = ledger.iter().find(|entry| !entry.joule.is_finite()) {
            return Err(SolveError::Energy { node: self.name.clone(), name: entry.name.clone(), joule: entry.joule });
        }
        // The largest of none may be infinite.
        match figures.iter().find(|(_, value)| value.is_nan()) {
            None => Ok(()),
            Some((name, value)) => {
                Err(SolveError::Figure { node: self.name.clone(), name: name.clone(), value: *value })
            }
        }
    }

    /// How far the measured fields moved since the iterate `previous`, or in a first one since the window's start.
    fn changes(&self, reply: &Reply, previous: Option<&Fields>, committed: &Fields) -> Result<Vec<Change>, SolveError> {
        let measured = |port: &Port| port.measure() != Measure::None;
        let mut changes = Vec::new();
        for field in reply.fields.values().filter(|field| measured(&field.port)) {
            let start = reply.start.get(field.name()).or_else(|| committed.get(field.name()));
            let before = previous.map_or(start, |fields| fields.get(field.name()));
            let (Some(before), Some(start)) = (before, start) else {
                return Err(SolveError::Mismatch(format!("{}: `{}` had no value before", self.name, field.name())));
            };
            // At the window's start the rows may be those of this reply already; what others read was committed.
            let read = previous.unwrap_or(committed).get(field.name());
            let other_rows = read.is_some_and(|read| read.support != field.support);
            changes.push(Change { other_rows, ..change(field, before, start)? });
        }
        Ok(changes)
    }

    /// Whether the frozen fields are, within the set share of their tolerances, those of the last trial.
    fn unchanged(&self, trial: &Trial<P::State>, frozen: &Frozen) -> Result<bool, SolveError> {
        for (name, new) in &frozen.end {
            let Some(old) = trial.frozen.end.get(name) else { return Ok(false) };
            if same(new, old) {
                continue;
            }
            let Some(&(measure, below)) = self.sources.get(name) else { return Ok(false) };
            let (true, Some(start)) = (below > 0.0 && new.support == old.support, frozen.start.get(name)) else {
                return Ok(false);
            };
            // From other rows there is no increment to compare with.
            if measure == Measure::Increment && start.support != new.support {
                return Ok(false);
            }
            if relative(&change(new, old, start)?, measure) >= below {
                return Ok(false);
            }
        }
        Ok(frozen.end.len() == trial.frozen.end.len())
    }
}

/// Whether two fields hold the same values on the same support.
#[must_use]
pub fn same(a: &Field, b: &Field) -> bool {
    a.support == b.support && a.values() == b.values()
}

impl<P: Physics> Participant for Local<P> {
    fn ports(&self) -> Ports {
        self.physics.ports()
    }

    fn initial(&mut self) -> Result<(Fields, Ready), SolveError> {
        let (state, reply) = self.physics.initial()?;
        self.finite(&reply)?;
        self.committed = Some((state, reply.fields.clone()));
        self.trial = None;
        Ok((reply.fields, Ready { ledger: reply.ledger }))
    }

    fn set_sources(&mut self, sources: &[Source]) {
        self.sources = sources.iter().map(|s| (s.field.clone(), (s.measure(), s.reuse_below))).collect();
    }

    fn solve(&mut self, version: Version, window: Window, frozen: &Frozen) -> Result<Answer, SolveError> {
        let Some((state, committed)) = &self.committed else {
            return Err(SolveError::Mismatch(format!("{}: asked for {version} before its start", self.name)));
        };
        let same_attempt = |trial: &&Trial<P::State>| {
            (trial.version.step, trial.version.attempt) == (version.step, version.attempt) && trial.window == window
        };
        let previous = self.trial.as_ref().filter(same_attempt);
        if let Some(trial) = previous
            && self.unchanged(trial, frozen)?
        {
            let mut answer = trial.answer.clone();
            for change in &mut answer.done.changes {
                (change.change, change.other_rows) = (0.0, false);
            }
            answer.done.reused = true;
            if let Some(trial) = &mut self.trial {
                trial.version = version;
            }
            return Ok(answer);
        }
        let (state, reply) = self.physics.solve(state, frozen, window)?;
        self.finite(&reply)?;
        fits(&self.name, &reply.fields, frozen)?;
        let changes = self.changes(&reply, previous.map(|trial| &trial.answer.fields), committed)?;
        let done = Done {
            changes,
            converged: reply.not_converged.is_none(),
            step_factor: reply.not_converged.map_or(1.0, |NotConverged { step_factor, .. }| step_factor),
            reason: reply.not_converged.map_or("", |NotConverged { reason, .. }| reason).into(),
            ledger: reply.ledger,
            figures: reply.figures,
            rows: Rows::of(&reply.fields),
            ..Done::default()
        };
        let answer = Answer { fields: reply.fields, done };
        self.trial = Some(Trial { version, window, frozen: frozen.clone(), state, answer: answer.clone() });
        Ok(answer)
    }

    fn snapshot(&self) -> Result<Vec<u8>, SolveError> {
        let Some((state, _)) = &self.committed else {
            return Err(SolveError::Mismatch(format!("{}: asked for its state before its start", self.name)));
        };
        let failed = |source| SolveError::Snapshot { node: self.name.clone(), what: "encoded", source };
        postcard::to_stdvec(state).map_err(failed)
    }

    fn restore(&mut self, state: &[u8], fields: Fields) -> Result<(), SolveError> {
        let failed = |source| SolveError::Snapshot { node: self.name.clone(), what: "restored", source };
        let state = postcard::from_bytes(state).map_err(failed)?;
        self.committed = Some((state, fields));
        self.trial = None;
        Ok(())
    }

    fn commit(&mut self, version: Version) -> Result<(), SolveError> {
        match self.trial.take() {
            Some(trial) if trial.version == version => {
                self.committed = Some((trial.state, trial.answer.fields));
                Ok(())
            }
            other => {
                self.trial = other;
                let held = self.trial.as_ref().map_or("none".into(), |trial| trial.version.to_string());
                Err(SolveError::Mismatch(format!("{}: asked to commit {version}, but holds {held}", self.name)))
            }
        }
    }
}
