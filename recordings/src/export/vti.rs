//! VTK ImageData files (The VTK User's Guide, "XML File Formats") of the fields on a grid.

use std::io::Write;

use stagger_messages::{Centring, Grid};

use super::arrays::{self, Section, VtkError};
use crate::Step;

/// What the file of a state begins with.
pub const BEGIN: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" \
                         header_type=\"UInt64\">\n";

/// Writes the fields of a state on a regular grid (a graded one is [`super::vtr`]'s): cell data or point data, as the grid is centred. ParaView takes cells between
/// `dims` + 1 points along each axis.
///
/// # Errors
/// The grid has no layout, or the file cannot be written.
pub fn grid(step: &Step, support: &str, grid: &Grid, output: impl Write) -> Result<(), VtkError> {
    let (origin_m, spacing_m, dims) = grid.layout().ok_or(VtkError::Grid)?;
    let cells = grid.centring() == Centring::Cell;
    let last = dims.map(|count| if cells { count } else { count - 1 });
    let text = |values: [f64; 3]| values.map(|value| format!("{value:?}")).join(" ");
    let extent = last.map(|last| format!("0 {last}")).join(" ");
    let begin = format!(
        "{BEGIN}<ImageData WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\">\n",
        text(origin_m),
        text(spacing_m)
    );
    let arrays = arrays::on_grid(step, support, grid.rows());
    let sections = [Section { name: if cells { "CellData" } else { "PointData" }, arrays }];
    let piece = format!("<Piece Extent=\"{extent}\">");
    arrays::write(output, &begin, step.t_s, &piece, &sections, "</Piece>\n</ImageData>\n")
}
