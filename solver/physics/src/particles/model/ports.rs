//! The ports of the particles: what they write, and the fields of others that belong to it.

use std::sync::Arc;

use stagger_messages::{Geometry, Measure, Port, Ports};

use crate::{common::PARTICLES, particles::settings::Settings};

/// The temperature that softens contacts.
pub const TEMPERATURE: &str = "temperature";
/// The push of sound.
pub const PUSH: &str = "acoustic_force";
/// The flag of particles that have boiled away, which leave.
pub const VAPOURISED: &str = "vapourised";

/// All ports of the particles.
#[derive(Debug)]
pub struct ParticlePorts {
    pub positions: Arc<Port>,
    pub velocities: Arc<Port>,
    pub radii: Arc<Port>,
    /// Written where particles come and go.
    pub ids: Arc<Port>,
    pub material: Arc<Port>,
    pub contacts: ContactPorts,
    pub wall_contacts: ContactPorts,
    pub wall_loads: WallLoadPorts,
}

impl ParticlePorts {
    /// The ports of particles with these settings.
    pub fn new(settings: &Settings) -> Self {
        let vectors = |name, unit, measure| Arc::new(Port::f64(name, unit, PARTICLES, 3, measure));
        Self {
            positions: vectors("positions", "m", Measure::Increment),
            velocities: vectors("velocities", "m/s", Measure::None),
            radii: Arc::new(Port::f64("radii", "m", PARTICLES, 1, Measure::None)),
            ids: Arc::new(Port::u32("ids", PARTICLES, 1)),
            material: Arc::new(Port::u32("material", PARTICLES, 1)),
            contacts: ContactPorts::new("contact", "contacts", settings.writes_contact_forces),
            wall_contacts: ContactPorts::new("wall_contact", "wall-contacts", settings.writes_contact_forces),
            wall_loads: WallLoadPorts::new(),
        }
    }

    /// Those that are read and written with these settings.
    pub fn declared(&self, settings: &Settings) -> Ports {
        let read = |name, unit, components| Port::f64(name, unit, PARTICLES, components, Measure::None).as_optional();
        let mut reads = Vec::new();
        reads.extend((settings.contact.softening_rate > 0.0).then(|| read(TEMPERATURE, "K", 1)));
        let deflects = settings.substrate.is_some_and(|under| under.deflects);
        reads.extend(deflects.then(|| (*self.wall_loads.deflection).clone()));
        // Several beams of sound may push.
        reads.push(read(PUSH, "N", 3).as_sum());
        // Rows that go are followed by their ids.
        reads.extend(settings.come_and_go().then(|| Port::u8(VAPOURISED, PARTICLES, 1).as_optional()));

        let loads = settings.substrate.map(|_| self.wall_loads.written());
        let written = [&self.positions, &self.velocities, &self.radii].into_iter();
        let written = written.chain(self.contacts.all()).chain(self.wall_contacts.all());
        let written = written.chain(loads.into_iter().flatten()).chain(settings.come_and_go().then_some(&self.ids));
        let written = written.chain(settings.writes_material.then_some(&self.material));
        let particles = &self.positions.support;
        Ports::new(reads, written.map(|port| (**port).clone()).collect())
            .with(Geometry::spheres(particles, &self.positions.field, &self.radii.field))
            .with(self.contacts.geometry(particles, particles))
            .with(self.wall_contacts.geometry(particles, "walls"))
    }
}

/// Ports of one list of contacts: indices, area, distance; the force where it is asked for.
#[derive(Debug)]
pub struct ContactPorts {
    pub pairs: Arc<Port>,
    pub area: Arc<Port>,
    pub distance: Arc<Port>,
    pub force: Option<Arc<Port>>,
}

impl ContactPorts {
    /// Ports on `support`, their names beginning with `prefix`.
    pub fn new(prefix: &str, support: &str, forces: bool) -> Self {
        let port = |name: &str, unit| Port::f64(&format!("{prefix}_{name}"), unit, support, 1, Measure::None);
        Self {
            pairs: Arc::new(Port::u32(&format!("{prefix}_pairs"), support, 2)),
            area: Arc::new(port("area", "m^2")),
            distance: Arc::new(port("distance", "m")),
            force: forces.then(|| Arc::new(port("normal_force", "N"))),
        }
    }

    /// The support of the list: pairs of rows of `of` and `with`.
    pub fn geometry(&self, of: &str, with: &str) -> Geometry {
        Geometry::pairs(&self.pairs.support, &self.pairs.field, of, with)
    }

    pub fn all(&self) -> impl Iterator<Item = &Arc<Port>> {
        [&self.pairs, &self.area, &self.distance].into_iter().chain(&self.force)
    }
}

/// Ports of what a substrate reads.
#[derive(Debug)]
pub struct WallLoadPorts {
    pub force: Arc<Port>,
    pub position: Arc<Port>,
    /// What it answers where it gives way.
    pub deflection: Arc<Port>,
}

impl WallLoadPorts {
    pub fn new() -> Self {
        let port = |name: &str, unit| Arc::new(Port::f64(name, unit, "wall-contacts", 3, Measure::None));
        Self {
            force: port("wall_contact_force", "N"),
            position: port("wall_contact_position", "m"),
            deflection: Arc::new(Port::f64("wall_deflection", "m", PARTICLES, 1, Measure::None)),
        }
    }

    pub fn written(&self) -> [&Arc<Port>; 2] {
        [&self.force, &self.position]
    }
}
