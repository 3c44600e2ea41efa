//! What a scene says of its particles, in SI units.

mod bonds;
mod domain;
mod fields;
mod inlet;
mod radius;
mod start_region;
pub(super) mod validate;

use serde::Serialize;

pub use bonds::*;
pub use domain::Domain;
pub use fields::*;
pub use inlet::{Pour, PourRegion};
pub use radius::Radius;

pub use crate::common::OnSubstrate;
use crate::common::Wall;

/// Everything the particle dynamics of a scene depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// What the particles are; not looked at where they are given.
    pub groups: Vec<Group>,
    /// What they are made of; a particle names its material by its place in this list.
    pub materials: Vec<Material>,
    /// Where particles start.
    pub start: Start,
    /// Seed of everything random.
    pub seed: u64,
    /// Temperature in K where nobody writes `temperature`, and of particles that are poured.
    pub temperature_k: f64,
    /// True where `ids` is written although no dispenser and no domain asks for it: another physics may turn particles to vapour.
    pub writes_ids: bool,
    /// True where `material` is written, the place of each particle's material in [`Self::materials`]: somebody reads it.
    pub writes_material: bool,
    /// True where the elastic normal force of each contact is written, for pictures and exports.
    pub writes_contact_forces: bool,
    /// What a substrate under a wall asks of the particles; `None` where there is none.
    pub substrate: Option<OnSubstrate>,
    /// Contact between particles, and between particles and walls.
    pub contact: Contact,
    /// Tangential force at contacts; `None` is frictionless.
    pub friction: Option<Friction>,
    /// Resistance to rolling and torsion; it acts where particles spin. `None` is none.
    pub rolling: Option<Rolling>,
    /// Contacts of pairs of materials that differ from the others.
    pub pairs: Vec<Pair>,
    /// The monograph's bond of particles that overlap; `None` is none.
    pub bond: Option<OverlapBond>,
    /// Bonds with a state of their own, which hold in tension and break; `None` is none.
    pub bonds: Option<BondSettings>,
    /// Drag of a resting or streaming gas; `None` is vacuum.
    pub drag: Option<Drag>,
    /// Electric, magnetic and near fields.
    pub fields: FieldForces,
    /// Gravity g in m/s².
    pub gravity_m_s2: [f64; 3],
    /// Walls, in the order of the scene.
    pub walls: Vec<Wall>,
    /// Whether particles spin (Zohdi 2018, section 6.1: off where it is minor).
    pub spin: bool,
    /// Arm at which tangential forces make them spin.
    pub lever_arm: LeverArm,
    /// Time integration inside a window.
    pub integrator: Integrator,
    /// Skin of the Verlet list as a share of each particle's radius: a pair is listed while its gap is below this share
    /// of the pair's mean radius. Zero builds the list anew at every substep.
    pub skin: f64,
    /// Dispensers, in the order of the scene.
    pub pours: Vec<Pour>,
    /// Particles whose centre leaves it are removed; `None` keeps all.
    pub domain: Option<Domain>,
}

impl Settings {
    /// Whether particles may come or go during a run.
    #[must_use]
    pub fn come_and_go(&self) -> bool {
        !self.pours.is_empty() || self.domain.is_some() || self.writes_ids
    }

    /// What a scene gets that says nothing else: seed 1, 300 K and gravity of 9.81 m/s² down the z axis; contacts without
    /// damping, friction or bonds; vacuum without fields or walls; particles that do not spin, all of one material, who
    /// neither come nor go; velocity Verlet at the automatic substep, with a skin of 0.3 radii.
    #[must_use]
    pub fn new(start: Start, material: Material, law: ContactLaw) -> Self {
        Self {
            groups: Vec::new(),
            materials: vec![material],
            start,
            seed: 1,
            temperature_k: 300.0,
            writes_ids: false,
            writes_material: false,
            writes_contact_forces: false,
            substrate: None,
            contact: Contact::new(law),
            friction: None,
            rolling: None,
            pairs: Vec::new(),
            bond: None,
            bonds: None,
            drag: None,
            fields: FieldForces::default(),
            gravity_m_s2: [0.0, 0.0, -9.81],
            walls: Vec::new(),
            spin: false,
            lever_arm: LeverArm::ContactPoint,
            integrator: Integrator::Verlet { substep_s: None },
            skin: 0.3,
            pours: Vec::new(),
            domain: None,
        }
    }

