//! Kirchhoff's laws on the network of contacts: potentials, currents and Joule heat.

use std::f64::consts::PI;

use stagger_coupling::SolveError;
use stagger_messages::Fields;

use super::{Current, Drive, Flow, graph::Graph, network::Network};
use crate::common::Conductance;

impl Current {
    /// Kirchhoff's laws on the network of contacts: Σ_j G_ij (V_j − V_i) = 0 at every particle, with the contact
    /// conductances G of [`Conductance`] and the σ_ij that belongs to them: the arithmetic mean of σ_i and σ_j for the monograph's,
    /// the harmonic one for the constriction, where the two are in series.
    ///
    /// Walls are conductors of one potential each: given, or such that the given current flows out of the wall. A current
    /// that finds no way to a wall of given potential does not flow. A cluster that touches no electrified wall carries
    /// nothing and has the potential 0.
    ///
    /// A contact turns G (V_i − V_j)² into heat, half of it in each particle; one with a wall heats the particle alone, whose
    /// own resistance it stands for. The sum over all contacts is the power the walls give, Σ_w V_w I_w, but for Σ_i V_i r_i
    /// with the solver's residuals r. Conserving charge and energy is what the monograph's averaging does not do.
    ///
    /// `current_density` is the current through a particle, ½ Σ_j |I_ij|, over its largest cross-section π R².
    pub(super) fn potentials(
        &self,
        model: Conductance,
        fields: &Fields,
        radii_m: &[f64],
        conductivity_s_m: &[f64],
        start: &[f64],
    ) -> Result<Flow, SolveError> {
        let count = radii_m.len();
        let network = Network::new(fields, count, &self.of_walls, |contact, i, j| {
            let own = conductivity_s_m[i];
            let sigma_s_m = j.map_or(own, |j| model.between(own, conductivity_s_m[j]));
            contact.conductance(super::NODE, model, sigma_s_m)
        })?;
        // Behind the particles, a node for each electrified wall; only those driven by a current are connected.
        let node = |electrode: usize| (count + electrode) as u32;
        let mut graph = Graph::new(count + self.electrodes.len());
        graph.edges.clone_from(&network.pairs);
        for touch in &network.touches {
            match self.electrodes[touch.electrode].drive {
                Drive::Potential(volt) => graph.links.push((touch.particle, volt, touch.weight)),
                Drive::Current(_) => graph.edges.push((touch.particle, node(touch.electrode), touch.weight)),
                Drive::CurrentDensity(_) => {}
            }
        }
        for (electrode, it) in self.electrodes.iter().enumerate() {
            if let Drive::Current(ampere) = it.drive {
                graph.sources.push((node(electrode), ampere));
            }
        }
        let solved = graph.solve(&self.settings.solver, start)?;

        let mut terminals = network.terminals(&self.electrodes);
        for (electrode, terminal) in terminals.iter_mut().enumerate() {
            terminal.potential_v = match self.electrodes[electrode].drive {
                Drive::Potential(volt) => volt,
                _ => solved.values[count + electrode],
            };
        }
        let (mut joule_w, mut through_a) = (vec![0.0; count], vec![0.0; count]);
        for &(i, j, conductance_s) in &network.pairs {
            let (i, j) = (i as usize, j as usize);
            let drop_v = solved.values[i] - solved.values[j];
            let current_a = conductance_s * drop_v;
            for side in [i, j] {
                joule_w[side] += 0.5 * current_a * drop_v;
                through_a[side] += 0.5 * current_a.abs();
            }
        }
        for touch in &network.touches {
            let terminal = &mut terminals[touch.electrode];
            let particle = touch.particle as usize;
            let drop_v = terminal.potential_v - solved.values[particle];
            let current_a = touch.weight * drop_v;
            terminal.current_a += current_a;
            joule_w[particle] += current_a * drop_v;
            through_a[particle] += 0.5 * current_a.abs();
        }
        // From the lowest potential, so that what the currents miss to add up to zero is not multiplied by a large number.
        let lowest_v = terminals.iter().map(|terminal| terminal.potential_v).fold(f64::INFINITY, f64::min);
        let given = terminals.iter().map(|terminal| (terminal.potential_v - lowest_v) * terminal.current_a);
        let electrical_w = given.fold(0.0, |sum, power_w| sum + power_w);
        let section = through_a.iter().zip(radii_m);
        Ok(Flow {
            electrical_w,
            current_density_a_m2: section.map(|(ampere, radius_m)| ampere / (PI * radius_m * radius_m)).collect(),
            joule_w,
            terminals,
            iterations: solved.iterations,
            residual: solved.residual,
            floating: solved.floats[..count].iter().filter(|floats| **floats).count(),
            values: solved.values,
        })
    }
}
