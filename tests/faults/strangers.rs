//! Fault: strangers.
