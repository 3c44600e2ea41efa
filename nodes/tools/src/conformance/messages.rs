//! Rules of single messages: what comes out of order, too late, from elsewhere or broken makes no difference.

use bytes::Bytes;
use prost::Message as _;
use stagger_messages::{
    Directive, Envelope, Iterate, Measure, Plan, SCHEMA_VERSION, Source, Verdict, Version, codec, directive,
};

use super::{
    Bench, Kept, Rule,
    heard::{Fault, same_changes, same_values},
    reference::Reference,
    session::{Given, Session, Trial, frozen_version, place},
    trials::disturbed,
};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "order",
        sentence: "fields may come before the directive, and those of a later iteration first",
        rests_on: &[],
        check: order,
    },
    Rule {
        name: "foreign",
        sentence: "a foreign run, another schema and malformed messages are refused and counted",
        rests_on: &[],
        check: foreign,
    },
    Rule {
        name: "late",
        sentence: "an older version or an older epoch changes nothing, and an older epoch is counted as refused",
        rests_on: &["commit-once", "foreign"],
        check: late,
    },
    Rule {
        name: "references",
        sentence: "a field sent as a reference has the values of the version it names; a broken one is waited for",
        rests_on: &["pure"],
        check: references,
    },
    Rule {
        name: "accelerated",
        sentence: "takes the coordinator's iterate of an accelerated field, not its writer's",
        rests_on: &["pure"],
        check: accelerated,
    },
];

const NO_SOURCES: Kept = Kept::NotApplicable("it reads no fields");

fn order(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let mut session = reference.open(bench)?;
    if session.sources.is_empty() {
        return Ok(NO_SOURCES);
    }
    let from = session.log.len();
    session.give(second)?;
    session.give(first)?;
    session.silent(from, "no report before the directive")?;
    for trial in [first, second] {
        let from = session.log.len();
        session.ask(trial, false, Vec::new(), false)?;
        let reply = session.answer(trial.version, from)?;
        same_values(&trial.reply.fields, &reply.fields)?;
    }
    Ok(Kept::Yes)
}

fn late(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, last) = reference.first();
    let mut session = reference.open(bench)?;
    session.repeat_step(&reference.steps[0])?;
    let next = &reference.steps[1];
    let refused = session.repeat(&next[0])?.done.refused;
    let from = session.log.len();
    // The step before once more, with its decision, and with other fields.
    session.decide(last.version, Verdict::Accept);
    session.ask(first, false, Vec::new(), false)?;
    session.put_all(&disturbed(&first.ends), first.version)?;
    session.silent(from, "no answer to a directive that is older than what was committed")?;
    // What was said in the epoch before, about the iteration to come.
    session.epoch = 0;
    session.ask(&next[1], false, Vec::new(), false)?;
    let sources = session.sources.len() as u64;
    session.put_all(&disturbed(&next[1].ends), next[1].version)?;
    session.epoch = 1;
    let reply = session.repeat(&next[1])?;
    same_changes(&next[1].reply.done.changes, &reply.done.changes)?;
    // Whether the directive of an older version counts as refused is the node's own choice.
    let found = reply.done.refused - refused.min(reply.done.refused);
    if !(sources + 1..=sources + 2).contains(&found) {
        return Err(Fault::new(
            format!("{} more refused messages in Done: those of the older epoch", sources + 1),
            found.to_string(),
        ));
    }
    session.accept(&next[1])?;
    session.repeat_step(&reference.steps[2])?;
    Ok(Kept::Yes)
}

