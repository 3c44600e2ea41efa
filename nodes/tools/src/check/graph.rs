//! Who reads what from whom, in which order and at which rate: as text, as Mermaid, as DOT.

use std::{collections::BTreeMap, fmt::Write as _};

use stagger_coupling::{Settings, observers};
use stagger_messages::{NodePlan, Plan, Port, Ports, Source};

/// How the graph is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Lines for people
    Text,
    /// For Markdown: `flowchart`
    Mermaid,
    /// For Graphviz: `digraph`
    Dot,
}

/// How often a node solves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Rate {
    /// It reads and nobody reads it: it solves once when the others have converged.
    looks_on: bool,
    /// Accepted steps from one solve to the next.
    every: u64,
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.looks_on, self.every) {
            (false, 1) => write!(f, "every iteration"),
            (false, every) => write!(f, "every iteration of one step in {every}"),
            (true, 1) => write!(f, "once per accepted step"),
            (true, every) => write!(f, "once in {every} accepted steps"),
        }
    }
}

/// The exchange of fields of a scene whose nodes fit together.
pub struct Graph<'a> {
    plan: &'a Plan,
    ports: &'a BTreeMap<String, Ports>,
    settings: &'a Settings,
}

/// Fields that go the same way at the same time.
type Arrows<'a> = BTreeMap<(&'a str, &'a str, bool), Vec<String>>;

impl<'a> Graph<'a> {
    /// Of a plan, the ports it was made from, and the settings it was made with.
    #[must_use]
    pub fn new(plan: &'a Plan, ports: &'a BTreeMap<String, Ports>, settings: &'a Settings) -> Self {
        Self { plan, ports, settings }
    }

    /// In one of the formats.
    #[must_use]
    pub fn write(&self, format: Format) -> String {
        match format {
            Format::Text => self.text(),
            Format::Mermaid => self.mermaid(),
            Format::Dot => self.dot(),
        }
    }

    fn writes(&self, node: &str) -> &'a [Port] {
        self.ports.get(node).map(|ports| ports.writes.as_slice()).unwrap_or_default()
    }

    fn is_read(&self, field: &str) -> bool {
        self.plan.nodes.iter().flat_map(|part| &part.sources).any(|source| source.field == field)
    }

    fn rate(&self, node: &str) -> Rate {
        let every = self.settings.every.get(node).copied().unwrap_or(1);
        Rate { looks_on: observers(self.plan).contains(node), every }
    }

    /// Fields by writer, reader and whether they are of the same iteration.
    fn arrows(&self) -> Arrows<'a> {
        let mut arrows = Arrows::new();
        for NodePlan { node, sources } in &self.plan.nodes {
            for source in sources {
                let label = if is_accelerated(source) {
                    format!("{} (accelerated)", source.field)
                } else {
                    source.field.clone()
                };
                arrows.entry((&source.writer, node, source.same_iteration)).or_default().push(label);
            }
        }
        arrows
    }

    fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        for (place, NodePlan { node, sources }) in (1..).zip(&self.plan.nodes) {
            let _ = writeln!(text, "  {place} {node}, {}", self.rate(node));
            for source in sources {
                let when = match (source.same_iteration, is_accelerated(source)) {
                    (true, _) => "this iteration",
                    (false, false) => "the iteration before",
                    (false, true) => "the iteration before, accelerated",
                };
                let _ = writeln!(text, "    reads  {:<24} from {}, {when}", source.field, source.writer);
            }
            for port in self.writes(node) {
                let to = if self.is_read(&port.field) { "" } else { "  (recorded only)" };
                let Port { field, components, unit, support, .. } = port;
                let _ = writeln!(text, "    writes {field:<24} {components} x {unit} on {support}{to}");
            }
        }
        text
    }

    fn mermaid(&self) -> String {
        let mut text = String::from("flowchart TD\n");
        // Names of their own: `end` and others mean something to Mermaid.
        let id = |node: &str| self.plan.order.iter().position(|name| name == node).map_or(0, |at| at + 1);
        let escape = |label: &str| label.replace('#', "#35;").replace('"', "#quot;");
        for (place, node) in (1..).zip(&self.plan.order) {
            let _ = writeln!(text, "    n{place}[\"{place}. {}<br>{}\"]", escape(node), self.rate(node));
        }
        for ((writer, reader, same), fields) in self.arrows() {
            let arrow = if same { "-->" } else { "-.->" };
            let label = escape(&fields.join(", "));
            let _ = writeln!(text, "    n{} {arrow}|\"{label}\"| n{}", id(writer), id(reader));
        }
        text
    }

    fn dot(&self) -> String {
        let mut text = String::from("digraph exchange {\n    node [shape=box];\n");
        let quote = |label: &str| format!("\"{}\"", label.replace('\\', "\\\\").replace('"', "\\\""));
        for (place, node) in (1..).zip(&self.plan.order) {
            let label = quote(&format!("{place}. {node}\n{}", self.rate(node))).replace('\n', "\\n");
            let _ = writeln!(text, "    {} [label={label}];", quote(node));
        }
        for ((writer, reader, same), fields) in self.arrows() {
            let style = if same { "solid" } else { "dashed" };
            let label = quote(&fields.join("\n")).replace('\n', "\\n");
            let _ = writeln!(text, "    {} -> {} [label={label}, style={style}];", quote(writer), quote(reader));
        }
        text.push_str("}\n");
        text
    }
}

