//! Planes through a grid: a coloured rectangle for each value, neighbours of one colour put together.

use std::fmt::Write as _;

use stagger_messages::Grid;

use super::{
    ramp::Ramp,
    svg::{Drawing, place},
};

/// Largest width and height of a picture, in units of its drawing.
const SIZE: f64 = 320.0;
/// Values along one side of a plane that are kept, at most; of more, every n-th.
pub const SIDE: usize = 64;
const AXES: [&str; 3] = ["x", "y", "z"];

/// The values in one plane of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The axis that the plane is normal to: 0, 1 or 2.
    pub axis: usize,
    /// Where the plane cuts that axis, in m.
    pub at_m: f64,
    /// Values along the level and the upright direction.
    pub counts: [usize; 2],
    /// Width and height, in m.
    pub size_m: [f64; 2],
    /// The values; the level direction runs fastest.
    pub values: Vec<f32>,
}

impl Slice {
    /// The planes through the middle of a grid that `values` fill. A direction along which the grid holds a single value has
    /// no plane across others, as there is nothing to see, but at least one plane there is.
    #[must_use]
    pub fn middles(grid: &Grid, values: &[f64]) -> Vec<Self> {
        let (Some((_, spacing_m, dims)), Some(coordinates_m)) = (grid.layout(), grid.coordinates_m()) else {
            return Vec::new();
        };
        // Rectangles are equally large: of a graded grid, each shows the cell that its middle lies in.
        let sides = dims.map(|count| if grid.is_graded() && count > 1 { SIDE } else { count.min(SIDE) });
        let shown = |axis: usize, number: usize| match coordinates_m[axis].as_slice() {
            along @ [first, .., last] if grid.is_graded() => {
                let at_m = first + (last - first) * (number as f64 + 0.5) / sides[axis] as f64;
                (along.partition_point(|edge| *edge <= at_m)).saturating_sub(1).min(dims[axis] - 1)
            }
            _ => nearest(number, sides[axis], dims[axis]),
        };
        let wide = |axis: &usize| {
            let [level, upright] = directions(*axis);
            dims[level] > 1 && dims[upright] > 1
        };
        // From above, from the front, from the side.
        let mut axes: Vec<usize> = [2, 1, 0].into_iter().filter(wide).collect();
        if axes.is_empty() {
            // A line of values, or a single one: across the last direction that holds one value alone.
            axes.extend([2, 1, 0].into_iter().find(|axis| dims[*axis] == 1));
        }
        let cut = |axis: usize| {
            let [level, upright] = directions(axis);
            let middle = dims[axis] / 2;
            let counts = [sides[level], sides[upright]];
            let mut kept = Vec::with_capacity(counts[0] * counts[1]);
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    let mut index = [middle; 3];
                    index[level] = shown(level, i);
                    index[upright] = shown(upright, j);
                    let row = index[0] + dims[0] * (index[1] + dims[1] * index[2]);
                    kept.push(values.get(row).map_or(f32::NAN, |value| *value as f32));
                }
            }
            let at_m = grid.point_m([middle; 3]).map_or(f64::NAN, |point| point[axis]);
            // Values at nodes are shown as far as half the way to their neighbours.
            let size_m = [level, upright].map(|axis| spacing_m[axis] * dims[axis] as f64);
            Self { axis, at_m, counts, size_m, values: kept }
        };
        axes.into_iter().map(cut).collect()
    }

    /// Name of the plane: its two directions.
    #[must_use]
    pub fn plane(&self) -> String {
        let [level, upright] = directions(self.axis).map(|axis| AXES[axis]);
        format!("{level}-{upright} plane at {}", AXES[self.axis])
    }

    /// The plane as a drawing, with at most `side` values along each direction.
    #[must_use]
    pub fn drawing(&self, name: &str, ramp: &Ramp, side: usize) -> String {
        let shown = self.counts.map(|count| count.min(side.max(1)));
        let per_metre = SIZE / self.size_m[0].max(self.size_m[1]).max(f64::MIN_POSITIVE);
        let [width, height] = self.size_m.map(|length| (per_metre * length).max(4.0));
        let (left, cell) = (0.5 * (SIZE - width), [width / shown[0] as f64, height / shown[1] as f64]);
        let mut drawing = Drawing::new(SIZE, height, name);
        let mut text = String::from("<g shape-rendering=\"crispEdges\">");
        for j in 0..shown[1] {
            let row = nearest(j, shown[1], self.counts[1]) * self.counts[0];
            let colour = |i: usize| {
                let value = self.values.get(row + nearest(i, shown[0], self.counts[0]));
                ramp.colour(value.map_or(f64::NAN, |value| f64::from(*value)))
            };
            let mut from = 0;
            while from < shown[0] {
                let first = colour(from);
                let until = (from + 1..shown[0]).find(|i| colour(*i) != first).unwrap_or(shown[0]);
                let (x, y) = (left + cell[0] * from as f64, height - cell[1] * (j + 1) as f64);
                let [x, y, width, height] = [x, y, cell[0] * (until - from) as f64, cell[1]].map(place);
                // Writing to a text cannot fail.
                let _ =
                    write!(text, "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{first}\"/>");
                from = until;
            }
        }
        drawing.raw(&(text + "</g>"));
        drawing.finish()
    }
}

