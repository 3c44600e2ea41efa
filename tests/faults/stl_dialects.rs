//! Fault: stl dialects.
