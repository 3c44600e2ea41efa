//! Rules of the start: what a node must do before any other rule can be told.

use std::collections::BTreeSet;

use stagger_messages::{Field, Fields, Manifest, Measure, Port, SCHEMA_VERSION, ValueKind, Version, keys};

use super::{
    Bench, ConformanceError, Finding, Kept, Ruling,
    heard::Fault,
    reference::{self, Reference, Surroundings},
    session::{Given, Reply, Session, place},
};

/// The rules in their order; where one is broken, the others cannot be told.
const RULES: [(&str, &str); 5] = [
    ("announce", "declares its token last, and answers the query for its manifest truly"),
    ("ports", "its ports are valid and fit the other nodes of the scene"),
    ("initial", "publishes every written field at version (0, 0, 0) as its port says, with finite values"),
    ("ready", "reports Ready when it holds all it reads, not before, and again when the plan comes again"),
    ("reply", "answers a trial with every written field at its version, then Done with the changes"),
];

/// Checks the start and records the reference run.
pub fn check(bench: &Bench, tell: &mut dyn FnMut(Finding)) -> Result<Option<Reference>, ConformanceError> {
    let around = Surroundings::new(bench)?;
    let mut kept = 0;
    let result = run(bench, around, &mut kept);
    for (index, (rule, sentence)) in RULES.into_iter().enumerate() {
        let ruling = match (&result, index.cmp(&kept)) {
            (Err(fault), std::cmp::Ordering::Equal) => Ruling::from(Err::<Kept, _>(fault.clone())),
            (Err(_), std::cmp::Ordering::Greater) => {
                Ruling::NotApplicable { because: "the rules above come first".into() }
            }
            _ => Ruling::Pass,
        };
        tell(Finding { rule, sentence, ruling });
    }
    Ok(result.ok())
}

/// Goes through the rules; `kept` counts those that hold.
fn run(bench: &Bench, around: Surroundings, kept: &mut usize) -> Result<Reference, Fault> {
    let mut session = Session::start(bench)?;
    announced(bench, &session.manifest)?;
    *kept += 1;
    ports(&session)?;
    let plan = reference::plan(bench, &session, &around)?;
    *kept += 1;

    let from = session.log.len();
    session.plan(&plan)?;
    let first = initial(&mut session, from)?;
    *kept += 1;

    ready(&mut session, &plan, &around.newest, from)?;
    *kept += 1;
    let reference = Reference::record(bench, &mut session, plan, first, around)?;
    for trial in reference.steps.iter().flatten() {
        reply(&session, &trial.reply)?;
    }
    *kept += 1;
    Ok(reference)
}

fn announced(bench: &Bench, manifest: &Manifest) -> Result<(), Fault> {
    let found = (manifest.schema, manifest.run.as_str(), manifest.node.as_str(), manifest.scene_hash);
    let expected = (SCHEMA_VERSION, bench.run.as_str(), bench.node.as_str(), bench.scene.hash);
    if found == expected {
        return Ok(());
    }
    Err(Fault::new(
        format!("a manifest with schema, run, node, hash of the scene {expected:?}, as the environment says"),
        format!("{found:?}"),
    ))
}

fn ports(session: &Session) -> Result<(), Fault> {
    let ports = session.ports();
    let mut names = BTreeSet::new();
    for port in ports.reads.iter().chain(&ports.writes) {
        let whole = keys::check_name(&port.field).is_ok()
            && !port.unit.is_empty()
            && !port.support.is_empty()
            && port.components > 0
            && port.kind() != ValueKind::Unspecified;
        if !whole {
            return Err(Fault::new("ports with a legal name, unit, support, components and kind", format!("{port:?}")));
        }
        if !names.insert(&port.field) {
            return Err(Fault::new("one port for each field", format!("two for `{}`", port.field)));
        }
    }
    if ports.writes.is_empty() {
        return Err(Fault::new("at least one written field", "none"));
    }
    Ok(())
}

fn initial(session: &mut Session, from: usize) -> Result<Fields, Fault> {
    for port in session.ports().writes {
        session.wait(from, &format!("`{}` at {}", port.field, Version::INITIAL), |heard, envelope| {
            let is_it = matches!(heard, super::heard::Heard::Field(received) if received.name == port.field);
            (is_it && envelope.version == Some(Version::INITIAL)).then_some(())
        })?;
    }
    let fields = session.published(Version::INITIAL, from)?;
    well_formed(session, &fields)?;
    Ok(fields)
}

fn ready(session: &mut Session, plan: &stagger_messages::Plan, given: &Given, from: usize) -> Result<(), Fault> {
    let sources = session.sources.clone();
    if let Some((last, others)) = sources.split_last() {
        for source in others {
            if let Some(field) = given.get(&place(source)) {
                session.put(&source.writer, field, Version::INITIAL, None)?;
            }
        }
        session.silent(from, &format!("no report before `{}` is there", last.field))?;
        if let Some(field) = given.get(&place(last)) {
            session.put(&last.writer, field, Version::INITIAL, None)?;
        }
    }
    session.ready(from, Version::INITIAL)?;
    let from = session.log.len();
    session.plan(plan)?;
    session.ready(from, Version::INITIAL)?;
    session.published(Version::INITIAL, from).map(|_| ())
}

fn reply(session: &Session, reply: &Reply) -> Result<(), Fault> {
    well_formed(session, &reply.fields)?;
    for port in session.ports().writes.iter().filter(|port| port.measure() != Measure::None) {
        let change = reply.done.changes.iter().find(|change| change.field == port.field);
        let finite = change.is_some_and(|c| [c.change, c.increment, c.magnitude].into_iter().all(f64::is_finite));
        if !finite {
            let found = change.map_or("none".into(), |change| format!("{change:?}"));
            return Err(Fault::new(format!("a finite change of `{}` in Done", port.field), found));
        }
    }
    Ok(())
}

/// Refuses fields that are not as their ports say, or not finite.
pub fn well_formed(session: &Session, fields: &Fields) -> Result<(), Fault> {
    for port in session.ports().writes {
        let Some(field) = fields.get(&port.field) else { continue };
        let shape = |port: &Port, support: &str| {
            format!("`{}` as {} x {:?} in {} on {support}", port.field, port.components, port.kind(), port.unit)
        };
        if *field.port != port || field.support.name != port.support {
            let found = shape(&field.port, &field.support.name);
            return Err(Fault::new(shape(&port, &port.support), found));
        }
        finite(field)?;
    }
    Ok(())
}

fn finite(field: &Field) -> Result<(), Fault> {
    match field.first_not_finite() {
        None => Ok(()),
        Some(index) => {
            let row = index / field.components().max(1);
            Err(Fault::new(
                format!("finite values of `{}`, or a Failure", field.name()),
                format!("NaN or inf in row {row}"),
            ))
        }
    }
}
