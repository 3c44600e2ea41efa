//! Fault: vtk legacy sections.
