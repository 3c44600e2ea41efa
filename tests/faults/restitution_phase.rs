//! Fault: restitution phase.
