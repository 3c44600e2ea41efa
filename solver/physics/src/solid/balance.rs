//! The implicit equations of a window, solved by Newton's method with multigrid-preconditioned conjugate gradients.

use rayon::prelude::*;

use super::{
    faces::{Faces, Lost},
    matter::{CHUNK, Matter},
};
use crate::common::{
    grid::{CellGrid, FaceMean, conduction::Conduction, multigrid::Multigrid},
    linear::{
        conjugate_gradient::dot,
        preconditioned::{self, update},
    },
};

/// Iterations of conjugate gradients in one of Newton's; where they do not suffice, Newton goes on from what they found.
const LINEAR_ITERATIONS: u32 = 500;
/// Loosest tolerance of a linear solve: far from the solution a better one is wasted.
const LOOSEST: f64 = 1e-2;
/// Share of the slope along a step up to which a shorter one is as good, and halvings after which any is taken.
const FLAT: f64 = 0.1;
const HALVINGS: u32 = 40;
/// Roundings that an insertion makes of the heat that passes a cell.
const ROUNDINGS: f64 = 8.0;

/// The heat balance of every cell over a window (Zohdi 2018, eqs. 5.34–5.37):
///
/// E(t+Δt) = E(t) + Δt \[ φ F(z) + (1 − φ) F(θ(t)) + H \],   z = θ(E(t+Δt))
///
/// with the enthalpy E of a cell, the temperature θ(E) that follows from it, and the heat flow F. What is iterated is z; E is
/// always its insertion on the right, so that heat in equals heat out to rounding whatever the tolerance, and whatever changes
/// of phase the window crosses. Conductivities that depend on temperature are taken at z.
pub(super) struct Balance<'a> {
    pub(super) grid: &'a CellGrid,
    pub(super) matter: &'a Matter,
    pub(super) faces: &'a Faces,
    pub(super) face_mean: FaceMean,
    /// Share of the conductances that is felt at once; below 1 with second sound.
    pub(super) instant: f64,
    /// E(t) + Δt \[ (1 − φ) F(θ(t)) + H \] in J.
    pub(super) known_j: Vec<f64>,
    /// φ Δt in s; positive.
    pub(super) weight_s: f64,
}

/// How a window ended.
pub(super) struct Solved {
    /// E in J.
    pub(super) energies_j: Vec<f64>,
    /// θ(E) in K.
    pub(super) temperatures_k: Vec<f64>,
    /// What leaves through the faces at z, in W.
    pub(super) lost_w: Lost,
    /// Conductances at z.
    pub(super) conduction: Conduction,
    /// z in K.
    pub(super) trial_k: Vec<f64>,
    pub(super) newton: u32,
    /// Iterations of conjugate gradients.
    pub(super) linear: u32,
    pub(super) converged: bool,
}

/// z inserted on the right.
#[derive(Default)]
struct Inserted {
    energies_j: Vec<f64>,
    temperatures_k: Vec<f64>,
    /// dθ/dE in K/J.
    slopes_k_j: Vec<f64>,
    change: f64,
    rounding: f64,
    largest_k: f64,
}

