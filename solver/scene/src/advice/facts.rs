//! What a scene has, as the numbers need it.

use stagger_coupling::{SolveError, Window, math};
use stagger_physics::{
    common::{
        Partner, conductance,
        walls::{Motion, Shape},
    },
    current::{Model as CurrentModel, Settings as CurrentSettings},
    optics::{Model, Path, Settings as OpticsSettings},
    particles::{Expectation, Particles, Radius, Settings as ParticlesSettings, Start},
    thermal::Settings as ThermalSettings,
};
use std::f64::consts::PI;

use super::{Edit, Effect, Quantity};
use crate::Scene;

type Vec3 = nalgebra::Vector3<f64>;

/// Share of a plane that circles of one size can cover: hexagonal packing.
const PLANE_COVER: f64 = 0.9069;

/// Particles of one size.
pub(super) struct Body {
    pub radius_m: f64,
    pub mass_kg: f64,
    /// How many; more than one for those that are poured.
    pub number: f64,
}

/// The room that walls leave the particles, in m; `None` where none bound it sideways.
#[derive(Clone, Copy)]
pub(super) struct Room {
    pub lower_m: [f64; 3],
    pub upper_m: [f64; 3],
    /// Whether walls keep the particles in it across gravity.
    pub confined: bool,
}

/// A laser of the scene.
pub(super) struct Laser<'s> {
    /// Its table.
    pub table: String,
    pub settings: &'s OpticsSettings,
    /// What it sends over the run, in J.
    pub energy_j: f64,
}

/// What advice rests on.
pub(super) struct Facts<'s> {
    pub scene: &'s Scene,
    pub within: f64,
    pub settings: &'s ParticlesSettings,
    pub thermal: Option<&'s ThermalSettings>,
    pub lasers: Vec<Laser<'s>>,
    pub expectation: Expectation,
    pub bodies: Vec<Body>,
    pub room: Room,
    /// Whether a physics pushes the particles.
    pub pushed: bool,
    particles: Particles,
}

