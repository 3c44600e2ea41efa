//! The pictures of a run: its start, its middle and its end, picked while it is read.

use std::collections::BTreeMap;

use stagger_coupling::math;
use stagger_messages::{Field, Fields, Points, geometry::Shape};
use stagger_recordings::{Step, display::colour_scale::Range};

use super::plot::{Slice, Sphere};

/// Snapshots that are kept while a run is read, of which one will be its middle. At 20 bytes a particle they are what the
/// reading needs beside the newest state.
const KEPT: usize = 12;
/// Supports of points that are drawn, at most.
const CLOUDS: usize = 3;
/// Points of the second and further supports that are drawn, at most: of more, every n-th.
const FEW: usize = 1500;
/// Fields on grids that are drawn, at most.
const GRID_FIELDS: usize = 6;

/// What points or a grid are coloured by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colouring {
    /// The field, or what is computed from one.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
}

/// Points at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Simulated time, in s.
    pub t_s: f64,
    /// Number of the step.
    pub step: u64,
    /// The points, as spheres.
    pub spheres: Vec<Sphere>,
}

/// A field in planes of its grid at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Simulated time, in s.
    pub t_s: f64,
    /// Number of the step.
    pub step: u64,
    /// The planes.
    pub planes: Vec<Slice>,
}

/// The points of one support at the start, the middle and the end of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// The support.
    pub support: String,
    /// What colours them.
    pub colouring: Colouring,
    /// The pictures.
    pub shown: Vec<Snapshot>,
}

/// A field on a grid at the start, the middle and the end of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Sliced {
    /// The support.
    pub support: String,
    /// The field.
    pub colouring: Colouring,
    /// The pictures.
    pub shown: Vec<Cut>,
}

/// All pictures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// Of points.
    pub clouds: Vec<Cloud>,
    /// Of grids.
    pub grids: Vec<Sliced>,
}

/// What is drawn of one state, by support, and for grids by field.
#[derive(Clone, Debug)]
struct Kept {
    t_s: f64,
    step: u64,
    clouds: BTreeMap<String, Vec<Sphere>>,
    grids: BTreeMap<(String, String), Vec<Slice>>,
}

/// Takes the states of a run and keeps what pictures of its start, middle and end need.
#[derive(Clone, Debug)]
pub struct Snapshots {
    colourings: BTreeMap<String, Colouring>,
    /// Units of the fields on grids.
    units: BTreeMap<String, String>,
    kept: Vec<Kept>,
    /// Every so many states one is kept.
    every: u64,
    seen: u64,
    last: Option<Step>,
}

impl Default for Snapshots {
    fn default() -> Self {
        Self { colourings: BTreeMap::new(), units: BTreeMap::new(), kept: Vec::new(), every: 1, seen: 0, last: None }
    }
}

impl Snapshots {
    /// Takes the next state; one without fields of its own, or without anything that has a place, is left out.
    pub fn take(&mut self, step: &Step) {
        let drawn = |shape: &Shape| match shape {
            Shape::Points(points) => single(points, &step.fields).is_some(),
            Shape::Grid(_) => true,
            Shape::Pairs(_) | Shape::Global(_) => false,
        };
        if !step.recorded || !step.supports.shapes(&step.fields).values().any(drawn) {
            return;
        }
        if self.seen.is_multiple_of(self.every) {
            if self.kept.len() == KEPT {
                let mut number = 0;
                self.kept.retain(|_| {
                    number += 1;
                    number % 2 == 1
                });
                self.every *= 2;
            }
            // The stride may just have grown beyond this one.
            if self.seen.is_multiple_of(self.every) {
                self.keep(step);
            }
        }
        self.seen += 1;
        self.last = Some(step.clone());
    }

