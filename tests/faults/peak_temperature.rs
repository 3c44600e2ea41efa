//! Fault: peak temperature.
