//! Fault: elastic imbalance.