    fn keep(&mut self, step: &Step) {
        let mut kept = Kept { t_s: step.t_s, step: step.version.step, clouds: BTreeMap::new(), grids: BTreeMap::new() };
        for (support, shape) in clouds_first(step) {
            match shape {
                Shape::Points(points) => {
                    let Some(places) = single(&points, &step.fields) else { continue };
                    let known = self.colourings.contains_key(&support);
                    if !known && self.colourings.len() == CLOUDS {
                        continue;
                    }
                    let colouring = self.colourings.entry(support.clone());
                    let colouring = colouring.or_insert_with(|| colouring_of(&step.fields, &support, &points));
                    let mut spheres = spheres(&step.fields, places, &points, colouring);
                    if !kept.clouds.is_empty() && spheres.len() > FEW {
                        spheres = spheres.iter().step_by(spheres.len().div_ceil(FEW)).copied().collect();
                    }
                    kept.clouds.insert(support, spheres);
                }
                Shape::Grid(grid) => {
                    for (name, field) in scalars(&step.fields, &support) {
                        if !self.units.contains_key(name) && self.units.len() == GRID_FIELDS {
                            continue;
                        }
                        self.units.insert(name.to_owned(), field.port.unit.clone());
                        let planes = Slice::middles(&grid, field.f64().unwrap_or_default());
                        kept.grids.insert((support.clone(), name.to_owned()), planes);
                    }
                }
                Shape::Pairs(_) | Shape::Global(_) => {}
            }
        }
        self.kept.push(kept);
    }

    /// Start, middle and end, or fewer where there are not as many, of everything that has a place.
    #[must_use]
    pub fn finish(mut self) -> Pictures {
        let Some(last) = self.last.take() else { return Pictures::default() };
        let newest = self.kept.last().is_some_and(|kept| kept.step == last.version.step);
        if !newest {
            self.keep(&last);
        }
        let (Some(first), Some(end)) = (self.kept.first(), self.kept.last()) else { return Pictures::default() };
        let (halfway, count) = (0.5 * (first.t_s + end.t_s), self.kept.len());
        let inner = 1..count.saturating_sub(1);
        let middle = inner.min_by(|&a, &b| {
            let away = |number: usize| (self.kept[number].t_s - halfway).abs();
            away(a).total_cmp(&away(b))
        });
        let mut number = 0;
        self.kept.retain(|_| {
            number += 1;
            number == 1 || number == count || Some(number - 1) == middle
        });
        let cloud = |(support, colouring): (String, Colouring)| {
            let shown = |kept: &mut Kept| {
                let spheres = kept.clouds.remove(&support)?;
                Some(Snapshot { t_s: kept.t_s, step: kept.step, spheres })
            };
            let shown = self.kept.iter_mut().filter_map(shown).collect();
            Cloud { support, colouring, shown }
        };
        let clouds = std::mem::take(&mut self.colourings).into_iter().map(cloud).collect();
        let of_grids: Vec<_> = self.kept.iter().flat_map(|kept| kept.grids.keys().cloned()).collect();
        let sliced = |(support, name): (String, String)| {
            let shown = |kept: &mut Kept| {
                let planes = kept.grids.remove(&(support.clone(), name.clone()))?;
                Some(Cut { t_s: kept.t_s, step: kept.step, planes })
            };
            let shown: Vec<_> = self.kept.iter_mut().filter_map(shown).collect();
            let unit = self.units.get(&name).cloned().unwrap_or_default();
            Sliced { support, colouring: Colouring { name, unit }, shown }
        };
        let grids = of_grids.into_iter().map(sliced).filter(|sliced| !sliced.shown.is_empty()).collect();
        Pictures { clouds, grids }
    }
}

/// The range of what colours some snapshots.
#[must_use]
pub fn range(snapshots: &[Snapshot]) -> Range {
    let mut range = Range::EMPTY;
    for sphere in snapshots.iter().flat_map(|snapshot| &snapshot.spheres) {
        range.include(&[f64::from(sphere.value)]);
    }
    range
}

/// The range of what colours some planes.
#[must_use]
pub fn range_of_cuts(cuts: &[Cut]) -> Range {
    let mut range = Range::EMPTY;
    for value in cuts.iter().flat_map(|cut| &cut.planes).flat_map(|plane| &plane.values) {
        range.include(&[f64::from(*value)]);
    }
    range
}

/// The supports of a state, bodies before bare points: they are what a run is about.
fn clouds_first(step: &Step) -> Vec<(String, Shape)> {
    let mut shapes: Vec<_> = step.supports.shapes(&step.fields).into_iter().collect();
    let bare = |shape: &Shape| !matches!(shape, Shape::Points(points) if step.fields.contains_key(&points.radii));
    shapes.sort_by_key(|(_, shape)| bare(shape));
    shapes
}

/// The places of points; `None` where the rows are paths, or have no places.
fn single<'f>(points: &Points, fields: &'f Fields) -> Option<&'f Field> {
    points.places(fields).ok().filter(|(_, of_one)| *of_one == 1).map(|(field, _)| field)
}

