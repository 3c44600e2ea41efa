//! Light that arrives at the upper face, as heat in the cells below it.

use stagger_coupling::math;

use super::settings::Light;
use crate::common::grid::CellGrid;

/// What became of the light, in W.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lit {
    /// Reflected at the surface.
    pub(super) reflected_w: f64,
    /// Left through the lower face.
    pub(super) through_w: f64,
}

/// Shares of the light that enters which each layer of cells takes, from the uppermost down, and the share that leaves below
/// (Zohdi 2018, eqs. 5.90–5.92: dI/dζ = −a I downwards).
pub(super) struct Layers {
    absorptivity: f64,
    /// Of the layers across z, lowest first.
    shares: Vec<f64>,
    through: f64,
    columns: usize,
}

impl Layers {
    pub(super) fn new(grid: &CellGrid, light: Light) -> Self {
        let widths_m = grid.widths_m(2);
        let columns = grid.layer(2, true).len();
        let (mut shares, mut left) = (vec![0.0; widths_m.len()], 1.0);
        match light.absorption_1_m {
            None => {
                if let Some(top) = shares.last_mut() {
                    *top = 1.0;
                }
                left = 0.0;
            }
            Some(absorption_1_m) => {
                for (share, width_m) in shares.iter_mut().zip(&widths_m).rev() {
                    *share = left * -math::exp_m1(-absorption_1_m * width_m);
                    left -= *share;
                }
            }
        }
        Self { absorptivity: light.absorptivity, shares, through: left, columns }
    }

    /// Adds to the power of each cell what it takes of the light on its column, in W.
    pub(super) fn add(&self, arrived_w: &[f64], power_w: &mut [f64]) -> Lit {
        let arrived = arrived_w.iter().sum::<f64>();
        for (layer, share) in self.shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let cells = &mut power_w[layer * self.columns..][..self.columns];
            for (power_w, arrived_w) in cells.iter_mut().zip(arrived_w) {
                *power_w += self.absorptivity * share * arrived_w;
            }
        }
        Lit { reflected_w: (1.0 - self.absorptivity) * arrived, through_w: self.absorptivity * self.through * arrived }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_takes_what_beer_and_lambert_say() {
        let grid = CellGrid::regular("slab", [0.0; 3], [1.0, 1.0, 2.0], [1, 1, 40]);
        let (absorption_1_m, absorptivity) = (1.5, 0.4);
        let layers = Layers::new(&grid, Light { absorptivity, absorption_1_m: Some(absorption_1_m) });
        let mut power_w = vec![0.0; grid.len()];
        let lit = layers.add(&[10.0], &mut power_w);
        let within: f64 = power_w[20..].iter().sum();
        let expected = 10.0 * absorptivity * (1.0 - (-absorption_1_m * 1.0f64).exp());
        assert!((within - expected).abs() < 1e-14 * 10.0, "{within} instead of {expected}");
        let all = power_w.iter().sum::<f64>() + lit.reflected_w + lit.through_w;
        assert!((all - 10.0).abs() < 1e-13, "{all}");
        let surface = Layers::new(&grid, Light { absorptivity, absorption_1_m: None });
        let mut power_w = vec![0.0; grid.len()];
        assert_eq!(surface.add(&[10.0], &mut power_w), Lit { reflected_w: 6.0, through_w: 0.0 });
        assert_eq!((power_w[39], power_w[38]), (4.0, 0.0));
    }
}
