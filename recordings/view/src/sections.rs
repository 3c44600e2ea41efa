//! Points without radii that lie in planes, and which of them are seen.

/// Points that are seen, with the number of each in the fields.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sections {
    /// Places of the points, in m.
    pub points_m: Vec<[f64; 3]>,
    /// Row of each point in the fields.
    pub rows: Vec<usize>,
    /// Distance between neighbours, in m.
    pub spacing_m: f64,
}

impl Sections {
    /// The points, cut open where a section stands below a horizontal plane: of that, what would hide a section from the
    /// viewer, who looks from the right, from the front and from above, is left out.
    pub fn of(points: &[[f64; 3]]) -> Self {
        let planes = planes(points);
        let sections: Vec<(usize, f64)> =
            planes.iter().filter(|plane| plane.axis != 2).map(|plane| (plane.axis, plane.at_m)).collect();
        let hides = |point: &[f64; 3]| {
            sections.iter().any(|&(axis, at_m)| if axis == 0 { point[0] > at_m } else { point[1] < at_m })
        };
        let mut seen = Self { spacing_m: spacing(points), ..Self::default() };
        for plane in planes {
            for row in plane.rows {
                if plane.axis != 2 || !hides(&points[row]) {
                    seen.points_m.push(points[row]);
                    seen.rows.push(row);
                }
            }
        }
        seen
    }
}

/// Points one after another that have one coordinate in common.
struct Plane {
    axis: usize,
    at_m: f64,
    rows: std::ops::Range<usize>,
}

/// Cuts the points into planes, each as long as it can be.
fn planes(points: &[[f64; 3]]) -> Vec<Plane> {
    let mut planes = Vec::new();
    let mut from = 0;
    while from < points.len() {
        let until = |axis: usize| {
            let at = points[from][axis];
            points[from..].iter().take_while(|point| point[axis] == at).count() + from
        };
        // Of equal ones the horizontal: a single point, or a line, hides nothing.
        let axis = [0, 1, 2].into_iter().max_by_key(|&axis| until(axis)).unwrap_or(2);
        planes.push(Plane { axis, at_m: points[from][axis], rows: from..until(axis) });
        from = until(axis);
    }
    planes
}

/// Smallest distance between points one after another; 0 for a single one.
fn spacing(points: &[[f64; 3]]) -> f64 {
    let distance = |[a, b]: &[[f64; 3]; 2]| {
        let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
        squared.sqrt()
    };
    let smallest =
        points.array_windows().map(distance).filter(|&distance| distance > 0.0).fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of 4 × 4 points, 1 m apart, with `axis` fixed at `at`.
    fn plane(axis: usize, at: f64) -> Vec<[f64; 3]> {
        let of = |k: i32| {
            let mut point = [f64::from(k % 4) - 1.5, f64::from(k / 4) - 1.5, 0.0];
            point[2] = at;
            if axis == 1 {
                point = [point[0], at, point[1] - 2.0];
            }
            point
        };
        (0..16).map(of).collect()
    }

    #[test]
    fn a_section_is_not_hidden_by_the_top() {
        let top = plane(2, 0.0);
        assert_eq!(Sections::of(&top).rows.len(), 16);
        let both = [top, plane(1, 0.0)].concat();
        let grid = Sections::of(&both);
        assert!((grid.spacing_m - 1.0).abs() < 1e-12);
        // The rows at y = -1.5 and -0.5 of the top are before the section.
        assert_eq!(grid.rows, (8..32).collect::<Vec<_>>());
        assert!(grid.points_m[..8].iter().all(|point| point[1] > 0.0));
    }

    #[test]
    fn without_points_nothing_is_seen() {
        assert_eq!(Sections::of(&[]), Sections::default());
        let one = Sections::of(&[[1.0, 2.0, -3.0]]);
        assert_eq!((one.rows, one.spacing_m), (vec![0], 0.0));
    }
}
