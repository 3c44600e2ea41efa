//! Fault: broken pipe.
