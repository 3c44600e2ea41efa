//! Stress in an elastic substrate under the contacts of the particles (Zohdi 2018, ch. 9).

mod deflection;
mod far_field;
mod half_space;
mod hertz_disc;
pub mod keys;
mod point_load;
mod samples;
mod settings;
mod tradeoff;

use std::{collections::BTreeMap, sync::Arc};

use half_space::HalfSpace;
use nalgebra::Vector3;
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window, math};
use stagger_messages::{Field, Fields, Measure, Port, Ports};

pub use self::{
    deflection::deflection_m,
    far_field::FarField,
    samples::{Samples, stress_at},
    settings::*,
};
use crate::common::{
    PARTICLES,
    checks::{field, radii, values},
};

const NODE: &str = "substrate";

/// Contact radii within which a load is spread over its disc. Beyond it is a point load, whose stress is at most 2 % of
/// F/(2πγ²) off there, and less as 1/γ² farther away.
pub const NEAR_RADII: f64 = 16.0;

/// Height of a particle's centre over the surface, in its radii, above which the surface under it is left plane: it cannot
/// touch within a window.
const HEIGHT_RADII: f64 = 4.0;

/// A contact's load on a half-space, in coordinates x, y along its surface and z into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Centre of the contact, in m.
    pub x_m: f64,
    /// Centre of the contact, in m.
    pub y_m: f64,
    /// Normal force, in N; positive into the solid.
    pub normal_n: f64,
    /// Tangential force, in N.
    pub tangential_n: [f64; 2],
    /// Contact radius a, in m; positive.
    pub radius_m: f64,
}

/// Stress in an elastic half-space under the contacts of the particles with its surface, one plane wall.
///
/// The sum over all contacts of the stress of their normal and tangential forces (eqs. 9.2, 9.5, 9.6), tension positive, on
/// grids and at single points: every load a point load (Boussinesq 1885, Cerruti 1882), and spread over its contact disc,
/// of radius √(A/π), within [`NEAR_RADII`] contact radii. It is quasi-static and elastic: stress at the window's end
/// follows from the forces then. Where the surface deflects, `wall_deflection` is what other contacts press in under
/// each particle.
pub struct Substrate {
    settings: Settings,
    half_space: HalfSpace,
    far_field: Option<FarField>,
    samples: Samples,
    /// Where stress is computed, in m, row by row.
    positions_m: Vec<f64>,
    written: Written,
}

struct Written {
    stress: Arc<Port>,
    position: Arc<Port>,
    deviator: Arc<Port>,
    von_mises: Arc<Port>,
    pressure: Arc<Port>,
    deflection: Arc<Port>,
}

/// The loads of an instant.
#[derive(Default)]
struct Loads {
    loads: Vec<Load>,
    /// Row of each load's particle.
    by: Vec<u32>,
    /// Sum of the normal forces, in N.
    normal_n: f64,
    /// Sum of the tangential forces, in N.
    tangential_n: [f64; 2],
}

