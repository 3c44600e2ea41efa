//! Fault: words and sizes.
