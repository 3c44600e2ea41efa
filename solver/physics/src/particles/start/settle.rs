//! Spheres that fall between the scene's walls and come to rest: a loose filling, and then the particles' own dynamics.

use rand_chacha::rand_core::RngCore;
use stagger_coupling::{Frozen, SolveError, Window, math};
use stagger_messages::Shown;

use super::{
    placed::{Placed, exact, model},
    radii::{Bodies, draw, volume},
    sequential_addition::SequentialAddition,
};
use crate::{
    common::{Vec3, Wall, random::random, walls},
    particles::{
        model::{Model, state::State},
        settings::{FieldForces, Integrator, Settings, Start, StartRegion, validate},
        window,
    },
};

/// Packing fraction of the loose filling, below what random sequential addition makes without effort.
const LOOSE: f64 = 0.2;
/// Windows, each followed by artificial damping, in √(R/g), the time in which a grain falls half its radius.
const WINDOWS: u32 = 10;
/// Windows in a row at whose ends the particles must be calm: a bouncing grain is slow at its highest point only.
const CALM: u32 = 20;
/// Times that a window is cut in a row before it is given up.
const CUTS: u32 = 100;
/// Windows after which settling is not begun: it would take hours.
const LARGEST_WINDOWS: f64 = 1e6;
/// Substeps in one window after which settling is given up: it would take hours too.
const LARGEST_SUBSTEPS: f64 = 1e5;
/// Falls from the top of the filling that settling may last where the scene says nothing.
const LONGEST_FALLS: f64 = 50.0;
/// Overlap with a wall at the start, over the radius, that is rounding.
const TOUCH: f64 = 1e-9;

/// When settled particles are at rest.
#[derive(Clone, Copy)]
pub(super) struct Settle {
    /// Mean kinetic energy over the mean of m g R.
    pub until: f64,
    /// Rate of artificial damping over √(g/R).
    pub damping: f64,
    /// Longest time, in s.
    pub longest_s: Option<f64>,
}

impl Settle {
    /// Positions at rest, in the order of the bodies.
    ///
    /// The contacts, the friction and the gravity of the scene act between its walls as they stand at t = 0; its fields, its
    /// gas, its bonds, and its dispensers do not. Beside them every velocity decays at the rate `damping` √(g/R̄), so that
    /// elastic spheres come to rest too.
    ///
    /// # Errors
    /// [`SolveError::Start`] where the loose filling finds no room or meets a wall, or where the particles are not at rest
    /// within the longest time.
    pub fn place(
        &self,
        settings: &Settings,
        region: &StartRegion,
        bodies: &Bodies,
        random: &mut impl RngCore,
    ) -> Result<Vec<Vec3>, SolveError> {
        let count = bodies.radii.len();
        if count == 0 {
            return Ok(Vec::new());
        }
        let gravity = Vec3::from(settings.gravity_m_s2);
        let region = region.extended(&bodies.radii, &gravity)?;
        let loose = SequentialAddition { region: &region, radii: &bodies.radii }.place(random)?;
        let placed = Placed {
            positions: loose.iter().map(|&position| position.into()).collect(),
            velocities: vec![[0.0; 3]; count],
            radii: bodies.radii.clone(),
            materials: bodies.materials.clone(),
            spins: vec![[0.0; 3]; count],
        };
        let bed = bed(settings, &placed);
        validate::settings(&bed)?;
        let bed = model(bed, exact(placed)?)?;
        let (state, _) = window::initial(&bed)?;
        self.rest(&bed, state, &region)
    }

