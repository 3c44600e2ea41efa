//! Rules of a trial: it is a pure function, and only what is accepted counts.

use stagger_coupling::Window;
use stagger_messages::{Fields, Part, Verdict, Version};

use super::{
    Bench, Kept, Rule,
    heard::{Fault, Heard, same_changes, same_values},
    reference::Reference,
    session::{Given, Session, Trial, place},
    start::well_formed,
};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "again",
        sentence: "a trial asked for again is answered again with the same bytes",
        rests_on: &[],
        check: again,
    },
    Rule {
        name: "pure",
        sentence: "the same frozen fields give the same bytes, whatever was tried in between",
        rests_on: &[],
        check: pure,
    },
    Rule {
        name: "reject",
        sentence: "a rejected attempt leaves no trace in the next one",
        rests_on: &["pure"],
        check: reject,
    },
    Rule {
        name: "farewell",
        sentence: "answers Stop with a summary of its committed fields, and exits with 0",
        rests_on: &[],
        check: farewell,
    },
    Rule {
        name: "commit",
        sentence: "commits what is accepted and nothing else",
        rests_on: &["farewell"],
        check: commit,
    },
    Rule {
        name: "commit-once",
        sentence: "a decision told twice is carried out once",
        rests_on: &[],
        check: commit_once,
    },
    Rule { name: "rest", sentence: "gives no answer in an iteration in which it rests", rests_on: &[], check: rest },
    Rule {
        name: "long-window",
        sentence: "solves a window of its own length from its own last committed version",
        rests_on: &["rest"],
        check: long_window,
    },
    Rule {
        name: "not-a-number",
        sentence: "a frozen value that is no number ends in a Failure, not in a crash or in a result",
        rests_on: &["pure", "reject"],
        check: not_a_number,
    },
    Rule { name: "sequence", sentence: "numbers its messages without a gap", rests_on: &[], check: sequence },
];

/// The same fields, all binary64 values a thousandth larger: other inputs, still physical.
pub(super) fn disturbed(fields: &Given) -> Given {
    let map = |field: &stagger_messages::Field| {
        let values: Vec<f64> = field.f64().ok()?.iter().map(|value| value * 1.001).collect();
        stagger_messages::Field::with_support(field.port.clone(), field.support.clone(), values.into()).ok()
    };
    fields.iter().map(|(key, field)| (key.clone(), map(field).unwrap_or_else(|| field.clone()))).collect()
}

/// A trial under another version.
fn at(trial: &Trial, version: Version) -> Trial {
    Trial { version, ..trial.clone() }
}

fn again(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let mut session = reference.open(bench)?;
    for trial in &reference.steps[0] {
        let first = session.repeat(trial)?;
        let from = session.log.len();
        session.ask(trial, true, Vec::new(), false)?;
        let second = session.answer(trial.version, from)?;
        same_values(&first.fields, &second.fields)?;
        same_changes(&first.done.changes, &second.done.changes)?;
    }
    Ok(Kept::Yes)
}

fn pure(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let mut session = reference.open(bench)?;
    session.repeat(first)?;
    session.solve(&Trial { ends: disturbed(&second.ends), ..second.clone() })?;
    // Iteration 3 freezes what iteration 2 of the reference run froze.
    session.repeat(&at(second, second.version.next_iteration()))?;
    Ok(Kept::Yes)
}

fn reject(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let mut session = reference.open(bench)?;
    session.repeat(first)?;
    session.solve(&Trial { ends: disturbed(&second.ends), ..second.clone() })?;
    session.decide(second.version, Verdict::Reject);
    let version = second.version.next_attempt();
    let reply = session.repeat(&at(first, version))?;
    // Its first iteration is measured against the committed values, as that of a first attempt is.
    same_changes(&first.reply.done.changes, &reply.done.changes)?;
    session.repeat(&at(second, version.next_iteration()))?;
    Ok(Kept::Yes)
}

/// Refuses a final report that does not summarise these fields.
fn summarises(session: &mut Session, fields: &Fields) -> Result<(), Fault> {
    let final_report = session.stop()?;
    for field in fields.values() {
        let expected = stagger_runtime::run::summary::of_field(field);
        let found = final_report.fields.iter().find(|summary| summary.field == expected.field);
        // A mean may be summed in another order.
        let same = found.is_some_and(|found| {
            (found.mean - expected.mean).abs() <= 1e-9 * expected.max.abs().max(expected.min.abs())
                && stagger_messages::FieldSummary { mean: expected.mean, ..found.clone() } == expected
        });
        if !same {
            let found = found.map_or("none".into(), |found| format!("{found:?}"));
            return Err(Fault::new(format!("the summary {expected:?}"), found));
        }
    }
    Ok(())
}

fn farewell(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let mut session = reference.open(bench)?;
    // Before any step the committed fields are the initial ones.
    summarises(&mut session, &reference.own)?;
    let status = session.ended("after Stop")?;
    if status.success() { Ok(Kept::Yes) } else { Err(Fault::new("exit code 0", status.to_string())) }
}

fn commit(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let mut session = reference.open(bench)?;
    session.repeat(first)?;
    session.repeat(second)?;
    session.accept(second)?;
    session.repeat(&reference.steps[1][0])?;
    // The trial of the second step is not accepted: the first one is what is committed.
    summarises(&mut session, &second.reply.fields)?;
    Ok(Kept::Yes)
}