    /// Number of particles at t = 0; zero is allowed.
    #[must_use]
    pub fn count(&self) -> usize {
        match &self.start {
            Start::Given { positions_m, .. } => positions_m.len(),
            _ => self.groups.iter().map(|group| group.count).sum(),
        }
    }
}

/// Particles of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// Its name; `particles` for the one that `[particles]` itself describes.
    pub name: String,
    /// Number of particles; zero is allowed.
    pub count: usize,
    /// Radii R.
    pub radius: Radius,
    /// Its material, as an index into [`Settings::materials`].
    pub material: u16,
}

/// A material of particles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Material {
    /// Its name in the scene.
    pub name: String,
    /// Density ρ in kg/m³.
    pub density_kg_m3: f64,
    /// Its own stiffness at the reference temperature, in the unit of the contact law's; `None` is the law's.
    pub stiffness: Option<f64>,
    /// Its own Poisson's ratio; `None` is the law's.
    pub poisson: Option<f64>,
}

/// What differs in the contact of two materials, or of a material and a wall, from what holds for all contacts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    /// Names of the materials or walls.
    pub between: [String; 2],
    /// Normal damping c_cd, in N s/m³.
    pub damping_n_s_m3: Option<f64>,
    /// Restitution coefficient.
    pub restitution: Option<f64>,
    /// Static coefficient of friction μ_s.
    pub static_coefficient: Option<f64>,
    /// Dynamic coefficient of friction μ_d.
    pub dynamic_coefficient: Option<f64>,
    /// Coefficient of rolling resistance.
    pub rolling: Option<f64>,
    /// Coefficient of torsion resistance.
    pub torsion: Option<f64>,
}

impl Pair {
    /// The scene's settings with those of this pair in their place.
    pub(crate) fn applied_to(&self, settings: &Settings) -> Settings {
        let mut own = settings.clone();
        if let Some(damping) = self.damping_n_s_m3 {
            own.contact.damping_n_s_m3 = damping;
        }
        own.contact.restitution = self.restitution.or(own.contact.restitution);
        if let Some(
            Friction::Regularised { static_coefficient, dynamic_coefficient, .. }
            | Friction::Spring { static_coefficient, dynamic_coefficient, .. },
        ) = &mut own.friction
        {
            *static_coefficient = self.static_coefficient.unwrap_or(*static_coefficient);
            *dynamic_coefficient = self.dynamic_coefficient.unwrap_or(*dynamic_coefficient).min(*static_coefficient);
        }
        if self.rolling.is_some() || self.torsion.is_some() {
            let general = own.rolling.unwrap_or(Rolling { rolling: 0.0, torsion: 0.0 });
            own.rolling = Some(Rolling {
                rolling: self.rolling.unwrap_or(general.rolling),
                torsion: self.torsion.unwrap_or(general.torsion),
            });
        }
        own
    }
}

