//! The contacts of one block's particles with walls.

use super::input::{KernelInput, Task};
use crate::{
    common::{Vec3, simd::Triple},
    particles::{
        contact::{
            kinematics::{ContactKinematics, wall_arm},
            normal::Normal,
            tangential::Tangential,
        },
        model::{
            bodies::sphere_inertia,
            state::{Dissipation, WallLoad},
        },
    },
};

impl KernelInput<'_> {
    /// Adds the loads by the walls, and those on them.
    pub fn walls<N: Normal, T: Tangential>(self, law: N, tangential: T, task: &mut Task<'_>) -> Dissipation {
        let Self { model, places, bodies, materials, poses, sinking, step_s, stopping_share, touch_s, .. } = self;
        let Task { block, walls, contact_history, loads, on_walls, on_contacts, touches, rate_1_s2, .. } = task;
        let surface = &model.contact.surface;
        let mut lost = Dissipation::default();
        for encounter in &walls.encounters {
            let k = encounter.particle as usize;
            let i = block.first as usize + k;
            let wall = encounter.wall as usize;
            let (here, body) = (&places[i], &bodies[i]);
            let pose = &poses[wall];
            let (sunk_m, sinking_m_s) = sinking.map_or((0.0, 0.0), |sinking| sinking.under(i, wall));
            touches.clear();
            let features = &walls.features[encounter.range()];
            let seen = model.seen_from(wall, pose, &here.position, sunk_m);
            model.walls.surfaces[wall].touch(&seen, here.radius, features, touches);
            if T::REMEMBERS {
                contact_history.note_walls(encounter.range(), touches);
            }
            for touch in touches.iter() {
                let entry = encounter.features.start as usize + touch.entry as usize;
                let normal = pose.to_world_direction(&touch.normal);
                let overlap = here.radius - touch.distance;
                let touched = here.position - normal * touch.distance;
                let velocity = pose.velocity_at(&touched);
                let patch = law.wall(overlap, here.radius);
                let arm = wall_arm(surface.arms_by_radius, touch.distance, here.radius);
                let kinematics = ContactKinematics {
                    normal: Triple::from(-normal),
                    overlap,
                    length: here.radius,
                    patch_m2: patch.area_m2,
                    stiffness: patch.shared(touch.share),
                    modulus: body.modulus,
                    // The dampers of all contacts give the restitution with the stiffness of all.
                    reduced_mass: body.mass / touch.crowd,
                    velocity: Triple::from(velocity - body.velocity),
                    rolling: Triple::from(body.spin * arm),
                    turning: Triple::from(-body.spin),
                    reduced_inertia: sphere_inertia(body.mass, here.radius),
                    spring: Triple::from(if T::REMEMBERS { *contact_history.wall(entry) } else { Vec3::zeros() }),
                    step_s,
                    stopping_share,
                    touch_s,
                };
                let pair = model.contact.table.get(materials[i], model.walls.materials[wall]);
                let contact = surface.contact_force(tangential, pair, &kinematics);
                **rate_1_s2 = rate_1_s2.max(contact.rate_1_s2);
                lost.contact_damping += contact.damping_w;
                lost.friction += contact.friction_w;
                lost.rolling += contact.rolling_w;
                if T::REMEMBERS {
                    *contact_history.wall_mut(entry) = Vec3::from(contact.spring);
                }
                let load = &mut loads[k];
                let force = Vec3::from(contact.force);
                load.force += force;
                if surface.spin {
                    load.moment += Vec3::from(contact.couple) * arm + Vec3::from(contact.resistance);
                }
                on_walls[wall] -= force;
                if model.settings.substrate.is_some() {
                    on_contacts.push(WallLoad { pair: [i as u32, encounter.wall], force: -force, position: touched });
                }
                if sinking_m_s != 0.0 {
                    // A sinking surface works on what is stored. Damping does not feel its rate: that grows as windows get
                    // shorter, and the iteration with the substrate would not contract.
                    let opening = kinematics.velocity.dot(kinematics.normal);
                    let damping_n = if opening == 0.0 { 0.0 } else { contact.damping_w / opening };
                    lost.walls += (force.dot(&normal) + damping_n) * sinking_m_s;
                }
                if !model.is_force_controlled(wall) {
                    lost.walls -= force.dot(&velocity);
                }
            }
        }
        lost
    }
}
