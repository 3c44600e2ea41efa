//! The faces of a grid that are seen where it is cut open through its middle: the block behind the cut, whose section, upper
//! side and right side face the viewer, who looks from the front, from the right and from above.

use stagger_messages::{Centring, Grid};

/// Rectangles around the values of cells, or between those of nodes, as triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faces {
    /// Corners, in m.
    pub corners_m: Vec<[f64; 3]>,
    /// Three corners each.
    pub triangles: Vec<[u32; 3]>,
    /// Row of each corner in the grid's fields.
    pub rows: Vec<usize>,
}

/// Smallest and largest corner of the block that is seen of a grid, in m; `None` where it has no layout.
pub fn block_m(grid: &Grid) -> Option<[[f64; 3]; 2]> {
    let (coordinates_m, (.., dims)) = (grid.coordinates_m()?, grid.layout()?);
    let first = [0, middle(dims), 0];
    let last = coordinates_m.each_ref().map(|along| along.len() - 1);
    Some([first, last].map(|corner| std::array::from_fn(|axis| coordinates_m[axis][corner[axis]])))
}

/// The layer of values along y at which a grid is cut.
fn middle([_, ny, _]: [usize; 3]) -> usize {
    ny / 2
}

impl Faces {
    /// Those of a grid; none where it has no layout.
    pub fn of(grid: &Grid) -> Self {
        let mut faces = Self::default();
        let (Some(coordinates_m), Some((.., dims))) = (grid.coordinates_m(), grid.layout()) else { return faces };
        let ([nx, _, nz], middle) = (dims, middle(dims));
        let cells = grid.centring() == Centring::Cell;
        let last = |axis: usize| coordinates_m[axis].len() - 1;
        for (axis, layer, coordinate) in [(1, middle, middle), (0, nx - 1, last(0)), (2, nz - 1, last(2))] {
            let plane =
                Plane { axis, layer, at_m: coordinates_m[axis][coordinate], coordinates_m: &coordinates_m, dims };
            let first = [0, if axis == 1 { 0 } else { middle }, 0];
            if cells {
                plane.around_cells(first, &mut faces);
            } else {
                plane.between_nodes(first, &mut faces);
            }
        }
        faces
    }
}

/// A layer of values across an axis.
struct Plane<'g> {
    axis: usize,
    layer: usize,
    at_m: f64,
    coordinates_m: &'g [Vec<f64>; 3],
    dims: [usize; 3],
}

impl Plane<'_> {
    /// The axes along the layer.
    fn along(&self) -> [usize; 2] {
        match self.axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        }
    }

    /// The index of a value in the layer, and its row.
    fn row(&self, [a, b]: [usize; 2]) -> usize {
        let mut index = [self.layer; 3];
        let [along_a, along_b] = self.along();
        (index[along_a], index[along_b]) = (a, b);
        index[0] + self.dims[0] * (index[1] + self.dims[1] * index[2])
    }

    fn corner_m(&self, [a, b]: [usize; 2]) -> [f64; 3] {
        let mut corner_m = [self.at_m; 3];
        let [along_a, along_b] = self.along();
        corner_m[along_a] = self.coordinates_m[along_a][a];
        corner_m[along_b] = self.coordinates_m[along_b][b];
        corner_m
    }

    /// Every value has a rectangle of its own colour.
    fn around_cells(&self, first: [usize; 3], faces: &mut Faces) {
        let [along_a, along_b] = self.along();
        for b in first[along_b]..self.dims[along_b] {
            for a in first[along_a]..self.dims[along_a] {
                let from = faces.corners_m.len() as u32;
                for corner in [[a, b], [a + 1, b], [a + 1, b + 1], [a, b + 1]] {
                    faces.corners_m.push(self.corner_m(corner));
                    faces.rows.push(self.row([a, b]));
                }
                faces.triangles.extend([[from, from + 1, from + 2], [from, from + 2, from + 3]]);
            }
        }
    }

    /// Colours run from value to value.
    fn between_nodes(&self, first: [usize; 3], faces: &mut Faces) {
        let [along_a, along_b] = self.along();
        let width = self.dims[along_a] - first[along_a];
        let from = faces.corners_m.len();
        for b in first[along_b]..self.dims[along_b] {
            for a in first[along_a]..self.dims[along_a] {
                faces.corners_m.push(self.corner_m([a, b]));
                faces.rows.push(self.row([a, b]));
                if a > first[along_a] && b > first[along_b] {
                    let here = from + (b - first[along_b]) * width + a - first[along_a];
                    let [left, below, beside] = [here - 1, here - width, here - width - 1].map(|corner| corner as u32);
                    let here = here as u32;
                    faces.triangles.extend([[beside, below, here], [beside, here, left]]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_seen_behind_the_middle_on_three_sides() {
        let grid = Grid::between([&[0.0, 1.0, 3.0], &[0.0, 1.0, 2.0, 3.0, 4.0], &[0.0, 0.5]]);
        let faces = Faces::of(&grid);
        // Two cells of the section, two of the right side and four of the upper one.
        assert_eq!(faces.corners_m.len(), 4 * 8);
        assert_eq!(faces.triangles.len(), 2 * 8);
        // The section stands in the middle of y, before the third layer.
        assert_eq!(faces.corners_m[..4], [[0.0, 2.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.0, 0.5], [0.0, 2.0, 0.5]]);
        assert_eq!((faces.rows[0], faces.rows[4]), (4, 5));
        // The right side is that of the last cells along x, from the middle of y on.
        assert_eq!((faces.corners_m[8], faces.rows[8]), ([3.0, 2.0, 0.0], 5));
        assert!(faces.corners_m[16..].iter().all(|corner| corner[2] == 0.5 && corner[1] >= 2.0));
        assert!(faces.triangles.as_flattened().iter().all(|corner| (*corner as usize) < faces.corners_m.len()));
        assert_eq!(block_m(&grid), Some([[0.0, 2.0, 0.0], [3.0, 4.0, 0.5]]));
    }

    #[test]
    fn between_nodes_there_is_one_rectangle_less_along_each_axis() {
        let faces = Faces::of(&Grid::of_nodes([0.0; 3], [1.0; 3], [4, 3, 2]));
        // The section of 3 x 1 rectangles, the right side of 1 x 1, the upper one of 3 x 1.
        assert_eq!((faces.triangles.len(), faces.corners_m.len()), (2 * 7, 8 + 4 + 8));
        // A node's colour is that of its row.
        let node = |corner: &[f64; 3]| corner[0] as usize + 4 * (corner[1] as usize + 3 * corner[2] as usize);
        assert!(faces.corners_m.iter().zip(&faces.rows).all(|(corner, row)| node(corner) == *row));
        // A plane of one layer is seen whole, and has no sides.
        assert_eq!(Faces::of(&Grid::of_nodes([0.0; 3], [1.0; 3], [3, 1, 3])).triangles.len(), 2 * 4);
        assert_eq!(Faces::of(&Grid::default()), Faces::default());
    }
}
