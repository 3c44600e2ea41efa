//! How far what a state shows reaches.

use std::collections::BTreeMap;

use stagger_messages::geometry::Shape;
use stagger_recordings::{Step, display::quantities::Spheres};

use crate::{faces::block_m, sections::Sections};

/// Smallest and largest corner, in m.
pub type Corners = [[f64; 3]; 2];

/// Those of the spheres but for strays or, where there are none, of all grids and points; `None` where there is nothing.
pub fn bounds_m(step: &Step) -> Option<Corners> {
    match Spheres::of(step) {
        Some(spheres) => of_spheres_m(&spheres),
        None => others_m(step).into_values().reduce(both),
    }
}

/// In each direction, of a hundred centres the outermost may lie beyond at either end: one that was thrown up from the
/// powder should not make everything small.
pub fn of_spheres_m(spheres: &Spheres<'_>) -> Option<Corners> {
    let finite = |centre: &&[f64; 3]| centre.iter().all(|length| length.is_finite());
    let centres: Vec<_> = spheres.centres_m.iter().filter(finite).collect();
    let last = centres.len().checked_sub(1)?;
    let strays = last / 100;
    let radius = spheres.radii_m.iter().copied().fold(0.0, f64::max);
    let mut bounds = [[-radius; 3], [radius; 3]];
    for axis in 0..3 {
        let mut lengths: Vec<f64> = centres.iter().map(|centre| centre[axis]).collect();
        // Of many thousand centres, sorting all would take most of the time of a picture.
        bounds[0][axis] += *lengths.select_nth_unstable_by(strays, f64::total_cmp).1;
        bounds[1][axis] += *lengths.select_nth_unstable_by(last - strays, f64::total_cmp).1;
    }
    Some(bounds)
}

/// Those of what is seen of each grid and of points without radii, by the name of their support.
pub fn others_m(step: &Step) -> BTreeMap<String, Corners> {
    let shapes = step.supports.shapes(&step.fields).into_iter();
    shapes.filter_map(|(support, shape)| Some((support, of_shape_m(step, &shape)?))).collect()
}

fn of_shape_m(step: &Step, shape: &Shape) -> Option<Corners> {
    match shape {
        Shape::Grid(grid) => block_m(grid),
        Shape::Points(points) if points.radii.is_empty() => {
            let (positions, 1) = points.places(&step.fields).ok()? else { return None };
            let seen = Sections::of(positions.f64().ok()?.as_chunks::<3>().0);
            seen.points_m.into_iter().map(|point| [point, point]).reduce(both)
        }
        Shape::Points(_) | Shape::Pairs(_) | Shape::Global(_) => None,
    }
}

fn both([low, high]: Corners, [other_low, other_high]: Corners) -> Corners {
    [
        std::array::from_fn(|axis| low[axis].min(other_low[axis])),
        std::array::from_fn(|axis| high[axis].max(other_high[axis])),
    ]
}

#[cfg(test)]
mod tests {
    use stagger_messages::{Geometry, Grid, Ports, Supports};

    use super::*;
    use crate::testing::{field, step};

    #[test]
    fn without_spheres_grids_and_points_are_what_is_seen() {
        let mut state = step([
            field("w", "K", "cells", 1, vec![0.0; 2]),
            field("stress_position", "m", "grid", 3, vec![0.0, 0.0, -1.0, 4.0, 0.0, -1.0]),
        ]);
        let cells = Geometry::grid("cells", Grid::of_cells([0.0; 3], [1.0, 2.0, 3.0], [2, 1, 1]));
        state.supports = Supports::of([&Ports::new(Vec::new(), Vec::new()).with(cells)]);
        assert_eq!(bounds_m(&state), Some([[0.0, 0.0, -1.0], [4.0, 2.0, 3.0]]));
        assert_eq!(others_m(&state)["cells"], [[0.0; 3], [2.0, 2.0, 3.0]]);
        // What falls on them is what is looked at.
        state.fields.extend([
            field("positions", "m", "particles", 3, vec![0.0, 0.0, 9.0]),
            field("radii", "m", "particles", 1, vec![1.0]),
        ]);
        assert_eq!(bounds_m(&state), Some([[-1.0, -1.0, 8.0], [1.0, 1.0, 10.0]]));
    }
}