/// Where particles start.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// Random sequential addition without overlap (Widom 1966), moving with one velocity.
    SequentialAddition {
        /// What holds the particles wholly.
        region: StartRegion,
        /// Velocity of every particle, in m/s.
        velocity_m_s: [f64; 3],
    },
    /// The sites of a crystal lattice, filled from the floor up.
    Lattice {
        /// What holds the particles wholly.
        region: StartRegion,
        /// The lattice.
        lattice: Lattice,
        /// Distance of nearest neighbours as a share of the largest diameter; at least 1.
        spacing: f64,
        /// Random displacement as a share of the one at which neighbours could touch; from 0 to 1.
        jitter: f64,
        /// Velocity of every particle, in m/s.
        velocity_m_s: [f64; 3],
    },
    /// Spheres that move and grow between the walls of a box to their final radii (Lubachevsky & Stillinger 1990).
    Growth {
        /// Lower corner of the box, in m; particles lie wholly inside.
        lower_m: [f64; 3],
        /// Upper corner, in m.
        upper_m: [f64; 3],
        /// Velocity of every particle, in m/s.
        velocity_m_s: [f64; 3],
    },
    /// What falls between the walls and comes to rest: a loose filling of the region, made higher against gravity where it is
    /// too small, and then the particles' own dynamics. They start at rest, and touch each other.
    Settle {
        /// What holds the loose filling wholly, before it is made higher.
        region: StartRegion,
        /// Mean kinetic energy over the mean of m g R at which they are at rest; positive.
        until: f64,
        /// Rate of artificial damping over √(g/R) with the mean radius; not negative.
        damping: f64,
        /// Longest time to settle, in s; `None` is 50 falls from the top of the filling.
        longest_s: Option<f64>,
    },
    /// Given particles, which may overlap; all lists are of one length.
    Given {
        /// Positions, in m.
        positions_m: Vec<[f64; 3]>,
        /// Velocities, in m/s.
        velocities_m_s: Vec<[f64; 3]>,
        /// Radii, in m.
        radii_m: Vec<f64>,
        /// Materials, as indices into [`Settings::materials`].
        materials: Vec<u16>,
        /// Spins, in rad/s, where [`Settings::spin`] is set; none at all where particles do not spin at the start.
        spins_rad_s: Vec<[f64; 3]>,
    },
}

/// Where particles may start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartRegion {
    /// An axis-aligned box.
    Box {
        /// Lower corner, in m.
        lower_m: [f64; 3],
        /// Upper corner, in m.
        upper_m: [f64; 3],
    },
    /// A cylinder along an axis of coordinates.
    Cylinder {
        /// Centre of its lower face, in m.
        base_m: [f64; 3],
        /// The axis: 0, 1 or 2 for x, y or z.
        axis: usize,
        /// Radius, in m.
        radius_m: f64,
        /// Height, in m.
        height_m: f64,
    },
    /// A sphere.
    Sphere {
        /// Its centre, in m.
        centre_m: [f64; 3],
        /// Radius, in m.
        radius_m: f64,
    },
}

/// A crystal lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lattice {
    /// Simple cubic: packing fraction π/6 = 0.524.
    SimpleCubic,
    /// Body-centred cubic: π√3/8 = 0.680.
    BodyCentredCubic,
    /// Face-centred cubic: π/√18 = 0.740.
    FaceCentredCubic,
    /// Hexagonal close-packed: π/√18 = 0.740.
    HexagonalClosePacked,
}

/// Normal contact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contact {
    /// The law.
    pub law: ContactLaw,
    /// Rate a_θ of thermal softening (Zohdi 2018, eq. 6.33); 0 is none.
    pub softening_rate: f64,
    /// Reference temperature θ* of softening, in K.
    pub softening_reference_k: f64,
    /// Floor K_lim of the softened stiffness (or Young's modulus for Hertz), in Pa.
    pub softening_floor_pa: f64,
    /// Normal damping c_cd (eq. 6.10), in N s/m per m² of contact area; 0 is none.
    pub damping_n_s_m3: f64,
    /// Restitution coefficient in (0, 1] that normal damping gives, beside c_cd; `None` is none.
    pub restitution: Option<f64>,
}

impl Contact {
    /// The law alone, as a scene gets it that says no more of it: no damping and no softening. The reference temperature of
    /// softening is 300 K, its floor a tenth of the law's stiffness.
    #[must_use]
    pub fn new(law: ContactLaw) -> Self {
        let (ContactLaw::Overlap { stiffness_pa: stiffness, .. }
        | ContactLaw::Hertz { young_pa: stiffness, .. }
        | ContactLaw::Linear { stiffness_n_m: stiffness }) = law;
        Self {
            law,
            softening_rate: 0.0,
            softening_reference_k: 300.0,
            softening_floor_pa: stiffness / 10.0,
            damping_n_s_m3: 0.0,
            restitution: None,
        }
    }
}

