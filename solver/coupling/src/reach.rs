//! Whether an iteration can reach its tolerances at all.

use stagger_messages::Plan;

use super::{Acceleration, Settings, systems};
use crate::math;

/// What a relaxation by a constant cannot reach, in words: one line a field, empty where all is well.
///
/// Where the feedback is weak, as it is in a small step, an iterate x + ω (x̃ − x) leaves |1 − ω| of the residual. The K-th
/// iteration's is |1 − ω|^(K−1) of the first, whatever the step; where that is above the tolerance, steps are accepted
/// only where the first change was small already.
#[must_use]
pub fn out_of_reach(plan: &Plan, settings: &Settings) -> Vec<String> {
    let mut told = Vec::new();
    for system in systems(plan, settings) {
        let Acceleration::Constant { relaxation } = system.method else { continue };
        let rate = (1.0 - relaxation).abs();
        let left = math::powi(rate, i32::try_from(settings.iterations).unwrap_or(i32::MAX).saturating_sub(1));
        for source in &system.fields {
            let tolerance = settings.tolerance_of(&source.field);
            if left <= tolerance {
                continue;
            }
            let needed = 1.0 + (math::ln(tolerance) / math::ln(rate)).ceil();
            let field = &source.field;
            let enough = if needed <= MOST { format!("coupling.iterations = {needed}, ") } else { String::new() };
            told.push(format!(
                "coupling.acceleration: `{field}` may never converge. A constant relaxation of {relaxation} leaves {rate:.3} of a \
                 change in each iteration where the feedback is weak, {left:.1e} after coupling.iterations = {}, and its tolerance \
                 is {tolerance:.1e}: a smaller step does not help. Set {enough}acceleration = \"aitken\" or \"iqn-ils\", a \
                 relaxation nearer to 1, or a tolerance above {left:.1e}",
                settings.iterations
            ));
        }
    }
    told
}

/// The most iterations a scene may ask for.
const MOST: f64 = 100.0;

#[cfg(test)]
mod tests {
    use stagger_messages::{Measure, NodePlan, Source};

    use super::*;
    use crate::{FieldSettings, StepSize};

    /// Two nodes that read each other; the first reads from the iteration before.
    fn plan() -> Plan {
        let source = |writer: &str, field: &str, same_iteration| Source {
            writer: writer.into(),
            field: field.into(),
            measure: Measure::Magnitude.into(),
            same_iteration,
            ..Source::default()
        };
        let node = |node: &str, source| NodePlan { node: node.into(), sources: vec![source] };
        let nodes = vec![node("a", source("b", "y", false)), node("b", source("a", "x", true))];
        Plan { nodes, order: vec!["a".into(), "b".into()], ..Plan::default() }
    }

    fn told(acceleration: Acceleration, iterations: u32) -> Vec<String> {
        let dt = StepSize { start_s: 1.0, limit_s: 1.0, minimum_s: 1e-3, growth: 2.0 };
        out_of_reach(&plan(), &Settings { acceleration, iterations, ..Settings::new(dt) })
    }

    #[test]
    fn a_constant_half_needs_twenty_one_iterations_for_a_millionth() {
        let half = Acceleration::Constant { relaxation: 0.5 };
        let lines = told(half, 8);
        assert_eq!(lines.len(), 1);
        for word in ["`y`", "7.8e-3", "1.0e-6", "coupling.iterations = 21"] {
            assert!(lines[0].contains(word), "{word}: {}", lines[0]);
        }
        // 2^-20 is below a millionth, 2^-19 is not.
        assert_eq!((told(half, 20).len(), told(half, 21).len()), (1, 0));
        assert!(told(Acceleration::Constant { relaxation: 0.99 }, 8).is_empty());
        assert!(told(Acceleration::Constant { relaxation: 1.0 }, 2).is_empty());
        assert!(told(Acceleration::Aitken { relaxation: 0.5 }, 8).is_empty());
    }

    #[test]
    fn a_field_of_its_own_method_and_tolerance_is_looked_at_by_itself() {
        let dt = StepSize { start_s: 1.0, limit_s: 1.0, minimum_s: 1e-3, growth: 2.0 };
        let mut settings = Settings::new(dt);
        let acceleration = Some(Acceleration::Constant { relaxation: 1.9 });
        settings.fields.insert("y".into(), FieldSettings { acceleration, absolute: None });
        // 0.9^7 is 0.48: no relaxation this far from 1 comes near in a hundred iterations.
        let lines = out_of_reach(&plan(), &settings);
        assert!(lines.len() == 1 && lines[0].contains("4.8e-1") && !lines[0].contains("iterations = 1"), "{lines:?}");
        settings.tolerance.insert("y".into(), 0.5);
        assert!(out_of_reach(&plan(), &settings).is_empty());
    }
}
