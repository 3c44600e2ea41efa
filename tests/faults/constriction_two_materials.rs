//! Fault: constriction two materials.
