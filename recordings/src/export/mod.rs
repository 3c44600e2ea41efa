//! Files for other programs.

mod arrays;
pub mod vti;
pub mod vtp;

pub use arrays::VtkError;
