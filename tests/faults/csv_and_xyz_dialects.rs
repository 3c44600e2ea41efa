//! Fault: csv and xyz dialects.
