//! Fault: deflection diverges.
