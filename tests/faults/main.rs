//! Small inputs that once went wrong, one file a fault: its scene, what is right, and why.
//!
//! Right values come from closed forms, from a file format's own writer, or from what a shell expects of a program.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../end_to_end/program.rs"]
#[allow(dead_code)] // Each of the two needs a part of it.
mod place;
mod program;
mod windows;

mod angular_momentum;
mod broken_pipe;
mod constriction_two_materials;
mod csv_and_xyz_dialects;
mod deflection_diverges;
mod elastic_imbalance;
mod energy_by_mass;
mod every3_vapour;
mod hotter_than_anything;
mod magnetic_field;
mod mesh_floor;
mod narrow_beam;
mod output_over_input;
mod particle_files;
mod peak_temperature;
mod plug_ins;
mod rejections;
mod restitution_phase;
mod rotating_wall;
mod rows_not_checked;
mod same_scene;
mod scarce_memory;
mod shallow_valley;
mod shell_limits;
mod start_keeps_state;
mod stl_dialects;
mod strangers;
mod thinned_verify;
mod two_conductivities;
mod uneven_frames;
mod unit_digits;
mod vtk_legacy_sections;
mod vtk_xml_attributes;
mod words_and_sizes;
