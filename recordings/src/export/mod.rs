//! Files for other programs.

mod arrays;
pub mod vti;
pub mod vtp;
pub mod vtr;

pub use arrays::VtkError;
