//! `stagger check`: whether a scene can run, and who reads what from whom.

use std::{collections::BTreeMap, fmt::Write as _};

use stagger_messages::{Plan, Ports};
use stagger_solver::{
    coupling::{self, PlanError},
    scene::Scene,
};

use crate::roster::{RosterError, Runs, participant, roster};

/// Why a scene cannot run.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// A node cannot be built.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// The nodes do not fit together.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// Ports of the nodes that can be asked without starting them, and the names of those that cannot.
///
/// # Errors
/// A node cannot be built.
pub fn ports(scene: &Scene) -> Result<(BTreeMap<String, Ports>, Vec<String>), RosterError> {
    let mut ports = BTreeMap::new();
    let mut commands = Vec::new();
    for (node, runs) in roster(scene) {
        match runs {
            Runs::Physics(kind) => {
                let built = participant(scene, &node, &kind)?;
                ports.insert(node, built.ports());
            }
            Runs::Command(_) => commands.push(node),
        }
    }
    Ok((ports, commands))
}

/// Checks a scene before anything is started. Where a command takes part, its ports are known only when it runs, and
/// the fit is checked then.
///
/// # Errors
/// A node cannot be built, or the nodes do not fit together.
pub fn check(scene: &Scene) -> Result<Option<Plan>, CheckError> {
    let (ports, commands) = ports(scene)?;
    Ok(fit(scene, &ports, &commands)?)
}

fn fit(scene: &Scene, ports: &BTreeMap<String, Ports>, commands: &[String]) -> Result<Option<Plan>, PlanError> {
    commands.is_empty().then(|| coupling::plan(ports, &scene.coupling)).transpose()
}

/// The settings in force and the exchange of fields, as text.
///
/// # Errors
/// As [`check`].
pub fn describe(scene: &Scene) -> Result<String, CheckError> {
    // Once: building a physics may place its particles.
    let (ports, commands) = ports(scene)?;
    let plan = fit(scene, &ports, &commands)?;
    let mut text = format!("{}\n\nsettings in force (* from the scene)\n", scene.title);
    for value in &scene.effective {
        let mark = if value.is_default { ' ' } else { '*' };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {mark} {:<40} {}", value.path, value.value);
    }
    text.push_str("\nwho reads what, in the order of solving\n");
    if let Some(plan) = plan {
        for node in &plan.nodes {
            let _ = writeln!(text, "  {}", node.node);
            for source in &node.sources {
                let when = if source.same_iteration { "this iteration" } else { "the iteration before" };
                let _ = writeln!(text, "    reads  {:<24} from {}, {when}", source.field, source.writer);
            }
            for port in ports.get(&node.node).map(|ports| ports.writes.as_slice()).unwrap_or_default() {
                let read = plan.nodes.iter().any(|other| other.sources.iter().any(|s| s.field == port.field));
                let to = if read { "" } else { "  (recorded only)" };
                let _ = writeln!(
                    text,
                    "    writes {:<24} {} x {} on {}{to}",
                    port.field, port.components, port.unit, port.support
                );
            }
        }
    } else {
        let _ = writeln!(text, "  known when it runs: {} are commands of their own", commands.join(", "));
    }
    Ok(text)
}
