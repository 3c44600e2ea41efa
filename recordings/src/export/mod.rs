//! Files for other programs.

pub mod vtp;