impl<'s> Facts<'s> {
    /// `None` where the scene has no particles.
    pub fn of(scene: &'s Scene, within: f64) -> Result<Option<Self>, SolveError> {
        let Some(settings) = scene.settings::<ParticlesSettings>() else { return Ok(None) };
        // Settling can take minutes, and needs the run's own engine.
        let particles = Particles::new(settings.clone().without_settling())?;
        let mut expectation = particles.expectation()?;
        let mut bodies: Vec<Body> = expectation
            .radii_m
            .iter()
            .zip(&expectation.masses_kg)
            .map(|(&radius_m, &mass_kg)| Body { radius_m, mass_kg, number: 1.0 })
            .collect();
        bodies.extend(poured(settings, scene.duration_s));
        if bodies.is_empty() {
            return Ok(None);
        }
        if let Start::Settle { until, .. } = settings.start {
            // They begin at rest but for `until` of m g R.
            let largest_m = bodies.iter().map(|body| body.radius_m).fold(0.0, f64::max);
            let walls = scene
                .walls
                .iter()
                .map(|wall| wall.motion.speed_m_s([f64::NEG_INFINITY, f64::INFINITY]))
                .fold(0.0, f64::max);
            let rest = (2.0 * until * expectation.acceleration_m_s2 * largest_m).sqrt();
            expectation.speed_m_s = rest.max(walls);
        }
        let whole = Window { t_s: 0.0, dt_s: scene.duration_s };
        let laser = |table: String, settings: &'s OpticsSettings| {
            let energy_j = settings.beam.mean_power_w(whole) * scene.duration_s;
            Laser { table, settings, energy_j }
        };
        let mut lasers: Vec<Laser<'s>> = Vec::new();
        lasers.extend(scene.settings().map(|settings| laser("optics".into(), settings)));
        lasers.extend(scene.own_settings().map(|(name, settings)| laser(format!("nodes.{name}"), settings)));
        let room = room(scene, &expectation, settings);
        let thermal = scene.settings();
        let pushed = scene.writes("acoustic_force");
        Ok(Some(Self { scene, within, settings, thermal, lasers, expectation, bodies, room, pushed, particles }))
    }

    pub fn number(&self) -> f64 {
        self.bodies.iter().map(|body| body.number).sum()
    }

    pub fn mass_kg(&self) -> f64 {
        self.bodies.iter().map(|body| body.number * body.mass_kg).sum()
    }

    pub fn smallest_m(&self) -> f64 {
        self.bodies.iter().map(|body| body.radius_m).fold(f64::INFINITY, f64::min)
    }

    pub fn largest_m(&self) -> f64 {
        self.bodies.iter().map(|body| body.radius_m).fold(0.0, f64::max)
    }

    pub fn duration_s(&self) -> f64 {
        self.scene.duration_s
    }

    /// Least heat capacity C of a material where particles start, in J/(kg K).
    pub fn capacity_j_kg_k(&self, thermal: &ThermalSettings) -> f64 {
        let start_k = thermal.temperature_k;
        match &thermal.enthalpy {
            // A table's least value bounds every rise from above.
            Some(enthalpy) => {
                let tables = enthalpy.materials.iter().flat_map(|material| &material.heat_capacity_j_kg_k.points);
                tables.map(|point| point[1]).fold(f64::INFINITY, f64::min)
            }
            None if start_k > 0.0 => thermal.heat_capacity_j_kg_k,
            None => f64::NAN,
        }
    }

    /// Least and greatest conductivity of a material, in W/(m K).
    pub fn conductivity_w_m_k(&self, thermal: &ThermalSettings) -> [f64; 2] {
        match &thermal.enthalpy {
            Some(enthalpy) => {
                let tables = enthalpy.materials.iter().flat_map(|material| &material.conductivity_w_m_k.points);
                tables.fold([f64::INFINITY, 0.0], |[least, most], point| [least.min(point[1]), most.max(point[1])])
            }
            None => [thermal.conductivity_w_m_k; 2],
        }
    }

    /// Bound of the force that presses particles together, as the mean over the run of all that they push on a floor, in N:
    /// their momentum at first and at last and what their weight adds, over the duration. `None` where something else
    /// presses: a moving wall, sound, attraction.
    pub fn press_n(&self) -> Option<f64> {
        let fields = &self.settings.fields;
        let other = self.scene.walls.iter().any(|wall| wall.motion != Motion::Fixed)
            || fields.near_field.is_some()
            || fields.magnetic.is_some()
            || self.pushed
            || self.settings.bond.is_some()
            || self.settings.bonds.is_some();
        let push = self.expectation.acceleration_m_s2 + 2.0 * self.expectation.speed_m_s / self.duration_s();
        (!other).then(|| self.mass_kg() * push)
    }

    /// Most particles that can lie on a plane with this normal.
    pub fn on_plane(&self, normal: [f64; 3]) -> f64 {
        let area_m2: f64 = {
            let [a, b, c] = [0, 1, 2].map(|axis| self.room.upper_m[axis] - self.room.lower_m[axis]);
            normal[0].abs() * b * c + normal[1].abs() * a * c + normal[2].abs() * a * b
        };
        if !self.room.confined {
            return self.number();
        }
        (PLANE_COVER * area_m2 / (PI * math::powi(self.smallest_m(), 2))).max(1.0).min(self.number())
    }

    /// Bound of the conductance in W/K of one contact, of those among which `press_n` is shared by `contacts`; `None` where
    /// the press is not known.
    ///
    /// A contact's area grows less than in proportion to its force for every law, so that the mean over time and contacts
    /// of the conductance is at most that at the mean force (Jensen's inequality). A contact with a wall conducts at least as
    /// well as one between particles.
    pub fn contact_conductance_w_k(&self, thermal: &ThermalSettings, contacts: f64, hottest_k: f64) -> Option<f64> {
        let (overlap_m, area_m2) = self.pressed(contacts, hottest_k)?;
        let [_, most] = self.conductivity_w_m_k(thermal);
        conductance(thermal.conductance, Partner::Wall, most, area_m2, self.largest_m() - overlap_m)
    }

    /// Overlap in m and area in m² of one of the contacts that share the press.
    fn pressed(&self, contacts: f64, hottest_k: f64) -> Option<(f64, f64)> {
        Some(self.particles.steady_contact(self.largest_m(), self.press_n()? / contacts.max(1.0), hottest_k))
    }

    /// Sum over the lasers of what they send, in J.
    pub fn light_j(&self) -> f64 {
        self.lasers.iter().map(|laser| laser.energy_j).sum()
    }

    /// Bound of the mean rise of temperature if all light is absorbed, and of the rise of the particle that gets most, in K.
    pub fn light_rise_k(&self, thermal: &ThermalSettings) -> [f64; 2] {
        let capacity = self.capacity_j_kg_k(thermal);
        let mean_k = self.light_j() / (self.mass_kg() * capacity);
        let peaks = self.lasers.iter().map(|laser| match laser.settings.model {
            Model::EnergyBalance => laser.energy_j / self.mass_kg(),
            _ => {
                let fluence_j_m2 = laser.fluence_j_m2(self.duration_s());
                let of = |body: &Body| {
                    fluence_j_m2 * laser.share_of(body) * PI * math::powi(body.radius_m, 2) / body.mass_kg
                };
                self.bodies.iter().map(of).fold(0.0, f64::max)
            }
        });
        // In a cloud that holds all the light no particle takes more than all of it.
        [mean_k, (peaks.sum::<f64>() / capacity).max(mean_k)]
    }

    /// Bounds of the mean rise by Joule heat and of any particle's, in K; `None` where it cannot be bounded.
    ///
    /// A current density that is a mean of its neighbours' is nowhere larger than the largest of the walls'. Between
    /// potentials no more current flows than the contacts with one electrode let through under all the tension.
    pub fn joule_rise_k(&self, thermal: &ThermalSettings) -> Option<[f64; 2]> {
        let Some(current) = self.scene.settings::<CurrentSettings>() else { return Some([0.0; 2]) };
        let on_s = (current.ends_s.min(self.duration_s()) - current.starts_s).max(0.0);
        let capacity = self.capacity_j_kg_k(thermal);
        let electrodes = || self.scene.walls.iter().map(|wall| wall.electrode);
        let [least_s_m, most_s_m] = current.conductivity.range_s_m();
        match current.model {
            CurrentModel::Averaging { heat_share } => {
                let densities =
                    self.bodies.iter().map(|body| body.mass_kg / (4.0 / 3.0 * PI * math::powi(body.radius_m, 3)));
                let density = densities.fold(f64::INFINITY, f64::min);
                let most = electrodes().filter_map(|electrode| electrode.current_density_a_m2);
                let most = most.fold(0.0f64, |most, own| most.max(own.abs()));
                // Where all particles carry it, the bound is met: the thousandth is for rounding.
                let rise_k = 1.001 * heat_share * most * most * on_s / (least_s_m.max(0.0) * density * capacity);
                rise_k.is_finite().then_some([rise_k; 2])
            }
            CurrentModel::Potential { conductance: model } => {
                if electrodes().any(|electrode| electrode.current_a.is_some()) {
                    return None;
                }
                let potentials = || electrodes().filter_map(|electrode| electrode.potential_v);
                let tension =
                    potentials().fold(f64::NEG_INFINITY, f64::max) - potentials().fold(f64::INFINITY, f64::min);
                let contacts = self.number();
                let (overlap_m, area_m2) = self.pressed(contacts, thermal.temperature_k)?;
                let one_s = conductance(model, Partner::Wall, most_s_m, area_m2, self.largest_m() - overlap_m)?;
                let heat_j = contacts * one_s * math::powi(tension.max(0.0), 2) * on_s;
                let lightest_kg = self.bodies.iter().map(|body| body.mass_kg).fold(f64::INFINITY, f64::min);
                Some([heat_j / (self.mass_kg() * capacity), heat_j / (lightest_kg * capacity)])
            }
        }
    }

    /// Bound of the temperature that anything would have that loses no heat and changes no phase, in K; `None` where the heat
    /// is not bounded.
    pub fn hottest_without_phases_k(&self, thermal: &ThermalSettings) -> Option<f64> {
        let own = thermal.start.iter().flat_map(|start| &start.temperatures_k).copied();
        let walls = self.scene.walls.iter().filter_map(|wall| wall.temperature_k);
        let walls = walls.chain(own).fold(thermal.temperature_k, f64::max);
        let [_, light_k] = self.light_rise_k(thermal);
        let [_, joule_k] = self.joule_rise_k(thermal)?;
        Some(walls + light_k + joule_k)
    }

    /// The same with phases: what has boiled leaves.
    pub fn hottest_k(&self, thermal: &ThermalSettings) -> Option<f64> {
        let phases = thermal.enthalpy.iter().flat_map(|enthalpy| &enthalpy.materials).map(|own| own.phases);
        let boils =
            phases.map(|own| own.and_then(|own| own.boiling).map_or(f64::INFINITY, |it| it.from_k + it.width_k));
        let boiled_k = boils.reduce(f64::max).unwrap_or(f64::INFINITY);
        self.hottest_without_phases_k(thermal).map(|hottest_k| hottest_k.min(boiled_k))
    }

    /// How long particles may move through the gas, in s: the run, or, where they fall onto something, twice the longest fall.
    pub fn flight_s(&self) -> f64 {
        let fields = &self.settings.fields;
        let falls = fields.electromagnetic.is_none() && self.speed_m_s().is_some() && !self.scene.walls.is_empty();
        let acceleration = self.expectation.acceleration_m_s2;
        if falls && acceleration > 0.0 {
            self.duration_s().min(2.0 * self.expectation.speed_m_s / acceleration)
        } else {
            self.duration_s()
        }
    }

    /// Speed that no particle exceeds, in m/s; `None` where forces act whose work is not known before the run.
    pub fn speed_m_s(&self) -> Option<f64> {
        let fields = &self.settings.fields;
        let unknown = fields.near_field.is_some() || fields.magnetic.is_some() || self.pushed;
        (!unknown).then_some(self.expectation.speed_m_s)
    }

    /// What the mean position is uncertain by once particles have met, in m: the least change grows until each lies elsewhere
    /// by about a diameter, at random, which for the mean of N is 2 R/√N. Zero for one particle.
    pub fn scatter_m(&self) -> f64 {
        let number = self.number();
        let diameter_m = self.bodies.iter().map(|body| 2.0 * body.radius_m * body.number).sum::<f64>() / number;
        if number > 1.0 { diameter_m / number.sqrt() } else { 0.0 }
    }

    /// How long the light warms particles, in s: half of the time it is on, as the mean rises evenly, and all that follows.
    pub fn warm_s(&self) -> f64 {
        let warm = |laser: &Laser<'_>| {
            let beam = &laser.settings.beam;
            let ends_s = beam.ends_s.min(self.duration_s());
            self.duration_s() - 0.5 * (beam.starts_s.min(ends_s) + ends_s)
        };
        self.lasers.iter().map(warm).fold(0.0, f64::max)
    }

    /// A bound of a mean and of a peak temperature as effects.
    pub fn temperatures(&self, mean_k: f64, peak_k: f64) -> Vec<Effect> {
        let start_k = self.settings.temperature_k;
        [(Quantity::MeanTemperature, mean_k), (Quantity::PeakTemperature, peak_k)]
            .map(|(quantity, at_most)| Effect { quantity, at_most, share: at_most / start_k })
            .into()
    }

    /// Edits that take tables out, and with them what the coupling says of their nodes and fields.
    pub fn without(&self, tables: &[&str], fields: &[&str]) -> Vec<Edit> {
        let tables = tables.iter().map(|table| (*table).to_owned());
        let of_nodes = tables.clone().map(|table| format!("coupling.every.{table}"));
        let of_fields =
            fields.iter().flat_map(|field| [format!("coupling.tolerance.{field}"), format!("coupling.fields.{field}")]);
        let given = |key: &String| {
            let below = format!("{key}.");
            self.scene.effective.iter().any(|value| value.path == *key || value.path.starts_with(&below))
        };
        let coupling: Vec<String> = of_nodes.chain(of_fields).filter(given).collect();
        tables.chain(coupling).map(|key| Edit::Delete { key }).collect()
    }
}

