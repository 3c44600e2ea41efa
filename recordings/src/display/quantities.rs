//! Which quantities of a state its pictures show: those that the physics name first, and what fields of others hold.

use std::collections::{BTreeMap, BTreeSet};

use stagger_messages::{Field, Fields, geometry::Shape};
use stagger_scene::built_in::{BUILT_IN, Pictured};

use crate::Step;

/// Fields of one support that nobody here has heard of and that are shown, at most.
const OTHERS: usize = 4;
/// Rows without a place that are shown one by one, at most.
const ROWS: usize = 16;

/// A quantity that colours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Its field.
    pub field: String,
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Title of its curves.
    pub title: String,
    /// What its rows are: the name of its support.
    pub support: String,
    /// Whether its values spread over decades.
    pub decades: bool,
    /// Whether a run is about the time in which it is not small.
    pub passing: bool,
}

/// The quantities of a state in the order of their pictures, each with a value for each row: first those on spheres, then those
/// on grids and bare points, then those on pairs. `known` are the fields that built-in physics write: of these only what their
/// physics name is shown.
///
/// Values from before particles came or went, which a slower node may have left, belong to others: of such there are none.
#[must_use]
pub fn quantities(step: &Step, known: &BTreeSet<String>) -> Vec<(Quantity, Vec<f64>)> {
    let shapes = step.supports.shapes(&step.fields);
    let mut supports: Vec<(u8, &String, &Shape)> =
        shapes.iter().filter_map(|(support, shape)| Some((place(step, shape)?, support, shape))).collect();
    supports.sort_by_key(|(place, ..)| *place);
    let mut found = Vec::new();
    for (_, support, shape) in supports {
        let on_it: BTreeMap<&str, &Field> = step
            .fields
            .iter()
            .filter(|(_, field)| field.port.support == *support)
            .map(|(name, field)| (name.as_str(), field))
            .collect();
        let plain = |field: &Field, name: &str, title: &str| Quantity {
            field: field.name().into(),
            name: name.into(),
            unit: unit(field),
            title: title.into(),
            support: support.clone(),
            decades: false,
            passing: false,
        };
        let first = shared(|name| on_it.contains_key(name));
        let beside = BUILT_IN.iter().flat_map(|kind| kind.pictured).filter(|pictured| pictured.beside);
        for pictured in first.into_iter().chain(beside) {
            let Some(field) = on_it.get(pictured.field) else { continue };
            let Some(values) = values(step, shape, field) else { continue };
            let quantity = plain(field, pictured.name, pictured.title);
            found.push((Quantity { decades: pictured.decades, passing: pictured.passing, ..quantity }, values));
        }
        if matches!(shape, Shape::Pairs(_)) {
            continue;
        }
        // What stands under a longer name is what another node than the first writes under the same.
        let others = on_it.iter().filter(|(name, field)| {
            !known.contains(**name) && !is_named(name) && !name.contains('/') && field.components() == 1
        });
        for (name, field) in others.take(OTHERS) {
            let Some(values) = values(step, shape, field) else { continue };
            let words = name.replace(['_', '-'], " ");
            found.push((plain(field, &words, &words), values));
        }
    }
    found
}

/// What colours the picture of a support with fields of these names, of all that the physics name.
pub(super) fn shared(has: impl Fn(&str) -> bool) -> Option<&'static Pictured> {
    let named = BUILT_IN.iter().flat_map(|kind| kind.pictured.iter().map(|pictured| (kind.rank, pictured)));
    let shared = named.filter(|(_, pictured)| !pictured.beside && has(pictured.field));
    shared.max_by_key(|(rank, _)| *rank).map(|(_, pictured)| pictured)
}

fn is_named(field: &str) -> bool {
    BUILT_IN.iter().flat_map(|kind| kind.pictured).any(|pictured| pictured.field == field)
}

/// Place among the pictures; `None` where the rows are nowhere.
fn place(step: &Step, shape: &Shape) -> Option<u8> {
    match shape {
        // Rows with several places are paths.
        Shape::Points(points) => match points.places(&step.fields) {
            Ok((_, 1)) => Some(u8::from(points.radii.is_empty())),
            _ => None,
        },
        Shape::Grid(grid) => grid.layout().map(|_| 1),
        Shape::Pairs(_) => Some(2),
        Shape::Global(_) => None,
    }
}

/// A value for each row: of three components their norm; `None` where they are no numbers, or lengths of the rows themselves.
fn values(step: &Step, shape: &Shape, field: &Field) -> Option<Vec<f64>> {
    let values = field.f64().ok()?;
    if let Shape::Points(points) = shape {
        if [&points.positions, &points.radii].into_iter().any(|own| *own == field.port.field) {
            return None;
        }
        if step.fields.get(&points.positions).is_some_and(|positions| positions.support != field.support) {
            return Some(Vec::new());
        }
    }
    match field.components() {
        1 => Some(values.to_vec()),
        3 => Some(norms(values.as_chunks::<3>().0).collect()),
        _ => None,
    }
}

/// The values of a scalar field whose rows have no place, where they are few enough to be shown one by one.
#[must_use]
pub fn numbers<'f>(field: &'f Field, shape: Option<&Shape>) -> Option<&'f [f64]> {
    let values = field.f64().ok()?;
    let few = field.components() == 1 && values.len() <= ROWS;
    (few && matches!(shape, Some(Shape::Global(_)))).then_some(values)
}

