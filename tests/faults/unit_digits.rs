//! Fault: unit digits.