impl Laser<'_> {
    /// Most light that falls on a place over the run, in J/m²: the irradiance at points along the path, summed over instants.
    pub fn fluence_j_m2(&self, duration_s: f64) -> f64 {
        let beam = &self.settings.beam;
        let Path::Sweep { from_m, to_m, speed_m_s } = beam.path else {
            return self.energy_j * beam.profile.irradiance_1_m2(0.0);
        };
        let lit_s = (beam.ends_s.min(duration_s) - beam.starts_s).max(0.0);
        let length_m = (Vec3::from(to_m) - Vec3::from(from_m)).norm();
        // Steps of a tenth of the beam, so that the sum is an integral to some 1e-3; a bounded number for endless sweeps.
        let steps = (10.0 * speed_m_s * lit_s / beam.profile.radius_m()).clamp(100.0, 20_000.0) as usize;
        let spots: Vec<Vec3> =
            (0..steps).map(|k| beam.spot_m(beam.starts_s + lit_s * (k as f64 + 0.5) / steps as f64)).collect();
        let points = (10.0 * length_m / beam.profile.radius_m()).clamp(8.0, 64.0) as usize;
        let at = |k: usize| {
            let place = Vec3::from(from_m) + (Vec3::from(to_m) - Vec3::from(from_m)) * (k as f64 / points as f64);
            spots.iter().map(|spot| beam.profile.irradiance_1_m2((place - spot).norm())).sum::<f64>() / steps as f64
        };
        self.energy_j * (0..=points).map(at).fold(0.0, f64::max)
    }

    /// Bound of the share of the light meeting a particle's cross-section that it takes.
    ///
    /// Lines at a quarter of the radius sample a circle's area within 8 %; light that neighbours reflect at most doubles what
    /// falls on one.
    pub fn share_of(&self, body: &Body) -> f64 {
        match self.settings.model {
            Model::EnergyBalance => 0.0,
            Model::BeerLambert { absorption_1_m, spacing_m } => {
                let sampling = 1.0 + 0.32 * spacing_m / body.radius_m;
                super::absorbed_share(absorption_1_m * body.radius_m) * sampling
            }
            Model::BeerLambertMonograph { absorption_1_m } => 4.0 / 3.0 * absorption_1_m * body.radius_m,
            Model::Rays { .. } => 2.0,
        }
    }

    /// How long the beam lights a place it passes, in s: its width over its speed, or all its time.
    pub fn dwell_s(&self) -> f64 {
        let beam = &self.settings.beam;
        let on_s = if beam.power_w > 0.0 { self.energy_j / beam.power_w } else { 0.0 };
        match beam.path {
            Path::Fixed { .. } => on_s,
            Path::Sweep { speed_m_s, .. } => (2.0 * beam.profile.radius_m() / speed_m_s).min(on_s),
        }
    }
}

