//! The curves beside the picture.

use std::collections::BTreeMap;

use stagger_coupling::Ledger;
use stagger_messages::FieldError;
use stagger_recordings::{Outcome, Step, display::quantities::numbers};

use crate::layers::{Coloured, curves};

/// One point of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Where the curve belongs: `temperature/mean`.
    pub path: String,
    /// Its name in the legend.
    pub name: String,
    /// Its value.
    pub value: f64,
}

fn point(path: impl Into<String>, name: impl Into<String>, value: f64) -> Point {
    Point { path: path.into(), name: name.into(), value }
}

/// Decades below its tolerance at which an error is drawn that is smaller, or exactly zero: less than 1e-8 of a
/// tolerance is rounding, and a curve that ends at zero would look like a run that does.
const FLOOR: f64 = -8.0;
/// Group of the curves of numbers that have no place.
pub const NUMBERS: &str = "numbers";
/// The iteration whose errors are drawn field by field. The first measures how far the step went; the second is the
/// first to measure what the physics do to each other.
const COMPARED: u32 = 2;

/// Sums up what is plotted once per accepted step.
#[derive(Clone, Debug, Default)]
pub struct Plots {
    iterations: u32,
    compared: Vec<FieldError>,
    solve_s: BTreeMap<String, f64>,
}

impl Plots {
    /// Takes note of an iteration, accepted or not.
    pub fn iteration(&mut self, outcome: &Outcome) {
        self.iterations += 1;
        for (node, done) in &outcome.reports {
            *self.solve_s.entry(node.clone()).or_default() += done.solve_s;
        }
        // A step that is accepted earlier keeps its last.
        if outcome.version.iteration <= COMPARED {
            self.compared.clone_from(&outcome.decision.errors);
        }
    }

    /// The curves that have a point for every accepted step.
    pub fn accepted(&mut self, outcome: &Outcome, ledger: &Ledger) -> Vec<Point> {
        let mut points = vec![
            point("window/dt", "dt [us]", outcome.decision.dt_s * 1e6),
            point("iterations/per_step", "iterations, rejected attempts included", f64::from(self.iterations)),
        ];
        self.iterations = 0;
        let contraction = outcome.decision.contraction;
        if contraction > 0.0 && contraction.is_finite() {
            let name = "log10 of the contraction rate";
            points.push(point("convergence/contraction", name, contraction.log10().max(FLOOR)));
        }
        points.extend(self.convergence(outcome.decision.violation));
        for (node, seconds) in std::mem::take(&mut self.solve_s) {
            points.push(point(format!("cost/{node}"), format!("{node} [ms]"), seconds * 1e3));
        }
        points.extend(energies(ledger));
        points
    }

    /// How far the accepted iteration, and each field in the iteration compared, are from their tolerances: the
    /// violation Z = error/tolerance (Zohdi 2018, section 6.5), in decades; converged below 0.
    fn convergence(&mut self, violation: f64) -> Vec<Point> {
        // Rerun has no logarithmic axis.
        let logarithm = |path: String, name: String, ratio: f64| {
            let decades = if ratio > 0.0 { ratio.log10().max(FLOOR) } else { FLOOR };
            (ratio >= 0.0 && ratio.is_finite()).then(|| point(path, name, decades))
        };
        let accepted = logarithm("convergence/accepted".into(), "log10 Z, accepted".into(), violation);
        let fields = self.compared.drain(..).filter(|error| error.tolerance > 0.0).filter_map(|error| {
            let name = format!("log10 Z of {}, iteration {COMPARED}", error.field.replace('_', " "));
            logarithm(format!("convergence/fields/{}", error.field), name, error.error / error.tolerance)
        });
        accepted.into_iter().chain(fields).collect()
    }

    /// The curves of a state whose fields are recorded: mean and largest value of what colours, and each number that has no
    /// place.
    pub fn state(&self, step: &Step, coloured: &Coloured) -> Vec<Point> {
        let mut points = Vec::new();
        for (quantity, values) in coloured {
            let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
            let Some(max) = finite.iter().copied().max_by(f64::total_cmp) else { continue };
            let mean = finite.iter().sum::<f64>() / finite.len() as f64;
            let group = curves(quantity);
            for (what, value) in [("mean", mean), ("maximum", max)] {
                let name = format!("{what} {} [{}]", quantity.name, quantity.unit);
                points.push(point(format!("{group}/{what}"), name, value));
            }
        }
        let shapes = step.supports.shapes(&step.fields);
        for (name, field) in &step.fields {
            let Some(values) = numbers(field, shapes.get(&field.port.support)) else { continue };
            let words = name.replace('_', " ");
            let unit = &field.port.unit;
            match values {
                [value] => points.push(point(format!("{NUMBERS}/{name}"), format!("{words} [{unit}]"), *value)),
                _ => points.extend(values.iter().enumerate().map(|(row, value)| {
                    point(format!("{NUMBERS}/{name}/{row}"), format!("{words} {row} [{unit}]"), *value)
                })),
            }
        }
        points
    }
}

