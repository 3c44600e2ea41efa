//! Fault: angular momentum.
