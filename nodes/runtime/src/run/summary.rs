//! What a run ends with: for people as text, for machines as JSON (docs/summary.md).

use std::{collections::BTreeMap, fmt};

use serde::Serialize;
use stagger_coupling::Account;
use stagger_messages::{Field, FieldSummary, codec};

use crate::coordinator::{
    monitor::{Steps, Work},
    supervision::Restart,
};

/// Version of the JSON.
pub const FORMAT: &str = "stagger-summary/1";

/// The end of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Name and version of this format.
    pub format: &'static str,
    /// Name of the run.
    pub run: String,
    /// Title of the scene.
    pub title: String,
    /// Whether the run reached its end.
    pub completed: bool,
    /// Steps and step sizes.
    pub steps: Steps,
    /// Wall time from the first directive to the last reply, in s.
    pub wall_s: f64,
    /// Work by node.
    pub nodes: BTreeMap<String, Work>,
    /// Fields published by all nodes.
    pub exchanges: u64,
    /// Bytes of their values.
    pub bytes: u64,
    /// Messages refused by the coordinator and all nodes.
    pub refused: u64,
    /// Energy by node, in J.
    pub ledger: BTreeMap<String, Account>,
    /// Imbalance of each node and each exchange, as a share of the energy turned over.
    pub imbalance: BTreeMap<String, f64>,
    /// Energy between two nodes that solve at different rates, given by the one and not yet taken by the other, in J.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub on_the_way: BTreeMap<String, f64>,
    /// Every field at the end.
    pub fields: Vec<FinalField>,
    /// Nodes that died and were started again.
    pub restarts: Vec<Restart>,
    /// Nodes that ended without saying what their fields held.
    pub missing: Vec<String>,
    /// Hash of all final fields: equal for equal bits.
    pub hash: String,
    /// The recording.
    pub recording: Option<Recorded>,
}

/// A field at the end of a run.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct FinalField {
    /// Name.
    pub field: String,
    /// SI unit.
    pub unit: String,
    /// Rows.
    pub rows: u64,
    /// Smallest value.
    pub min: f64,
    /// Mean value.
    pub mean: f64,
    /// Largest value.
    pub max: f64,
    /// Hash of the values.
    pub hash: String,
}

/// What was recorded.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Recorded {
    /// The file.
    pub path: String,
    /// Messages in it.
    pub messages: u64,
    /// Its size, in bytes.
    pub bytes: u64,
    /// Messages that were sent but did not arrive.
    pub lost: u64,
    /// Time the run waited for the disk, in s.
    pub waited_s: f64,
}

impl From<&FieldSummary> for FinalField {
    fn from(field: &FieldSummary) -> Self {
        Self {
            field: field.field.clone(),
            unit: field.unit.clone(),
            rows: field.rows,
            min: field.min,
            mean: field.mean,
            max: field.max,
            hash: format!("{:016x}", field.hash),
        }
    }
}

/// Smallest, mean and largest value of a field, summed in its order, and the hash of its bytes.
#[must_use]
pub fn of_field(field: &Field) -> FieldSummary {
    let mut summary = FieldSummary {
        field: field.name().into(),
        unit: field.port.unit.clone(),
        rows: field.rows() as u64,
        hash: field.hash(),
        ..FieldSummary::default()
    };
    let mut put = |values: &mut dyn ExactSizeIterator<Item = f64>| {
        let count = values.len() as f64;
        let (mut low, mut high, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        for value in values {
            low = low.min(value);
            high = high.max(value);
            sum += value;
        }
        if count > 0.0 {
            (summary.min, summary.mean, summary.max) = (low, sum / count, high);
        }
    };
    if let Ok(values) = field.f64() {
        put(&mut values.iter().copied());
    } else if let Ok(values) = field.u32() {
        put(&mut values.iter().map(|value| f64::from(*value)));
    } else if let Ok(values) = field.u8() {
        put(&mut values.iter().map(|value| f64::from(*value)));
    }
    summary
}

/// Fields of all nodes by name; where several nodes write one, the second and later ones are called `node/field`.
#[must_use]
pub fn told_apart<'n>(nodes: impl Iterator<Item = (&'n str, Vec<FieldSummary>)>) -> Vec<FieldSummary> {
    let mut apart: BTreeMap<String, FieldSummary> = BTreeMap::new();
    for (node, fields) in nodes {
        for mut field in fields {
            if apart.contains_key(&field.field) {
                field.field = format!("{node}/{}", field.field);
            }
            apart.insert(field.field.clone(), field);
        }
    }
    apart.into_values().collect()
}

