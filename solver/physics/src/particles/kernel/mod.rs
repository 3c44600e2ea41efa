//! The contact loops: all contacts of a block, with each other and with walls, in the processor's registers.

pub mod dispatch;
pub mod fields;
pub mod input;
pub mod pairs;
pub mod sinking;
pub mod sliding;
pub mod walls;
