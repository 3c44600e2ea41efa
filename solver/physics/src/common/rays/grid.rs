//! Spheres by the cells of a regular grid that a ray crosses cell by cell (Amanatides & Woo 1987).

use super::{Ray, Sphere, Vec3};
use stagger_coupling::math;

/// Cells a sphere: finer ones are crossed in vain, coarser ones hold more spheres to try. Measured on dense beds.
const CELLS_PER_SPHERE: f64 = 2.0;

/// Share of a radius by which a sphere is registered beyond itself: its own rounding stays inside.
const MARGIN: f64 = 1e-9;

/// Spheres by the cells of a regular grid that they reach into, crossed cell by cell by a ray (Amanatides & Woo 1987).
///
/// Building it takes O(N), a ray through a bed of spheres of similar size a few cells. A sphere far from all others makes the
/// cells large: at worst, N spheres in one cell, a ray tries them all.
#[derive(Clone, Debug)]
pub struct Grid {
    spheres: Vec<Sphere>,
    lower: Vec3,
    upper: Vec3,
    cell: Vec3,
    sides: [usize; 3],
    /// Where each cell's entries start in `entries`; one more than cells.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Grid {
    /// Spheres with finite centres and positive radii.
    #[must_use]
    pub fn new(spheres: Vec<Sphere>) -> Self {
        let (mut lower, mut upper) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for Sphere { centre, radius } in &spheres {
            let reach = Vec3::repeat(radius * (1.0 + MARGIN));
            (lower, upper) = (lower.inf(&(centre - reach)), upper.sup(&(centre + reach)));
        }
        if spheres.is_empty() {
            (lower, upper) = (Vec3::zeros(), Vec3::zeros());
        }
        let mut grid = Self {
            lower,
            upper,
            cell: Vec3::repeat(1.0),
            sides: [0; 3],
            starts: vec![0],
            entries: Vec::new(),
            spheres,
        };
        if grid.spheres.is_empty() {
            return grid;
        }
        let extent = upper - lower;
        let size = cell_size(extent, CELLS_PER_SPHERE * grid.spheres.len() as f64);
        grid.sides = [0, 1, 2].map(|axis| (extent[axis] / size).ceil().max(1.0) as usize);
        grid.cell = Vec3::from_fn(|axis, _| extent[axis] / grid.sides[axis] as f64);
        grid.register();
        grid
    }

    /// The spheres, in the order they were given.
    #[must_use]
    pub fn spheres(&self) -> &[Sphere] {
        &self.spheres
    }

    /// Corners of the box around all spheres, in m.
    #[must_use]
    pub fn bounds(&self) -> [Vec3; 2] {
        [self.lower, self.upper]
    }

    fn register(&mut self) {
        let cells: usize = self.sides.iter().product();
        let mut starts = vec![0u32; cells + 1];
        self.each_entry(|cell, _| starts[cell + 1] += 1);
        for cell in 0..cells {
            starts[cell + 1] += starts[cell];
        }
        let mut entries = vec![0; starts[cells] as usize];
        let mut next = starts.clone();
        self.each_entry(|cell, sphere| {
            entries[next[cell] as usize] = sphere;
            next[cell] += 1;
        });
        (self.starts, self.entries) = (starts, entries);
    }

    /// Calls `take` with every cell and every sphere that reaches into it, spheres in their order.
    fn each_entry(&self, mut take: impl FnMut(usize, u32)) {
        for (index, Sphere { centre, radius }) in (0u32..).zip(&self.spheres) {
            let reach = radius * (1.0 + MARGIN);
            let from = self.cell_of(&(centre - Vec3::repeat(reach)));
            let to = self.cell_of(&(centre + Vec3::repeat(reach)));
            // Distance from the centre to a cell, squared, axis by axis.
            let apart = |axis: usize, cell: usize| {
                let low = self.lower[axis] + cell as f64 * self.cell[axis];
                math::powi((low - centre[axis]).max(centre[axis] - (low + self.cell[axis])).max(0.0), 2)
            };
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    let plane = apart(2, z) + apart(1, y);
                    for x in from[0]..=to[0] {
                        if plane + apart(0, x) <= reach * reach {
                            take(self.index([x, y, z]), index);
                        }
                    }
                }
            }
        }
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.sides[1] + y) * self.sides[0] + x
    }

    /// The cell of a point, or the nearest one. A cast saturates.
    fn cell_of(&self, point: &Vec3) -> [usize; 3] {
        [0, 1, 2].map(|axis| (((point[axis] - self.lower[axis]) / self.cell[axis]) as usize).min(self.sides[axis] - 1))
    }

    /// Where the ray enters the box around all spheres, in m along it; 0 inside, `None` where it misses it.
    fn enters(&self, ray: &Ray) -> Option<f64> {
        let (mut from, mut to) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
            if direction == 0.0 {
                if origin < self.lower[axis] || origin > self.upper[axis] {
                    return None;
                }
                continue;
            }
            let [near, far] = [self.lower[axis], self.upper[axis]].map(|side| (side - origin) / direction);
            (from, to) = (from.max(near.min(far)), to.min(near.max(far)));
        }
        (from <= to).then_some(from)
    }

    /// The sphere that the ray enters first, `but` excepted, and the way to it in m; of equally near ones that of the lowest
    /// index.
    #[must_use]
    pub fn nearest(&self, ray: &Ray, but: Option<u32>) -> Option<(u32, f64)> {
        if self.spheres.is_empty() {
            return None;
        }
        let mut cell = self.cell_of(&(ray.origin + ray.direction * self.enters(ray)?));
        let mut next = Vec3::repeat(f64::INFINITY);
        let mut step = next;
        for axis in 0..3 {
            let direction = ray.direction[axis];
            if direction != 0.0 {
                let side = if direction > 0.0 { cell[axis] + 1 } else { cell[axis] };
                next[axis] = (self.lower[axis] + side as f64 * self.cell[axis] - ray.origin[axis]) / direction;
                step[axis] = self.cell[axis] / direction.abs();
            }
        }
        let mut best: Option<(u32, f64)> = None;
        loop {
            let cell_index = self.index(cell);
            let entries = self.starts[cell_index] as usize..self.starts[cell_index + 1] as usize;
            for &sphere in &self.entries[entries] {
                if Some(sphere) == but {
                    continue;
                }
                if let Some(way) = self.spheres[sphere as usize].entry(ray) {
                    let nearer = |(other, least): (u32, f64)| way < least || (way <= least && sphere < other);
                    if best.is_none_or(nearer) {
                        best = Some((sphere, way));
                    }
                }
            }
            let axis = next.imin();
            if best.is_some_and(|(_, way)| way <= next[axis]) {
                return best;
            }
            let last = if ray.direction[axis] > 0.0 { self.sides[axis] - 1 } else { 0 };
            if cell[axis] == last || next[axis] == f64::INFINITY {
                return best;
            }
            cell[axis] = if last == 0 { cell[axis] - 1 } else { cell[axis] + 1 };
            next[axis] += step[axis];
        }
    }
}

