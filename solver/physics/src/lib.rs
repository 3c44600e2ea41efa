//! The physics of stagger, each a pure [`Physics`](stagger_coupling::Physics) in a folder of its own. They meet in fields
//! alone; what several of them use is in [`common`].

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod acoustics;
pub mod common;
pub mod current;
mod kind;
pub mod optics;
pub mod particles;
pub mod solid;
pub mod substrate;
pub mod thermal;

pub use kind::{Configured, PhysicsKind, ReadBodies, Settings, Surroundings, configured};
