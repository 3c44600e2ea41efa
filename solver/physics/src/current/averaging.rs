//! The monograph's averaging of current densities over contacts (Zohdi 2018, eqs. 8.13–8.14).

use std::f64::consts::PI;

use stagger_coupling::{SolveError, math};
use stagger_messages::Fields;

use super::{Current, Drive, Flow, graph::Graph, network::Network};

impl Current {
    /// The monograph's averaging (Zohdi 2018, eqs. 8.13–8.14): J_i = Σ_j A_ij J_j / Σ_j A_ij over the particles j that touch
    /// particle i. A particle that touches an electrified wall holds that wall's J (the mean by area, of several). H = a J² V/σ
    /// (eq. 8.6).
    ///
    /// This is Laplace's equation on the graph of contacts, weighted by their areas. It spreads J without conserving charge:
    /// a dead end carries as much as its neck. No potential follows from it, and the power drawn is booked as what is heated.
    pub(super) fn averaged(
        &self,
        heat_share: f64,
        fields: &Fields,
        radii_m: &[f64],
        conductivity_s_m: &[f64],
        start: &[f64],
    ) -> Result<Flow, SolveError> {
        let network = Network::new(fields, radii_m.len(), &self.of_walls, |contact, _, _| Ok(contact.area_m2))?;
        let held = self.held(&network, radii_m.len());
        let mut graph = Graph::new(radii_m.len());
        for &(i, j, area_m2) in &network.pairs {
            match (held[i as usize], held[j as usize]) {
                (None, None) => graph.edges.push((i, j, area_m2)),
                (None, Some(value)) => graph.links.push((i, value, area_m2)),
                (Some(value), None) => graph.links.push((j, value, area_m2)),
                (Some(_), Some(_)) => {}
            }
        }
        let solved = graph.solve(&self.settings.solver, start)?;
        let values: Vec<f64> = held.iter().zip(solved.values).map(|(held, free)| held.unwrap_or(free)).collect();
        let mut terminals = network.terminals(&self.electrodes);
        for touch in &network.touches {
            terminals[touch.electrode].current_a += values[touch.particle as usize] * touch.area_m2;
        }
        let heating = values.iter().zip(radii_m.iter().zip(conductivity_s_m));
        let joule_w: Vec<f64> = heating
            .map(|(j, (&radius_m, sigma))| heat_share * j * j * 4.0 / 3.0 * PI * math::powi(radius_m, 3) / sigma)
            .collect();
        let floating = solved.floats.iter().zip(&held).filter(|(floats, held)| **floats && held.is_none()).count();
        Ok(Flow {
            electrical_w: joule_w.iter().sum(),
            current_density_a_m2: values.iter().map(|j| j.abs()).collect(),
            values,
            joule_w,
            terminals,
            iterations: solved.iterations,
            residual: solved.residual,
            floating,
        })
    }

    /// The current density that each particle at an electrified wall holds, in A/m².
    fn held(&self, network: &Network, count: usize) -> Vec<Option<f64>> {
        let mut sums = vec![[0.0; 2]; count];
        for touch in &network.touches {
            if let Drive::CurrentDensity(j) = self.electrodes[touch.electrode].drive {
                let [weighted, area_m2] = &mut sums[touch.particle as usize];
                *weighted += j * touch.area_m2;
                *area_m2 += touch.area_m2;
            }
        }
        sums.into_iter().map(|[weighted, area_m2]| (area_m2 > 0.0).then(|| weighted / area_m2)).collect()
    }
}
