//! Fault: uneven frames.
