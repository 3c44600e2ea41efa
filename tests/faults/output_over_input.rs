//! Fault: output over input.
