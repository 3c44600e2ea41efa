//! VTK RectilinearGrid files (The VTK User's Guide, "XML File Formats") of the fields on a graded grid.

use std::io::Write;

use stagger_messages::{Centring, Grid};

use super::arrays::{self, Array, Section, VtkError};
use crate::Step;

/// What the file of a state begins with.
pub const BEGIN: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"RectilinearGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
                         header_type=\"UInt64\">\n";

/// Writes the fields of a state on a graded grid, between the edges of its cells or at its nodes.
///
/// # Errors
/// The grid has no layout, or the file cannot be written.
pub fn grid(step: &Step, support: &str, grid: &Grid, output: impl Write) -> Result<(), VtkError> {
    let coordinates_m = grid.coordinates_m().ok_or(VtkError::Grid)?;
    let extent = coordinates_m.each_ref().map(|along| format!("0 {}", along.len().saturating_sub(1))).join(" ");
    let begin = format!("{BEGIN}<RectilinearGrid WholeExtent=\"{extent}\">\n");
    let is_cells = grid.centring() == Centring::Cell;
    let data = Section {
        name: if is_cells { "CellData" } else { "PointData" },
        arrays: arrays::on_grid(step, support, grid.rows()),
    };
    let [x, y, z] = coordinates_m;
    let along = vec![Array::numbers("x", &x), Array::numbers("y", &y), Array::numbers("z", &z)];
    let sections = [data, Section { name: "Coordinates", arrays: along }];
    let piece = format!("<Piece Extent=\"{extent}\">");
    arrays::write(output, &begin, step.t_s, &piece, &sections, "</Piece>\n</RectilinearGrid>\n")
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Field, Geometry, Measure, Port, Ports, Supports, Version};

    use super::*;

    #[test]
    fn a_graded_grid_has_its_own_coordinates() {
        let edges: [&[f64]; 3] = [&[0.0, 1.0, 3.0], &[0.0, 1.0], &[-2.0, -0.5, 0.0]];
        let described = Grid::between(edges);
        let port = Arc::new(Port::f64("heat", "K", "cells", 1, Measure::None));
        let field = Field::new(&port, 0, vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        let ports = Ports::new(Vec::new(), vec![(*port).clone()]).with(Geometry::grid("cells", described.clone()));
        let step = Step {
            version: Version::default(),
            t_s: 0.5,
            dt_s: 0.5,
            fields: [("heat".to_owned(), field)].into(),
            supports: Supports::of([&ports]),
            recorded: true,
        };
        let mut file = Vec::new();
        grid(&step, "cells", &described, &mut file).unwrap();
        let text = String::from_utf8_lossy(&file);
        assert!(text.contains("<RectilinearGrid WholeExtent=\"0 2 0 1 0 2\">"), "{text}");
        assert!(text.contains("Name=\"heat\"") && text.contains("<Coordinates>"), "{text}");
        // Time, 4 values, then 3, 2 and 3 coordinates, each list with its length in front.
        let bytes = &file[file.windows(2).position(|pair| pair == b"\n_").unwrap() + 2..];
        let number = |place: usize| f64::from_le_bytes(bytes[place..place + 8].try_into().unwrap());
        assert_eq!((number(8), number(24 + 8 * 3)), (0.5, 4.0));
        let x = 16 + 8 + 32 + 8;
        assert_eq!([number(x), number(x + 8), number(x + 16)], [0.0, 1.0, 3.0]);
    }
}
