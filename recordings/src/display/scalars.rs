//! The numbers of a step that a display plots.

use stagger_coupling::Ledger;

use super::{schema::display::Scalar, timestamp};
use crate::{Outcome, Step};

/// Numbers of a run at the end of a step, by the name of their topic: window size and iterations of the step `reached`,
/// mean and largest value of every scalar field, and the energies held.
pub(super) fn scalars(step: &Step, reached: Option<&Outcome>, ledger: &Ledger) -> Vec<(String, Scalar)> {
    let mut scalars = Vec::new();
    let mut add = |name: String, value: f64, unit: &str| {
        scalars.push((name, Scalar { timestamp: Some(timestamp(step.t_s)), value, unit: unit.into() }));
    };
    if let Some(outcome) = reached.filter(|outcome| outcome.version == step.version) {
        add("dt".into(), step.dt_s, "s");
        add("iterations".into(), f64::from(outcome.version.iteration), "1");
        add("violation".into(), outcome.decision.violation, "1");
    }
    if let Some(positions) = step.fields.get("positions") {
        add("particles".into(), positions.rows() as f64, "1");
    }
    for (name, field) in &step.fields {
        let Ok(values) = field.f64() else { continue };
        // What stands on contacts changes in number from step to step: its mean says little.
        if field.components() != 1 || field.support.name != "particles" || values.is_empty() {
            continue;
        }
        add(format!("{name}/mean"), values.iter().sum::<f64>() / values.len() as f64, &field.port.unit);
        add(format!("{name}/max"), values.iter().copied().fold(f64::NEG_INFINITY, f64::max), &field.port.unit);
    }
    for (node, account) in ledger.nodes() {
        for (name, joule) in &account.stored {
            add(format!("energy/{node}/{name}"), *joule, "J");
        }
    }
    scalars
}