impl Substrate {
    /// Checks the settings and lays out the points.
    ///
    /// # Errors
    /// A setting is outside its range, or a point outside the substrate.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        let (plane, far_field) = settings.check()?;
        let half_space = HalfSpace::new(&plane);
        let points_m: Vec<[f64; 3]> =
            settings.grids.iter().flat_map(Grid::points_m).chain(settings.points_m.iter().copied()).collect();
        let local: Vec<[f64; 3]> = points_m.iter().map(|point| half_space.within(point)).collect::<Result<_, _>>()?;
        let port = |name: &str, unit: &str, components: u32| {
            Arc::new(Port::f64(name, unit, "grid", components, Measure::None))
        };
        let written = Written {
            stress: port("stress", "Pa", 6),
            position: port("stress_position", "m", 3),
            deviator: port("stress_deviator_norm", "Pa", 1),
            von_mises: port("von_mises_stress", "Pa", 1),
            pressure: port("pressure", "Pa", 1),
            deflection: Arc::new(Port::f64("wall_deflection", "m", PARTICLES, 1, Measure::Magnitude)),
        };
        let (samples, positions_m) = (Samples::new(&local), points_m.into_iter().flatten().collect());
        Ok(Self { settings, half_space, far_field, samples, positions_m, written })
    }

    /// The contacts with the substrate's wall, as loads.
    fn loads(&self, fields: &Fields) -> Result<Loads, SolveError> {
        let list = field(fields, "wall_contact_pairs")?;
        let of = "`wall_contact_pairs`";
        let column = |name: &str| {
            let found = field(fields, name)?.support.revision;
            if found != list.support.revision {
                return Err(SolveError::Mismatch(format!(
                    "{NODE}: field `{name}` is of contact list {found}, but {of} is list {}",
                    list.support.revision
                )));
            }
            values(NODE, fields, name, list.rows(), of)
        };
        let areas = column("wall_contact_area")?;
        let forces = column("wall_contact_force")?.as_chunks::<3>().0;
        let positions = column("wall_contact_position")?.as_chunks::<3>().0;
        let mut loads = Loads::default();
        for (row, &[particle, wall]) in list.u32()?.as_chunks::<2>().0.iter().enumerate() {
            let force = self.half_space.vector(&Vector3::from(forces[row]));
            if wall != self.settings.wall_index || force == Vector3::zeros() {
                continue;
            }
            if areas[row] <= 0.0 {
                return Err(SolveError::Mismatch(format!(
                    "{NODE}: field `wall_contact_area` is {} m^2 in row {row}, but a contact with a force has an area",
                    areas[row]
                )));
            }
            let at = self.half_space.position(&Vector3::from(positions[row]));
            loads.normal_n += force.z;
            loads.tangential_n[0] += force.x;
            loads.tangential_n[1] += force.y;
            loads.by.push(particle);
            loads.loads.push(Load {
                x_m: at.x,
                y_m: at.y,
                normal_n: force.z,
                tangential_n: [force.x, force.y],
                radius_m: (areas[row] / std::f64::consts::PI).sqrt(),
            });
        }
        Ok(loads)
    }

    /// What other contacts press in under each particle, as a field on the particles.
    fn deflection(&self, young_pa: f64, fields: &Fields, loads: &Loads) -> Result<Field, SolveError> {
        let radii_m = radii(NODE, fields)?;
        let positions = values(NODE, fields, "positions", radii_m.len(), "`radii`")?.as_chunks::<3>().0;
        let place = |(position, radius): (&[f64; 3], &f64)| {
            let at = self.half_space.position(&Vector3::from(*position));
            (-at.z < HEIGHT_RADII * radius).then_some([at.x, at.y])
        };
        let at: Vec<_> = positions.iter().zip(radii_m).map(place).collect();
        let under = deflection::under_particles(self.settings.poisson, young_pa, &loads.loads, &loads.by, &at);
        Ok(Field::new(&self.written.deflection, field(fields, "radii")?.support.revision, under)?)
    }

    /// The written fields and figures for the stress at the points.
    fn reply(&self, stress: &[[f64; 6]], loads: &Loads) -> Result<Reply, SolveError> {
        let measures: Vec<Measures> = stress.iter().map(Measures::of).collect();
        let column = |port: &Arc<Port>, of: fn(&Measures) -> f64| {
            Field::new(port, 0, measures.iter().map(of).collect::<Vec<f64>>())
        };
        let values: Vec<f64> = stress.iter().flat_map(|tensor| self.half_space.to_scene(*tensor)).collect();
        let written = &self.written;
        let fields = [
            Field::new(&written.stress, 0, values)?,
            Field::new(&written.position, 0, self.positions_m.clone())?,
            column(&written.deviator, |of| of.deviator_squared.sqrt())?,
            column(&written.von_mises, |of| of.von_mises_pa())?,
            column(&written.pressure, |of| of.pressure_pa)?,
        ];
        let mut figures = BTreeMap::from([
            ("loads".to_owned(), loads.loads.len() as f64),
            ("normal load [N]".to_owned(), loads.normal_n),
            ("tangential load [N]".to_owned(), math::hypot(loads.tangential_n[0], loads.tangential_n[1])),
        ]);
        let largest = measures.iter().map(Measures::von_mises_pa).fold(0.0, f64::max);
        figures.insert("largest von Mises stress [Pa]".to_owned(), largest);
        let mut rest = measures.as_slice();
        for grid in &self.settings.grids {
            let (points, others) = rest.split_at(grid.counts().iter().product());
            rest = others;
            let count = points.len() as f64;
            let squared = points.iter().map(|of| of.deviator_squared).sum::<f64>() / count;
            let mean = points.iter().map(|of| of.deviator_squared.sqrt()).sum::<f64>() / count;
            let largest = points.iter().map(|of| of.deviator_squared.sqrt()).fold(0.0, f64::max);
            figures.insert(format!("{}: mean σ':σ' [Pa^2]", grid.name), squared);
            figures.insert(format!("{}: mean norm of σ' [Pa]", grid.name), mean);
            figures.insert(format!("{}: largest norm of σ' [Pa]", grid.name), largest);
        }
        let fields = fields.into_iter().map(|field| (field.name().to_owned(), field)).collect();
        Ok(Reply { fields, figures, ..Reply::default() })
    }
}

/// Invariants of a stress tensor.
struct Measures {
    /// −tr σ / 3, in Pa.
    pressure_pa: f64,
    /// σ':σ' of the deviator σ' = σ − ⅓ tr σ, in Pa².
    deviator_squared: f64,
}

impl Measures {
    fn of(&[xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> Self {
        let mean = (xx + yy + zz) / 3.0;
        let [x, y, z] = [xx, yy, zz].map(|normal| normal - mean);
        let deviator_squared = x * x + y * y + z * z + 2.0 * (xy * xy + yz * yz + zx * zx);
        Self { pressure_pa: -mean, deviator_squared }
    }

    /// √(3/2 σ':σ'), in Pa.
    fn von_mises_pa(&self) -> f64 {
        (1.5 * self.deviator_squared).sqrt()
    }
}

impl Physics for Substrate {
    type State = ();

    fn ports(&self) -> Ports {
        crate::Settings::ports(&self.settings)
    }

    fn initial(&self) -> Result<((), Reply), SolveError> {
        let mut reply = self.reply(&vec![[0.0; 6]; self.positions_m.len() / 3], &Loads::default())?;
        if self.settings.deflection_young_pa.is_some() {
            let flat = Field::new(&self.written.deflection, 0, vec![0.0; self.settings.count])?;
            reply.fields.insert(flat.name().into(), flat);
        }
        Ok(((), reply))
    }

    fn solve(&self, (): &(), frozen: &Frozen, _: Window) -> Result<((), Reply), SolveError> {
        let loads = self.loads(&frozen.end)?;
        let stress = self.samples.stress(self.settings.poisson, &loads.loads, self.far_field);
        let mut reply = self.reply(&stress, &loads)?;
        if let Some(young_pa) = self.settings.deflection_young_pa {
            let deflection = self.deflection(young_pa, &frozen.end, &loads)?;
            reply.fields.insert(deflection.name().into(), deflection);
        }
        Ok(((), reply))
    }
}
