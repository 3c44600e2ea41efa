//! Fault: rows not checked.
