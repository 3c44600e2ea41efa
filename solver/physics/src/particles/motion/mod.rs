//! The motion of the particles within a window: forces, substeps and integrators.

pub mod anderson;
#[cfg(test)]
mod critical_step_tests;
pub mod expectation;
pub mod finish;
pub mod fixed;
pub mod force_controlled_walls;
pub mod forces;
pub mod gyration;
pub mod integrate;
pub mod prepare;
pub mod start_forces;
pub mod state_at;
pub mod substep;
pub mod trapezoidal;
pub mod verlet;