impl Balance<'_> {
    /// Solves from `trial_k` until insertion changes no temperature by more than `tolerance` of the largest, or than rounding.
    pub(super) fn solve(&self, mut trial_k: Vec<f64>, tolerance: f64, iterations: u32) -> Solved {
        let mut each = Vec::new();
        let mut conduction = None;
        let mut inserted = Inserted::default();
        let mut flow_w = vec![0.0; trial_k.len()];
        let (mut newton, mut linear) = (0, 0);
        loop {
            newton += 1;
            let conductivities = self.matter.conductivities(&trial_k, &mut each);
            let depends = self.matter.conductivity_depends_on_temperature();
            let conduction = match &mut conduction {
                Some(known) if !depends => known,
                other => other.insert(Conduction::new(self.grid, conductivities, self.face_mean).scaled(self.instant)),
            };
            conduction.flow_into(&trial_k, &mut flow_w);
            let lost_w = self.faces.add_flow(conductivities, &trial_k, &mut flow_w);
            // What a cell loses more through the faces for each kelvin it is hotter.
            let mut own_w_k = vec![0.0; trial_k.len()];
            self.faces.add_slopes(conductivities, &trial_k, &mut own_w_k);
            let at_cells_w_k = conduction.at_cells();
            self.insert(&trial_k, &flow_w, [&at_cells_w_k, &own_w_k], &mut inserted);
            let reachable = tolerance.max(inserted.rounding);
            let converged = inserted.change <= reachable;
            if converged || newton >= iterations || !inserted.change.is_finite() {
                let Inserted { energies_j, temperatures_k, .. } = inserted;
                let conduction = std::mem::take(conduction);
                return Solved { energies_j, temperatures_k, lost_w, conduction, trial_k, newton, linear, converged };
            }
            linear += self.improve(conduction, own_w_k, &inserted, reachable, &mut trial_k);
        }
    }

    fn insert(&self, trial_k: &[f64], flow_w: &[f64], outflows_w_k: [&[f64]; 2], inserted: &mut Inserted) {
        let rows = trial_k.len();
        let Inserted { energies_j, temperatures_k, slopes_k_j, .. } = inserted;
        for values in [&mut *energies_j, &mut *temperatures_k, &mut *slopes_k_j] {
            values.resize(rows, 0.0);
        }
        let chunks = energies_j
            .par_chunks_mut(CHUNK)
            .zip(temperatures_k.par_chunks_mut(CHUNK))
            .zip(slopes_k_j.par_chunks_mut(CHUNK))
            .enumerate();
        let most = chunks.map(|(chunk, ((energies_j, temperatures_k), slopes_k_j))| {
            let (mut change_k, mut largest_k, mut stiffness) = (0.0_f64, 0.0_f64, 0.0_f64);
            let values = energies_j.iter_mut().zip(temperatures_k).zip(slopes_k_j);
            for (row, ((energy_j, temperature_k), slope_k_j)) in (chunk * CHUNK..).zip(values) {
                let mass_kg = self.matter.masses_kg[row];
                *energy_j = self.known_j[row] + self.weight_s * flow_w[row];
                let place = self.matter.place(row, *energy_j / mass_kg);
                (*temperature_k, *slope_k_j) = (place.temperature_k, place.slope / mass_kg);
                let away_k = (trial_k[row] - place.temperature_k).abs();
                // `max` would pass over what is no number.
                change_k = if away_k <= change_k { change_k } else { away_k };
                largest_k = largest_k.max(place.temperature_k.abs());
                let outflow_w_k = outflows_w_k[0][row] + outflows_w_k[1][row];
                stiffness = stiffness.max(self.weight_s * outflow_w_k * *slope_k_j);
            }
            [change_k, largest_k, stiffness]
        });
        let [change_k, largest_k, stiffness] = most.reduce(
            || [0.0; 3],
            |one, other| [0, 1, 2].map(|of| if other[of] <= one[of] { one[of] } else { other[of] }),
        );
        inserted.largest_k = largest_k;
        inserted.rounding = ROUNDINGS * f64::EPSILON * stiffness;
        inserted.change = if largest_k > 0.0 { change_k / largest_k } else { change_k };
    }

    /// Moves the trial temperatures z by one step of Newton's method; returns the iterations of conjugate gradients.
    ///
    /// With A the conductances and slopes of the faces, w = φ Δt and D = dθ/dE, the equations linearise to
    ///
    /// (1/(w D) + A) x = A ρ,   δz = x − ρ,   ρ = z − θ(E)
    ///
    /// which is symmetric and positive definite; while a phase changes at one temperature, D and with it x is 0: E moves and θ
    /// does not. A line search as in `thermal` makes it end for every Δt: the equations are the gradient of a convex function.
    fn improve(
        &self,
        conduction: &Conduction,
        own_w_k: Vec<f64>,
        inserted: &Inserted,
        tolerance: f64,
        trial_k: &mut [f64],
    ) -> u32 {
        let rows = trial_k.len();
        let Inserted { temperatures_k, slopes_k_j, .. } = inserted;
        let mut residual_k = vec![0.0; rows];
        update(&mut residual_k, |row, _| trial_k[row] - temperatures_k[row]);
        let mut right_w = vec![0.0; rows];
        conduction.multiply(&own_w_k, &residual_k, &mut right_w);

        let mut diagonal_w_k = own_w_k.clone();
        update(&mut diagonal_w_k, |row, own| own + (self.weight_s * slopes_k_j[row]).recip());
        let steepest = slopes_k_j.par_iter().copied().reduce(|| 0.0, f64::max);
        let mut system = Multigrid::new(self.grid, conduction, diagonal_w_k);
        update(&mut right_w, |row, right| if slopes_k_j[row] > 0.0 { right } else { 0.0 });
        let norm = dot(&right_w, &right_w).sqrt();
        // What is left of the linear equations, times w D, is left of ρ.
        let wanted = 0.5 * tolerance * inserted.largest_k;
        let reach = norm * self.weight_s * steepest;
        let linear_tolerance = if reach > 0.0 { (wanted / reach).clamp(1e-14, LOOSEST) } else { LOOSEST };
        let mut step_k = vec![0.0; rows];
        let outcome = preconditioned::solve(&mut system, &right_w, &mut step_k, linear_tolerance, LINEAR_ITERATIONS);
        drop(system);

        update(&mut step_k, |row, found| found - residual_k[row]);
        let mut outflow_j = right_w;
        conduction.multiply(&own_w_k, &step_k, &mut outflow_j);
        update(&mut outflow_j, |_, outflow| self.weight_s * outflow);
        let share = self.share_of_step(inserted, trial_k, &step_k, &outflow_j);
        update(trial_k, |row, trial| trial + share * step_k[row]);
        outcome.iterations
    }

    /// Share of a step up to which the convex function falls, to within [`FLAT`]; 1 where it falls all along.
    fn share_of_step(&self, inserted: &Inserted, trial_k: &[f64], step_k: &[f64], outflow_j: &[f64]) -> f64 {
        // The derivative along the step: A δz · (z − θ(E)), with E falling by A δz.
        let slope = |share: f64| {
            let partials: Vec<f64> = outflow_j
                .par_chunks(CHUNK)
                .enumerate()
                .map(|(chunk, outflow_j)| {
                    (chunk * CHUNK..).zip(outflow_j).fold(0.0, |sum, (row, outflow_j)| {
                        let energy_j = inserted.energies_j[row] - share * outflow_j;
                        let found_k = self.matter.place(row, energy_j / self.matter.masses_kg[row]).temperature_k;
                        sum + outflow_j * (trial_k[row] + share * step_k[row] - found_k)
                    })
                })
                .collect();
            partials.into_iter().sum::<f64>()
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
            if here < 0.0 { falls = middle } else { rises = middle }
        }
        0.5 * (falls + rises)
    }
}
