//! Fault: vtk xml attributes.
