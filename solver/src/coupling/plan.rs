use std::collections::BTreeMap;

use stagger_messages::{Measure, NodePlan, Plan, Port, Ports, Source};

use super::{Order, Settings};

/// Order in which the physics of stagger solve where the scene names none: what moves, then what heats, then what
/// only follows.
const DEFAULT_SEQUENCE: [&str; 5] = ["particles", "optics", "current", "thermal", "substrate"];

/// A set of nodes that cannot be coupled, with every reason.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the nodes do not fit together:\n{}", .0.iter().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n"))]
pub struct PlanError(pub Vec<String>);

/// Who reads from whom: each port read must have exactly one writer of the same unit, shape and support.
///
/// # Errors
/// Every missing, doubled or mismatched writer, and every name in the sequence that is no node.
pub fn plan(nodes: &BTreeMap<String, Ports>, settings: &Settings) -> Result<Plan, PlanError> {
    let mut problems = Vec::new();
    let order = order(nodes, settings, &mut problems);
    let writers = writers(nodes, &mut problems);
    let position = |node: &str| order.iter().position(|name| name == node);
    let mut plans = Vec::new();
    for node in &order {
        let mut sources = Vec::new();
        for read in &nodes[node].reads {
            let Some((writer, written)) = writers.get(read.field.as_str()) else {
                problems.push(no_writer(node, read, nodes));
                continue;
            };
            if *writer == node {
                problems.push(format!("`{node}` reads `{}`, which it writes itself", read.field));
            } else if let Some(difference) = mismatch(read, written) {
                problems.push(format!("`{node}` reads `{}` {difference} `{writer}` writes it", read.field));
            }
            let earlier = settings.order == Order::GaussSeidel && position(writer) < position(node);
            let measure = written.measure();
            let tolerance = if measure == Measure::None { 0.0 } else { settings.tolerance_of(&read.field) };
            sources.push(Source {
                field: read.field.clone(),
                writer: (*writer).into(),
                same_iteration: earlier,
                interpolate: settings.interpolate,
                measure: measure.into(),
                reuse_below: settings.reuse * tolerance,
                accelerated: false,
            });
        }
        plans.push(NodePlan { node: node.clone(), sources });
    }
    if problems.is_empty() { Ok(Plan { order, nodes: plans, from: None }) } else { Err(PlanError(problems)) }
}

/// The measured fields of all nodes: those that decide convergence.
#[must_use]
pub fn measured(nodes: &BTreeMap<String, Ports>) -> BTreeMap<String, Measure> {
    let writes = nodes.values().flat_map(|ports| &ports.writes);
    writes.filter(|port| port.measure() != Measure::None).map(|port| (port.field.clone(), port.measure())).collect()
}

fn order(nodes: &BTreeMap<String, Ports>, settings: &Settings, problems: &mut Vec<String>) -> Vec<String> {
    let mut order: Vec<String> = Vec::new();
    for name in &settings.sequence {
        if !nodes.contains_key(name) {
            let names: Vec<_> = nodes.keys().map(String::as_str).collect();
            problems.push(format!("coupling.sequence names `{name}`, but the nodes are {}", names.join(", ")));
        } else if !order.contains(name) {
            order.push(name.clone());
        }
    }
    let known = DEFAULT_SEQUENCE.iter().map(|name| (*name).to_owned()).filter(|name| nodes.contains_key(name));
    for name in known.chain(nodes.keys().cloned()) {
        if !order.contains(&name) {
            order.push(name);
        }
    }
    order
}

fn writers<'a>(
    nodes: &'a BTreeMap<String, Ports>,
    problems: &mut Vec<String>,
) -> BTreeMap<&'a str, (&'a String, &'a Port)> {
    let mut writers: BTreeMap<&str, (&String, &Port)> = BTreeMap::new();
    for (node, ports) in nodes {
        for port in &ports.writes {
            if let Some((first, _)) = writers.insert(&port.field, (node, port)) {
                problems.push(format!(
                    "field `{}` is written by both `{first}` and `{node}`: remove one of them",
                    port.field
                ));
            }
        }
    }
    writers
}

fn no_writer(node: &str, read: &Port, nodes: &BTreeMap<String, Ports>) -> String {
    let present: Vec<_> = nodes.keys().map(String::as_str).collect();
    format!(
        "`{node}` reads `{}` [{}] on {}, which none of the nodes ({}) writes: add the physics that does",
        read.field,
        read.unit,
        read.support,
        present.join(", ")
    )
}

fn mismatch(read: &Port, written: &Port) -> Option<String> {
    let shape =
        |port: &Port| format!("as {} x {:?} in {} on {}", port.components, port.kind(), port.unit, port.support);
    (read != &written.as_read()).then(|| format!("{}, but {} is how", shape(read), shape(written)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::StepSize;

    fn settings() -> Settings {
        Settings::new(StepSize { start_s: 1.0, limit_s: 1.0, minimum_s: 1e-3, growth: 2.0 })
    }

    fn nodes() -> BTreeMap<String, Ports> {
        let positions = Port::f64("positions", "m", "particles", 3, Measure::Increment);
        let temperature = Port::f64("temperature", "K", "particles", 1, Measure::Magnitude);
        BTreeMap::from([
            ("thermal".into(), Ports { reads: vec![positions.as_read()], writes: vec![temperature.clone()] }),
            ("particles".into(), Ports { reads: vec![temperature.as_read()], writes: vec![positions] }),
        ])
    }

    #[test]
    fn gauss_seidel_reads_what_was_solved_before_and_jacobi_does_not() {
        let seidel = plan(&nodes(), &settings()).unwrap();
        assert_eq!(seidel.order, ["particles", "thermal"]);
        assert!(!seidel.nodes[0].sources[0].same_iteration && seidel.nodes[1].sources[0].same_iteration);
        let jacobi = plan(&nodes(), &Settings { order: Order::Jacobi, ..settings() }).unwrap();
        assert!(jacobi.nodes.iter().flat_map(|node| &node.sources).all(|source| !source.same_iteration));
        let turned = Settings { sequence: vec!["thermal".into()], ..settings() };
        assert_eq!(plan(&nodes(), &turned).unwrap().order, ["thermal", "particles"]);
    }

    #[test]
    fn all_problems_are_told_at_once() {
        let mut nodes = nodes();
        let thermal = nodes["thermal"].clone();
        nodes.insert("copy".into(), thermal);
        nodes.get_mut("particles").unwrap().reads.push(Port::f64("current", "A/m^2", "particles", 1, Measure::None));
        nodes.get_mut("thermal").unwrap().reads[0].unit = "mm".into();
        let settings = Settings { sequence: vec!["optic".into()], ..settings() };
        let PlanError(lines) = plan(&nodes, &settings).unwrap_err();
        assert_eq!(lines.len(), 4, "{lines:#?}");
        assert!(lines[0].contains("`optic`") && lines[1].contains("both `copy` and `thermal`"));
        assert!(lines[2].contains("`current` [A/m^2]") && lines[3].contains("in mm on particles"));
    }
}
