//! The bed that benches and examples share: equal glass spheres in a box without a lid.
#![allow(dead_code, reason = "each program that includes it uses a part of it")]

use stagger_physics::{
    common::{Shape, Wall},
    particles::{Contact, ContactLaw, Friction, Integrator, Lattice, Material, Settings, Start, StartRegion},
};

/// Radius of every particle, in m.
pub const RADIUS_M: f64 = 0.5e-3;
/// Density, in kg/m³.
pub const DENSITY_KG_M3: f64 = 2500.0;

/// Hertz's law with E = 10 MPa, ν = 0.3.
pub const HERTZ: ContactLaw = ContactLaw::Hertz { young_pa: 1e7, poisson: 0.3 };

/// Friction with a tangential spring (Mindlin), μ = 0.5.
pub const SPRING: Friction =
    Friction::Spring { stiffness_ratio: None, damping_ratio: None, static_coefficient: 0.5, dynamic_coefficient: 0.5 };

/// Particles that start at `start` in a box of `width_m`, with restitution 0.5 and steps of `step_s`.
pub fn settings(start: Start, width_m: f64, law: ContactLaw, friction: Option<Friction>, step_s: f64) -> Settings {
    let material = Material { name: "glass".into(), density_kg_m3: DENSITY_KG_M3, stiffness: None, poisson: None };
    Settings {
        contact: Contact { softening_floor_pa: 0.0, restitution: Some(0.5), ..Contact::new(law) },
        friction,
        walls: walls(width_m),
        spin: true,
        integrator: Integrator::Verlet { substep_s: Some(step_s) },
        ..Settings::new(start, material, law)
    }
}

/// Floor and four sides.
pub fn walls(width_m: f64) -> Vec<Wall> {
    let plane = |name: &str, through, normal| Wall::fixed(name, Shape::plane(through, normal), None);
    vec![
        plane("floor", [0.0; 3], [0.0, 0.0, 1.0]),
        plane("left", [0.0; 3], [1.0, 0.0, 0.0]),
        plane("right", [width_m, 0.0, 0.0], [-1.0, 0.0, 0.0]),
        plane("front", [0.0; 3], [0.0, 1.0, 0.0]),
        plane("back", [0.0, width_m, 0.0], [0.0, -1.0, 0.0]),
    ]
}

/// Particles given one by one, at rest in the order of `positions_m`.
pub fn given(positions_m: Vec<[f64; 3]>, velocities_m_s: Vec<[f64; 3]>) -> Start {
    let count = positions_m.len();
    Start::Given {
        positions_m,
        velocities_m_s,
        radii_m: vec![RADIUS_M; count],
        materials: vec![0; count],
        spins_rad_s: Vec::new(),
    }
}

/// A loose heap of `count` particles, about 25 layers of a simple cubic lattice that is 2 % wider than they are, each a
/// little off its site; and the width of the box.
pub fn loose(count: usize) -> (Start, f64) {
    let spacing_m = 1.02 * 2.0 * RADIUS_M;
    let columns = ((count as f64 / 25.0).sqrt().ceil()).max(1.0);
    let layers = (count as f64 / (columns * columns)).ceil() + 1.0;
    let width_m = columns * spacing_m;
    let region = StartRegion::Box { lower_m: [0.0; 3], upper_m: [width_m, width_m, layers * spacing_m] };
    let start =
        Start::Lattice { region, lattice: Lattice::SimpleCubic, spacing: 1.02, jitter: 1.0, velocity_m_s: [0.0; 3] };
    (start, width_m)
}
