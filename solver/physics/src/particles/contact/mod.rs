//! What happens in one contact: how its bodies lie and move, and the laws of its forces.

pub mod damping;
pub mod force;
pub mod friction;
pub mod hertz;
pub mod kinematics;
pub mod law;
pub mod linear;
pub mod monograph_bond;
pub mod normal;
pub mod overlap;
pub mod pair_table;
pub mod rolling;
pub mod softening;
pub mod tangential;
pub mod tangential_spring;
