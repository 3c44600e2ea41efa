//! What the rows of a support are in space, as a node describes it and as a reader looks it up.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::{self, Display, Formatter},
    sync::Arc,
};

use serde::Serialize;

use crate::{
    Centring, Field, Fields, Geometry, Global, Grid, Manifest, MessageError, Pairs, Points, Port, Ports, ValueKind,
    geometry::Shape, shown_name,
};

/// Coordinates of a point.
const AXES: usize = 3;

impl Ports {
    /// Fields read and written. The supports they stand on are described by other nodes, or known by convention:
    /// `particles` are points at `positions`.
    #[must_use]
    pub fn new(reads: Vec<Port>, writes: Vec<Port>) -> Self {
        Self { reads, writes, supports: Vec::new() }
    }

    /// The same, with the description of a support.
    #[must_use]
    pub fn with(mut self, support: Geometry) -> Self {
        self.supports.push(support);
        self
    }
}

impl Geometry {
    /// Rows of `support` that are points (3 components of `positions`, in m) or paths of n points (3 n components).
    #[must_use]
    pub fn points(support: &str, positions: &str) -> Self {
        Self::of(support, Shape::Points(Points { positions: positions.into(), radii: String::new() }))
    }

    /// Rows of `support` that are spheres around `positions` with `radii`, both in m.
    #[must_use]
    pub fn spheres(support: &str, positions: &str, radii: &str) -> Self {
        Self::of(support, Shape::Points(Points { positions: positions.into(), radii: radii.into() }))
    }

    /// Rows of `support` that are pairs: the field `indices` holds a row of the support `of` and one of `others`,
    /// which may be the same support.
    #[must_use]
    pub fn pairs(support: &str, indices: &str, of: &str, others: &str) -> Self {
        let others = if of == others { "" } else { others };
        Self::of(support, Shape::Pairs(Pairs { indices: indices.into(), of: of.into(), others: others.into() }))
    }

    /// Rows of `support` that are the values of a regular grid.
    #[must_use]
    pub fn grid(support: &str, grid: Grid) -> Self {
        Self::of(support, Shape::Grid(grid))
    }

    /// Rows of `support` that have no place.
    #[must_use]
    pub fn global(support: &str) -> Self {
        Self::of(support, Shape::Global(Global {}))
    }

    fn of(support: &str, shape: Shape) -> Self {
        Self { support: support.into(), shape: Some(shape) }
    }

    /// What is wrong with the description, in words that follow on the support's name; `None` where nothing is.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        match &self.shape {
            None => Some("has no shape".into()),
            Some(Shape::Points(points)) if points.positions.is_empty() => {
                Some("is of points, but names no field with their positions".into())
            }
            Some(Shape::Pairs(pairs)) if pairs.indices.is_empty() || pairs.of.is_empty() => {
                Some("is of pairs, but does not say of what, and which field holds them".into())
            }
            Some(Shape::Grid(grid)) => grid.fault(),
            Some(_) => None,
        }
    }
}

impl Grid {
    /// A grid of `dims` cells with values in their middles, from the corner `origin_m` on, both lengths in m.
    #[must_use]
    pub fn of_cells(origin_m: [f64; AXES], spacing_m: [f64; AXES], dims: [u32; AXES]) -> Self {
        Self {
            origin_m: origin_m.into(),
            spacing_m: spacing_m.into(),
            dims: dims.into(),
            centring: Centring::Cell.into(),
            coordinates_m: Vec::new(),
        }
    }

    /// A grid of `dims` nodes with values at them, from the node `origin_m` on, both lengths in m.
    #[must_use]
    pub fn of_nodes(origin_m: [f64; AXES], spacing_m: [f64; AXES], dims: [u32; AXES]) -> Self {
        Self { centring: Centring::Node.into(), ..Self::of_cells(origin_m, spacing_m, dims) }
    }

