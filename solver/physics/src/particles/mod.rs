//! Particle dynamics: contact, damping, friction, drag and gravity of spheres (Zohdi 2018, ch. 6), integrated inside
//! each coupling window.
//!
//! The folders stand one upon the other in this order, and each takes from those before it alone:
//!
//! 1. `settings`: what a scene says of its particles, in SI units, and the ranges of it
//! 2. `contact`: one contact, its kinematics and its laws
//! 3. `bonds`: bonds with a state of their own
//! 4. `fields`: electric, magnetic and near fields, and drag
//! 5. `search`: lists of what may touch, and what contacts remember entry by entry
//! 6. `model`: the data; `Model` stays as it is during a run, [`State`] goes from window to window
//! 7. `kernel`: the contact loops
//! 8. `exchange`: fields of other physics in, fields and energies out
//! 9. `motion`: forces, substeps and integrators
//! 10. `insertion`: particles that come and go
//! 11. `window`: one window as a whole
//! 12. `start`: where particles are at t = 0
//! 13. `advice`: what a scene could do without or lacks, before it runs
//! 14. `tradeoff`: settings that trade speed for accuracy
//! 15. `keys`: reads what a scene says of them

pub mod advice;
pub mod bonds;
mod contact;
mod exchange;
pub mod fields;
mod insertion;
mod kernel;
pub mod keys;
mod model;
mod motion;
mod search;
mod settings;
pub mod start;
mod tradeoff;
mod window;

use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::Ports;

pub use insertion::{
    inlet::Poured,
    moved::{Body, Moved},
};
use model::ports::ParticlePorts;
pub use model::state::State;
pub use settings::*;

/// The particles of a scene.
///
/// Writes `positions`, `velocities`, `radii` and the contacts between particles and with walls, all at the window's
/// end; reads, where somebody writes them, `temperature` if it softens the contacts, and `acoustic_force`, the push of sound.
#[derive(Debug)]
pub struct Particles(model::Model);

impl Particles {
    /// Places the particles of `settings` and derives what does not change during a run.
    ///
    /// # Errors
    /// [`SolveError::Start`] where the start cannot be made, [`SolveError::Mismatch`] where a setting is out of its
    /// range; the message names the setting.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        start::model(settings).map(Self)
    }
}

impl Physics for Particles {
    type State = State;

    fn ports(&self) -> Ports {
        self.0.ports.declared(&self.0.settings)
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        window::initial(&self.0)
    }

    fn solve(&self, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        window::solve(&self.0, state, frozen, window)
    }
}

impl crate::Settings for Settings {
    type Physics = Particles;

    fn ports(&self) -> Ports {
        ParticlePorts::new(self).declared(self)
    }

    fn build(self) -> Result<Particles, SolveError> {
        Particles::new(self)
    }

    /// Settling can take minutes; whether particles can be placed where they fall from is known at once.
    fn check(&self) -> Result<(), SolveError> {
        Particles::new(self.clone().without_settling()).map(drop)
    }
}