fn foreign(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let mut session = reference.open(bench)?;
    let refused = session.repeat(first)?.done.refused;
    let ours = session.envelope("coordinator", second.version);
    // None of these uses a number of the coordinator's own sequence.
    let foreign = Envelope { run: "another".into(), ..ours.clone() };
    let newer = Envelope { schema: SCHEMA_VERSION + 1, ..ours };
    for envelope in [foreign.clone(), newer.clone()] {
        let iterate = Iterate { committed: Some(second.committed), ..Iterate::default() };
        let task = Some(directive::Task::Iterate(iterate));
        session.direct_raw(Directive { envelope: Some(envelope), task, ..Directive::default() }.encode_to_vec())?;
    }
    session.direct_raw(vec![0xff; 40])?;
    let mut sent = 3;
    if let Some(source) = session.sources.first().cloned() {
        let field = disturbed(&second.ends).remove(&place(&source));
        for envelope in [foreign, newer].map(|envelope| Envelope { sender: source.writer.clone(), ..envelope }) {
            let Some(field) = &field else { continue };
            let header = codec::field_attachment(&envelope, field, None);
            session.put_raw(&source.writer, &source.field, header, field.values().bytes().clone())?;
            sent += 1;
        }
        session.put_raw(&source.writer, &source.field, vec![0xff; 40], Bytes::from_static(&[1, 2, 3]))?;
        sent += 1;
    }
    let found = session.repeat(second)?.done.refused - refused;
    if found != sent {
        return Err(Fault::new(format!("{sent} more refused messages in Done"), found.to_string()));
    }
    Ok(Kept::Yes)
}

/// Where a source finds its value for a trial of the first step.
fn holds(source: &Source, version: Version) -> Version {
    frozen_version(source, version, Version::INITIAL)
}

fn references(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let mut session = reference.open(bench)?;
    let sources = session.sources.clone();
    let Some(one) = sources.first() else { return Ok(NO_SOURCES) };
    session.repeat(first)?;
    session.repeat(second)?;
    let fourth = Version { iteration: 4, ..second.version };
    session.solve(&Trial {
        ends: disturbed(&second.ends),
        version: second.version.next_iteration(),
        ..second.clone()
    })?;
    // Iteration 4 freezes what iteration 2 froze, by its name alone; the first of them by a name that is wrong.
    let from = session.log.len();
    let trial = Trial { version: fourth, ..second.clone() };
    session.ask(&trial, false, Vec::new(), false)?;
    for source in &sources {
        let Some(field) = second.ends.get(&place(source)) else { continue };
        let named = if source == one { Version { attempt: 9, ..fourth } } else { holds(source, second.version) };
        session.put(&source.writer, field, holds(source, fourth), Some(named))?;
    }
    session.silent(from, &format!("no report while `{}` refers to a version that is not there", one.field))?;
    if let Some(field) = second.ends.get(&place(one)) {
        session.put(&one.writer, field, holds(one, fourth), Some(holds(one, second.version)))?;
    }
    same_values(&second.reply.fields, &session.answer(fourth, from)?.fields)?;
    Ok(Kept::Yes)
}

fn accelerated(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let jacobi = |accelerated: &dyn Fn(&Source) -> bool| {
        let mut plan: Plan = reference.plan.clone();
        for source in plan.nodes.iter_mut().flat_map(|part| &mut part.sources) {
            source.same_iteration = false;
            source.accelerated = accelerated(source);
        }
        plan
    };
    let begin = |plan: &Plan| -> Result<Session, Fault> {
        let mut session = Session::start(bench)?;
        reference.begin(&mut session, plan)?;
        session.solve(first)?;
        Ok(session)
    };
    let mut session = begin(&jacobi(&|_| false))?;
    let fields = session.sources.clone();
    let Some(field) = fields.iter().find(|source| source.measure() != Measure::None) else {
        return Ok(Kept::NotApplicable("it reads no field whose convergence is judged"));
    };
    let expected = session.solve(second)?.fields;
    drop(session);

    let mut session = begin(&jacobi(&|source| source.field == field.field))?;
    let from = session.log.len();
    let mut writers = second.ends.clone();
    let own: Given = writers.remove_entry(&place(field)).into_iter().collect();
    writers.extend(disturbed(&own));
    session.ask(second, false, Vec::new(), false)?;
    session.put_all(&writers, first.version)?;
    session.silent(from, &format!("no report before the coordinator's `{}`", field.field))?;
    for value in own.values() {
        session.put("coordinator", value, first.version, None)?;
    }
    same_values(&expected, &session.answer(second.version, from)?.fields)?;
    Ok(Kept::Yes)
}