    /// A grid of cells between these edges along x, y and z, in m: one more along each axis than there are cells, rising.
    #[must_use]
    pub fn between(edges_m: [&[f64]; AXES]) -> Self {
        let first = |edges: &[f64]| edges.first().copied().unwrap_or(f64::NAN);
        let cells = |edges: &[f64]| u32::try_from(edges.len().saturating_sub(1)).unwrap_or(0);
        let spacing =
            |edges: &[f64]| (edges.last().copied().unwrap_or(f64::NAN) - first(edges)) / f64::from(cells(edges));
        Self {
            coordinates_m: edges_m.concat(),
            ..Self::of_cells(edges_m.map(first), edges_m.map(spacing), edges_m.map(cells))
        }
    }

    /// The smallest corner in m, the spacing in m, and the number of values along each axis; `None` where the grid has a
    /// `Grid::fault`. Where it is graded, the spacing is the mean one.
    #[must_use]
    pub fn layout(&self) -> Option<([f64; AXES], [f64; AXES], [usize; AXES])> {
        let of = |values: &[f64]| <[f64; AXES]>::try_from(values).ok();
        let (origin_m, spacing_m) = (of(&self.origin_m)?, of(&self.spacing_m)?);
        let dims = <[u32; AXES]>::try_from(self.dims.as_slice()).ok()?;
        let sound = origin_m.iter().all(|length| length.is_finite())
            && spacing_m.iter().all(|length| length.is_finite() && *length > 0.0)
            && dims.iter().all(|count| *count > 0)
            && self.centring() != Centring::Unspecified
            && self.coordinates_are_sound(dims);
        // A count of rows has 64 bits; three counts of 32 bits could exceed them.
        let rows = dims.iter().try_fold(1u64, |rows, count| rows.checked_mul(u64::from(*count)))?;
        usize::try_from(rows).ok()?;
        sound.then(|| (origin_m, spacing_m, dims.map(|count| count as usize)))
    }

    /// Whether the spacing is given value by value.
    #[must_use]
    pub fn is_graded(&self) -> bool {
        !self.coordinates_m.is_empty()
    }

    /// The edges of the cells, or the nodes, along each axis, in m; `None` where the grid has a `Grid::fault`.
    #[must_use]
    pub fn coordinates_m(&self) -> Option<[Vec<f64>; AXES]> {
        let (origin_m, spacing_m, dims) = self.layout()?;
        let counts = dims.map(|count| count + self.edges_beyond());
        let mut from = 0;
        Some(std::array::from_fn(|axis| {
            let range = from..from + counts[axis];
            from = range.end;
            self.coordinates_m.get(range).map_or_else(
                || (0..counts[axis]).map(|index| origin_m[axis] + spacing_m[axis] * index as f64).collect(),
                <[f64]>::to_vec,
            )
        }))
    }

    /// Coordinates along an axis beyond its number of values.
    fn edges_beyond(&self) -> usize {
        usize::from(self.centring() == Centring::Cell)
    }

    fn coordinates_are_sound(&self, dims: [u32; AXES]) -> bool {
        if !self.is_graded() {
            return true;
        }
        let mut rest = self.coordinates_m.as_slice();
        dims.iter().all(|&count| {
            let Some((own, others)) = rest.split_at_checked(count as usize + self.edges_beyond()) else { return false };
            rest = others;
            own.iter().all(|length| length.is_finite()) && own.array_windows().all(|[a, b]| a < b)
        }) && rest.is_empty()
    }

