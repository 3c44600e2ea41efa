//! Fault: mesh floor.