    fn rest(&self, bed: &Model, mut state: State, region: &StartRegion) -> Result<Vec<Vec3>, SolveError> {
        clear_of_walls(bed, &state)?;
        let bodies = state.bodies.clone();
        let count = bodies.len() as f64;
        let gravity = bed.gravity.norm();
        let radius = bodies.radii.iter().sum::<f64>() / count;
        let window_s = (radius / gravity).sqrt() / f64::from(WINDOWS);
        let down = bed.gravity / gravity;
        let height = -region.lowest_along((-down).into()) - region.lowest_along(down.into());
        let fall_s = (2.0 * height.max(radius) / gravity).sqrt();
        let longest_s = self.longest_s.unwrap_or(LONGEST_FALLS * fall_s);
        if longest_s > LARGEST_WINDOWS * window_s {
            return Err(SolveError::Start(format!(
                "particles: settling for {:e} s would take more than a million steps of {:e} s, a tenth of the time \
                 in which they fall half their radius: the start region is too high for particles of radius {:e} m; \
                 make it lower, or set a shorter `longest`",
                Shown(longest_s),
                Shown(window_s),
                Shown(radius)
            )));
        }
        let kept = math::exp(-self.damping / f64::from(WINDOWS));
        // Σ m g R.
        let weights: f64 =
            gravity * bodies.masses.iter().zip(&bodies.radii).map(|(mass, radius)| mass * radius).sum::<f64>();

        let (mut calm, mut windows, mut share) = (0, 0.0, f64::INFINITY);
        while calm < CALM {
            if windows * window_s >= longest_s {
                return Err(not_at_rest(&state, longest_s, share, self.until));
            }
            state = advance(bed, state, window_s)?;
            share = kinetic_j(&state) / weights;
            calm = if share <= self.until { calm + 1 } else { 0 };
            for vector in state.motion.velocities.iter_mut().chain(&mut state.motion.spins) {
                *vector *= kept;
            }
            windows += 1.0;
        }
        Ok(state.bodies.in_rows(&state.motion.positions))
    }
}

impl StartRegion {
    /// The region, or one that reaches higher, against gravity, where it is too small for a loose filling.
    ///
    /// # Errors
    /// [`SolveError::Start`] where it is too small and cannot be made higher.
    pub(super) fn extended(&self, radii: &[f64], gravity: &Vec3) -> Result<Self, SolveError> {
        let fraction = volume(radii) / self.volume_m3();
        let factor = fraction / LOOSE;
        if factor <= 1.0 {
            return Ok(*self);
        }
        let up = gravity.iamax();
        let rises = gravity[up] < 0.0;
        match *self {
            Self::Box { mut lower_m, mut upper_m } => {
                let height = factor * (upper_m[up] - lower_m[up]);
                if rises {
                    upper_m[up] = lower_m[up] + height;
                } else {
                    lower_m[up] = upper_m[up] - height;
                }
                Ok(Self::Box { lower_m, upper_m })
            }
            Self::Cylinder { mut base_m, axis, radius_m, height_m } if axis == up => {
                if !rises {
                    base_m[axis] -= (factor - 1.0) * height_m;
                }
                Ok(Self::Cylinder { base_m, axis, radius_m, height_m: factor * height_m })
            }
            Self::Cylinder { .. } | Self::Sphere { .. } => Err(SolveError::Start(format!(
                "particles: the packing fraction in the start region is {fraction:.3}, where a loose filling has {LOOSE}, and \
                 only a box or an upright cylinder can be made higher; use one of these, a larger region, or fewer particles"
            ))),
        }
    }
}

impl Settings {
    /// The same settings with the loose filling in place of a start that settles: enough to know the node's ports, and
    /// quick.
    #[must_use]
    pub fn without_settling(mut self) -> Self {
        if let Start::Settle { region, .. } = self.start {
            let radii = draw(&self.groups, &mut random(self.seed)).radii;
            // What cannot be extended is refused when it is filled.
            let region = region.extended(&radii, &Vec3::from(self.gravity_m_s2)).unwrap_or(region);
            self.start = Start::SequentialAddition { region, velocity_m_s: [0.0; 3] };
        }
        self
    }
}

/// What settles: the scene's particles at the places of the loose filling, with nothing but contacts and gravity.
fn bed(settings: &Settings, placed: &Placed) -> Settings {
    Settings {
        groups: Vec::new(),
        start: Start::Given {
            positions_m: placed.positions.clone(),
            velocities_m_s: placed.velocities.clone(),
            radii_m: placed.radii.clone(),
            materials: placed.materials.clone(),
            spins_rad_s: Vec::new(),
        },
        writes_ids: false,
        writes_material: false,
        writes_contact_forces: false,
        substrate: None,
        bond: None,
        bonds: None,
        drag: None,
        fields: FieldForces::default(),
        walls: settings.walls.iter().map(held).collect(),
        integrator: match settings.integrator {
            integrator @ Integrator::Verlet { .. } => integrator,
            Integrator::Trapezoidal { .. } | Integrator::Held => Integrator::Verlet { substep_s: None },
        },
        pours: Vec::new(),
        domain: None,
        ..settings.clone()
    }
}