    /// Number of values: the product of the dims; 0 where the grid has a `Grid::fault`.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.layout().map_or(0, |(.., dims)| dims.iter().product())
    }

    /// Place of the value `[i, j, k]`, in m.
    #[must_use]
    pub fn point_m(&self, index: [usize; AXES]) -> Option<[f64; AXES]> {
        let (origin_m, spacing_m, dims) = self.layout()?;
        if self.is_graded() {
            let mut from = 0;
            let mut point_m = [0.0; AXES];
            for axis in 0..AXES {
                let at = |beyond: usize| self.coordinates_m.get(from + index[axis] + beyond).copied();
                point_m[axis] = 0.5 * (at(0)? + at(self.edges_beyond())?);
                from += dims[axis] + self.edges_beyond();
            }
            return Some(point_m);
        }
        let shift = if self.centring() == Centring::Cell { 0.5 } else { 0.0 };
        Some(std::array::from_fn(|axis| origin_m[axis] + spacing_m[axis] * (index[axis] as f64 + shift)))
    }

    fn fault(&self) -> Option<String> {
        self.layout().is_none().then(|| {
            format!(
                "is a grid with origin {:?} m, spacing {:?} m, dims {:?}, centring {:?} and {} coordinates, where three finite \
                 lengths, three positive lengths, three counts of at least 1, cell or node, and rising coordinates for each \
                 axis or none are expected",
                self.origin_m,
                self.spacing_m,
                self.dims,
                self.centring(),
                self.coordinates_m.len()
            )
        })
    }
}

/// The geometry of the supports of a run, by name: as the nodes describe them and, for recordings and nodes that do not, by
/// convention. It is cheap to clone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Supports(Arc<BTreeMap<String, Shape>>);

impl Supports {
    /// Those that the ports of some nodes describe. The first description of a support counts.
    #[must_use]
    pub fn of<'p>(ports: impl IntoIterator<Item = &'p Ports>) -> Self {
        let mut supports = Self::default();
        ports.into_iter().for_each(|ports| supports.include(ports));
        supports
    }

    /// Adds what a node's manifest describes.
    pub fn take(&mut self, manifest: &Manifest) {
        manifest.ports.iter().for_each(|ports| self.include(ports));
    }

    fn include(&mut self, ports: &Ports) {
        for geometry in ports.supports.iter().filter(|geometry| geometry.fault().is_none()) {
            if let Some(shape) = &geometry.shape {
                Arc::make_mut(&mut self.0).entry(geometry.support.clone()).or_insert_with(|| shape.clone());
            }
        }
    }

    /// What the rows of a support are, among the fields of a state. A grid whose number of values is not that of the rows
    /// counts as rows without a place.
    #[must_use]
    pub fn shape(&self, support: &str, fields: &Fields) -> Shape {
        let on_it = fields.values().filter(|field| field.port.support == support);
        match self.0.get(support) {
            Some(Shape::Grid(grid)) if on_it.clone().any(|field| field.rows() != grid.rows()) => {
                Shape::Global(Global {})
            }
            Some(shape) => shape.clone(),
            None => convention(support, on_it.map(|field| &*field.port)),
        }
    }

    /// Every support that the fields written by some nodes stand on, or that they describe, by name, as it is told.
    #[must_use]
    pub fn told<'p>(ports: impl IntoIterator<Item = &'p Ports>) -> BTreeMap<String, Told> {
        let ports: Vec<&Ports> = ports.into_iter().collect();
        let described = Self::of(ports.iter().copied());
        let written = || ports.iter().flat_map(|ports| &ports.writes);
        let names = described.0.keys().chain(written().map(|port| &port.support));
        let mut told = BTreeMap::new();
        for name in names.cloned().collect::<BTreeSet<_>>() {
            let on_it = written().filter(|port| port.support == name);
            let shape = described.0.get(&name).cloned().unwrap_or_else(|| convention(&name, on_it.clone()));
            let fields = on_it.map(|port| port.field.clone()).collect();
            told.insert(name, Told::of(shape, fields));
        }
        told
    }

    /// Every support that a state's fields stand on, by name, with what its rows are.
    #[must_use]
    pub fn shapes(&self, fields: &Fields) -> BTreeMap<String, Shape> {
        let names = fields.values().map(|field| &field.port.support);
        let mut shapes = BTreeMap::new();
        for name in names {
            if !shapes.contains_key(name) {
                shapes.insert(name.clone(), self.shape(name, fields));
            }
        }
        shapes
    }
}

