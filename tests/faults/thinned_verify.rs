//! Fault: thinned verify.
