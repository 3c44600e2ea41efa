//! Fault: every3 vapour.
