//! Gravity and the fields that act on one particle alone.

use super::input::{KernelInput, Load};
use crate::particles::model::{Model, state::Dissipation};

impl KernelInput<'_> {
    /// Gravity and the fields on the particles of a block.
    pub fn fields(self, range: std::ops::Range<usize>, loads: &mut [Load]) -> Dissipation {
        let Model { fields, gravity, .. } = self.model;
        let mut lost = Dissipation::default();
        let empty = fields.is_empty();
        for (i, load) in range.zip(loads) {
            let (place, body) = (&self.places[i], &self.bodies[i]);
            load.force = gravity * body.mass;
            if !empty {
                let acting = fields.body(place.radius, body.mass);
                let force = fields.force(self.t_s, &place.position, &body.velocity, acting);
                load.force += force.force;
                lost.drag += force.drag_w;
                lost.fields -= force.gained_w;
            }
        }
        lost
    }
}
