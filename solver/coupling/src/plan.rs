//! Who reads which field from whom, and in which order the nodes solve.

use std::collections::{BTreeMap, BTreeSet};

use stagger_messages::{Geometry, Measure, NodePlan, Plan, Port, Ports, Source};

use super::{Acceleration, Order, Settings, observers};

/// A set of nodes that cannot be coupled, with every reason.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the nodes do not fit together:\n{}", .0.iter().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n"))]
pub struct PlanError(pub Vec<String>);

/// The fields whose change decides about convergence, by node and name, and how it is measured.
pub type Measured = BTreeMap<(String, String), Measure>;

/// Who reads from whom: each port read must have exactly one writer of the same unit, shape and support, or, where it
/// adds up, at least one.
///
/// # Errors
/// Every missing, doubled or mismatched writer, every name in the sequence that is no node, and every support that is
/// described wrongly or twice in different ways.
pub fn plan(nodes: &BTreeMap<String, Ports>, settings: &Settings) -> Result<Plan, PlanError> {
    let mut problems = Vec::new();
    let order = order(nodes, settings, &mut problems);
    problems.extend(settings.every.keys().filter(|node| !nodes.contains_key(*node)).map(|node| {
        format!(
            "coupling.every names `{node}`, but the nodes are {}",
            nodes.keys().cloned().collect::<Vec<_>>().join(", ")
        )
    }));
    let writers = writers(nodes);
    let position = |node: &str| order.iter().position(|name| name == node);
    let mut plans = Vec::new();
    let mut doubled = BTreeSet::new();
    for node in &order {
        let mut sources = Vec::new();
        for read in &nodes[node].reads {
            let others = writers.get(read.field.as_str()).map(Vec::as_slice).unwrap_or_default();
            match others {
                [] if read.optional => continue,
                [] => problems.push(no_writer(node, read, nodes)),
                [(first, _), (second, _), ..] if !read.adds_up && doubled.insert(&read.field) => problems.push(format!(
                    "field `{}` is written by both `{first}` and `{second}`, and `{node}` reads one: remove one of them",
                    read.field
                )),
                _ => {}
            }
            for (writer, written) in others {
                if *writer == node {
                    problems.push(format!("`{node}` reads `{}`, which it writes itself", read.field));
                } else if let Some(difference) = mismatch(read, written) {
                    problems.push(format!("`{node}` reads `{}` {difference} `{writer}` writes it", read.field));
                }
                let measure = written.measure();
                let tolerance = if measure == Measure::None { 0.0 } else { settings.tolerance_of(&read.field) };
                sources.push(Source {
                    field: read.field.clone(),
                    writer: (*writer).into(),
                    same_iteration: settings.order == Order::GaussSeidel && position(writer) < position(node),
                    interpolate: settings.interpolate,
                    measure: measure.into(),
                    reuse_below: settings.reuse * tolerance,
                    accelerated: false,
                });
            }
        }
        plans.push(NodePlan { node: node.clone(), sources });
    }
    problems.extend(descriptions(nodes));
    let mut plan = Plan { order, nodes: plans, from: None };
    for field in systems(&plan, settings).iter().flat_map(|system| &system.fields) {
        let sources = plan.nodes.iter_mut().flat_map(|node| &mut node.sources);
        sources.filter(|source| source.field == field.field).for_each(|source| source.accelerated = true);
    }
    if problems.is_empty() { Ok(plan) } else { Err(PlanError(problems)) }
}

/// The measured fields of all nodes that others read or that read nobody: those that decide convergence. What a node
/// that only reads computes changes nothing for the others.
#[must_use]
pub fn measured(nodes: &BTreeMap<String, Ports>, plan: &Plan) -> Measured {
    let observers = observers(plan);
    let iterated = nodes.iter().filter(|(node, _)| !observers.contains(*node));
    let writes = iterated.flat_map(|(node, ports)| ports.writes.iter().map(move |port| (node, port)));
    writes
        .filter(|(_, port)| port.measure() != Measure::None)
        .map(|(node, port)| ((node.clone(), port.field.clone()), port.measure()))
        .collect()
}

/// Fields that are accelerated together.
#[derive(Clone, Debug, PartialEq)]
pub struct System {
    /// How.
    pub method: Acceleration,
    /// The fields and their writers.
    pub fields: Vec<Source>,
}

/// What is accelerated: measured fields of a single writer that are read from the iteration before by a node on which
/// their own writer depends. Those for which the scene names no method of their own form one system.
#[must_use]
pub fn systems(plan: &Plan, settings: &Settings) -> Vec<System> {
    let mut together = System { method: settings.acceleration, fields: Vec::new() };
    let mut systems = Vec::new();
    let mut seen = BTreeSet::new();
    for node in &plan.nodes {
        for source in node.sources.iter().filter(|source| !source.same_iteration) {
            let writers = node.sources.iter().filter(|other| other.field == source.field).count();
            let fed_back = source.measure() != Measure::None && depends(plan, &source.writer, &node.node);
            if writers > 1 || !fed_back || !seen.insert(&source.field) {
                continue;
            }
            match settings.fields.get(&source.field).and_then(|field| field.acceleration) {
                Some(method) => systems.push(System { method, fields: vec![source.clone()] }),
                None => together.fields.push(source.clone()),
            }
        }
    }
    systems.push(together);
    systems.retain(|system| system.method != Acceleration::None && !system.fields.is_empty());
    systems
}

