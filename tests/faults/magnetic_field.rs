//! Fault: magnetic field.
