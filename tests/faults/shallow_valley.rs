//! Fault: shallow valley.
