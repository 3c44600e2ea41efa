//! The physics of stagger, each a pure [`Physics`](stagger_coupling::Physics) in a folder of its own. They meet in fields
//! alone; what several of them use is in [`common`].
//!
//! Use it for the models by themselves: a contact law, the heat through a contact, the light of a beam. A scene of them is run
//! by stagger-scene, which also lists them.
//!
//! ```
//! use stagger_physics::common::{Conductance, Partner, conductance};
//!
//! // Heat through a spot of radius 1 µm between two grains of steel 50 µm apart, at 20 W/(m K): a spot between half-spaces
//! // (Holm 1967), and the monograph's bar (Zohdi 2018, eq. 6.35).
//! let (area_m2, distance_m) = (std::f64::consts::PI * 1e-12, 50e-6);
//! let between = |model| conductance(model, Partner::Particle, 20.0, area_m2, distance_m);
//! let spot_w_k = between(Conductance::Constriction).ok_or("no distance")?;
//! let bar_w_k = between(Conductance::Monograph).ok_or("no distance")?;
//! assert!((spot_w_k - 40e-6).abs() < 1e-12);
//! assert!(bar_w_k < 0.05 * spot_w_k, "a bar as thin as the spot conducts far less");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
