//! Newton's method with conjugate gradients for the balance of a window.

use super::balance::{Balance, Inserted};
use crate::common::linear::{Symmetric, conjugate_gradient};

/// Iterations of conjugate gradients in one of Newton's; where they do not suffice, Newton goes on from what they found.
const LINEAR_ITERATIONS: u32 = 2000;
/// Loosest tolerance of a linear solve: far from the solution a better one is wasted.
const LOOSEST: f64 = 1e-3;
/// Share of the slope along a step up to which a shorter one is as good, and halvings after which any is taken.
const FLAT: f64 = 0.1;
const HALVINGS: u32 = 40;

/// Moves the trial temperatures z by one step of Newton's method; returns the iterations of conjugate gradients.
///
/// With A = φ Δt (conductances and slopes of the ambient), D = dθ/dE and S = √D, z + D A z linearises to
///
/// (I + S A S) y = S A ρ,   δz = S y − ρ,   ρ = z − θ(E)
///
/// which is symmetric and positive definite even where D = 0: while a phase changes at one temperature, E moves and θ does
/// not. Equations whose θ(E) bends and jumps in slope would let Newton cycle at large Δt. They are the gradient of a convex
/// function of z (of A z, Σ∫θ dE and ½ z·A z), so a step is cut where that function stops falling along it: semismooth
/// Newton with a line search (Qi & Sun 1993), which ends for every Δt. A trial along the step costs no heat flow.
pub(super) fn improve(balance: &Balance<'_>, inserted: &Inserted, tolerance: f64, trial_k: &mut [f64]) -> u32 {
    let rows = trial_k.len();
    let residual_k: Vec<f64> =
        trial_k.iter().zip(&inserted.temperatures_k).map(|(trial, found)| trial - found).collect();
    let roots: Vec<f64> = inserted.slopes_k_j.iter().map(|slope| slope.sqrt()).collect();
    let outflow_j_k: Vec<f64> = (0..rows).map(|i| balance.outflow_j_k(i, trial_k[i])).collect();
    let network = &balance.network;
    // A times a vector: what leaves through contacts, and what the ambient takes more.
    let outflow = |change_k: &[f64]| {
        let mut outflow_j = vec![0.0; rows];
        network.response(change_k, &mut outflow_j);
        for (i, outflow_j) in outflow_j.iter_mut().enumerate() {
            let ambient_j_k = outflow_j_k[i] - balance.weight_s * network.at_particle_w_k[i];
            *outflow_j = ambient_j_k * change_k[i] - balance.weight_s * *outflow_j;
        }
        outflow_j
    };

    let right: Vec<f64> = outflow(&residual_k).iter().zip(&roots).map(|(outflow, root)| outflow * root).collect();
    let diagonal = outflow_j_k.iter().zip(&roots).map(|(outflow, root)| 1.0 + outflow * root * root).collect();
    let couplings = network.between_particles().map(|(i, j, conductance_w_k)| {
        (i, j, -balance.weight_s * conductance_w_k * roots[i as usize] * roots[j as usize])
    });
    let matrix = Symmetric::new(diagonal, couplings);
    // What is left of the linear equations, times S, is left of ρ.
    let norm = conjugate_gradient::dot(&right, &right).sqrt();
    let steepest = roots.iter().fold(0.0_f64, |most, &root| most.max(root));
    let wanted = 0.5 * tolerance * inserted.largest_k;
    let reach = norm * steepest;
    let linear_tolerance = if reach > 0.0 { (wanted / reach).clamp(1e-15, LOOSEST) } else { LOOSEST };
    let mut solution = vec![0.0; rows];
    let outcome = conjugate_gradient::solve(&matrix, &right, &mut solution, linear_tolerance, LINEAR_ITERATIONS);

    let step_k: Vec<f64> = (0..rows).map(|i| roots[i] * solution[i] - residual_k[i]).collect();
    let outflow_j = outflow(&step_k);
    let share = share_of_step(balance, inserted, trial_k, &step_k, &outflow_j);
    for (trial_k, step_k) in trial_k.iter_mut().zip(&step_k) {
        *trial_k += share * step_k;
    }
    outcome.iterations
}

/// Share of a step up to which the convex function falls, to within [`FLAT`]; 1 where it falls all along.
fn share_of_step(
    balance: &Balance<'_>,
    inserted: &Inserted,
    trial_k: &[f64],
    step_k: &[f64],
    outflow_j: &[f64],
) -> f64 {
    // The derivative along the step: A δz · (z − θ(E)), with E falling by A δz.
    let slope = |share: f64| {
        (0..trial_k.len()).fold(0.0, |sum, i| {
            let energy_j = inserted.energies_j[i] - share * outflow_j[i];
            let found_k = balance.curve(i).place(energy_j / balance.masses_kg[i]).temperature_k;
            sum + outflow_j[i] * (trial_k[i] + share * step_k[i] - found_k)
        })
    };
    let at_start = slope(0.0);
    let flat = FLAT * at_start.abs();
    // Roundings make a slope of no meaning positive: then the step is as good as any.
    if at_start >= 0.0 || slope(1.0) <= flat {
        return 1.0;
    }
    let (mut falls, mut rises) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (falls + rises);
        let here = slope(middle);
        if here.abs() <= flat {
            return middle;
        }
        if here < 0.0 {
            falls = middle;
        } else {
            rises = middle;
        }
    }
    0.5 * (falls + rises)
}
