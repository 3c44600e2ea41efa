//! Rules of checkpoints, restarts and ends.

use stagger_messages::{Fields, Plan, Snapshot, Version, codec};

use super::{
    Bench, Kept, Rule,
    heard::{Fault, Heard, same_values},
    reference::Reference,
    session::Session,
};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "snapshot",
        sentence: "puts a snapshot of what it committed when a directive asks for a checkpoint",
        rests_on: &[],
        check: snapshot,
    },
    Rule {
        name: "restore",
        sentence: "a new process goes on from a snapshot with the same bytes",
        rests_on: &["snapshot"],
        check: restore,
    },
    Rule { name: "epoch", sentence: "begins anew with the plan of a new epoch", rests_on: &[], check: epoch },
    Rule { name: "parent", sentence: "ends when the pipe on its standard input closes", rests_on: &[], check: parent },
    Rule { name: "coordinator", sentence: "ends when the coordinator is gone", rests_on: &[], check: coordinator },
];

/// Goes through the first step and asks for a checkpoint with the next directive.
fn take(bench: &Bench, reference: &Reference) -> Result<(Session, Snapshot), Fault> {
    let mut session = reference.open(bench)?;
    session.repeat_step(&reference.steps[0])?;
    let from = session.log.len();
    let next = &reference.steps[1][0];
    session.ask(next, false, Vec::new(), true)?;
    session.give(next)?;
    let snapshot =
        session.wait(from, "a Snapshot in answer to a directive with `checkpoint`", |heard, _| match heard {
            Heard::Snapshot(snapshot) => Some(snapshot.clone()),
            _ => None,
        })?;
    same_values(&next.reply.fields, &session.answer(next.version, from)?.fields)?;
    Ok((session, snapshot))
}

fn snapshot(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (_, last) = reference.first();
    let (_, snapshot) = take(bench, reference)?;
    let version = |version: Option<Version>| version.unwrap_or_default().to_string();
    let about = snapshot.envelope.as_ref().and_then(|envelope| envelope.version);
    for (what, found) in [("in its envelope", about), ("as committed", snapshot.committed)] {
        if found != Some(last.version) {
            return Err(Fault::new(format!("{} {what} of the snapshot", last.version), version(found)));
        }
    }
    let mut fields = Fields::new();
    for message in snapshot.fields {
        let received = codec::field_of(message)
            .map_err(|error| Fault::new("fields with their values in the snapshot", error.to_string()))?;
        fields.extend(received.field.map(|field| (received.name, field)));
    }
    same_values(&last.reply.fields, &fields)?;
    Ok(Kept::Yes)
}

fn restore(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (_, last) = reference.first();
    let (first, snapshot) = take(bench, reference)?;
    drop(first);
    let mut session = Session::start(bench)?;
    session.next_epoch();
    session.offer(&snapshot)?;
    let from = session.log.len();
    session.plan(&Plan { from: Some(last.version), ..reference.plan.clone() })?;
    session.put_all(&last.after, last.version)?;
    session.ready(from, last.version)?;
    same_values(&last.reply.fields, &session.published(last.version, from)?)?;
    for step in &reference.steps[1..] {
        session.repeat_step(step)?;
    }
    Ok(Kept::Yes)
}

fn epoch(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let mut session = reference.open(bench)?;
    session.repeat_step(&reference.steps[0])?;
    session.repeat(&reference.steps[1][0])?;
    session.next_epoch();
    let from = session.log.len();
    reference.begin(&mut session, &reference.plan)?;
    session.repeat_step(&reference.steps[0])?;
    session.repeat(&reference.steps[1][0])?;
    let ours = session.log[from..].iter().filter_map(Heard::envelope).find(|envelope| envelope.epoch == session.epoch);
    match ours.map(|envelope| envelope.sequence) {
        Some(0) => Ok(Kept::Yes),
        found => Err(Fault::new("sequence numbers from 0 in the new epoch", format!("{found:?}"))),
    }
}

fn parent(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let mut session = reference.open(bench)?;
    session.repeat(reference.first().0)?;
    session.close_pipe();
    session.ended("after its standard input closed")?;
    Ok(Kept::Yes)
}

fn coordinator(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let mut session = reference.open(bench)?;
    session.repeat(reference.first().0)?;
    session.close_hub()?;
    session.ended("after the coordinator's token and hub were gone")?;
    Ok(Kept::Yes)
}