/// What the dispensers pour, each as particles of its mean size.
fn poured(settings: &ParticlesSettings, duration_s: f64) -> Vec<Body> {
    let of = |pour: &stagger_physics::particles::Pour| {
        let open_s = (pour.until_s.min(duration_s) - pour.from_s).max(0.0);
        let number = (pour.rate_1_s * open_s).ceil().min(pour.limit.map_or(f64::INFINITY, |limit| limit as f64));
        let radius_m = match pour.radius {
            // The mean of R³ is that of a particle of this size.
            Radius::Uniform { mean_m, spread_m } => math::cbrt(mean_m * (mean_m * mean_m + spread_m * spread_m)),
            Radius::LogNormal { mean_m, .. } => mean_m,
        };
        let density = settings.materials.get(usize::from(pour.material)).map_or(0.0, |own| own.density_kg_m3);
        Body { radius_m, mass_kg: density * 4.0 / 3.0 * PI * math::powi(radius_m, 3), number }
    };
    settings.pours.iter().map(of).filter(|body| body.number > 0.0).collect()
}

/// The box about the start and the dispensers, widened to the walls that hold the particles sideways.
fn room(scene: &Scene, expectation: &Expectation, settings: &ParticlesSettings) -> Room {
    let mut lower_m = [f64::INFINITY; 3];
    let mut upper_m = [f64::NEG_INFINITY; 3];
    let mut reach = |place: [f64; 3], radius_m: f64| {
        for axis in 0..3 {
            lower_m[axis] = lower_m[axis].min(place[axis] - radius_m);
            upper_m[axis] = upper_m[axis].max(place[axis] + radius_m);
        }
    };
    for (place, &radius_m) in expectation.positions_m.iter().zip(&expectation.radii_m) {
        reach(*place, radius_m);
    }
    for pour in &settings.pours {
        for corner in pour.region.corners_m() {
            reach(corner.into(), 0.0);
        }
    }
    let gravity = settings.gravity_m_s2;
    let down = (0..3).fold(0, |most, axis| if gravity[axis].abs() > gravity[most].abs() { axis } else { most });
    let mut confined = false;
    for wall in &scene.walls {
        match &wall.shape {
            Shape::Box { lower_m: from, upper_m: to, .. } => {
                for axis in (0..3).filter(|axis| *axis != down) {
                    (lower_m[axis], upper_m[axis]) = (from[axis], to[axis]);
                }
                confined = true;
            }
            Shape::Cylinder(cylinder) if cylinder.length_m.is_none() => {
                for axis in (0..3).filter(|axis| *axis != down) {
                    lower_m[axis] = cylinder.through_m[axis] - cylinder.radius_m;
                    upper_m[axis] = cylinder.through_m[axis] + cylinder.radius_m;
                }
                confined = true;
            }
            _ => {}
        }
    }
    // Without gravity or anything to push them apart, particles stay where they are.
    Room { lower_m, upper_m, confined }
}
