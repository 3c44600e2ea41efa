//! The contacts of one block's particles with walls.

use super::{
    Vec3,
    contact::{Meeting, Normal, Tangential},
    kernel::{Bed, Task, inertia},
    lanes::Triple,
    state::Dissipation,
};

impl Bed<'_> {
    /// Adds the loads by the walls.
    pub fn walls<N: Normal, T: Tangential>(self, law: N, tangential: T, task: &mut Task<'_>) -> Dissipation {
        let Self { particles, places, bodies, materials, step_s, .. } = self;
        let Task { block, walls, springs, loads, .. } = task;
        let surface = &particles.surface;
        let mut lost = Dissipation::default();
        for (entry, wall) in walls.iter().enumerate() {
            let k = wall.particle as usize;
            let i = block.first as usize + k;
            let (here, body) = (&places[i], &bodies[i]);
            let plane = &particles.planes[wall.plane as usize];
            let overlap = here.radius - plane.distance(&here.position);
            if overlap <= 0.0 {
                if T::REMEMBERS {
                    springs.part_wall(entry);
                }
                continue;
            }
            let meeting = Meeting {
                normal: Triple::from(-plane.normal),
                overlap,
                length: here.radius,
                touch: law.wall(overlap, here.radius),
                modulus: body.modulus,
                reduced_mass: body.mass,
                velocity: Triple::from(-body.velocity),
                rolling: Triple::from(body.spin * here.radius),
                turning: Triple::from(-body.spin),
                reduced_inertia: inertia(body.mass, here.radius),
                spring: Triple::from(if T::REMEMBERS { *springs.wall(entry) } else { Vec3::zeros() }),
                step_s,
            };
            let pair = particles.table.get(materials[i], materials[i]);
            let response = surface.respond(tangential, pair, &meeting);
            lost.contact_damping += response.damping_w;
            lost.friction += response.friction_w;
            lost.rolling += response.rolling_w;
            if T::REMEMBERS {
                springs.meet_wall(entry, Vec3::from(response.spring));
            }
            let load = &mut loads[k];
            load.force += Vec3::from(response.force);
            if surface.spin {
                load.moment += Vec3::from(response.couple) * here.radius + Vec3::from(response.resistance);
            }
        }
        lost
    }
}
