//! Fault: two conductivities.
