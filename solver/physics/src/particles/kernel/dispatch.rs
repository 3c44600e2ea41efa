//! Chooses the contact loop that is compiled for a scene's laws.

use super::{
    input::{KernelInput, Task},
    pairs::PairKernel,
};
use crate::{
    common::width,
    particles::{
        contact::{
            friction::{Frictionless, Regularised},
            law::Law,
            normal::Normal,
            tangential::Tangential,
            tangential_spring::TangentialSpring,
        },
        model::state::Dissipation,
        settings::Friction,
    },
};

impl KernelInput<'_> {
    /// Adds the loads by the contacts of a block.
    pub fn contacts(self, task: Task<'_>) -> Dissipation {
        match self.model.contact.law {
            Law::Overlap(law) => self.of_law(law, task),
            Law::Hertz(law) => self.of_law(law, task),
            Law::Linear(law) => self.of_law(law, task),
        }
    }

    fn of_law<N: Normal>(self, law: N, task: Task<'_>) -> Dissipation {
        match self.model.settings.friction {
            None => self.of_laws(law, Frictionless, task),
            Some(Friction::Regularised { .. }) => self.of_laws(law, Regularised, task),
            Some(Friction::Spring { .. }) => self.of_laws(law, TangentialSpring, task),
        }
    }

    fn of_laws<N: Normal, T: Tangential>(self, law: N, tangential: T, mut task: Task<'_>) -> Dissipation {
        let mut lost = width::chosen().dispatch(PairKernel { input: self, law, tangential, task: &mut task });
        lost += self.walls(law, tangential, &mut task);
        lost
    }
}