/// Energies by node and name, and the share of each node's turnover that is not accounted for.
///
/// Each node has a picture of its own: the heat of a laser is a million times the energy of the powder's motion.
fn energies(ledger: &Ledger) -> Vec<Point> {
    let mut points = Vec::new();
    for (node, account) in ledger.nodes() {
        // Fixed units, so that a curve keeps its scale: motion in nJ, heat and light in mJ.
        let motion = account.stored.contains_key("kinetic");
        let (group, unit, per_joule) = if motion { ("motion", "nJ", 1e9) } else { ("heat", "mJ", 1e3) };
        for (kind, map) in [("stored", &account.stored), ("gained", &account.gained), ("lost", &account.lost)] {
            for (name, joule) in map {
                let what = if kind == "stored" { String::new() } else { format!(" {kind} so far") };
                let label = format!("{node}: {name}{what} [{unit}]").replace('_', " ");
                points.push(point(format!("energy/{group}/{node}/{kind}/{name}"), label, joule * per_joule));
            }
        }
    }
    for (what, share) in ledger.imbalances() {
        let path = what.replace([':', ' '], "_");
        points.push(point(format!("imbalance/{path}"), format!("{what} [ppm of the energy turned over]"), share * 1e6));
    }
    points
}

#[cfg(test)]
mod tests {
    use stagger_messages::{Decision, Done, Energy, Verdict, Version};

    use super::*;
    use crate::{
        layers::Layers,
        testing::{field, step},
    };

    /// Temperature's error falls by a hundred in each iteration; after the third nothing changes any more.
    fn outcome(iteration: u32) -> Outcome {
        let error =
            |field: &str, error| FieldError { field: field.into(), error, tolerance: 1e-6, ..FieldError::default() };
        let temperature = if iteration < 4 { 0.01f64.powi(iteration as i32 - 1) } else { 0.0 };
        let decision = Decision {
            verdict: Verdict::Accept.into(),
            violation: temperature / 1e-6,
            dt_s: 2e-6,
            errors: vec![error("temperature", temperature), error("positions", 0.0)],
            ..Decision::default()
        };
        let reports = [("thermal".to_owned(), Done { solve_s: 0.5, ..Done::default() })].into();
        let version = Version { iteration, ..Version::first(1) };
        Outcome { decision, version, iteration: iteration.into(), reports }
    }

    fn value(points: &[Point], path: &str) -> Option<f64> {
        points.iter().find(|point| point.path == path).map(|point| point.value)
    }

    #[test]
    fn errors_are_shown_as_decades_above_their_tolerance_and_zeros_at_the_floor() {
        let accepted = |last: u32| {
            let mut plots = Plots::default();
            (1..=last).for_each(|iteration| plots.iteration(&outcome(iteration)));
            let points = plots.accepted(&outcome(last), &Ledger::default());
            let value = |path| value(&points, path).unwrap();
            ["convergence/accepted", "convergence/fields/temperature", "convergence/fields/positions"].map(value)
        };
        for (last, expected) in [(1, [6.0, 6.0, FLOOR]), (3, [2.0, 4.0, FLOOR]), (4, [FLOOR, 4.0, FLOOR])] {
            let found = accepted(last);
            assert!(found.iter().zip(expected).all(|(found, it)| (found - it).abs() < 1e-12), "{last}: {found:?}");
        }
    }

    #[test]
    fn a_step_sums_up_its_iterations() {
        let mut plots = Plots::default();
        plots.iteration(&outcome(1));
        plots.iteration(&outcome(2));
        let points = plots.accepted(&outcome(2), &Ledger::default());
        assert_eq!(value(&points, "iterations/per_step"), Some(2.0));
        assert_eq!(value(&points, "cost/thermal"), Some(1000.0));
        assert_eq!(value(&points, "window/dt"), Some(2.0));
        plots.iteration(&outcome(3));
        assert_eq!(value(&plots.accepted(&outcome(3), &Ledger::default()), "iterations/per_step"), Some(1.0));
    }

    #[test]
    fn energies_are_drawn_by_node_and_a_leak_shows() {
        let mut ledger = Ledger::default();
        ledger.book("optics", &[Energy::gained("laser", 2.0), Energy::lost("absorbed", 2.0)]);
        ledger.book("thermal", &[Energy::stored("heat", 1.5), Energy::gained("absorbed", 2.0)]);
        let points = energies(&ledger);
        assert_eq!(value(&points, "energy/heat/optics/lost/absorbed"), Some(2000.0));
        // Half a joule of two is missing.
        assert_eq!(value(&points, "imbalance/thermal"), Some(-0.25e6));
        assert_eq!(value(&points, "imbalance/optics"), Some(0.0));
    }

    #[test]
    fn what_has_no_place_is_a_curve() {
        let step = step([
            field("pool_width", "m", "solid", 1, vec![1e-4]),
            field("charge", "C", "electrodes", 1, vec![1.0, -1.0]),
            field("direction", "1", "solid", 3, vec![1.0, 0.0, 0.0]),
            field("positions", "m", "particles", 3, vec![0.0; 3]),
            field("radii", "m", "particles", 1, vec![1.0]),
            field("temperature", "K", "particles", 1, vec![300.0]),
        ]);
        let points = Plots::default().state(&step, &Layers::default().coloured(&step));
        let found: Vec<_> = points.iter().map(|point| (point.path.as_str(), point.value)).collect();
        let expected = [
            ("fields/temperature/mean", 300.0),
            ("fields/temperature/maximum", 300.0),
            ("numbers/charge/0", 1.0),
            ("numbers/charge/1", -1.0),
            ("numbers/pool_width", 1e-4),
        ];
        assert_eq!(found, expected);
    }
}