/// What recordings without descriptions mean: the supports as the built-in physics named them then, pairs of indices are
/// pairs of particles, and all else has no place. The ports are those of the fields on the support.
fn convention<'p>(support: &str, ports: impl Iterator<Item = &'p Port> + Clone) -> Shape {
    let points = |positions: &str, radii: &str| Points { positions: positions.into(), radii: radii.into() };
    let known = match support {
        "particles" => Some(points("positions", "radii")),
        "grid" => Some(points("stress_position", "")),
        "rays" => Some(points("ray_paths", "")),
        "acoustic-rays" => Some(points("acoustic_paths", "")),
        _ => None,
    };
    if let Some(points) = known.filter(|points| ports.clone().any(|port| port.field == points.positions)) {
        return Shape::Points(points);
    }
    let mut ports = ports;
    match ports.find(|port| port.components == 2 && port.kind() == ValueKind::U32) {
        Some(port) => {
            let others = if support == "wall-contacts" { "walls" } else { "" };
            Shape::Pairs(Pairs { indices: port.field.clone(), of: "particles".into(), others: others.into() })
        }
        None => Shape::Global(Global {}),
    }
}

/// A support as people and programs are told it: its kind, and of the rest what belongs to that kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Told {
    /// `points`, `pairs`, `grid` or `global`.
    pub kind: &'static str,
    /// The fields on it, by name.
    pub fields: BTreeSet<String>,
    /// Of points: the field with their places.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub positions: Option<String>,
    /// Of spheres: the field with their radii.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radii: Option<String>,
    /// Of pairs: the field with the two indices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indices: Option<String>,
    /// Of pairs: the supports of the first and of the second index.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<[String; 2]>,
    /// Of a grid: its smallest corner, in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin_m: Option<Vec<f64>>,
    /// Of a grid: the distance of its values along each axis, in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing_m: Option<Vec<f64>>,
    /// Of a grid: its values along each axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dims: Option<Vec<u32>>,
    /// Of a graded grid: the edges of its cells, or its nodes, along x, then y, then z, in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinates_m: Option<Vec<f64>>,
    /// Of a grid: `cell` or `node`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centring: Option<&'static str>,
}

impl Told {
    fn of(shape: Shape, fields: BTreeSet<String>) -> Self {
        let told = Self { kind: kind(&shape), fields, ..Self::default() };
        match shape {
            Shape::Points(Points { positions, radii }) => {
                Self { positions: Some(positions), radii: Some(radii).filter(|radii| !radii.is_empty()), ..told }
            }
            Shape::Pairs(Pairs { indices, of, others }) => {
                let others = if others.is_empty() { of.clone() } else { others };
                Self { indices: Some(indices), of: Some([of, others]), ..told }
            }
            Shape::Grid(grid) => Self {
                centring: Some(if grid.centring() == Centring::Node { "node" } else { "cell" }),
                origin_m: Some(grid.origin_m),
                spacing_m: Some(grid.spacing_m),
                dims: Some(grid.dims),
                coordinates_m: Some(grid.coordinates_m).filter(|coordinates| !coordinates.is_empty()),
                ..told
            },
            Shape::Global(_) => told,
        }
    }
}

impl Display for Told {
    /// Its kind and geometry in a few words.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        let metres =
            |lengths: &[f64]| lengths.iter().map(|length| format!("{length:e}")).collect::<Vec<_>>().join(", ");
        if let Some(positions) = &self.positions {
            write!(f, " at {}", shown_name(positions))?;
        }
        if let Some(radii) = &self.radii {
            write!(f, ", radius {}", shown_name(radii))?;
        }
        if let (Some(indices), Some([of, others])) = (&self.indices, &self.of) {
            write!(f, " {} of {} and {}", shown_name(indices), shown_name(of), shown_name(others))?;
        }
        if let (Some(dims), Some(spacing_m), Some(origin_m)) = (&self.dims, &self.spacing_m, &self.origin_m) {
            let dims = dims.iter().map(u32::to_string).collect::<Vec<_>>().join(" x ");
            let values = self.centring.unwrap_or("cell");
            let spacing = if self.coordinates_m.is_some() { "graded, mean spacing" } else { "spacing" };
            write!(f, " of {dims} {values}s, {spacing} {} m, from {} m", metres(spacing_m), metres(origin_m))?;
        }
        Ok(())
    }
}

