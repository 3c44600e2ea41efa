//! Fault: rotating wall.