/// The fields on a support with one number per row.
fn scalars<'f>(fields: &'f Fields, support: &str) -> impl Iterator<Item = (&'f str, &'f Field)> {
    let fits = move |field: &Field| field.port.support == support && field.components() == 1 && field.f64().is_ok();
    fields.iter().filter(move |(_, field)| fits(field)).map(|(name, field)| (name.as_str(), field))
}

/// The velocities of points: a vector in m/s.
fn velocities<'f>(fields: &'f Fields, support: &str) -> Option<&'f Field> {
    let fits = |field: &&Field| {
        field.port.support == support && field.components() == 3 && field.port.unit == "m/s" && field.f64().is_ok()
    };
    fields.values().find(fits)
}

/// Temperature, or the first scalar on the points, or their speed where there is none but their size.
fn colouring_of(fields: &Fields, support: &str, points: &Points) -> Colouring {
    let others = || scalars(fields, support).filter(|(name, _)| *name != points.radii);
    let first = others().find(|(_, field)| field.port.unit == "K").or_else(|| others().next());
    match first {
        Some((name, field)) => Colouring { name: name.into(), unit: field.port.unit.clone() },
        None => Colouring { name: "speed".into(), unit: "m/s".into() },
    }
}

fn spheres(fields: &Fields, places: &Field, points: &Points, colouring: &Colouring) -> Vec<Sphere> {
    // Values on other rows, which a slower node may have left, are those of other points.
    let on_it = |field: &&Field| field.support == places.support;
    let numbers = |name: &str| fields.get(name).filter(on_it).and_then(|field| field.f64().ok());
    let (centres, _) = places.f64().unwrap_or_default().as_chunks::<3>();
    let radii = numbers(&points.radii);
    let bare = if radii.is_some() { 0.0 } else { half_spacing_m(centres) };
    let own = numbers(&colouring.name);
    let velocities = velocities(fields, &places.port.support).filter(on_it).and_then(|field| field.f64().ok());
    let (velocities, _) = velocities.unwrap_or_default().as_chunks::<3>();
    let value = |row: usize| match own {
        Some(values) => values.get(row).copied(),
        None if colouring.name == "speed" => velocities.get(row).map(|[x, y, z]| math::hypot(math::hypot(*x, *y), *z)),
        None => None,
    };
    let sphere = |(row, centre): (usize, &[f64; 3])| Sphere {
        centre_m: centre.map(|length| length as f32),
        radius_m: radii.map_or(bare, |radii| radii.get(row).copied().unwrap_or_default()) as f32,
        value: value(row).unwrap_or(f64::NAN) as f32,
    };
    centres.iter().enumerate().map(sphere).collect()
}