impl Points {
    /// The places of the rows, in m, and the points of each row: 1, or more where the rows are paths.
    ///
    /// # Errors
    /// The field is not there, or it does not hold points.
    pub fn places<'f>(&self, fields: &'f Fields) -> Result<(&'f Field, usize), MessageError> {
        let field = fields.get(&self.positions).ok_or_else(|| MessageError::NoField(self.positions.clone()))?;
        field.f64()?;
        let components = field.components();
        if components == 0 || !components.is_multiple_of(AXES) {
            return Err(MessageError::NoPoints { field: self.positions.clone(), components });
        }
        Ok((field, components / AXES))
    }
}

/// What a shape is called.
#[must_use]
pub const fn kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Points(_) => "points",
        Shape::Pairs(_) => "pairs",
        Shape::Grid(_) => "grid",
        Shape::Global(_) => "global",
    }
}

#[cfg(test)]
mod tests {
    use crate::Measure;

    use super::*;

    fn fields(all: &[(Port, Vec<f64>)]) -> Fields {
        let field = |(port, values): &(Port, Vec<f64>)| {
            let values: crate::Values = match port.kind() {
                ValueKind::U32 => values.iter().map(|value| *value as u32).collect::<Vec<_>>().into(),
                _ => values.clone().into(),
            };
            (port.field.clone(), Field::new(&Arc::new(port.clone()), 0, values).unwrap())
        };
        all.iter().map(field).collect()
    }

    fn scalar(name: &str, support: &str) -> Port {
        Port::f64(name, "K", support, 1, Measure::None)
    }

    #[test]
    fn what_nobody_describes_is_what_the_built_in_physics_meant() {
        let state = fields(&[
            (Port::f64("positions", "m", "particles", 3, Measure::None), vec![0.0; 6]),
            (Port::u32("contact_pairs", "contacts", 2), vec![0.0, 1.0]),
            (Port::u32("wall_contact_pairs", "wall-contacts", 2), vec![0.0, 0.0]),
            (scalar("beam_power", "beam"), vec![1.0]),
            (scalar("w", "grid"), vec![1.0, 2.0]),
        ]);
        let shapes = Supports::default().shapes(&state);
        let kinds: Vec<_> = shapes.iter().map(|(name, shape)| (name.as_str(), kind(shape))).collect();
        // No field says where the points of that grid are.
        let expected = [
            ("beam", "global"),
            ("contacts", "pairs"),
            ("grid", "global"),
            ("particles", "points"),
            ("wall-contacts", "pairs"),
        ];
        assert_eq!(kinds, expected);
        let Shape::Pairs(pairs) = &shapes["wall-contacts"] else { panic!("pairs") };
        assert_eq!((pairs.of.as_str(), pairs.others.as_str()), ("particles", "walls"));
    }