/// The level and the upright direction of a plane normal to an axis, as one looks along it.
fn directions(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

/// Which of `count` values is shown as the `shown`-th of fewer.
fn nearest(number: usize, shown: usize, count: usize) -> usize {
    (2 * number + 1) * count / (2 * shown.max(1))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_graded_grid_is_drawn_to_scale() {
        let edges: [&[f64]; 3] = [&[0.0, 1.0, 4.0], &[0.0, 1.0, 2.0], &[0.0, 1.0]];
        let slices = Slice::middles(&Grid::between(edges), &[1.0, 2.0, 3.0, 4.0]);
        let [slice] = &slices[..] else { panic!("{slices:?}") };
        assert_eq!((slice.counts, slice.size_m), ([SIDE, SIDE], [4.0, 2.0]));
        // A quarter of the first row is the narrow cell.
        let narrow = slice.values[..SIDE].iter().filter(|value| **value == 1.0).count();
        assert_eq!(narrow, SIDE / 4);
        assert_eq!(slice.values[SIDE * SIDE - 1], 4.0);
    }

    use stagger_recordings::display::colour_scale::Range;

    use super::*;
    use crate::report::plot::Axis;

    fn slices(dims: [u32; 3]) -> Vec<Slice> {
        let grid = Grid::of_cells([0.0; 3], [1.0, 2.0, 4.0], dims);
        let values: Vec<f64> = (0..grid.rows()).map(|row| row as f64).collect();
        Slice::middles(&grid, &values)
    }

    #[test]
    fn a_grid_is_cut_in_its_middle_along_each_axis() {
        let found = slices([4, 3, 2]);
        let planes: Vec<_> = found.iter().map(|slice| (slice.plane(), slice.at_m, slice.counts)).collect();
        assert_eq!(planes.len(), 3);
        assert_eq!(planes[0], ("x-y plane at z".into(), 6.0, [4, 3]));
        assert_eq!(planes[1], ("x-z plane at y".into(), 3.0, [4, 2]));
        assert_eq!(planes[2], ("y-z plane at x".into(), 2.5, [3, 2]));
        assert_eq!(found[0].values, (12..24).map(|row| row as f32).collect::<Vec<_>>());
        assert_eq!(found[1].values, [4.0, 5.0, 6.0, 7.0, 16.0, 17.0, 18.0, 19.0]);
        assert_eq!(found[2].values, [2.0, 6.0, 10.0, 14.0, 18.0, 22.0]);
        assert_eq!((slices([4, 3, 1]).len(), slices([4, 1, 1]).len(), slices([1, 1, 1]).len()), (1, 1, 1));
        assert_eq!(slices([1, 1, 5])[0].counts, [1, 5]);
    }

    #[test]
    fn a_plane_is_drawn_from_below_upwards_and_equal_neighbours_as_one() {
        let ramp = Ramp { axis: Axis::linear("w", "K"), range: Range { min: 0.0, max: 1.0 } };
        let slice = Slice {
            axis: 2,
            at_m: 0.0,
            counts: [4, 2],
            size_m: [4.0, 2.0],
            values: vec![0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
        };
        let drawing = slice.drawing("w", &ramp, SIDE);
        roxmltree::Document::parse(&drawing).unwrap();
        assert_eq!(drawing.matches("<rect").count(), 3);
        let first = format!("<rect x=\"0\" y=\"80\" width=\"160\" height=\"80\" fill=\"{}\"/>", ramp.colour(0.0));
        assert!(drawing.contains(&first), "{drawing}");
        let large = slices([1000, 900, 3]);
        assert_eq!(large[0].counts, [64, 64]);
        let drawing = large[0].drawing("w", &Ramp { range: Range { min: 0.0, max: 2.7e6 }, ..ramp }, 20);
        assert!(drawing.matches("<rect").count() <= 400);
    }
}
