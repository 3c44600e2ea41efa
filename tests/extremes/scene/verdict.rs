//! What may come of a scene: a finite, conserved result, or an error that names its cause.

use stagger_coupling::{Account, Ledger};
use stagger_physics::particles::{Integrator, Settings};
use stagger_scene::Scene;

use super::{
    keys::numeric,
    run::{Base, End, Sets},
};

/// What came of it, where it was right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The check refused it.
    Refused,
    /// It stopped, and said why.
    Stopped,
    /// It ran, but the energy of the motion is off by more than [`MOTION`].
    Coarse,
    /// It ran; where it is too large for that, it was read.
    Ran,
}

/// Sums of thousands of terms, over the energy turned over: what a balance by construction is off by.
const ROUNDING: f64 = 1e-9;
/// Rounding of what is held, of which the energy turned over may be any part.
const HELD: f64 = 1e-12;
/// What Verlet's rule is off by at 25 substeps to the shortest contact, and in a scene of a few impacts.
const MOTION: f64 = 0.1;

/// Runs a scene with overrides; the error is what is wrong with what came of it.
pub fn judge(base: &Base, sets: &Sets) -> Result<Outcome, String> {
    match base.run(sets) {
        End::Refused(problems) => {
            if problems.list.is_empty() {
                return Err("refused without a problem".into());
            }
            for problem in &problems.list {
                if problem.location.is_empty() || problem.key.is_empty() || problem.message.is_empty() {
                    return Err(format!("refused without a place, a key or a reason: {problem:?}"));
                }
            }
            Ok(Outcome::Refused)
        }
        End::Stopped { cause } => {
            if names_a_cause(&cause) {
                Ok(Outcome::Stopped)
            } else {
                Err(format!("stopped without a cause: {cause}"))
            }
        }
        End::Large => Ok(Outcome::Ran),
        End::Ran { not_finite: Some(what), .. } => Err(format!("ran, but {what} is not finite")),
        End::Ran { ledger, volume_m3, highest_k, not_finite: None } => {
            let scene = base.parse(sets).map_err(|problems| problems.to_string())?;
            conserved(&ledger, &scene, volume_m3 * highest_k)
        }
    }
}

/// Whether an error says which node it is about, and what of it: a field, a row, a key, a wall, a particle.
fn names_a_cause(cause: &str) -> bool {
    let nodes = [
        "particles",
        "thermal",
        "optics",
        "second",
        "current",
        "substrate",
        "acoustics",
        "solid",
        "wall `",
        "dispenser `",
    ];
    let named = nodes.iter().any(|node| cause.contains(node))
        || cause.contains("` did not converge in")
        || cause.contains("the change of `");
    // A solver that gives up says why.
    let silent = cause.contains("did not converge.");
    let word = |name: &str| cause.contains(name);
    let about = word("`") || numeric().iter().any(|(_, key)| word(key.name)) || word("particle ") || word("region");
    named && about && !silent
}

/// Whether the energy of each node and of each exchange between them is accounted for. `volume_k_m3` is Σ V θ.
fn conserved(ledger: &Ledger, scene: &Scene, volume_k_m3: f64) -> Result<Outcome, String> {
    let mut outcome = Outcome::Ran;
    for (node, account) in ledger.nodes() {
        let share = match (node.as_str(), scene.settings::<Settings>(), scene.physics.get("current")) {
            ("particles", Some(Settings { integrator: Integrator::Verlet { substep_s: None }, .. }), _) => MOTION,
            // Where the scene sets the step, the energy is as wrong as the step is coarse.
            ("particles", ..) => f64::MAX,
            // As exact as its equations are solved.
            ("current", _, Some(_)) => ROUNDING + 100.0 * largest(scene, "current.tolerance"),
            _ => ROUNDING,
        };
        // Heat is known by temperatures, whatever part of it moves: half of the digits of a temperature at 1 K.
        let heat_j = if node == "thermal" { heat_j(scene, volume_k_m3) } else { 0.0 };
        let bound = share * account.turned_over() + HELD * (held(account) + heat_j) + f64::MIN_POSITIVE;
        let imbalance = account.imbalance().abs();
        if imbalance > bound && node == "particles" {
            outcome = Outcome::Coarse;
        } else if imbalance > bound {
            return Err(format!("ran, but {node} is off by {imbalance:e} J, more than {bound:e} J"));
        }
    }
    // What is handed over is as exact as the iteration: a reader may have solved with the iterate before.
    let iterated = ROUNDING + 2.0 * largest(scene, "tolerance");
    for (name, share) in ledger.imbalances() {
        if name.contains(": ") && share.abs() > iterated {
            return Err(format!("ran, but of {name} {share:e} is lost on the way"));
        }
    }
    Ok(outcome)
}

/// The largest number in effect under a key's name.
fn largest(scene: &Scene, name: &str) -> f64 {
    let named = scene.effective.iter().filter(|value| value.path.contains(name));
    named.flat_map(|value| &value.si).copied().fold(0.0, f64::max)
}

/// Heat from 0 K on of the heaviest material, in J.
fn heat_j(scene: &Scene, volume_k_m3: f64) -> f64 {
    // Where the scene says nothing of them, they are a metal's.
    let per_k_m3 = largest(scene, "density").max(1e4) * largest(scene, "heat-capacity").max(1e3);
    per_k_m3 * volume_k_m3
}

/// All energies of an account, whatever their signs.
fn held(account: &Account) -> f64 {
    let sides = [&account.initial, &account.stored, &account.gained, &account.lost];
    sides.into_iter().flat_map(|side| side.values()).map(|joule| joule.abs()).sum()
}
