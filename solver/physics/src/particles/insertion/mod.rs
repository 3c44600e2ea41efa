//! Particles that come and go: at the start of a window, from what is committed alone.

pub mod inlet;
pub mod moved;
pub mod renewed;