/// Half of about how far bare points are apart: of as many that fill their box, their plane or their line evenly, in m.
fn half_spacing_m(points: &[[f64; 3]]) -> f64 {
    let mut range = [Range::EMPTY; 3];
    for point in points {
        range.iter_mut().zip(point).for_each(|(range, length)| range.include(&[*length]));
    }
    let extents: Vec<f64> = range.iter().map(|range| range.max - range.min).filter(|extent| *extent > 0.0).collect();
    if extents.is_empty() {
        return 0.0;
    }
    let share = extents.iter().product::<f64>() / points.len() as f64;
    0.5 * math::powf(share, 1.0 / extents.len() as f64)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Geometry, Grid, Measure, Port, Ports, Supports, Version};

    use super::*;

    fn step(number: u64, t_s: f64, fields: &[(&str, &str, u32, Vec<f64>)]) -> Step {
        let field = |(name, unit, components, values): &(&str, &str, u32, Vec<f64>)| {
            let port = Arc::new(Port::f64(name, unit, "particles", *components, Measure::None));
            ((*name).to_owned(), Field::new(&port, 0, values.clone()).unwrap())
        };
        let version = Version { step: number, attempt: 1, iteration: 1 };
        let fields = fields.iter().map(field).collect();
        Step { version, t_s, dt_s: 0.0, fields, supports: Supports::default(), recorded: true }
    }

    fn falling(number: u64, t_s: f64) -> Step {
        step(number, t_s, &[("positions", "m", 3, vec![0.0, 0.0, -t_s]), ("radii", "m", 1, vec![0.5])])
    }

    #[test]
    fn start_middle_and_end_are_found_in_one_pass_whatever_the_length() {
        for steps in [1, 2, 3, 11, 12, 13, 100, 10_000] {
            let mut snapshots = Snapshots::default();
            (0..steps).for_each(|number| snapshots.take(&falling(number, number as f64)));
            assert!(snapshots.kept.len() <= KEPT);
            let found = snapshots.finish().clouds.remove(0).shown;
            assert_eq!(found.len() as u64, steps.min(3), "{steps}");
            let (first, last) = (&found[0], &found[found.len() - 1]);
            assert_eq!((first.step, last.step), (0, steps - 1));
            if steps > 2 {
                // At least 6 are kept, evenly: the nearest is at most a twelfth of the run from its middle.
                let away = (found[1].t_s - 0.5 * last.t_s).abs() / last.t_s;
                assert!(away <= 1.0 / 12.0, "{steps}: {away}");
            }
        }
        assert_eq!(Snapshots::default().finish(), Pictures::default());
    }

    #[test]
    fn particles_are_coloured_by_temperature_or_the_first_scalar_or_their_speed() {
        let positions = ("positions", "m", 3, vec![1.0, 2.0, 3.0]);
        let radii = ("radii", "m", 1, vec![0.5]);
        let velocities = ("velocities", "m/s", 3, vec![3.0, 0.0, -4.0]);
        let power = ("absorbed_power", "W", 1, vec![7.0]);
        let kelvin = ("temperature", "K", 1, vec![300.0]);
        let fields = [positions, radii, velocities, power, kelvin];
        for (count, name, value) in [(3, "speed", 5.0), (4, "absorbed_power", 7.0), (5, "temperature", 300.0)] {
            let mut snapshots = Snapshots::default();
            snapshots.take(&step(1, 0.0, &fields[..count]));
            let Cloud { colouring, shown: found, .. } = snapshots.finish().clouds.remove(0);
            assert_eq!(colouring.name, name);
            let [sphere] = found[0].spheres.as_slice() else { panic!("one particle") };
            assert_eq!((sphere.value, sphere.radius_m, sphere.centre_m), (value, 0.5, [1.0, 2.0, 3.0]));
            assert_eq!(range(&found), Range { min: f64::from(value), max: f64::from(value) });
        }
    }

    #[test]
    fn a_value_on_other_rows_colours_nobody() {
        let mut state = falling(1, 0.0);
        let port = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::None));
        state.fields.insert("temperature".into(), Field::new(&port, 1, vec![300.0]).unwrap());
        let mut snapshots = Snapshots::default();
        snapshots.take(&state);
        assert!(snapshots.finish().clouds[0].shown[0].spheres[0].value.is_nan());
    }

    #[test]
    fn a_grid_alone_has_its_planes_and_bare_points_a_size() {
        let grid = Grid::of_cells([0.0; 3], [1.0; 3], [4, 3, 2]);
        let ports = Ports::new(Vec::new(), Vec::new())
            .with(Geometry::grid("cells", grid))
            .with(Geometry::points("marks", "places"));
        let mut state = step(1, 0.0, &[]);
        state.supports = Supports::of([&ports]);
        let on = |name: &str, unit: &str, support: &str, components: u32, values: Vec<f64>| {
            let port = Arc::new(Port::f64(name, unit, support, components, Measure::None));
            (name.to_owned(), Field::new(&port, 0, values).unwrap())
        };
        state.fields.extend([
            on("w", "K", "cells", 1, (0..24).map(f64::from).collect()),
            on("places", "m", "marks", 3, vec![0.0, 0.0, 0.0, 8.0, 0.0, 0.0]),
            on("weight", "kg", "marks", 1, vec![1.0, 2.0]),
        ]);
        let mut snapshots = Snapshots::default();
        snapshots.take(&state);
        let pictures = snapshots.finish();
        let [sliced] = pictures.grids.as_slice() else { panic!("one field") };
        assert_eq!((sliced.support.as_str(), sliced.colouring.name.as_str()), ("cells", "w"));
        assert_eq!(sliced.shown[0].planes.len(), 3);
        assert_eq!(range_of_cuts(&sliced.shown), Range { min: 2.0, max: 23.0 });
        let [cloud] = pictures.clouds.as_slice() else { panic!("one cloud") };
        assert_eq!((cloud.support.as_str(), cloud.colouring.name.as_str()), ("marks", "weight"));
        // Two points on a line of 8 m.
        assert!((cloud.shown[0].spheres[0].radius_m - 2.0).abs() < 1e-6);
    }
}
