//! Keys of a scene that belong to no physics alone: materials, walls, beams and rays.

pub mod beam;
pub mod grids;
pub mod materials;
pub mod rays;
pub mod walls;