/// The wall where it stands at t = 0.
fn held(wall: &Wall) -> Wall {
    let mut held = wall.clone();
    if held.motion != walls::Motion::Fixed {
        let shift = held.motion.pose(0.0, &walls::WallState::default()).to_world(&Vec3::zeros());
        held.motion = walls::Motion::Path(walls::Series::constant(shift.into()));
    }
    held
}

/// Refuses a filling that reaches into a wall, from where it would be flung out, or never come back.
fn clear_of_walls(bed: &Model, state: &State) -> Result<(), SolveError> {
    let contacts = &state.wall_contacts;
    if contacts.deepest <= TOUCH {
        return Ok(());
    }
    let distances = contacts.pairs.u32()?.as_chunks::<2>().0;
    let touched = distances.iter().map(|[_, wall]| *wall as usize).min().unwrap_or(0);
    let name = bed.settings.walls.get(touched).map_or("", |wall| wall.name.as_str());
    Err(SolveError::Start(format!(
        "particles: before they settle they are filled in loosely, and {} of them would reach into walls, the first of which \
         is `{name}`; leave the space above the start region free, up to five times the particles' volume, or use the \
         start `growth`",
        distances.len()
    )))
}

/// One window, cut into shorter ones where it does not converge whole.
fn advance(bed: &Model, mut state: State, window_s: f64) -> Result<State, SolveError> {
    let (mut left_s, mut dt_s, mut cuts, mut substeps) = (window_s, window_s, 0, 0.0);
    while left_s > 0.0 {
        if substeps > LARGEST_SUBSTEPS {
            return Err(SolveError::Start(format!(
                "particles: contacts and damping ask for more than {LARGEST_SUBSTEPS:e} substeps in {:e} s of settling, a \
                 tenth of the time in which a particle falls half its radius; use softer contacts or less contact damping",
                Shown(window_s)
            )));
        }
        let now_s = dt_s.min(left_s);
        let (next, reply) = window::solve(bed, &state, &Frozen::default(), Window { t_s: 0.0, dt_s: now_s })?;
        match reply.not_converged {
            None => {
                state = next;
                substeps += reply.figures.get("substeps").copied().unwrap_or(1.0);
                left_s = if now_s < left_s { left_s - now_s } else { 0.0 };
                cuts = 0;
            }
            Some(reason) if cuts < CUTS => {
                dt_s = now_s * reason.step_factor;
                cuts += 1;
            }
            Some(_) => {
                return Err(SolveError::Start(format!(
                    "particles: settling does not get on with windows of {:e} s; use softer contacts or larger particles",
                    Shown(dt_s)
                )));
            }
        }
    }
    Ok(state)
}

/// Of translation and spin.
fn kinetic_j(state: &State) -> f64 {
    let sum = |factors: &[f64], vectors: &[Vec3]| -> f64 {
        factors.iter().zip(vectors).map(|(factor, vector)| 0.5 * factor * vector.norm_squared()).sum()
    };
    sum(&state.bodies.masses, &state.motion.velocities) + sum(&state.bodies.inertias, &state.motion.spins)
}

fn not_at_rest(state: &State, longest_s: f64, share: f64, until: f64) -> SolveError {
    let mut touched = vec![false; state.bodies.len()];
    for (list, ends) in [(&state.contacts, 2), (&state.wall_contacts, 1)] {
        let pairs = list.pairs.u32().map_or(&[][..], |pairs| pairs.as_chunks::<2>().0);
        for row in pairs.iter().flat_map(|pair| &pair[..ends]) {
            touched[*row as usize] = true;
        }
    }
    let free = touched.iter().filter(|touched| !**touched).count();
    SolveError::Start(format!(
        "particles: not at rest after {:e} s of settling: the mean kinetic energy is {share:.2e} m g R, where `until` \
         asks for {:e}; {free} of {} particles touch nothing: walls must hold them all; set a longer `longest`, a \
         larger `until`, or more `damping`",
        Shown(longest_s),
        Shown(until),
        state.bodies.len()
    ))
}