/// Hash over the names and hashes of all final fields, in the order of their names.
#[must_use]
pub fn hash(fields: &[FieldSummary]) -> String {
    let mut sorted: Vec<_> = fields.iter().collect();
    sorted.sort_by(|a, b| a.field.cmp(&b.field));
    let mut bytes = Vec::new();
    for field in sorted {
        bytes.extend_from_slice(field.field.as_bytes());
        bytes.extend_from_slice(&field.hash.to_le_bytes());
    }
    format!("{:016x}", codec::hash(&bytes))
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Steps { accepted, rejected, iterations, .. } = self.steps;
        let end = if self.completed { "completed" } else { "not completed" };
        writeln!(f, "{}\nrun {}, {end}", self.title, self.run)?;
        writeln!(f, "\n  simulated     {:.6} ms in {:.2} s of wall time", 1e3 * self.steps.time_s, self.wall_s)?;
        writeln!(
            f,
            "  steps         {accepted} accepted, {rejected} rejected, {iterations} iterations ({:.2} per attempt)",
            iterations as f64 / (accepted + rejected).max(1) as f64
        )?;
        writeln!(
            f,
            "  step size     {:.3e} / {:.3e} / {:.3e} s (min / mean / max)",
            self.steps.dt_min_s, self.steps.dt_mean_s, self.steps.dt_max_s
        )?;
        if self.steps.contractions > 0 {
            writeln!(f, "  contraction   {:.3} from one iteration to the next (mean)", self.steps.contraction)?;
        }
        let sensitive = self.steps.sensitive.iter().map(|(field, times)| format!("{field} {times}"));
        let sensitive = sensitive.collect::<Vec<_>>().join(", ");
        if !sensitive.is_empty() {
            writeln!(f, "  step size by  {sensitive} (times each field was the most sensitive)")?;
        }
        for Restart { node, at, from_step, steps_repeated, outage_s } in &self.restarts {
            writeln!(
                f,
                "  restart       `{node}` in {at}: {outage_s:.2} s until ready from step {from_step}, {steps_repeated} steps once more"
            )?;
        }
        writeln!(f, "  exchanges     {}, {:.1} MB", self.exchanges, 1e-6 * self.bytes as f64)?;
        if self.refused > 0 {
            writeln!(f, "  refused       {} messages", self.refused)?;
        }
        if let Some(Recorded { path, messages, bytes, lost, .. }) = &self.recording {
            writeln!(f, "  recording     {path}: {messages} messages, {:.1} MB", 1e-6 * *bytes as f64)?;
            if *lost > 0 {
                writeln!(f, "                {lost} messages did not arrive")?;
            }
        }
        writeln!(f, "\n  {:<12} {:>8} {:>8} {:>10} {:>10}", "node", "solves", "reused", "solve s", "wait s")?;
        for (node, work) in &self.nodes {
            let Work { solves, reused, solve_s, wait_s, .. } = work;
            writeln!(f, "  {node:<12} {solves:>8} {reused:>8} {solve_s:>10.3} {wait_s:>10.3}")?;
        }
        for (node, work) in &self.nodes {
            for (name, value) in &work.figures {
                writeln!(f, "  {node}: {name} {}", number(*value))?;
            }
        }
        self.energy(f)?;
        writeln!(f, "\n  {:<24} {:>8} {:>12} {:>12} {:>12}  unit", "field at the end", "rows", "min", "mean", "max")?;
        for field in &self.fields {
            let FinalField { field, unit, rows, min, mean, max, .. } = field;
            let [min, mean, max] = [min, mean, max].map(|value| number(*value));
            writeln!(f, "  {field:<24} {rows:>8} {min:>12} {mean:>12} {max:>12}  {unit}")?;
        }
        write!(f, "\n  hash of the final fields  {}", self.hash)
    }
}

impl Summary {
    fn energy(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n  {:<34} {:>14}", "energy", "J")?;
        for (node, account) in &self.ledger {
            for (name, joule) in &account.stored {
                let change = joule - account.initial.get(name).unwrap_or(&0.0);
                writeln!(f, "  {:<34} {joule:>14.6e}  changed by {change:+.3e}", format!("{node}: {name}"))?;
            }
            for (name, joule) in &account.gained {
                writeln!(f, "  {:<34} {joule:>14.6e}  came in", format!("{node}: {name}"))?;
            }
            for (name, joule) in &account.lost {
                writeln!(f, "  {:<34} {joule:>14.6e}  went out", format!("{node}: {name}"))?;
            }
        }
        for (what, joule) in &self.on_the_way {
            writeln!(f, "  {:<34} {joule:>14.6e}  given and not yet taken", format!("on the way of {what}"))?;
        }
        for (what, share) in &self.imbalance {
            writeln!(f, "  {:<34} {share:>14.1e}  of the energy turned over", format!("imbalance of {what}"))?;
        }
        Ok(())
    }
}

fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if (1e-2..1e5).contains(&size) {
        format!("{value:.4}")
    } else {
        format!("{value:.4e}")
    }
}
