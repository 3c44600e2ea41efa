//! Fault: shell limits.
