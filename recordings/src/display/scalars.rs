//! The numbers of a step that a display plots.

use stagger_coupling::Ledger;
use stagger_messages::geometry::Shape;

use super::{quantities::numbers, schema::display::Scalar, timestamp};
use crate::{Outcome, Step};

/// Numbers of a run at the end of a step, by the name of their topic: window size and iterations of the step `reached`,
/// mean and largest value of every scalar field on points or on a grid, scalars without a place, and the energies held.
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
    let shapes = step.supports.shapes(&step.fields);
    for (support, shape) in &shapes {
        // Bodies may come and go; bare points and grids stay as many as they are.
        if let Shape::Points(points) = shape
            && let Some(radii) = step.fields.get(&points.radii)
        {
            add(support.clone(), radii.rows() as f64, "1");
        }
    }
    for (name, field) in &step.fields {
        let Ok(values) = field.f64() else { continue };
        if field.components() != 1 || values.is_empty() {
            continue;
        }
        let unit = &field.port.unit;
        match shapes.get(&field.port.support) {
            Some(Shape::Points(_) | Shape::Grid(_)) => {
                add(format!("{name}/mean"), values.iter().sum::<f64>() / values.len() as f64, unit);
                add(format!("{name}/max"), values.iter().copied().fold(f64::NEG_INFINITY, f64::max), unit);
            }
            // What stands on contacts changes in number from step to step: its mean says little.
            shape => match numbers(field, shape) {
                Some([value]) => add(format!("{name}/value"), *value, unit),
                Some(values) => {
                    values.iter().enumerate().for_each(|(row, value)| add(format!("{name}/{row}"), *value, unit));
                }
                None => {}
            },
        }
    }
    for (node, account) in ledger.nodes() {
        for (name, joule) in &account.stored {
            add(format!("energy/{node}/{name}"), *joule, "J");
        }
    }
    scalars
}