/// The unit as it is printed.
fn unit(field: &Field) -> String {
    field.port.unit.replace("^2", "²").replace("^3", "³")
}

/// Norms of vectors.
pub(super) fn norms(vectors: &[[f64; 3]]) -> impl Iterator<Item = f64> {
    vectors.iter().map(|[x, y, z]| (x * x + y * y + z * z).sqrt())
}

/// The spheres of a state that come first: their places, and what else is known of each.
#[derive(Clone, Copy, Debug)]
pub struct Spheres<'s> {
    /// Places of the centres, in m.
    pub centres_m: &'s [[f64; 3]],
    /// Radii, in m.
    pub radii_m: &'s [f64],
    /// Velocities, in m/s; empty where they are not known.
    pub velocities_m_s: &'s [[f64; 3]],
}

impl<'s> Spheres<'s> {
    /// Those of a state; `None` where it has none.
    #[must_use]
    pub fn of(step: &'s Step) -> Option<Self> {
        let fields: &Fields = &step.fields;
        step.supports.shapes(fields).values().find_map(|shape| {
            let Shape::Points(points) = shape else { return None };
            let (positions, 1) = points.places(fields).ok()? else { return None };
            let radii_m = fields.get(&points.radii)?.f64().ok()?;
            let is_velocity = |field: &&Field| {
                field.support == positions.support && field.components() == 3 && field.port.unit == "m/s"
            };
            let velocities = fields.values().find(is_velocity).and_then(|field| field.f64().ok()).unwrap_or_default();
            let centres_m = positions.f64().ok()?.as_chunks::<3>().0;
            (!centres_m.is_empty()).then_some(Self {
                centres_m,
                radii_m,
                velocities_m_s: velocities.as_chunks::<3>().0,
            })
        })
    }

    /// Their speeds, in m/s.
    pub fn speeds_m_s(self) -> impl Iterator<Item = f64> {
        norms(self.velocities_m_s)
    }

    /// Mean of the radii, in m.
    #[must_use]
    pub fn mean_radius_m(&self) -> f64 {
        self.radii_m.iter().sum::<f64>() / self.radii_m.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Geometry, Grid, Measure, Port, Ports, Supports, Version};

    use super::*;

    fn field(name: &str, unit: &str, support: &str, components: u32, values: Vec<f64>) -> (String, Field) {
        let port = Arc::new(Port::f64(name, unit, support, components, Measure::None));
        (name.into(), Field::new(&port, 0, values).unwrap())
    }

    fn step(fields: impl IntoIterator<Item = (String, Field)>) -> Step {
        let cells = Geometry::grid("cells", Grid::of_cells([0.0; 3], [1.0; 3], [2, 1, 1]));
        let ports = Ports::new(Vec::new(), Vec::new()).with(cells);
        Step {
            version: Version::first(1),
            t_s: 0.0,
            dt_s: 0.0,
            fields: fields.into_iter().collect(),
            supports: Supports::of([&ports]),
            recorded: true,
        }
    }

    fn names(step: &Step, known: &[&str]) -> Vec<String> {
        let known = known.iter().map(|name| (*name).to_owned()).collect();
        quantities(step, &known).into_iter().map(|(quantity, _)| quantity.field).collect()
    }

    #[test]
    fn spheres_come_first_and_a_higher_rank_colours_them() {
        let mut fields = vec![
            field("solid_temperature", "K", "cells", 1, vec![300.0, 301.0]),
            field("positions", "m", "particles", 3, vec![0.0; 6]),
            field("radii", "m", "particles", 1, vec![1.0; 2]),
            field("velocities", "m/s", "particles", 3, vec![0.0, 3.0, 4.0, 0.0, 0.0, 0.0]),
            field("current_density", "A/m^2", "particles", 1, vec![5.0, 7.0]),
        ];
        assert_eq!(names(&step(fields.clone()), &[]), ["velocities", "current_density", "solid_temperature"]);
        let of_speed = &quantities(&step(fields.clone()), &BTreeSet::new())[0];
        assert_eq!((of_speed.0.name.as_str(), of_speed.1.as_slice()), ("speed", &[5.0, 0.0][..]));
        fields.push(field("temperature", "K", "particles", 1, vec![300.0; 2]));
        assert_eq!(names(&step(fields), &[]), ["temperature", "current_density", "solid_temperature"]);
    }

    #[test]
    fn fields_of_others_are_shown_and_what_built_in_physics_write_beside_is_not() {
        let fields = [
            field("moisture", "1", "cells", 1, vec![1.0, 2.0]),
            field("porosity", "1", "cells", 1, vec![1.0, 2.0]),
            field("flow", "m/s", "cells", 3, vec![0.0; 6]),
            field("second/moisture", "1", "cells", 1, vec![1.0, 2.0]),
            field("reading", "V", "instrument", 1, vec![1.0]),
        ];
        assert_eq!(names(&step(fields.clone()), &[]), ["moisture", "porosity"]);
        assert_eq!(names(&step(fields), &["porosity"]), ["moisture"]);
    }
}
