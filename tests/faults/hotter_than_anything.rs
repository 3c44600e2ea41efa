//! Fault: hotter than anything.