/// Law of the normal force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactLaw {
    /// K_p |E|^p A (eq. 6.7).
    Overlap {
        /// Stiffness K_p0 at the reference temperature, in Pa.
        stiffness_pa: f64,
        /// Exponent p_p.
        exponent: f64,
    },
    /// 4/3 √R* E* δ^{3/2} (eq. 6.58).
    Hertz {
        /// Young's modulus E at the reference temperature, in Pa.
        young_pa: f64,
        /// Poisson's ratio ν.
        poisson: f64,
    },
    /// k_n δ (Cundall & Strack 1979).
    Linear {
        /// Stiffness k_n at the reference temperature, in N/m.
        stiffness_n_m: f64,
    },
}

/// Arm at which the tangential force of a contact turns a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LeverArm {
    /// From its centre to the contact point, in the plane of the lens that the overlapping spheres share, or on the wall:
    /// angular momentum is kept.
    #[default]
    ContactPoint,
    /// Its radius (Zohdi 2018, eqs. 6.11–6.15): friction makes angular momentum, at δ/d of what it transfers.
    Radius,
}

/// Law of the tangential force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Friction {
    /// The monograph's regularised friction (eqs. 6.11–6.15); its stick stiffness depends on the step.
    Regularised {
        /// K_f, in N per m of sliding and m² of contact area.
        stiffness_n_m3: f64,
        /// Static coefficient μ_s.
        static_coefficient: f64,
        /// Dynamic coefficient μ_d.
        dynamic_coefficient: f64,
    },
    /// A spring with a memory at each contact (Cundall & Strack 1979), which holds a pile at rest.
    Spring {
        /// Ratio κ of tangential to normal stiffness; `None` is Mindlin's 2(1−ν)/(2−ν) with Hertz's law, else 2/7.
        stiffness_ratio: Option<f64>,
        /// Damping ratio ζ of the spring; `None` is that of the normal restitution.
        damping_ratio: Option<f64>,
        /// Static coefficient μ_s.
        static_coefficient: f64,
        /// Dynamic coefficient μ_d.
        dynamic_coefficient: f64,
    },
}

/// Resistance to rolling (eq. 6.18) and to torsion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rolling {
    /// Coefficient μ_r of the moment μ_r a ‖Ψ^n‖ against rolling.
    pub rolling: f64,
    /// Coefficient of the same moment against spin about the normal.
    pub torsion: f64,
}

/// The monograph's bond (eqs. 6.16–6.17): it acts while the overlap strain is at least E*.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OverlapBond {
    /// Normal stiffness K_nb, in Pa.
    pub stiffness_pa: f64,
    /// Exponent p_b.
    pub exponent: f64,
    /// Tangential stiffness K_rb, in N per m of sliding and m² of contact area.
    pub shear_stiffness_n_m3: f64,
    /// Strain E* from which it acts.
    pub strain: f64,
}

/// Stokes drag 6π c_e R (v_e − v) (eq. 6.22).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Drag {
    /// Viscosity c_e of the gas, in Pa s.
    pub viscosity_pa_s: f64,
    /// Velocity v_e of the gas, in m/s.
    pub velocity_m_s: [f64; 3],
}

/// Time integration inside a window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Velocity Verlet with equal substeps.
    Verlet {
        /// Upper bound of a substep, in s, which never exceeds half of the critical step of the contacts there are; `None`
        /// takes 1/25 of the shortest expected contact time.
        substep_s: Option<f64>,
    },
    /// The monograph's trapezoidal rule, solved by fixed-point iteration over the whole window (eqs. 6.23–6.27).
    Trapezoidal {
        /// Weight φ in [0, 1] of the window's end.
        phi: f64,
        /// Tolerance of the fixed point, relative change over increment.
        tolerance: f64,
        /// Iterations K_d after which the window is given up.
        iterations: u32,
        /// Differences of iterates that Anderson's mixing uses (Walker & Ni 2011); 0 is the plain iteration.
        anderson_depth: u32,
    },
    /// None: particles stay where they start, at rest, while their temperatures change. For beds that hardly move.
    Held,
}