    #[test]
    fn a_description_counts_where_it_is_sound_and_the_rows_fit() {
        let grid = Grid::of_cells([0.0, 1.0, 2.0], [0.5, 1.0, 2.0], [4, 3, 2]);
        assert_eq!((grid.rows(), grid.point_m([3, 0, 1])), (24, Some([1.75, 1.5, 5.0])));
        let nodes = Grid::of_nodes([0.0, 1.0, 2.0], [0.5, 1.0, 2.0], [4, 3, 2]);
        assert_eq!(nodes.point_m([3, 0, 1]), Some([1.5, 1.0, 4.0]));
        let ports = Ports::new(Vec::new(), Vec::new()).with(Geometry::grid("cells", grid));
        let supports = Supports::of([&ports]);
        let of = |rows: usize| supports.shape("cells", &fields(&[(scalar("w", "cells"), vec![1.0; rows])]));
        assert_eq!((kind(&of(24)), kind(&of(23))), ("grid", "global"));
        for wrong in [
            Grid { spacing_m: vec![1.0, 0.0, 1.0], ..nodes.clone() },
            Grid { origin_m: vec![0.0, f64::NAN, 0.0], ..nodes.clone() },
            Grid { dims: vec![u32::MAX; 3], ..nodes.clone() },
            Grid { dims: vec![4, 3], ..nodes.clone() },
            Grid { coordinates_m: vec![0.0, 1.0, 2.0], ..nodes.clone() },
            Grid {
                coordinates_m: vec![0.0, 1.0, 0.5, 0.0, 1.0, 0.0, 1.0],
                ..Grid::of_cells([0.0; 3], [1.0; 3], [2, 1, 1])
            },
            Grid { centring: 0, ..nodes },
        ] {
            let wrong = Geometry::grid("cells", wrong);
            assert!(wrong.fault().is_some(), "{wrong:?}");
            let ports = Ports::new(Vec::new(), Vec::new()).with(wrong);
            assert_eq!(Supports::of([&ports]), Supports::default());
        }
    }

    #[test]
    fn a_graded_grid_says_where_each_value_is() {
        let edges: [&[f64]; 3] = [&[0.0, 1.0, 3.0, 7.0], &[-1.0, 1.0], &[0.0, 0.5, 2.0]];
        let grid = Grid::between(edges);
        assert_eq!(grid.layout(), Some(([0.0, -1.0, 0.0], [7.0 / 3.0, 2.0, 1.0], [3, 1, 2])));
        assert_eq!(grid.point_m([2, 0, 1]), Some([5.0, 0.0, 1.25]));
        assert_eq!(grid.coordinates_m(), Some(edges.map(<[f64]>::to_vec)));
        let regular = Grid::of_nodes([0.0, 1.0, 2.0], [0.5, 1.0, 2.0], [2, 1, 2]);
        assert_eq!(regular.coordinates_m(), Some([vec![0.0, 0.5], vec![1.0], vec![2.0, 4.0]]));
        let ports = Ports::new(Vec::new(), vec![scalar("w", "cells")]).with(Geometry::grid("cells", grid));
        let told = &Supports::told([&ports])["cells"];
        assert!(told.to_string().contains("3 x 1 x 2 cells, graded, mean spacing"), "{told}");
        assert_eq!(told.coordinates_m.as_ref().map(Vec::len), Some(9));
    }

    #[test]
    fn every_support_is_told_in_words_and_as_values() {
        let grid = Grid::of_cells([0.0, 1.0, 2.0], [0.5, 1.0, 2.0], [4, 3, 2]);
        let ports = Ports::new(Vec::new(), vec![scalar("w", "cells"), scalar("total", "whole")])
            .with(Geometry::grid("cells", grid))
            .with(Geometry::spheres("marks", "places", "sizes"));
        let told = Supports::told([&ports]);
        let words: Vec<_> = told.iter().map(|(name, told)| format!("{name}: {told}")).collect();
        let expected = [
            "cells: grid of 4 x 3 x 2 cells, spacing 5e-1, 1e0, 2e0 m, from 0e0, 1e0, 2e0 m",
            "marks: points at places, radius sizes",
            "whole: global",
        ];
        assert_eq!(words, expected);
        assert_eq!(told["cells"].fields, ["w".to_owned()].into());
    }

    #[test]
    fn points_may_be_paths_and_what_holds_none_is_told() {
        let state = fields(&[
            (Port::f64("paths", "m", "rays", 9, Measure::None), vec![0.0; 18]),
            (scalar("w", "rays"), vec![0.0; 2]),
        ]);
        let points = |positions: &str| Points { positions: positions.into(), radii: String::new() };
        assert_eq!(points("paths").places(&state).unwrap().1, 3);
        assert!(points("w").places(&state).unwrap_err().to_string().contains("1 values per row"));
        assert!(points("v").places(&state).unwrap_err().to_string().contains("`v`"));
    }
}