fn commit_once(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (_, last) = reference.first();
    let mut session = reference.open(bench)?;
    session.repeat_step(&reference.steps[0])?;
    let next = &reference.steps[1];
    let from = session.log.len();
    session.ask(&next[0], false, Vec::new(), false)?;
    session.decide(last.version, Verdict::Accept);
    session.ask(&next[0], true, Vec::new(), false)?;
    session.give(&next[0])?;
    same_values(&next[0].reply.fields, &session.answer(next[0].version, from)?.fields)?;
    // And once more with the next trial.
    session.decide(last.version, Verdict::Accept);
    session.repeat(&next[1])?;
    session.accept(&next[1])?;
    session.repeat_step(&reference.steps[2])?;
    Ok(Kept::Yes)
}

/// What the node is told of a window that is its own.
fn part(bench: &Bench, rests: bool, window: Window) -> Vec<Part> {
    let Window { t_s, dt_s } = window;
    vec![Part { node: bench.node.clone(), rests, committed: Some(Version::INITIAL), t_s, dt_s }]
}

/// Leaves the node out of the first step. What it reads does not change in it where it reads the iterate before.
fn rested(bench: &Bench, reference: &Reference) -> Result<Session, Fault> {
    let (first, _) = reference.first();
    let mut session = reference.open(bench)?;
    let from = session.log.len();
    session.ask(first, false, part(bench, true, first.window), false)?;
    session.put_all(&reference.given, first.version)?;
    session.silent(from, "no report from a node that rests")?;
    session.decide(first.version, Verdict::Accept);
    Ok(session)
}

fn rest(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    rested(bench, reference)?;
    Ok(Kept::Yes)
}

fn long_window(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, _) = reference.first();
    // The whole of two windows as one, which is what the node is to give.
    let window = Window { t_s: 0.0, dt_s: 2.0 * first.window.dt_s };
    let plain = Trial { window, ..first.clone() };
    let expected = reference.open(bench)?.solve(&plain)?;

    let mut session = rested(bench, reference)?;
    let version = Version::first(2);
    let short = Window { t_s: first.window.dt_s, ..first.window };
    let second = Trial { version, committed: first.version, window: short, ..first.clone() };
    let from = session.log.len();
    session.ask(&second, false, part(bench, false, window), false)?;
    session.give(&second)?;
    same_values(&expected.fields, &session.answer(version, from)?.fields)?;
    Ok(Kept::Yes)
}

fn not_a_number(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let (first, second) = reference.first();
    let mut session = reference.open(bench)?;
    let floats: Vec<_> = session.sources.iter().map(place).filter(|key| is_floats(&second.ends, key)).collect();
    if floats.is_empty() {
        return Ok(Kept::NotApplicable("it reads no numbers that could be none"));
    }
    let (mut first, mut version) = (first.clone(), first.version);
    for key in floats {
        session.repeat(&first)?;
        let mut ends = second.ends.clone();
        if let Some(field) = ends.get_mut(&key) {
            let values = vec![f64::NAN; field.rows() * field.components()];
            let broken =
                stagger_messages::Field::with_support(field.port.clone(), field.support.clone(), values.into());
            *field = broken.map_err(|error| Fault::new("a field of the same shape", error.to_string()))?;
        }
        let trial = Trial { ends, version: version.next_iteration(), ..second.clone() };
        let from = session.log.len();
        session.ask(&trial, false, Vec::new(), false)?;
        session.give(&trial)?;
        let expected = format!("a Failure, or the same answer where `{}` does not matter", key.1);
        let failed = session.wait(from, &expected, |heard, envelope| match heard {
            Heard::Report(_, body) if envelope.version == Some(trial.version) => {
                Some(matches!(body, stagger_messages::report::Body::Failure(_)))
            }
            _ => None,
        })?;
        if !failed {
            let fields = session.published(trial.version, from)?;
            well_formed(&session, &fields)?;
            same_values(&second.reply.fields, &fields)
                .map_err(|fault| Fault::new(expected, format!("Done with other values ({fault})")))?;
        }
        session.decide(trial.version, Verdict::Reject);
        version = version.next_attempt();
        first = at(&first, version);
    }
    // It goes on after a failure.
    session.repeat(&first)?;
    Ok(Kept::Yes)
}

fn is_floats(fields: &Given, key: &(String, String)) -> bool {
    fields.get(key).is_some_and(|field| field.f64().is_ok_and(|values| !values.is_empty()))
}

fn sequence(bench: &Bench, reference: &Reference) -> Result<Kept, Fault> {
    let mut session = reference.open(bench)?;
    for step in &reference.steps {
        session.repeat_step(step)?;
    }
    // What it put last before it answers is heard before the answer.
    let numbers: Vec<u64> = session.log.iter().filter_map(Heard::envelope).map(|envelope| envelope.sequence).collect();
    let gap = numbers.iter().zip(0..).position(|(found, expected)| *found != expected);
    match gap {
        None => Ok(Kept::Yes),
        Some(at) => {
            Err(Fault::new(format!("its message {at} to have the sequence number {at}"), numbers[at].to_string()))
        }
    }
}
