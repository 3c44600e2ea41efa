//! What may touch: lists of neighbours and of near walls, block by block, and what their entries remember.

pub mod blocks;
pub mod contact_history;
pub mod lists;
pub mod neighbours;
pub mod wall_list;
pub mod z_curve;
