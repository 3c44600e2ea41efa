//! What a physics is to everything that does not know it: a name, keys of a scene, ports, and a participant.

use std::{any::Any, collections::BTreeSet, fmt, sync::Arc};

use serde::Serialize;
use stagger_config::{key::Section, reader::Table};
use stagger_coupling::{Local, Participant, Physics, SolveError};
use stagger_messages::Ports;

use crate::common::{
    Bodies, OnSubstrate, Pictured, SolidSurface, Wall, advice::Advisor, grid::CellGrid, keys::materials::Materials,
    tradeoff::Tradeoff,
};

/// One kind of physics, as its folder describes it; `built_in` of stagger-scene lists them.
#[derive(Debug)]
pub struct PhysicsKind {
    /// Its name: that of its table in a scene and of the node that runs it, where the scene gives no other.
    pub name: &'static str,
    /// What it computes, in a few words: `"the temperatures of [thermal]"`.
    pub computes: &'static str,
    /// What its table describes, for the top of a scene.
    pub doc: &'static str,
    /// What it means that the table is absent.
    pub absent: &'static str,
    /// Keys of its table.
    pub section: &'static Section,
    /// Place in the order of solving where the scene names none: what moves, then what heats, then what only follows.
    pub rank: u32,
    /// Where its table says what the bodies of the scene are, which others need to know of: reads that part of it.
    pub bodies: Option<ReadBodies>,
    /// Reads its table; `None` only where a mistake was reported.
    pub read: fn(Table<'_>, &Surroundings<'_, '_>) -> Option<Arc<dyn Configured>>,
    /// What it contributes to advice on scenes; `None` contributes nothing.
    pub advice: Option<&'static Advisor>,
    /// What it contributes to trade-offs between speed and accuracy; `None` contributes nothing.
    pub tradeoff: Option<&'static Tradeoff>,
    /// Its quantities that pictures of a run show first.
    pub pictured: &'static [Pictured],
}

/// Settings as a scene holds those of any physics; none where a mistake was reported.
pub fn configured<S: Settings>(settings: Option<S>) -> Option<Arc<dyn Configured>> {
    settings.map(|settings| Arc::new(settings) as Arc<dyn Configured>)
}

/// Reads what the bodies of a scene are; without a table there are none.
pub type ReadBodies = for<'d> fn(Option<Table<'d>>, &Materials, &[Wall], u64) -> Bodies<'d>;

/// What a physics may know of a scene beside its own table.
#[derive(Clone, Copy)]
pub struct Surroundings<'s, 'd> {
    /// What the particles are.
    pub bodies: &'s Bodies<'d>,
    /// Walls, in the order of the scene.
    pub walls: &'s [Wall],
    /// The materials that there are.
    pub materials: &'s Materials,
    /// Grids of cells, in the order of the scene.
    pub grids: &'s [CellGrid],
    /// Seed of everything random.
    pub seed: u64,
    /// Ports of the physics that were read before it.
    pub others: &'s [Ports],
    /// The wall with a solid under it, where a physics computes that.
    pub on_substrate: Option<OnSubstrate>,
    /// The upper face of a solid on a grid, where a physics that was read before computes one.
    pub solid: Option<&'s SolidSurface>,
}

impl Surroundings<'_, '_> {
    /// Names of the fields that the physics read before write.
    #[must_use]
    pub fn written(&self) -> BTreeSet<&str> {
        self.others.iter().flat_map(|ports| &ports.writes).map(|port| port.field.as_str()).collect()
    }

    /// Names of the fields that the physics read before read.
    #[must_use]
    pub fn read(&self) -> BTreeSet<&str> {
        self.others.iter().flat_map(|ports| &ports.reads).map(|port| port.field.as_str()).collect()
    }
}

/// Settings of a physics: everything that it depends on, in SI units.
pub trait Settings: Clone + fmt::Debug + Serialize + Send + Sync + 'static {
    /// The physics.
    type Physics: Physics + 'static;

    /// Fields read and written, known without building anything.
    fn ports(&self) -> Ports;

    /// Builds the physics.
    ///
    /// # Errors
    /// A setting is outside its range, or the start asked for cannot be made.
    fn build(self) -> Result<Self::Physics, SolveError>;

    /// Whether the physics can be built, found out as far as it takes no long time.
    ///
    /// # Errors
    /// As in [`Self::build`].
    fn check(&self) -> Result<(), SolveError> {
        self.clone().build().map(drop)
    }

    /// The wall under which it computes a solid.
    fn on_substrate(&self) -> Option<OnSubstrate> {
        None
    }

    /// The upper face of the solid on a grid that it computes.
    fn solid_surface(&self) -> Option<SolidSurface> {
        None
    }

    /// Mean changes of its fields, in their units, that suffice for convergence where the scene gives none.
    fn absolute_tolerances(&self, bodies: &Bodies<'_>) -> Vec<(&'static str, f64)> {
        let _ = bodies;
        Vec::new()
    }
}

/// [`Settings`] of any physics.
pub trait Configured: Any + fmt::Debug + Send + Sync {
    /// Fields read and written.
    fn ports(&self) -> Ports;

    /// The participant that runs under the name of a node.
    ///
    /// # Errors
    /// As in [`Settings::build`].
    fn participant(&self, node: &str) -> Result<Box<dyn Participant>, SolveError>;

    /// Whether it can be built.
    ///
    /// # Errors
    /// As in [`Settings::check`].
    fn check(&self) -> Result<(), SolveError>;

    /// The wall under which it computes a solid.
    fn on_substrate(&self) -> Option<OnSubstrate>;

    /// The upper face of the solid on a grid that it computes.
    fn solid_surface(&self) -> Option<SolidSurface>;

    /// Mean changes of its fields that suffice for convergence where the scene gives none.
    fn absolute_tolerances(&self, bodies: &Bodies<'_>) -> Vec<(&'static str, f64)>;

    /// The settings as JSON; a number that is not finite is `null`.
    fn to_json(&self) -> serde_json::Value;

    /// Itself, for those that know the physics.
    fn as_any(&self) -> &dyn Any;
}

impl<S: Settings> Configured for S {
    fn ports(&self) -> Ports {
        Settings::ports(self)
    }

    fn participant(&self, node: &str) -> Result<Box<dyn Participant>, SolveError> {
        Ok(Box::new(Local::new(node, self.clone().build()?)))
    }

    fn check(&self) -> Result<(), SolveError> {
        Settings::check(self)
    }

    fn on_substrate(&self) -> Option<OnSubstrate> {
        Settings::on_substrate(self)
    }

    fn solid_surface(&self) -> Option<SolidSurface> {
        Settings::solid_surface(self)
    }

    fn absolute_tolerances(&self, bodies: &Bodies<'_>) -> Vec<(&'static str, f64)> {
        Settings::absolute_tolerances(self, bodies)
    }

    fn to_json(&self) -> serde_json::Value {
        // Settings are numbers, texts, lists and structures, which JSON has.
        serde_json::to_value(self).unwrap_or_default()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