/// Whether what is frozen is the coordinator's iterate: only what is fed back can be accelerated.
fn is_accelerated(source: &Source) -> bool {
    source.accelerated && !source.same_iteration
}

#[cfg(test)]
mod tests {
    use super::*;
    use stagger_coupling::{StepSize, plan};
    use stagger_messages::Measure;

    fn settings() -> Settings {
        Settings::new(StepSize { start_s: 1.0, limit_s: 1.0, minimum_s: 1e-3, growth: 2.0 })
    }

    /// Of the first `count` of three nodes: the first two read each other, the third looks on.
    fn written(count: usize, format: Format, settings: &Settings, accelerated: bool) -> String {
        let positions = Port::f64("positions", "m", "particles", 3, Measure::Increment);
        let temperature = Port::f64("temperature", "K", "particles", 1, Measure::Magnitude);
        let height = Port::f64("height", "m", "probe", 1, Measure::None);
        let fed_back = if count > 1 { vec![temperature.as_read()] } else { Vec::new() };
        let nodes = [
            ("particles", Ports::new(fed_back, vec![positions.clone()])),
            ("thermal", Ports::new(vec![positions.as_read()], vec![temperature.clone()])),
            ("end", Ports::new(vec![positions.as_read(), temperature.as_read()], vec![height])),
        ];
        let nodes = nodes.into_iter().take(count).map(|(name, ports)| (name.to_owned(), ports)).collect();
        let mut plan = plan(&nodes, settings).unwrap();
        for source in plan.nodes.iter_mut().flat_map(|part| &mut part.sources) {
            source.accelerated = accelerated;
        }
        Graph::new(&plan, &nodes, settings).write(format)
    }

    #[test]
    fn one_physics_reads_nothing() {
        let write = |format| written(1, format, &settings(), false);
        let line = format!("    writes {:<24} 3 x m on particles  (recorded only)\n", "positions");
        assert_eq!(write(Format::Text), format!("  1 particles, every iteration\n{line}"));
        assert_eq!(write(Format::Mermaid), "flowchart TD\n    n1[\"1. particles<br>every iteration\"]\n");
        let dot = "digraph exchange {\n    node [shape=box];\n    \"particles\" \
                   [label=\"1. particles\\nevery iteration\"];\n}\n";
        assert_eq!(write(Format::Dot), dot);
    }

    #[test]
    fn what_is_fed_back_and_accelerated_is_told_from_what_is_new() {
        let write = |format| written(2, format, &settings(), true);
        let text = write(Format::Text);
        assert!(text.contains("temperature              from thermal, the iteration before, accelerated\n"), "{text}");
        assert!(text.contains("positions                from particles, this iteration\n"), "{text}");
        assert_eq!(
            write(Format::Mermaid),
            "flowchart TD\n    n1[\"1. particles<br>every iteration\"]\n    n2[\"2. thermal<br>every iteration\"]\n    \
             n1 -->|\"positions\"| n2\n    n2 -.->|\"temperature (accelerated)\"| n1\n"
        );
        let dot = write(Format::Dot);
        assert!(dot.contains("\"particles\" -> \"thermal\" [label=\"positions\", style=solid];\n"), "{dot}");
        let fed_back = "\"thermal\" -> \"particles\" [label=\"temperature (accelerated)\", style=dashed];\n";
        assert!(dot.contains(fed_back), "{dot}");
    }

    #[test]
    fn whoever_looks_on_solves_once_per_step_or_at_its_interval() {
        let mermaid = written(3, Format::Mermaid, &settings(), false);
        // `end` would close a block of Mermaid: it may stand in a text, not as a name.
        assert!(mermaid.contains("    n2[\"2. thermal<br>every iteration\"]\n"), "{mermaid}");
        assert!(mermaid.contains("    n3[\"3. end<br>once per accepted step\"]\n"), "{mermaid}");
        let lines = mermaid.lines().skip(1).map(str::trim);
        assert!(lines.into_iter().all(|line| line.starts_with('n') && !line.starts_with("node")), "{mermaid}");
        let every = Settings { every: BTreeMap::from([("end".to_owned(), 5)]), ..settings() };
        let text = written(3, Format::Text, &every, false);
        assert!(text.contains("  3 end, once in 5 accepted steps\n"), "{text}");
        let dot = written(3, Format::Dot, &every, false);
        assert!(dot.contains("\"end\" [label=\"3. end\\nonce in 5 accepted steps\"];\n"), "{dot}");
    }
}
