//! Light that the particles reflect and absorb, ray by ray (Zohdi 2018, ch. 10).

use std::f64::consts::PI;

use nalgebra::Vector3;
use stagger_coupling::SolveError;

use super::{NODE, Share, Surface, settings::Settings};
use crate::common::{
    SolidSurface,
    beam::Frame,
    checks::{positive, setting},
    rays::{Grid, Ray, Sampling, Strike, facing, paths_m, points_m, reflectance, spheres, starts, trace_onto},
};

/// A beam sampled by rays, each with the same power, and what they meet.
pub(super) struct Rays {
    /// Where they pass the beam's cross-section, in m from its axis.
    points_m: Vec<[f64; 2]>,
    sampling: Sampling,
    surface: Surface,
    walls: Vec<[f64; 3]>,
    /// Half the side of the square that a ray stands for where half of the power lies, in m.
    half_width_m: f64,
}

impl Rays {
    pub(super) fn new(settings: &Settings, sampling: Sampling, surface: Surface) -> Self {
        let points_m = points_m(&settings.beam.profile, &sampling);
        let half_width_m =
            0.5 * settings.beam.profile.quantile_m(0.5) * (2.0 * PI / sampling.count.max(1) as f64).sqrt();
        let walls = facing(&settings.walls, settings.beam.direction);
        Self { points_m, sampling, surface, walls, half_width_m }
    }

    /// Whether molten particles reflect otherwise than solid ones.
    pub(super) fn may_melt(&self) -> bool {
        self.surface.molten.is_some()
    }

    pub(super) fn count(&self) -> usize {
        self.points_m.len()
    }

    /// Share of the beam's power that each particle and each cell of the solid takes, what becomes of the rest, and where some
    /// rays go. `melted` are the particles' liquid shares; none are molten where it is `None`.
    pub(super) fn absorbed(
        &self,
        frame: &Frame,
        spot_m: Vector3<f64>,
        positions_m: &[f64],
        radii_m: &[f64],
        melted: Option<&[f64]>,
        solid: Option<&SolidSurface>,
    ) -> Share {
        let grid = Grid::new(spheres(positions_m, radii_m));
        let rays = starts(frame, spot_m, &self.points_m, &grid);
        let reflected = |strike: &Strike| {
            let melted = melted.map_or(0.0, |melted| melted[strike.sphere as usize]);
            self.surface.reflects(strike.cosine, melted)
        };
        let share = 1.0 / rays.len() as f64;
        let mut values = vec![0.0; radii_m.len()];
        let surface = |strike: &Strike| {
            let reflected = reflected(strike);
            (reflected, strike.power * (1.0 - reflected))
        };
        let mut arrived = vec![0.0; solid.map_or(0, SolidSurface::len)];
        let lands = |ray: &Ray| solid?.met(ray.origin, ray.direction);
        let land = |point, power| {
            if let Some(solid) = solid {
                solid.spread(point, self.half_width_m, power, &mut arrived);
            }
        };
        let add = |particle: u32, absorbed: f64| values[particle as usize] += absorbed * share;
        let outcome = trace_onto(&grid, &rays, self.sampling.limits, &self.walls, surface, add, (lands, land));
        let paths_m = paths_m(&grid, &rays, self.sampling.limits, reflected);
        values.extend(arrived);
        Share { values, traced: Some((outcome, paths_m)) }
    }
}

impl Surface {
    /// Refuses settings outside their range.
    pub(super) fn check(&self) -> Result<(), SolveError> {
        positive(NODE, "magnetic permeability", self.permeability)?;
        for index in [Some(self.solid), self.molten].into_iter().flatten() {
            positive(NODE, "refractive index", index.real)?;
            let k = index.extinction;
            setting(NODE, "extinction", k, k.is_finite() && k >= 0.0, "finite and at least 0")?;
        }
        Ok(())
    }

    /// Share of the light that a particle reflects, of which the share `melted` is liquid: its surface is taken to be so by
    /// that share. A switch at one half would make the power jump, and the coupling would iterate about the jump.
    #[must_use]
    pub fn reflects(&self, cosine: f64, melted: f64) -> f64 {
        let solid = || reflectance(self.solid, self.permeability, cosine);
        match self.molten.filter(|_| melted > 0.0) {
            None => solid(),
            Some(molten) => {
                let melted = melted.min(1.0);
                let liquid = reflectance(molten, self.permeability, cosine);
                if melted < 1.0 { (1.0 - melted) * solid() + melted * liquid } else { liquid }
            }
        }
    }
}