/// Size of cells, about `cells` of which fill a box: cubes, or squares and pieces of a line where the box is thinner than
/// one.
fn cell_size(extent: Vec3, cells: f64) -> f64 {
    let mut sides = <[f64; 3]>::from(extent);
    sides.sort_by(|a, b| b.total_cmp(a));
    let cube = math::cbrt(sides[0] * sides[1] * sides[2] / cells);
    let square = (sides[0] * sides[1] / cells).sqrt();
    if cube <= sides[2] {
        cube
    } else if square <= sides[1] {
        square
    } else {
        sides[0] / cells
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The nearest sphere by trying all.
    fn brute_force(spheres: &[Sphere], ray: &Ray) -> Option<(u32, f64)> {
        let hits = (0u32..).zip(spheres).filter_map(|(index, sphere)| Some((index, sphere.entry(ray)?)));
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn vectors(within: f64) -> impl Strategy<Value = Vec3> {
        [-within..within, -within..within, -within..within].prop_map(Vec3::from)
    }

    fn sphere(span: f64) -> impl Strategy<Value = Sphere> {
        (vectors(span), 0.01..0.5f64).prop_map(|(centre, radius)| Sphere { centre, radius })
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_trying_all_finds(
            mut spheres in prop::collection::vec(sphere(2.0), 0..60),
            far in prop::collection::vec(sphere(100.0), 0..3),
            rays in prop::collection::vec((vectors(4.0), vectors(1.0), 0u8..4), 1..30),
        ) {
            spheres.extend(far);
            let grid = Grid::new(spheres.clone());
            for (origin, direction, axis) in rays {
                // Every fourth along an axis, where the other components are zero.
                let direction = if axis < 3 { Vec3::ith(axis.into(), direction.x.signum()) } else { direction.normalize() };
                prop_assume!(direction.iter().all(|component| component.is_finite()));
                let ray = Ray { origin, direction };
                prop_assert_eq!(grid.nearest(&ray, None), brute_force(&spheres, &ray));
            }
        }
    }

    #[test]
    fn thin_and_long_boxes_have_no_more_cells_than_thick_ones() {
        for extent in [[1.0, 1.0, 1.0], [1.0, 1.0, 1e-6], [1e-6, 1.0, 1e-6], [1.0, 1e-3, 1e-9]] {
            let size = cell_size(Vec3::from(extent), 1000.0);
            let cells: f64 = extent.iter().map(|side| (side / size).ceil()).product();
            assert!((1000.0..=2000.0).contains(&cells), "{extent:?}: {cells}");
        }
    }

    #[test]
    fn the_sphere_left_behind_is_not_met_again_and_equal_ones_go_by_index() {
        let at = |x: f64, radius: f64| Sphere { centre: Vec3::new(x, 0.0, 0.0), radius };
        let grid = Grid::new(vec![at(1.0, 0.5), at(3.0, 0.5), at(3.0, 0.5)]);
        let ray = Ray { origin: Vec3::zeros(), direction: Vec3::x() };
        assert_eq!(grid.nearest(&ray, None), Some((0, 0.5)));
        assert_eq!(grid.nearest(&ray, Some(0)), Some((1, 2.5)));
        assert_eq!(grid.nearest(&Ray { direction: -Vec3::x(), ..ray }, None), None);
        assert_eq!(Grid::new(Vec::new()).nearest(&ray, None), None);
    }
}
