//! Settings of the stress in an elastic substrate.

use super::Substrate;
use crate::common::{Bodies, OnSubstrate, PARTICLES};
use serde::Serialize;
use stagger_coupling::SolveError;
use stagger_messages::{Geometry, Measure, Port, Ports};

use super::{NODE, far_field::FarField};
use crate::common::{
    Wall,
    checks::{positive, setting},
    walls::{Motion, Plane, Shape},
};

/// Most points that stress is asked for at.
const POINTS_LIMIT: usize = 10_000_000;

/// Everything the stress in the substrate depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Number of particles at t = 0.
    pub count: usize,
    /// Its surface: a plane at rest.
    pub wall: Wall,
    /// Index of that wall in the scene.
    pub wall_index: u32,
    /// Poisson's ratio ν, above −1 and at most ½.
    pub poisson: f64,
    /// Young's modulus E in Pa where the surface gives way under the particles; `None` is a surface that stays plane.
    pub deflection_young_pa: Option<f64>,
    /// Grids of points at which stress is computed.
    pub grids: Vec<Grid>,
    /// Single points at which stress is computed, in m.
    pub points_m: Vec<[f64; 3]>,
    /// Tolerance of the grouping of far loads (see [`FarField`]); `None` sums every load.
    pub far_field_tolerance: Option<f64>,
}

/// A regular grid: the centres of equal cells of an axis-aligned box, so that the mean over the points is the volume average
/// to second order. A side of no length makes it a plane or a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Grid {
    /// Name in the scene.
    pub name: String,
    /// Lower corner, in m.
    pub lower_m: [f64; 3],
    /// Upper corner, in m; not below the lower one along any axis.
    pub upper_m: [f64; 3],
    /// Side of a cell, in m, which is rounded so that a whole number of cells fits.
    pub spacing_m: f64,
}

impl Grid {
    /// Cells along each axis; at least one.
    #[must_use]
    pub fn counts(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| ((self.upper_m[axis] - self.lower_m[axis]) / self.spacing_m).round().max(1.0) as usize)
    }

    /// The grid as a support: cells whose middles are [`Grid::points_m`]. Along a side of no length the cell has the side
    /// asked for.
    #[must_use]
    pub fn as_support(&self) -> stagger_messages::Grid {
        let counts = self.counts();
        let width = |axis: usize| self.upper_m[axis] - self.lower_m[axis];
        let spacing_m = [0, 1, 2].map(|axis| match width(axis) {
            0.0 => self.spacing_m,
            width => width / counts[axis] as f64,
        });
        let origin_m =
            [0, 1, 2].map(|axis| self.lower_m[axis] - if width(axis) == 0.0 { 0.5 * spacing_m[axis] } else { 0.0 });
        // A count beyond 32 bits is beyond the limit of points; the support then has a fault, which is told.
        stagger_messages::Grid::of_cells(origin_m, spacing_m, counts.map(|count| u32::try_from(count).unwrap_or(0)))
    }

    /// The points, in m; x runs fastest, then y.
    pub fn points_m(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        let [nx, ny, nz] = self.counts();
        let at = move |axis: usize, k: usize, n: usize| {
            let (lower, upper) = (self.lower_m[axis], self.upper_m[axis]);
            lower + (upper - lower) * ((k as f64 + 0.5) / n as f64)
        };
        let rows = (0..nz).flat_map(move |k| (0..ny).map(move |j| (j, k)));
        rows.flat_map(move |(j, k)| (0..nx).map(move |i| [at(0, i, nx), at(1, j, ny), at(2, k, nz)]))
    }
}

impl Settings {
    /// Checks every setting; returns the surface and how far loads are grouped.
    pub(super) fn check(&self) -> Result<(Plane, Option<FarField>), SolveError> {
        self.wall.check()?;
        let Shape::Plane(plane) = self.wall.shape else {
            return Err(SolveError::Start(format!("{NODE}: wall `{}` is not a plane", self.wall.name)));
        };
        if self.wall.motion != Motion::Fixed {
            return Err(SolveError::Start(format!("{NODE}: wall `{}` moves; a substrate is at rest", self.wall.name)));
        }
        let poisson = self.poisson;
        setting(NODE, "Poisson's ratio", poisson, poisson > -1.0 && poisson <= 0.5, "above -1 and at most 0.5")?;
        if let Some(young_pa) = self.deflection_young_pa {
            positive(NODE, "Young's modulus", young_pa)?;
        }
        let mut points = self.points_m.len() as f64;
        for grid in &self.grids {
            positive(NODE, &format!("spacing of grid `{}`", grid.name), grid.spacing_m)?;
            for (lower, upper) in grid.lower_m.iter().zip(&grid.upper_m) {
                let what = format!("side of grid `{}`", grid.name);
                setting(NODE, &what, upper - lower, *upper >= *lower, "finite and at least 0 m")?;
            }
            points += grid.counts().iter().map(|&count| count as f64).product::<f64>();
        }
        setting(NODE, "number of points", points, points <= POINTS_LIMIT as f64, "at most ten million")?;
        Ok((plane, self.far_field_tolerance.map(FarField::new).transpose()?))
    }
}

impl crate::Settings for Settings {
    type Physics = Substrate;

    fn ports(&self) -> Ports {
        let contact =
            |name: &str, unit: &str, components: u32| Port::f64(name, unit, "wall-contacts", components, Measure::None);
        let mut reads = vec![
            Port::u32("wall_contact_pairs", "wall-contacts", 2),
            contact("wall_contact_area", "m^2", 1),
            contact("wall_contact_force", "N", 3),
            contact("wall_contact_position", "m", 3),
        ];
        let at_points =
            |name: &str, unit: &str, components: u32| Port::f64(name, unit, "grid", components, Measure::None);
        let mut writes = vec![
            at_points("stress", "Pa", 6),
            at_points("stress_position", "m", 3),
            at_points("stress_deviator_norm", "Pa", 1),
            at_points("von_mises_stress", "Pa", 1),
            at_points("pressure", "Pa", 1),
        ];
        if self.deflection_young_pa.is_some() {
            reads.push(Port::f64("positions", "m", PARTICLES, 3, Measure::None));
            reads.push(Port::f64("radii", "m", PARTICLES, 1, Measure::None));
            writes.push(Port::f64("wall_deflection", "m", PARTICLES, 1, Measure::Magnitude));
        }
        Ports::new(reads, writes).with(match (self.grids.as_slice(), self.points_m.as_slice()) {
            ([grid], []) => Geometry::grid("grid", grid.as_support()),
            _ => Geometry::points("grid", "stress_position"),
        })
    }

    fn build(self) -> Result<Substrate, SolveError> {
        Substrate::new(self)
    }

    fn on_substrate(&self) -> Option<OnSubstrate> {
        Some(OnSubstrate { wall: self.wall_index as usize, deflects: self.deflection_young_pa.is_some() })
    }

    /// A deflection that comes and goes with a single contact has no size to be measured by.
    fn absolute_tolerances(&self, bodies: &Bodies<'_>) -> Vec<(&'static str, f64)> {
        self.deflection_young_pa.map(|_| ("wall_deflection", 1e-9 * bodies.radius_m)).into_iter().collect()
    }
}
