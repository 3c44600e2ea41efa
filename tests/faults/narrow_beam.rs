//! Fault: narrow beam.