/// Whether what `node` computes depends, over any number of others, on what `on` computes.
fn depends(plan: &Plan, node: &str, on: &str) -> bool {
    let mut reached = BTreeSet::from([node]);
    let mut open = vec![node];
    while let Some(next) = open.pop() {
        let sources = plan.nodes.iter().filter(|plan| plan.node == next).flat_map(|plan| &plan.sources);
        for source in sources {
            if reached.insert(&source.writer) {
                open.push(&source.writer);
            }
        }
    }
    reached.contains(on)
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
    for name in settings.default_sequence.iter().filter(|name| nodes.contains_key(*name)).cloned() {
        if !order.contains(&name) {
            order.push(name);
        }
    }
    // Whoever is read follows at once on what it reads itself, so that its readers have its values in the same
    // iteration; who is not, comes last.
    let reads = |reader: &str, writer: &str| {
        let wrote = |read: &Port| nodes[writer].writes.iter().any(|port| port.field == read.field);
        nodes[reader].reads.iter().any(wrote)
    };
    for name in nodes.keys() {
        if order.contains(name) {
            continue;
        }
        let is_read = order.iter().any(|other| reads(other, name));
        let after = order.iter().rposition(|other| reads(name, other)).map_or(0, |last| last + 1);
        order.insert(if is_read { after } else { order.len() }, name.clone());
    }
    order
}

/// What is wrong with the descriptions of supports: each has a sound one, and all nodes that describe it agree.
fn descriptions(nodes: &BTreeMap<String, Ports>) -> Vec<String> {
    let mut known: BTreeMap<&str, (&str, &Geometry)> = BTreeMap::new();
    let mut problems = Vec::new();
    for (node, geometry) in nodes.iter().flat_map(|(node, ports)| ports.supports.iter().map(move |it| (node, it))) {
        let name = &geometry.support;
        if let Some(fault) = geometry.fault() {
            problems.push(format!("`{node}` describes support `{name}`, which {fault}"));
        }
        let (first, there) = *known.entry(name).or_insert((node, geometry));
        if there != geometry {
            problems.push(format!(
                "support `{name}` is described by both `{first}` and `{node}`, and differently: give one another name"
            ));
        }
    }
    problems
}

/// The writers of each field, by name.
fn writers(nodes: &BTreeMap<String, Ports>) -> BTreeMap<&str, Vec<(&String, &Port)>> {
    let mut writers: BTreeMap<&str, Vec<(&String, &Port)>> = BTreeMap::new();
    for (node, ports) in nodes {
        for port in &ports.writes {
            writers.entry(&port.field).or_default().push((node, port));
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
    (Port { adds_up: false, optional: false, ..read.clone() } != written.as_read())
        .then(|| format!("{}, but {} is how", shape(read), shape(written)))
}

#[cfg(test)]
mod tests {
    use stagger_messages::Grid;

    use super::*;
    use crate::StepSize;

    fn settings() -> Settings {
        let settings = Settings::new(StepSize { start_s: 1.0, limit_s: 1.0, minimum_s: 1e-3, growth: 2.0 });
        Settings { default_sequence: ["particles", "optics", "thermal"].map(Into::into).into(), ..settings }
    }

    fn nodes() -> BTreeMap<String, Ports> {
        let positions = Port::f64("positions", "m", "particles", 3, Measure::Increment);
        let temperature = Port::f64("temperature", "K", "particles", 1, Measure::Magnitude);
        BTreeMap::from([
            ("thermal".into(), Ports::new(vec![positions.as_read()], vec![temperature.clone()])),
            ("particles".into(), Ports::new(vec![temperature.as_read()], vec![positions])),
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
    fn a_node_of_another_name_solves_before_those_that_read_it_and_a_reader_last() {
        let power = Port::f64("power", "W", "particles", 1, Measure::Magnitude);
        let mut nodes = nodes();
        let positions = nodes["particles"].writes[0].clone();
        nodes.get_mut("thermal").unwrap().reads.push(power.as_sum());
        let laser = Ports::new(vec![positions.as_read()], vec![power]);
        nodes.insert("optics".into(), laser.clone());
        nodes.insert("second".into(), laser);
        nodes.insert("a-probe".into(), Ports::new(vec![positions.as_read()], Vec::new()));
        let plan = plan(&nodes, &settings()).unwrap();
        assert_eq!(plan.order, ["particles", "second", "optics", "thermal", "a-probe"]);
        assert_eq!(observers(&plan), ["a-probe".to_owned()].into());
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

    #[test]
    fn a_support_has_one_sound_description() {
        let grid = |dims| Geometry::grid("cells", Grid::of_cells([0.0; 3], [1.0; 3], dims));
        let described = |of: [Geometry; 2]| {
            let mut nodes = nodes();
            for (ports, support) in nodes.values_mut().zip(of) {
                ports.supports.push(support);
            }
            plan(&nodes, &settings())
        };
        described([grid([4, 3, 2]), grid([4, 3, 2])]).unwrap();
        let PlanError(lines) = described([grid([4, 3, 2]), grid([4, 3, 3])]).unwrap_err();
        assert!(lines.len() == 1 && lines[0].contains("`cells` is described by both `particles` and `thermal`"));
        let PlanError(lines) = described([grid([4, 3, 0]), Geometry::points("marks", "")]).unwrap_err();
        assert!(lines.len() == 2 && lines[0].contains("[4, 3, 0]") && lines[1].contains("`marks`"), "{lines:?}");
    }
}
